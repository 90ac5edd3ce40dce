//! Adds up the figures of [`Summary`] while a run goes on; no file, no clock.

use crate::error::{Error, Result};
use crate::gluing::StepReport;
use crate::observer::{Happening, Observer, SubsystemView, View};
use crate::recording::body_track::BodyTrack;
use crate::recording::energies::EnergyTrack;
use crate::recording::ground_grid::GroundGrid;
use crate::recording::layout::{RECORDING, REPORT};
use crate::recording::snapshot::{failed, real, real_id};
use crate::recording::summary::{FailureRecord, Status, Summary};
use crate::scenario::Scenario;
use terraglue_subsystem::{Kind, ValuesMut};

/// Over a shorter way, m, the energy per distance says nothing.
const SMALLEST_DISTANCE_M: f64 = 1e-3;

/// Follows a run and adds up its figures.
pub struct SummaryObserver {
    scenario: String,
    strategy: String,
    body_name: Option<String>,
    speed_name: Option<String>,
    gravity_m_s2: f64,
    soil_module: Option<String>,
    events: Vec<Happening>,
    steps: u64,
    t_s: f64,
    body: Option<BodyTrack>,
    speed: Option<Integral>,
    sinkage: Option<Deepest>,
    mean_sinkage: Option<MeanSinkage>,
    mass_error: Option<(usize, u32, f64)>,
    motors: Vec<Motors>,
    energy_j: f64,
    electrical_j: f64,
    energies: EnergyTrack,
    gluing: GluingFigures,
}

/// Mean depth below the initial surface under loaded feet.
struct MeanSinkage {
    grid: Box<GroundGrid>,
    sum_m: f64,
    steps: u64,
}

impl MeanSinkage {
    fn find(view: &View) -> Result<Option<Self>> {
        let grid = GroundGrid::find(view)?;
        Ok(grid.map(|grid| Self { grid: Box::new(grid), sum_m: 0.0, steps: 0 }))
    }

    fn follow(&mut self, view: &View) -> Result {
        let soil = &view.subsystems[self.grid.subsystem];
        let (mut sum, mut loaded) = (0.0, 0u32);
        for port in view.gluing.ports.iter().filter(|p| p.wrench[0] > 0.0) {
            sum += self.grid.sinkage_at(soil, port.origin[0], port.origin[1], view.t_s)?;
            loaded += 1;
        }
        if loaded > 0 {
            self.sum_m += sum / f64::from(loaded);
            self.steps += 1;
        }
        Ok(())
    }

    fn mean_m(&self) -> Option<f64> {
        (self.steps > 0).then(|| self.sum_m / self.steps as f64)
    }
}

/// Integral of a variable over time, taken with its value at the start of each step.
struct Integral {
    subsystem: usize,
    id: u32,
    before: f64,
    sum: f64,
}

/// Where sinkage under the feet is read.
enum Deepest {
    Variable { soil: usize, id: u32, largest: f64 },
    Ground { grid: Box<GroundGrid>, largest: f64 },
}

/// Torques and velocities of a subsystem's joints.
struct Motors {
    subsystem: usize,
    ids: Vec<u32>,
    values: Vec<f64>,
}

/// Figures of the gluing over all steps.
#[derive(Default)]
struct GluingFigures {
    steps: u64,
    histogram: Vec<u64>,
    soil_histogram: Vec<u64>,
    bodies: u64,
    soil: u64,
    soil_max: u32,
    not_converged: u64,
    /// Steps that had a tolerance to reach, and those whose gap says something.
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

impl Motors {
    fn find(subsystem: usize, view: &SubsystemView) -> Option<Self> {
        let joints = view.instance.variables().iter().filter_map(|v| v.name.strip_suffix(".torque"));
        let pair = |joint: &str| {
            let torque = real_id(view.instance, &format!("{joint}.torque"))?;
            Some([torque, real_id(view.instance, &format!("{joint}.velocity"))?])
        };
        let ids: Vec<u32> = joints.filter_map(pair).flatten().collect();
        (!ids.is_empty()).then(|| Self { subsystem, values: vec![0.0; ids.len()], ids })
    }

    /// Σ |τ·ω|, W.
    fn power(&mut self, view: &View) -> Result<f64> {
        let s = &view.subsystems[self.subsystem];
        s.instance
            .get(&self.ids, ValuesMut::F64(&mut self.values))
            .map_err(|e| failed(s, view.t_s, "get", e.to_string()))?;
        Ok(self.values.chunks_exact(2).map(|p| (p[0] * p[1]).abs()).sum())
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

impl GluingFigures {
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
        let g = scenario.world.gravity_m_s2;
        Self {
            scenario: scenario.name.clone(),
            strategy: scenario.gluing.strategy.clone(),
            body_name: scenario.report.body.clone(),
            speed_name: scenario.report.commanded_speed.clone(),
            gravity_m_s2: (g[0] * g[0] + g[1] * g[1] + g[2] * g[2]).sqrt(),
            soil_module: None,
            events: Vec::new(),
            steps: 0,
            t_s: 0.0,
            body: None,
            speed: None,
            sinkage: None,
            mean_sinkage: None,
            mass_error: None,
            motors: Vec::new(),
            energy_j: 0.0,
            electrical_j: 0.0,
            energies: EnergyTrack::default(),
            gluing: GluingFigures::default(),
        }
    }

    fn commanded_speed(&self, view: &View) -> Result<Option<Integral>> {
        let find = || {
            let (subsystem, variable) = self.speed_name.as_deref()?.split_once('.')?;
            let subsystem = view.subsystems.iter().position(|s| s.name == subsystem)?;
            Some((subsystem, real_id(view.subsystems[subsystem].instance, variable)?))
        };
        let Some((subsystem, id)) = find() else { return Ok(None) };
        let before = real(&view.subsystems[subsystem], id, view.t_s)?;
        Ok(Some(Integral { subsystem, id, before, sum: 0.0 }))
    }

    fn follow_energy(&mut self, view: &View) -> Result {
        for motors in &mut self.motors {
            self.energy_j += motors.power(view)? * view.h_s;
        }
        self.electrical_j = view.energy.electrical;
        Ok(())
    }

    /// The figures so far. `wall_s` and `cpu_s` are the times of the step loop, s.
    pub fn summary(&self, wall_s: f64, cpu_s: f64, error: Option<&Error>, status: Status) -> Summary {
        let per = |total: f64, n: f64| if n > 0.0 { total / n } else { 0.0 };
        let body = self.body.as_ref();
        let weight_n = body.map_or(0.0, |b| b.mass_kg * self.gravity_m_s2);
        let work_j = body.map_or(0.0, |b| weight_n * b.distance_m.abs());
        let moved = body.is_some_and(|b| b.distance_m.abs() >= SMALLEST_DISTANCE_M);
        let g = &self.gluing;
        let energies = self.energies.figures(self.energy_j);
        // what no step could say does not apply; before the first step nothing is known to be amiss
        let applies = |steps: u64| g.steps == 0 || steps > 0;
        let known = |value: f64| value.is_finite().then_some(value);
        let electrical_j = known(self.electrical_j);
        Summary {
            status,
            error: error.map(FailureRecord::from),
            events: self.events.clone(),
            scenario: self.scenario.clone(),
            strategy: self.strategy.clone(),
            soil_module: self.soil_module.clone(),
            steps: self.steps,
            simulated_s: self.t_s,
            wall_s,
            cpu_s,
            real_time_factor: per(self.t_s, wall_s),
            distance_m: body.map(|b| b.distance_m),
            commanded_distance_m: self.speed.as_ref().map(|s| s.sum),
            max_roll_rad: body.map(|b| b.max_roll_rad),
            max_pitch_rad: body.map(|b| b.max_pitch_rad),
            max_sinkage_m: self.sinkage.as_ref().map(Deepest::largest),
            energy_j: self.energy_j,
            cost_of_transport: (moved && work_j > 0.0).then(|| self.energy_j / work_j),
            evaluations_mean: g.mean(g.bodies),
            evaluations_max: g.histogram.len().saturating_sub(1) as u32,
            steps_not_converged: applies(g.checked).then_some(g.not_converged),
            max_gap_m: applies(g.with_gap).then_some(g.max_gap_m),
            max_action_reaction_gap_n: applies(g.with_gap).then_some(g.max_action_reaction_gap_n),
            soil_mass_error_relative: self.mass_error.map(|m| m.2),
            recording: RECORDING.into(),
            report: REPORT.into(),
            form: g.form().into(),
            evaluations_p95: g.percentile(&g.histogram, 0.95),
            evaluations_soil_mean: g.mean(g.soil),
            evaluations_soil_max: g.soil_max,
            evaluations_soil_p95: g.percentile(&g.soil_histogram, 0.95),
            max_estimate_gap_n: g.max_estimate_gap_n,
            interface_work_error_j: known(g.interface_work_error_j),
            energy_balance_j: energies.drift_j,
            cpu_per_step_s: per(cpu_s, self.steps as f64),
            height_gained_m: body.map(BodyTrack::height_gained_m),
            stalled: body.and_then(BodyTrack::stall),
            electrical_energy_j: electrical_j,
            electrical_energy_j_per_m: body
                .filter(|_| moved)
                .and_then(|b| Some(electrical_j? / b.distance_m.abs())),
            kappa_max: g.kappa_max,
            jacobian_refreshes_mean: g.mean(g.refreshes),
            evaluations_jacobian_mean: g.mean(g.differences),
            max_residual: g.residual,
            max_complementarity_n: g.complementarity_n,
            rank_missing_max: g.rank_missing,
            condition_max: g.condition,
            steps_halved: g.halved,
            mean_sinkage_m: self.mean_sinkage.as_ref().and_then(MeanSinkage::mean_m),
            path_m: body.map(|b| b.path_m),
            energies,
        }
    }
}

impl Observer for SummaryObserver {
    fn started(&mut self, view: &View) -> Result {
        self.body = BodyTrack::find(view, self.body_name.as_deref());
        self.speed = self.commanded_speed(view)?;
        self.sinkage = Deepest::find(view)?;
        self.mean_sinkage = MeanSinkage::find(view)?;
        self.energies.start(view);
        self.soil_module = soils(view).map(|(_, s)| s.module.to_owned()).next();
        let mass =
            |(k, s): (usize, &SubsystemView)| Some((k, real_id(s.instance, "mass_error_relative")?, 0.0));
        self.mass_error = soils(view).find_map(mass);
        self.motors = view.subsystems.iter().enumerate().filter_map(|(k, s)| Motors::find(k, s)).collect();
        if let Some(body) = &mut self.body {
            body.follow(view, 0.0);
        }
        self.follow_energy(view)
    }

    fn stepped(&mut self, view: &View) -> Result {
        (self.steps, self.t_s) = (view.step_index, view.t_s);
        self.gluing.add(view.gluing);
        if let Some(speed) = &mut self.speed {
            speed.sum += speed.before * view.h_s;
            speed.before = real(&view.subsystems[speed.subsystem], speed.id, view.t_s)?;
        }
        if let Some(body) = &mut self.body {
            body.follow(view, self.speed.as_ref().map_or(0.0, |s| s.sum));
        }
        if let Some(sinkage) = &mut self.sinkage {
            sinkage.follow(view)?;
        }
        if let Some(sinkage) = &mut self.mean_sinkage {
            sinkage.follow(view)?;
        }
        self.energies.follow(view);
        if let Some((soil, id, worst)) = &mut self.mass_error {
            *worst = worst.max(real(&view.subsystems[*soil], *id, view.t_s)?.abs());
        }
        self.follow_energy(view)
    }

    fn happened(&mut self, happening: &Happening) -> Result {
        self.events.push(happening.clone());
        Ok(())
    }
}
