//! Content of `/gluing` for a step, as the report and programs read it; [`super::gluing_message`] is its form in the file.

use terraglue_gluing::StepReport;

/// One message of `/gluing`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GluingRecord {
    /// Simulated time, s.
    pub t: f64,
    /// Evaluations of the bodies in this step.
    pub evaluations_bodies: u32,
    /// Evaluations of the soils in this step.
    pub evaluations_soil: u32,
    /// Whether the strategy reached its tolerance; `None`: a single pass has none.
    pub converged: Option<bool>,
    /// Whether the X-T form ran.
    pub xt_form: bool,
    /// Largest gap over the closed ports, m; `None` for a single pass at contacts.
    pub max_gap_m: Option<f64>,
    /// Largest difference of the wrench on the two sides, N.
    pub max_action_reaction_gap_n: f64,
    /// |Λe| / T_ref; NaN where it is not finite.
    pub residual: f64,
    /// Largest eigenvalue of K·G1; NaN where it is not finite.
    pub kappa_max: f64,
    /// Largest |T* − T1| along n, N.
    pub estimate_gap_n: f64,
    /// Work that the interface gains in this step, J; `None`: unknown.
    pub interface_work_error_j: Option<f64>,
    /// Ports of this step.
    pub ports: Vec<PortRecord>,
    /// Extremes of all steps since the message before.
    pub since_last: WindowRecord,
}

/// One port of a [`GluingRecord`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PortRecord {
    /// Subsystem of the body.
    pub subsystem: String,
    /// Name of the body.
    pub body: String,
    /// Id of the shape that touches.
    pub shape: u32,
    /// Where the foot stands.
    pub origin: Point,
    /// n, t1, t2 in the world.
    pub frame: Vec<f64>,
    /// Wrench on the body along n, t1, t2 (N) and about them (N m).
    pub wrench: Vec<f64>,
    /// Normal force of the rigid-contact estimate, N.
    pub t_star_n: f64,
    /// Gap after commit, m.
    pub gap_m: f64,
}

/// A point as viewers write it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Point {
    /// m.
    pub x: f64,
    /// m.
    pub y: f64,
    /// m.
    pub z: f64,
}

/// Figures of all steps since the message before, this one included.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WindowRecord {
    /// Number of steps.
    pub steps: u64,
    /// Sum over the steps.
    pub evaluations_bodies: u64,
    /// Largest of one step.
    pub evaluations_bodies_max: u32,
    /// Sum over the steps.
    pub evaluations_soil: u64,
    /// Largest of one step.
    pub evaluations_soil_max: u32,
    /// Steps that did not reach their tolerance.
    pub not_converged: u64,
    /// Largest gap, m; `None` where no step had a meaningful one.
    pub max_gap_m: Option<f64>,
    /// Largest difference of the wrench on the two sides, N.
    pub max_action_reaction_gap_n: f64,
    /// Largest |T* − T1|, N.
    pub estimate_gap_n: f64,
    /// Sum of the magnitudes, J; NaN: unknown.
    pub interface_work_error_j: f64,
}

terraglue_subsystem::persist!(WindowRecord {
    steps,
    evaluations_bodies,
    evaluations_bodies_max,
    evaluations_soil,
    evaluations_soil_max,
    not_converged,
    max_gap_m,
    max_action_reaction_gap_n,
    estimate_gap_n,
    interface_work_error_j,
});

impl WindowRecord {
    /// Takes one more step in.
    pub fn add(&mut self, step: &StepReport) {
        self.steps += 1;
        self.evaluations_bodies += u64::from(step.evaluations_bodies);
        self.evaluations_bodies_max = self.evaluations_bodies_max.max(step.evaluations_bodies);
        self.evaluations_soil += u64::from(step.evaluations_soil);
        self.evaluations_soil_max = self.evaluations_soil_max.max(step.evaluations_soil);
        self.not_converged += u64::from(!step.converged && step.evaluations_bodies > 0);
        if step.has_gap() {
            self.max_gap_m = Some(self.max_gap_m.map_or(step.max_gap_m, |gap| gap.max(step.max_gap_m)));
        }
        self.max_action_reaction_gap_n = self.max_action_reaction_gap_n.max(step.max_action_reaction_gap_n);
        self.estimate_gap_n = self.estimate_gap_n.max(step.estimate_gap_n);
        self.interface_work_error_j += step.interface_work_error_j.abs();
    }
}
