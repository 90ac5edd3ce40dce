//! The energies of a run: what motors put in, where it went, and what nobody accounts for.

use crate::motor_work::MotorWork;
use serde::{Deserialize, Serialize};
use terraglue_engine::observer::{View, ledger_of};
use terraglue_gluing::StepReport;
use terraglue_subsystem::Kind;

/// Beyond this share of what was turned over, the drift is wrong.
const TOLERATED: f64 = 0.01;
/// Below this the drift is rounding, J.
const ROUNDING_J: f64 = 1e-9;

/// Where the energy of a run came from and went. Null is unknown: a subsystem keeps no energy ledger.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Energies {
    /// Net mechanical work of the motors and of loads from outside, J.
    pub work_j: Option<f64>,
    /// Work of the motors that pushed their joints the way these went, J.
    #[serde(default)]
    pub driving_j: f64,
    /// Work that motors took out where they held their joints back, J; ≥ 0.
    #[serde(default)]
    pub braking_j: f64,
    /// Change of the kinetic energy since the start, J.
    pub kinetic_change_j: Option<f64>,
    /// Change of the potential energy since the start, J: weight and springs of bodies, springs of the glue, elastic
    /// energy and weight of soils.
    pub potential_change_j: Option<f64>,
    /// Heat of the soils, J; null also where there is no soil.
    pub soil_heat_j: Option<f64>,
    /// Heat of everything else, J: joints, contacts between bodies, dampers of the glue.
    pub other_heat_j: Option<f64>,
    /// Energy that is not accounted for, J: changes and heat − work; > 0 came from nowhere.
    pub drift_j: Option<f64>,
    /// Reference of the drift, J: the largest of ∫|power|dt of motors and loads, ∫|power|dt through the ports, and the
    /// changes of kinetic and potential energy. A robot that stands does next to no work with its motors.
    pub turnover_j: f64,
    /// Whether that is the work through the ports.
    pub by_ports: bool,
    /// Whether that is a change of kinetic or potential energy.
    #[serde(default)]
    pub by_changes: bool,
    /// Subsystems that keep no energy ledger, or not a whole one.
    pub without_book: Vec<String>,
}

impl Energies {
    /// The drift over what was turned over; none where one is unknown or no more was turned over than rounding may be.
    pub fn drift_share(&self) -> Option<f64> {
        self.drift_j.filter(|_| self.turnover_j > ROUNDING_J).map(|d| d / self.turnover_j)
    }

    /// Whether the drift is more than 1 % of what was turned over (and than rounding, 1e-9 J).
    pub fn is_off(&self) -> bool {
        self.drift_j.is_some_and(|d| d.abs() > (TOLERATED * self.turnover_j).max(ROUNDING_J))
    }

    /// Reference of the drift, in words.
    pub fn measure(&self) -> &'static str {
        match (self.by_ports, self.by_changes) {
            (true, _) => "of the work at the ports",
            (_, true) => "of the change of kinetic and potential energy",
            _ => "of the motors' work",
        }
    }

    /// Why the drift is unknown, for people; empty where it is known.
    pub fn why_unknown(&self) -> String {
        match self.without_book.as_slice() {
            _ if self.drift_j.is_some() => String::new(),
            [] => "no step was made".into(),
            [one] => format!("{one} keeps no energy ledger"),
            many => format!("{} keep no energy ledger", many.join(", ")),
        }
    }
}

/// The state of all ledgers at once, J; not a number where unknown.
#[derive(Clone, Copy)]
struct EnergySums {
    kinetic: f64,
    potential: f64,
    soil_heat: f64,
    heat: f64,
    work: f64,
}

impl EnergySums {
    fn of(view: &View) -> Self {
        let soils = view.subsystems.iter().filter(|s| s.kind == Kind::Soil);
        Self {
            kinetic: view.energy.kinetic,
            potential: view.energy.potential,
            soil_heat: soils.map(|s| s.instance.energy().dissipated).sum(),
            heat: view.energy.dissipated,
            work: view.energy.actuator_work,
        }
    }
}

/// Follows the ledgers of a run.
#[derive(Default)]
pub(crate) struct EnergyTrack {
    ends: Option<(EnergySums, EnergySums)>,
    has_soil: bool,
    glue_stored_j: f64,
    glue_heat_j: f64,
    work_path_j: f64,
    port_path_j: f64,
    without_book: Vec<String>,
}

terraglue_subsystem::persist!(EnergySums { kinetic, potential, soil_heat, heat, work });
terraglue_subsystem::persist!(EnergyTrack {
    ends,
    has_soil,
    glue_stored_j,
    glue_heat_j,
    work_path_j,
    port_path_j,
    without_book,
});

impl EnergyTrack {
    /// At the start.
    pub fn start(&mut self, view: &View) {
        self.has_soil = view.subsystems.iter().any(|s| s.kind == Kind::Soil);
        let silent = view.subsystems.iter().filter(|s| !ledger_of(s.kind, &s.instance.energy()).is_known());
        self.without_book = silent.map(|s| s.name.to_owned()).collect();
        let ledgers = EnergySums::of(view);
        self.ends = Some((ledgers, ledgers));
    }

    /// After a step.
    pub fn follow(&mut self, view: &View) {
        let now = EnergySums::of(view);
        let (first, before) = self.ends.unwrap_or((now, now));
        let step = (now.work - before.work).abs();
        self.work_path_j += if step.is_nan() { 0.0 } else { step };
        self.ends = Some((first, now));
        self.add(view.gluing);
    }

    fn add(&mut self, glued: &StepReport) {
        self.glue_stored_j += glued.glue_stored_j;
        self.glue_heat_j += glued.glue_heat_j;
        self.port_path_j += glued.port_work_path_j;
    }

    /// The figures so far, with the work of the motors of the same run.
    pub fn figures(&self, motors: &MotorWork) -> Energies {
        let driven = motors.both_j().max(self.work_path_j);
        let base = Energies {
            driving_j: motors.driving_j,
            braking_j: motors.braking_j,
            turnover_j: driven.max(self.port_path_j),
            by_ports: driven < self.port_path_j,
            without_book: self.without_book.clone(),
            ..Energies::default()
        };
        let Some((first, now)) = self.ends else { return base };
        let known = |value: f64| value.is_finite().then_some(value);
        let kinetic = now.kinetic - first.kinetic;
        let potential = now.potential - first.potential + self.glue_stored_j;
        let heat = now.heat - first.heat + self.glue_heat_j;
        let soil_heat = now.soil_heat - first.soil_heat;
        let work = now.work - first.work;
        // f64::max leaves out what is not a number
        let changed = kinetic.abs().max(potential.abs());
        let by_changes = changed > base.turnover_j;
        Energies {
            turnover_j: if by_changes { changed } else { base.turnover_j },
            by_ports: base.by_ports && !by_changes,
            by_changes,
            work_j: known(work),
            kinetic_change_j: known(kinetic),
            potential_change_j: known(potential),
            soil_heat_j: known(soil_heat).filter(|_| self.has_soil),
            other_heat_j: known(heat - soil_heat),
            drift_j: known(kinetic + potential + heat - work),
            ..base
        }
    }
}

#[cfg(test)]
#[path = "../tests/unit/energies.rs"]
mod tests;
