//! Adds up the figures of [`Summary`] while a run goes on; no file, no clock.

use crate::body_track::BodyTrack;
use crate::energies::EnergyTrack;
use crate::ground_grid::GroundGrid;
use crate::layout::{RECORDING, REPORT};
use crate::motor_work::MotorWork;
use crate::prints::PrintTrack;
use crate::snapshot::{real, real_id};
use crate::summary::{EnergySummary, FailureRecord, GluingSummary, MotionSummary, RunTimes, Status, Summary};
use terraglue_diagnostics::error::{Error, Result};
use terraglue_engine::observer::{Event, Observer, SubsystemView, View};
use terraglue_gluing::StepReport;
use terraglue_numerics::rotation;
use terraglue_scenario::Scenario;
use terraglue_subsystem::{Causality, Kind};

mod state;

/// Over a shorter way, m, the energy per distance is meaningless.
const SMALLEST_DISTANCE_M: f64 = 1e-3;

/// Follows a run and adds up its figures.
pub struct SummaryObserver {
    scenario: String,
    strategy: String,
    body_name: Option<String>,
    speed_name: Option<String>,
    gravity_m_s2: [f64; 3],
    soil_module: Option<String>,
    events: Vec<Event>,
    steps: u64,
    t_s: f64,
    body: Option<BodyTrack>,
    speed: Option<Integral>,
    sinkage: Option<Deepest>,
    prints: Option<PrintTrack>,
    mass_error: Option<(usize, u32, f64)>,
    motors: MotorWork,
    electrical_j: f64,
    energies: EnergyTrack,
    gluing: GluingSums,
}

/// Integral of a variable over time. Set values hold over the step that follows, reported values belong to the step before.
struct Integral {
    subsystem: usize,
    id: u32,
    told: bool,
    before: f64,
    sum: f64,
}

/// Where sinkage under the feet is read.
enum Deepest {
    Variable { soil: usize, id: u32, largest: f64 },
    Ground { grid: Box<GroundGrid>, largest: f64 },
}

/// Figures of the gluing over all steps.
#[derive(Default)]
struct GluingSums {
    steps: u64,
    histogram: Vec<u64>,
    soil_histogram: Vec<u64>,
    bodies: u64,
    soil: u64,
    soil_max: u32,
    not_converged: u64,
    /// Steps that had a tolerance to reach, and those whose gap is meaningful.
    checked: u64,
    with_gap: u64,
    tt_steps: u64,
    xt_steps: u64,
    max_gap_m: f64,
    max_action_reaction_gap_n: f64,
    max_estimate_gap_n: f64,
    interface_work_error_j: f64,
    kappa_max: f64,
    refreshes: u64,
    differences: u64,
    residual: f64,
    complementarity_n: f64,
    rank_missing: u32,
    condition: f64,
    halved: u64,
}

impl Deepest {
    fn find(view: &View) -> Result<Option<Self>> {
        for (soil, s) in soils(view) {
            if let Some(id) = real_id(s.instance, "max_sinkage") {
                return Ok(Some(Self::Variable { soil, id, largest: 0.0 }));
            }
        }
        let grid = GroundGrid::find(view)?;
        Ok(grid.map(|grid| Self::Ground { grid: Box::new(grid), largest: 0.0 }))
    }

    fn follow(&mut self, view: &View) -> Result {
        match self {
            Self::Variable { soil, id, largest } => {
                *largest = largest.max(real(&view.subsystems[*soil], *id, view.t_s)?);
            }
            Self::Ground { grid, largest } => {
                let soil = &view.subsystems[grid.subsystem];
                for port in view.gluing.ports.iter().filter(|p| p.wrench[0] > 0.0) {
                    let depth = grid.sinkage_at(soil, port.origin[0], port.origin[1], view.t_s)?;
                    *largest = largest.max(depth);
                }
            }
        }
        Ok(())
    }

    fn largest(&self) -> f64 {
        match self {
            Self::Variable { largest, .. } | Self::Ground { largest, .. } => *largest,
        }
    }
}

/// Counts a step with so many evaluations.
fn count(histogram: &mut Vec<u64>, evaluations: u32) {
    let n = (evaluations as usize).min(9999);
    if histogram.is_empty() {
        histogram.reserve(256);
    }
    if histogram.len() <= n {
        histogram.resize(n + 1, 0);
    }
    histogram[n] += 1;
}

impl GluingSums {
    fn add(&mut self, g: &StepReport) {
        if g.evaluations_bodies == 0 && g.evaluations_soil == 0 {
            return;
        }
        self.steps += 1;
        count(&mut self.histogram, g.evaluations_bodies);
        count(&mut self.soil_histogram, g.evaluations_soil);
        self.bodies += u64::from(g.evaluations_bodies);
        self.soil += u64::from(g.evaluations_soil);
        self.soil_max = self.soil_max.max(g.evaluations_soil);
        self.not_converged += u64::from(!g.converged);
        self.checked += u64::from(!g.single_pass);
        self.with_gap += u64::from(g.has_gap());
        let iterated = g.rank.1 > 0 || g.residual > 0.0;
        self.xt_steps += u64::from(g.xt_form);
        self.tt_steps += u64::from(iterated && !g.xt_form);
        self.max_gap_m = self.max_gap_m.max(g.max_gap_m);
        self.max_action_reaction_gap_n = self.max_action_reaction_gap_n.max(g.max_action_reaction_gap_n);
        self.max_estimate_gap_n = self.max_estimate_gap_n.max(g.estimate_gap_n);
        self.interface_work_error_j += g.interface_work_error_j.abs();
        self.kappa_max = self.kappa_max.max(g.kappa_max);
        self.refreshes += u64::from(g.jacobian_refreshes);
        self.differences += u64::from(g.evaluations_jacobian);
        self.residual = self.residual.max(g.residual);
        self.complementarity_n = self.complementarity_n.max(g.complementarity_n);
        self.rank_missing = self.rank_missing.max(g.rank.1 - g.rank.0.min(g.rank.1));
        self.condition = self.condition.max(g.condition);
        self.halved += u64::from(g.halvings > 0);
    }

    /// Smallest number of evaluations that `share` of the steps do not exceed.
    fn percentile(&self, histogram: &[u64], share: f64) -> u32 {
        let wanted = share * self.steps as f64;
        let mut seen = 0;
        for (n, count) in histogram.iter().enumerate() {
            seen += count;
            if seen as f64 >= wanted {
                return n as u32;
            }
        }
        0
    }

    fn form(&self) -> &'static str {
        match (self.tt_steps > 0, self.xt_steps > 0) {
            (false, false) => "single pass",
            (true, false) => "T-T",
            (false, true) => "X-T",
            (true, true) => "T-T and X-T",
        }
    }

    fn mean(&self, sum: u64) -> f64 {
        if self.steps == 0 { 0.0 } else { sum as f64 / self.steps as f64 }
    }

    fn summary(&self) -> GluingSummary {
        // a figure that no step could give does not apply; before the first step nothing is known to be amiss
        let applies = |steps: u64| self.steps == 0 || steps > 0;
        GluingSummary {
            form: self.form().into(),
            evaluations_mean: self.mean(self.bodies),
            evaluations_max: self.histogram.len().saturating_sub(1) as u32,
            evaluations_p95: self.percentile(&self.histogram, 0.95),
            evaluations_soil_mean: self.mean(self.soil),
            evaluations_soil_max: self.soil_max,
            evaluations_soil_p95: self.percentile(&self.soil_histogram, 0.95),
            evaluations_jacobian_mean: self.mean(self.differences),
            jacobian_refreshes_mean: self.mean(self.refreshes),
            steps_not_converged: applies(self.checked).then_some(self.not_converged),
            steps_halved: self.halved,
            max_gap_m: applies(self.with_gap).then_some(self.max_gap_m),
            max_action_reaction_gap_n: applies(self.with_gap).then_some(self.max_action_reaction_gap_n),
            max_estimate_gap_n: self.max_estimate_gap_n,
            interface_work_error_j: known(self.interface_work_error_j),
            max_residual: self.residual,
            max_complementarity_n: self.complementarity_n,
            kappa_max: self.kappa_max,
            rank_missing_max: self.rank_missing,
            condition_max: self.condition,
        }
    }
}

fn known(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

fn soils<'a>(view: &'a View) -> impl Iterator<Item = (usize, &'a SubsystemView<'a>)> {
    view.subsystems.iter().enumerate().filter(|(_, s)| s.kind == Kind::Soil)
}

impl SummaryObserver {
    /// Simulated time of the last step, s.
    pub fn t_s(&self) -> f64 {
        self.t_s
    }

    /// For a run of this scenario.
    pub fn new(scenario: &Scenario) -> Self {
        Self {
            scenario: scenario.name.clone(),
            strategy: scenario.gluing.strategy.name().to_owned(),
            body_name: scenario.report.body.clone(),
            speed_name: scenario.report.commanded_speed.clone(),
            gravity_m_s2: scenario.world.gravity_m_s2,
            soil_module: None,
            events: Vec::new(),
            steps: 0,
            t_s: 0.0,
            body: None,
            speed: None,
            sinkage: None,
            prints: None,
            mass_error: None,
            motors: MotorWork::default(),
            electrical_j: 0.0,
            energies: EnergyTrack::default(),
            gluing: GluingSums::default(),
        }
    }

    fn commanded_speed(&self, view: &View) -> Result<Option<Integral>> {
        let find = || {
            let (subsystem, variable) = self.speed_name.as_deref()?.split_once('.')?;
            let subsystem = view.subsystems.iter().position(|s| s.name == subsystem)?;
            Some((subsystem, real_id(view.subsystems[subsystem].instance, variable)?))
        };
        let Some((subsystem, id)) = find() else { return Ok(None) };
        let variables = view.subsystems[subsystem].instance.variables();
        let causality = variables.iter().find(|v| v.id == id).map(|v| v.causality);
        let told = matches!(causality, Some(Causality::Output | Causality::Local));
        let before = real(&view.subsystems[subsystem], id, view.t_s)?;
        Ok(Some(Integral { subsystem, id, told, before, sum: 0.0 }))
    }

    /// The figures so far. `wall_s` and `cpu_s` are the times of the step loop, s.
    pub fn summary(&self, wall_s: f64, cpu_s: f64, error: Option<&Error>, status: Status) -> Summary {
        let per = |total: f64, n: f64| if n > 0.0 { total / n } else { 0.0 };
        let body = self.body.as_ref();
        let weight_n = body.map(|b| b.mass_kg * rotation::length(self.gravity_m_s2)).filter(|w| *w > 0.0);
        Summary {
            status,
            error: error.map(FailureRecord::from),
            events: self.events.clone(),
            scenario: self.scenario.clone(),
            strategy: self.strategy.clone(),
            soil_module: self.soil_module.clone(),
            steps: self.steps,
            simulated_s: self.t_s,
            times: RunTimes::new(self.t_s, wall_s, cpu_s),
            cpu_per_step_s: per(cpu_s, self.steps as f64),
            motion: self.motion(weight_n),
            max_sinkage_m: self.sinkage.as_ref().map(Deepest::largest),
            mean_sinkage_m: self.prints.as_ref().and_then(PrintTrack::mean_m),
            print_depth: self.prints.as_ref().and_then(PrintTrack::depth),
            soil_mass_error_relative: self.mass_error.map(|m| m.2),
            energy: self.energy(weight_n),
            gluing: self.gluing.summary(),
            recording: RECORDING.into(),
            report: REPORT.into(),
        }
    }

    /// The motion of the reported body of this weight.
    fn motion(&self, weight_n: Option<f64>) -> MotionSummary {
        let body = self.body.as_ref();
        MotionSummary {
            distance_m: body.map(|b| b.distance_m),
            commanded_distance_m: self.speed.as_ref().map(|s| s.sum),
            max_roll_rad: body.map(|b| b.max_roll_rad),
            max_pitch_rad: body.map(|b| b.max_pitch_rad),
            height_gained_m: body.and_then(BodyTrack::height_gained_m),
            stalled: body.and_then(BodyTrack::stall),
            path_m: body.map(|b| b.path_m),
            peak_force_over_weight: body.and_then(|b| Some(b.peak_n()? / weight_n?)),
        }
    }

    /// Energies, and what a reported body of this weight takes over its distance.
    fn energy(&self, weight_n: Option<f64>) -> EnergySummary {
        let distance_m = self.body.as_ref().map(|b| b.distance_m.abs());
        let way_m = distance_m.filter(|way| *way >= SMALLEST_DISTANCE_M);
        let transport = |energy_j: f64| Some(energy_j / (weight_n? * way_m?));
        let energy_j = self.motors.both_j();
        let by_motors = Some(energy_j).filter(|e| *e > 0.0);
        let energies = self.energies.figures(&self.motors);
        let electrical_j = known(self.electrical_j);
        EnergySummary {
            energy_j,
            energy_j_per_m: by_motors.and_then(|e| Some(e / way_m?)),
            cost_of_transport: by_motors.and_then(transport),
            electrical_energy_j: electrical_j,
            electrical_energy_j_per_m: electrical_j.and_then(|e| Some(e / way_m?)),
            electrical_cost_of_transport: electrical_j.and_then(transport),
            energy_balance_j: energies.drift_j,
            energies,
        }
    }
}

impl Observer for SummaryObserver {
    fn started(&mut self, view: &View) -> Result {
        self.body = BodyTrack::find(view, self.body_name.as_deref(), &self.gravity_m_s2);
        self.speed = self.commanded_speed(view)?;
        self.sinkage = Deepest::find(view)?;
        self.prints = PrintTrack::find(view)?;
        self.energies.start(view);
        self.soil_module = soils(view).map(|(_, s)| s.module.to_owned()).next();
        let mass =
            |(k, s): (usize, &SubsystemView)| Some((k, real_id(s.instance, "mass_error_relative")?, 0.0));
        self.mass_error = soils(view).find_map(mass);
        self.motors = MotorWork::find(view);
        if let Some(body) = &mut self.body {
            body.follow(view, 0.0);
        }
        self.electrical_j = view.energy.electrical;
        Ok(())
    }

    fn stepped(&mut self, view: &View) -> Result {
        (self.steps, self.t_s) = (view.step_index, view.t_s);
        self.gluing.add(view.gluing);
        if let Some(speed) = &mut self.speed {
            let now = real(&view.subsystems[speed.subsystem], speed.id, view.t_s)?;
            speed.sum += if speed.told { now } else { speed.before } * view.h_s;
            speed.before = now;
        }
        if let Some(body) = &mut self.body {
            body.follow(view, self.speed.as_ref().map_or(0.0, |s| s.sum));
        }
        if let Some(sinkage) = &mut self.sinkage {
            sinkage.follow(view)?;
        }
        if let Some(prints) = &mut self.prints {
            prints.follow(view)?;
        }
        self.energies.follow(view);
        if let Some((soil, id, worst)) = &mut self.mass_error {
            *worst = worst.max(real(&view.subsystems[*soil], *id, view.t_s)?.abs());
        }
        self.electrical_j = view.energy.electrical;
        self.motors.follow(view)
    }

    fn event(&mut self, event: &Event) -> Result {
        self.events.push(event.clone());
        Ok(())
    }
}
