//! `summary.json`: the figures of a run that scripts read.

use crate::energies::Energies;
use crate::layout::{SUMMARY, at, other_at};
use serde::{Deserialize, Serialize};
use std::path::Path;
use terraglue_diagnostics::error::{Error, Result};
use terraglue_engine::observer::Event;

/// How a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Status {
    /// All of the simulated time was reached.
    Done,
    /// An error stopped it.
    Failed,
    /// The user stopped it.
    Stopped,
}

/// The failure that stopped a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FailureRecord {
    /// Module that failed; null where no module did.
    pub module: Option<String>,
    /// Function of the interface that failed.
    pub function: Option<String>,
    /// Simulated time, s.
    pub time_s: Option<f64>,
    /// Error message.
    pub message: String,
}

impl From<&Error> for FailureRecord {
    fn from(error: &Error) -> Self {
        let mut record = Self { module: None, function: None, time_s: None, message: error.to_string() };
        match error {
            Error::Module { module, function, time_s, .. } => {
                record.module = Some(module.clone());
                record.function = Some((*function).into());
                record.time_s = Some(*time_s);
            }
            Error::Full { kept_s, .. } => record.time_s = Some(*kept_s),
            Error::NotConverged { time_s, .. } | Error::Simulation { time_s, .. } => {
                record.time_s = Some(*time_s);
            }
            _ => {}
        }
        record
    }
}

/// Figures of a run. Numbers that do not apply (no robot, no soil, no commanded speed) are null. In `summary.json` all keys are on one
/// level.
///
/// ```
/// use terraglue_recording::{Status, Summary, SummaryObserver};
/// use terraglue_scenario::Scenario;
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let text = "[time]\nduration_s = 1.0\n[arm]\nmodule = \"arm.py\"\n";
/// let scenario = Scenario::parse(text, "arm.toml", &[])?;
/// // the observer has seen no step
/// let summary = SummaryObserver::new(&scenario).summary(2.0, 1.0, None, Status::Done);
/// assert_eq!((summary.steps, summary.motion.distance_m), (0, None));
///
/// let folder = tempfile::tempdir()?;
/// summary.write(folder.path())?;
/// assert_eq!(Summary::read(folder.path())?, summary);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// How the run ended.
    pub status: Status,
    /// The failure that stopped it; null unless `failed`.
    pub error: Option<FailureRecord>,
    /// Events, changes and warnings in order of time.
    pub events: Vec<Event>,
    /// Name of the scenario.
    pub scenario: String,
    /// Gluing strategy.
    pub strategy: String,
    /// Module of the soil.
    pub soil_module: Option<String>,
    /// Accepted steps.
    pub steps: u64,
    /// Simulated time, s.
    pub simulated_s: f64,
    /// How long it took.
    #[serde(flatten)]
    pub times: RunTimes,
    /// CPU time per step, s.
    pub cpu_per_step_s: f64,
    /// Where the reported body went.
    #[serde(flatten)]
    pub motion: MotionSummary,
    /// Largest committed depth under a foot below the initial surface, m.
    pub max_sinkage_m: Option<f64>,
    /// Mean over the steps of the depth under the loaded feet below the initial surface, m; null where no foot was loaded or
    /// the soil shows no height.
    #[serde(default)]
    pub mean_sinkage_m: Option<f64>,
    /// Depth of the prints below the initial surface; null where nothing pressed or the soil shows no height.
    #[serde(default)]
    pub print_depth: Option<PrintDepth>,
    /// Relative error of the soil's mass; null where the soil moves no material.
    pub soil_mass_error_relative: Option<f64>,
    /// Where the energy came from and went.
    #[serde(flatten)]
    pub energy: EnergySummary,
    /// How the subsystems were glued.
    #[serde(flatten)]
    pub gluing: GluingSummary,
    /// File name of the recording beside this file.
    pub recording: String,
    /// File name of the report beside this file.
    pub report: String,
}

/// Figures of the motion of the reported body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MotionSummary {
    /// Horizontal displacement of the reported body along its initial heading, m.
    pub distance_m: Option<f64>,
    /// Integral of the variable `report.commanded_speed` over time, m: the distance that was asked for.
    pub commanded_distance_m: Option<f64>,
    /// Largest magnitude of the roll angle (z-y-x Euler), rad.
    pub max_roll_rad: Option<f64>,
    /// Largest magnitude of the pitch angle (z-y-x Euler), rad.
    pub max_pitch_rad: Option<f64>,
    /// Height of the reported body at the end above that at the start, against gravity, m; null without gravity.
    pub height_gained_m: Option<f64>,
    /// Where the body has stood still, if it did so for the last 5 s or longer; null: it came on.
    pub stalled: Option<Stall>,
    /// Length of the way of the reported body's origin, m.
    #[serde(default)]
    pub path_m: Option<f64>,
    /// Largest normal force of the ground on the reported robot, all its feet or wheels together, over its weight; null where
    /// the world holds it.
    #[serde(default)]
    pub peak_force_over_weight: Option<f64>,
}

/// Figures of energy and work.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EnergySummary {
    /// Mechanical work of the motors, driving and braking together, Σ |power|·h, J: `energies.driving_j` +
    /// `energies.braking_j`.
    pub energy_j: f64,
    /// energy_j / |distance|, J/m; null below 1 mm and where no motor worked.
    #[serde(default)]
    pub energy_j_per_m: Option<f64>,
    /// energy_j / (m·g·|distance|), dimensionless; null below 1 mm and where no motor worked. Mechanical; see
    /// `electrical_cost_of_transport`.
    pub cost_of_transport: Option<f64>,
    /// Electrical energy that the motors drew, J; null where no motor has a drive with losses.
    #[serde(default)]
    pub electrical_energy_j: Option<f64>,
    /// electrical_energy_j / |distance|, J/m; null below 1 mm.
    #[serde(default)]
    pub electrical_energy_j_per_m: Option<f64>,
    /// electrical_energy_j / (m·g·|distance|), dimensionless; null below 1 mm and where the electrical energy is.
    #[serde(default)]
    pub electrical_cost_of_transport: Option<f64>,
    /// Drift of the energy ledger: change of (kinetic + potential + dissipated − actuator work) of all
    /// subsystems and of the glue since the start, J; null: unknown. The same as `energies.drift_j`.
    pub energy_balance_j: Option<f64>,
    /// Where the energy came from and went.
    #[serde(default)]
    pub energies: Energies,
}

/// Figures of the gluing over all steps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GluingSummary {
    /// Form of the iteration that ran: `single pass`, `T-T`, `X-T` or `T-T and X-T`.
    pub form: String,
    /// Evaluations of the bodies per step, mean; 1 for a single pass, which makes no iterations.
    pub evaluations_mean: f64,
    /// Evaluations of the bodies per step, largest.
    pub evaluations_max: u32,
    /// Evaluations of the bodies per step that 95 % of the steps do not exceed.
    pub evaluations_p95: u32,
    /// Evaluations of the soils per step, mean.
    pub evaluations_soil_mean: f64,
    /// Evaluations of the soils per step, largest.
    pub evaluations_soil_max: u32,
    /// Evaluations of the soils per step that 95 % of the steps do not exceed.
    pub evaluations_soil_p95: u32,
    /// Evaluations per step that finite differences took, mean; not among the others.
    #[serde(default)]
    pub evaluations_jacobian_mean: f64,
    /// Fresh interface Jacobians per step, mean.
    #[serde(default)]
    pub jacobian_refreshes_mean: f64,
    /// Steps that did not reach the tolerance; null for a single pass, which has none.
    pub steps_not_converged: Option<u64>,
    /// Steps that were halved.
    #[serde(default)]
    pub steps_halved: u64,
    /// Largest |C| over closed ports after commit, m; null for a single pass at contacts, whose soil takes over the
    /// motion of the body.
    pub max_gap_m: Option<f64>,
    /// Largest difference of the wrench on the two sides, N; null for a single pass at contacts: see
    /// `interface_work_error_j`.
    pub max_action_reaction_gap_n: Option<f64>,
    /// Largest |T* − T1| along n, N.
    pub max_estimate_gap_n: f64,
    /// Sum over the steps of the magnitude of the work that the interface gains, J: work on both sides by each side's own
    /// wrench; null where a soil keeps no energy ledger.
    pub interface_work_error_j: Option<f64>,
    /// Largest |Λ·e|/T_ref that was accepted.
    #[serde(default)]
    pub max_residual: f64,
    /// Largest residual of complementarity at unilateral ports, N.
    #[serde(default)]
    pub max_complementarity_n: f64,
    /// Largest κ = λmax(K·G1) of any step; 0 where no strategy formed it.
    #[serde(default)]
    pub kappa_max: f64,
    /// Largest number of components by which Λ was short of its full rank.
    #[serde(default)]
    pub rank_missing_max: u32,
    /// Largest condition of Λ; 0 where no strategy formed it.
    #[serde(default)]
    pub condition_max: f64,
}

/// How long a run took.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunTimes {
    /// Wall time of the step loop, s.
    pub wall_s: f64,
    /// CPU time of the step loop, s.
    pub cpu_s: f64,
    /// simulated_s / wall_s.
    pub real_time_factor: f64,
    /// simulated_s / cpu_s: how fast a core would be that has nothing else to do.
    #[serde(default)]
    pub cpu_real_time_factor: f64,
}

impl RunTimes {
    /// Of so much simulated time, s.
    pub(crate) fn new(simulated_s: f64, wall_s: f64, cpu_s: f64) -> Self {
        let per = |s: f64| if s > 0.0 { simulated_s / s } else { 0.0 };
        Self { wall_s, cpu_s, real_time_factor: per(wall_s), cpu_real_time_factor: per(cpu_s) }
    }
}

/// Depth of prints: each counts once, with the largest depth under it while it was pressed, however often that was. A wheel
/// leaves a print every 3 cm.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PrintDepth {
    /// Number of prints.
    pub count: u64,
    /// Half of them are deeper, m.
    pub median_m: f64,
    /// A tenth of them is less deep, m.
    pub p10_m: f64,
    /// A tenth of them is deeper, m.
    pub p90_m: f64,
}

/// Since when and where less than a tenth of the commanded distance was made.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stall {
    /// Simulated time, s.
    pub t_s: f64,
    /// World x of the body then, m.
    pub x_m: f64,
    /// World y of the body then, m.
    pub y_m: f64,
}

impl Summary {
    /// Writes `summary.json` into a results folder.
    ///
    /// # Errors
    /// [`Error::File`]: the file cannot be written.
    pub fn write(&self, folder: &Path) -> Result {
        let path = folder.join(SUMMARY);
        let mut text = serde_json::to_string_pretty(self).map_err(other_at(&path))?;
        text.push('\n');
        std::fs::write(&path, text).map_err(at(&path))
    }

    /// Reads `summary.json` of a results folder.
    ///
    /// # Errors
    /// [`Error::File`]: there is no such file, or it is no summary.
    pub fn read(folder: &Path) -> Result<Self> {
        let path = folder.join(SUMMARY);
        let text = terraglue_subsystem::files::read(&path).map_err(at(&path))?;
        serde_json::from_slice(&text).map_err(other_at(&path))
    }
}
