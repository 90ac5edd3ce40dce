//! Messages of our own topics: how a step was glued, energies, events; written by hand, read by serde.

use crate::gluing::StepReport;
use crate::observer::{Happening, View};
use crate::recording::json::JsonBuffer;
use crate::recording::layout::nanoseconds;
use serde::{Deserialize, Deserializer};
use terraglue_subsystem::{Energy, Kind};

/// One message of `/gluing`.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default)]
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
    #[serde(deserialize_with = "number_or_nan")]
    pub residual: f64,
    /// Largest eigenvalue of K·G1; NaN where it is not finite.
    #[serde(deserialize_with = "number_or_nan")]
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
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(default)]
pub struct PortRecord {
    /// Subsystem of the body.
    pub subsystem: String,
    /// Name of the body.
    pub body: String,
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
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
pub struct Point {
    /// m.
    pub x: f64,
    /// m.
    pub y: f64,
    /// m.
    pub z: f64,
}

/// Figures of all steps since the message before, this one included.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(default)]
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
    /// Largest gap, m; `None` where no step had one that says something.
    pub max_gap_m: Option<f64>,
    /// Largest difference of the wrench on the two sides, N.
    pub max_action_reaction_gap_n: f64,
    /// Largest |T* − T1|, N.
    pub estimate_gap_n: f64,
    /// Sum of the magnitudes, J; NaN: unknown.
    #[serde(deserialize_with = "number_or_nan")]
    pub interface_work_error_j: f64,
}

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

fn number_or_nan<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::<f64>::deserialize(deserializer)?.unwrap_or(f64::NAN))
}

/// Writes a message of `/gluing`.
pub(crate) fn write_gluing(json: &mut JsonBuffer, view: &View, window: &WindowRecord) {
    let g = view.gluing;
    json.raw("{").field("t", view.t_s);
    json.key("evaluations_bodies").integer(g.evaluations_bodies);
    json.key("evaluations_soil").integer(g.evaluations_soil);
    json.key("evaluations_line_search").integer(g.evaluations_line_search);
    json.key("evaluations_jacobian").integer(g.evaluations_jacobian);
    json.key("jacobian_refreshes").integer(g.jacobian_refreshes);
    json.key("halvings").integer(g.halvings);
    match g.single_pass {
        true => json.key("converged").raw("null"),
        false => json.key("converged").boolean(g.converged),
    };
    json.key("xt_form").boolean(g.xt_form);
    json.known("max_gap_m", if g.has_gap() { g.max_gap_m } else { f64::NAN });
    json.field("max_action_reaction_gap_n", g.max_action_reaction_gap_n);
    json.field("residual", g.residual).field("complementarity_n", g.complementarity_n);
    json.field("kappa_max", g.kappa_max).field("estimate_gap_n", g.estimate_gap_n);
    json.known("interface_work_error_j", g.interface_work_error_j);
    json.key("rank").integer(g.rank.0).key("size").integer(g.rank.1);
    json.key("ports").raw("[");
    for port in &g.ports {
        let subsystem = view.subsystems.get(port.subsystem as usize);
        let body = subsystem.and_then(|s| s.scene.bodies.get(port.body as usize));
        json.element().raw("{").key("key").raw("\"").integer(port.key).raw("\"");
        json.key("subsystem").text(subsystem.map_or("", |s| s.name));
        json.key("body").text(body.map_or("", |b| &b.name)).key("shape").integer(port.shape);
        json.vector("origin", &port.origin).numbers("frame", &port.frame).numbers("wrench", &port.wrench);
        json.field("t_star_n", port.t_star_n).field("gap_m", port.gap_m).raw("}");
    }
    json.raw("]").key("since_last").raw("{").key("steps").integer(window.steps);
    json.key("evaluations_bodies").integer(window.evaluations_bodies);
    json.key("evaluations_bodies_max").integer(window.evaluations_bodies_max);
    json.key("evaluations_soil").integer(window.evaluations_soil);
    json.key("evaluations_soil_max").integer(window.evaluations_soil_max);
    json.key("not_converged").integer(window.not_converged);
    json.known("max_gap_m", window.max_gap_m.unwrap_or(f64::NAN));
    json.field("max_action_reaction_gap_n", window.max_action_reaction_gap_n);
    json.field("estimate_gap_n", window.estimate_gap_n);
    json.known("interface_work_error_j", window.interface_work_error_j).raw("}}");
}

/// Writes a message of `/energy`: the sum, then each subsystem that can have any; what is unknown is null.
pub(crate) fn write_energy(json: &mut JsonBuffer, view: &View) {
    json.raw("{").field("t", view.t_s);
    let mut put = |prefix: &str, e: &Energy| {
        let parts = [
            ("kinetic", e.kinetic),
            ("potential", e.potential),
            ("dissipated", e.dissipated),
            ("port_work", e.port_work),
            ("actuator_work", e.actuator_work),
            ("electrical", e.electrical),
        ];
        for (name, value) in parts {
            json.element().raw("\"").raw(prefix).raw(if prefix.is_empty() { "" } else { "." });
            json.raw(name).raw("\":");
            if value.is_nan() {
                json.raw("null")
            } else {
                json.number(name, value)
            };
        }
    };
    put("", &view.energy);
    for s in view.subsystems.iter().filter(|s| matches!(s.kind, Kind::Robot | Kind::Soil)) {
        put(s.name, &s.instance.energy());
    }
    json.raw("}");
}

/// Writes a message of `/events`.
pub(crate) fn write_event(json: &mut JsonBuffer, happening: &Happening) {
    json.raw("{").timestamp(nanoseconds(happening.t_s)).key("level").integer(2);
    json.key("message").text(&happening.what).key("name").text("terraglue").key("file").text("");
    json.key("line").integer(0).field("t_s", happening.t_s).key("what").text(&happening.what).raw("}");
}
