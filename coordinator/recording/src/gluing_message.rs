//! The messages of `/gluing`: how the recorded step was glued, its ports, and the extremes since the message before.
//!
//! Values that are unknown, or do not apply to a single pass, are NaN.

use crate::descriptor::{field, file, message, nested, repeated};
use crate::messages::{GluingRecord, Point, PortRecord, WindowRecord};
use crate::selection::Precision;
use prost_types::DescriptorProto;
use prost_types::field_descriptor_proto::{Label, Type};
use terraglue_diagnostics::error::{Error, Result};
use terraglue_engine::observer::View;

/// Name of the message type.
pub(crate) const SCHEMA: &str = "terraglue.StepReport";

#[derive(Clone, PartialEq, prost::Message)]
pub(crate) struct StepMessage {
    #[prost(double, tag = "1")]
    t: f64,
    #[prost(uint32, tag = "2")]
    evaluations_bodies: u32,
    #[prost(uint32, tag = "3")]
    evaluations_soil: u32,
    #[prost(uint32, tag = "4")]
    evaluations_line_search: u32,
    #[prost(uint32, tag = "5")]
    evaluations_jacobian: u32,
    #[prost(uint32, tag = "6")]
    jacobian_refreshes: u32,
    #[prost(uint32, tag = "7")]
    halvings: u32,
    #[prost(bool, tag = "8")]
    single_pass: bool,
    #[prost(bool, tag = "9")]
    converged: bool,
    #[prost(bool, tag = "10")]
    xt_form: bool,
    #[prost(double, tag = "11")]
    max_gap_m: f64,
    #[prost(double, tag = "12")]
    max_action_reaction_gap_n: f64,
    #[prost(double, tag = "13")]
    residual: f64,
    #[prost(double, tag = "14")]
    complementarity_n: f64,
    #[prost(double, tag = "15")]
    kappa_max: f64,
    #[prost(double, tag = "16")]
    estimate_gap_n: f64,
    #[prost(double, tag = "17")]
    interface_work_error_j: f64,
    #[prost(uint32, tag = "18")]
    rank: u32,
    #[prost(uint32, tag = "19")]
    size: u32,
    #[prost(message, repeated, tag = "20")]
    ports: Vec<PortMessage>,
    #[prost(message, required, tag = "21")]
    since_last: WindowMessage,
}

#[derive(Clone, PartialEq, prost::Message)]
struct PortMessage {
    #[prost(uint64, tag = "1")]
    key: u64,
    #[prost(string, tag = "2")]
    subsystem: String,
    #[prost(string, tag = "3")]
    body: String,
    #[prost(uint32, tag = "4")]
    shape: u32,
    #[prost(double, repeated, tag = "5")]
    origin: Vec<f64>,
    #[prost(double, repeated, tag = "6")]
    frame: Vec<f64>,
    #[prost(double, repeated, tag = "7")]
    wrench: Vec<f64>,
    #[prost(double, tag = "8")]
    t_star_n: f64,
    #[prost(double, tag = "9")]
    gap_m: f64,
}

#[derive(Clone, PartialEq, prost::Message)]
struct WindowMessage {
    #[prost(uint64, tag = "1")]
    steps: u64,
    #[prost(uint64, tag = "2")]
    evaluations_bodies: u64,
    #[prost(uint32, tag = "3")]
    evaluations_bodies_max: u32,
    #[prost(uint64, tag = "4")]
    evaluations_soil: u64,
    #[prost(uint32, tag = "5")]
    evaluations_soil_max: u32,
    #[prost(uint64, tag = "6")]
    not_converged: u64,
    #[prost(double, tag = "7")]
    max_gap_m: f64,
    #[prost(double, tag = "8")]
    max_action_reaction_gap_n: f64,
    #[prost(double, tag = "9")]
    estimate_gap_n: f64,
    #[prost(double, tag = "10")]
    interface_work_error_j: f64,
}

/// Number, name and type of the fields, in the order of their numbers.
type Fields = &'static [(&'static str, Type)];

const STEP: Fields = &[
    ("t", Type::Double),
    ("evaluations_bodies", Type::Uint32),
    ("evaluations_soil", Type::Uint32),
    ("evaluations_line_search", Type::Uint32),
    ("evaluations_jacobian", Type::Uint32),
    ("jacobian_refreshes", Type::Uint32),
    ("halvings", Type::Uint32),
    ("single_pass", Type::Bool),
    ("converged", Type::Bool),
    ("xt_form", Type::Bool),
    ("max_gap_m", Type::Double),
    ("max_action_reaction_gap_n", Type::Double),
    ("residual", Type::Double),
    ("complementarity_n", Type::Double),
    ("kappa_max", Type::Double),
    ("estimate_gap_n", Type::Double),
    ("interface_work_error_j", Type::Double),
    ("rank", Type::Uint32),
    ("size", Type::Uint32),
];

const PORT: Fields = &[
    ("key", Type::Uint64),
    ("subsystem", Type::String),
    ("body", Type::String),
    ("shape", Type::Uint32),
    ("origin", Type::Double),
    ("frame", Type::Double),
    ("wrench", Type::Double),
    ("t_star_n", Type::Double),
    ("gap_m", Type::Double),
];

const WINDOW: Fields = &[
    ("steps", Type::Uint64),
    ("evaluations_bodies", Type::Uint64),
    ("evaluations_bodies_max", Type::Uint32),
    ("evaluations_soil", Type::Uint64),
    ("evaluations_soil_max", Type::Uint32),
    ("not_converged", Type::Uint64),
    ("max_gap_m", Type::Double),
    ("max_action_reaction_gap_n", Type::Double),
    ("estimate_gap_n", Type::Double),
    ("interface_work_error_j", Type::Double),
];

fn described(name: &str, fields: Fields, lists: &[&str]) -> DescriptorProto {
    let one = |(k, (name, of)): (usize, &(&str, Type))| match lists.contains(name) {
        true => repeated(name, k as u32 + 1, *of),
        false => field(name, k as u32 + 1, *of),
    };
    message(name, fields.iter().enumerate().map(one).collect())
}

/// The message types.
pub(crate) fn descriptor() -> Vec<u8> {
    let mut step = described("StepReport", STEP, &[]);
    let mut ports = nested("ports", 20, ".terraglue.Port");
    ports.set_label(Label::Repeated);
    step.field.extend([ports, nested("since_last", 21, ".terraglue.Window")]);
    let port = described("Port", PORT, &["origin", "frame", "wrench"]);
    file("terraglue", vec![step, port, described("Window", WINDOW, &[])])
}

/// The message of a step.
///
/// # Errors
/// A figure that must be a number is none.
pub(crate) fn step(view: &View, window: &WindowRecord, precision: Precision) -> Result<StepMessage> {
    let g = view.gluing;
    let known = [
        ("max_action_reaction_gap_n", g.max_action_reaction_gap_n),
        ("residual", g.residual),
        ("complementarity_n", g.complementarity_n),
        ("kappa_max", g.kappa_max),
        ("estimate_gap_n", g.estimate_gap_n),
    ];
    if let Some((key, _)) = known.iter().find(|(_, value)| value.is_nan()) {
        return Err(not_a_number(key, view.t_s));
    }
    Ok(StepMessage {
        t: view.t_s,
        evaluations_bodies: g.evaluations_bodies,
        evaluations_soil: g.evaluations_soil,
        evaluations_line_search: g.evaluations_line_search,
        evaluations_jacobian: g.evaluations_jacobian,
        jacobian_refreshes: g.jacobian_refreshes,
        halvings: g.halvings,
        single_pass: g.single_pass,
        converged: g.converged && !g.single_pass,
        xt_form: g.xt_form,
        max_gap_m: if g.has_gap() { g.max_gap_m } else { f64::NAN },
        max_action_reaction_gap_n: g.max_action_reaction_gap_n,
        residual: g.residual,
        complementarity_n: g.complementarity_n,
        kappa_max: g.kappa_max,
        estimate_gap_n: g.estimate_gap_n,
        interface_work_error_j: g.interface_work_error_j,
        rank: g.rank.0,
        size: g.rank.1,
        ports: ports(view, precision)?,
        since_last: window.into(),
    })
}

fn not_a_number(key: &str, time_s: f64) -> Error {
    Error::Simulation { time_s, message: format!("recording /gluing: `{key}` is not a number (NaN)") }
}

fn ports(view: &View, precision: Precision) -> Result<Vec<PortMessage>> {
    let rounded = |numbers: &[f64]| numbers.iter().map(|x| precision.of(*x)).collect();
    let one = |port: &terraglue_gluing::PortReport| {
        let subsystem = view.subsystems.get(port.subsystem as usize);
        let body = subsystem.and_then(|s| s.scene.bodies.get(port.body as usize));
        let mut numbers = port.origin.iter().chain(&port.frame).chain(&port.wrench);
        if numbers.any(|v| v.is_nan()) || port.t_star_n.is_nan() || port.gap_m.is_nan() {
            return Err(not_a_number("ports", view.t_s));
        }
        Ok(PortMessage {
            key: port.key,
            subsystem: subsystem.map_or("", |s| s.name).into(),
            body: body.map_or("", |b| &b.name).into(),
            shape: port.shape,
            origin: rounded(&port.origin),
            frame: rounded(&port.frame),
            wrench: rounded(&port.wrench),
            t_star_n: precision.of(port.t_star_n),
            gap_m: precision.of(port.gap_m),
        })
    };
    view.gluing.ports.iter().map(one).collect()
}

impl From<&WindowRecord> for WindowMessage {
    fn from(w: &WindowRecord) -> Self {
        Self {
            steps: w.steps,
            evaluations_bodies: w.evaluations_bodies,
            evaluations_bodies_max: w.evaluations_bodies_max,
            evaluations_soil: w.evaluations_soil,
            evaluations_soil_max: w.evaluations_soil_max,
            not_converged: w.not_converged,
            max_gap_m: w.max_gap_m.unwrap_or(f64::NAN),
            max_action_reaction_gap_n: w.max_action_reaction_gap_n,
            estimate_gap_n: w.estimate_gap_n,
            interface_work_error_j: w.interface_work_error_j,
        }
    }
}

fn known(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

impl From<StepMessage> for GluingRecord {
    fn from(m: StepMessage) -> Self {
        Self {
            t: m.t,
            evaluations_bodies: m.evaluations_bodies,
            evaluations_soil: m.evaluations_soil,
            converged: (!m.single_pass).then_some(m.converged),
            xt_form: m.xt_form,
            max_gap_m: known(m.max_gap_m),
            max_action_reaction_gap_n: m.max_action_reaction_gap_n,
            residual: known(m.residual).unwrap_or(f64::NAN),
            kappa_max: known(m.kappa_max).unwrap_or(f64::NAN),
            estimate_gap_n: m.estimate_gap_n,
            interface_work_error_j: known(m.interface_work_error_j),
            ports: m.ports.into_iter().map(PortRecord::from).collect(),
            since_last: m.since_last.into(),
        }
    }
}

impl From<PortMessage> for PortRecord {
    fn from(m: PortMessage) -> Self {
        let axis = |k: usize| m.origin.get(k).copied().unwrap_or_default();
        Self {
            origin: Point { x: axis(0), y: axis(1), z: axis(2) },
            subsystem: m.subsystem,
            body: m.body,
            shape: m.shape,
            frame: m.frame,
            wrench: m.wrench,
            t_star_n: m.t_star_n,
            gap_m: m.gap_m,
        }
    }
}

impl From<WindowMessage> for WindowRecord {
    fn from(m: WindowMessage) -> Self {
        Self {
            steps: m.steps,
            evaluations_bodies: m.evaluations_bodies,
            evaluations_bodies_max: m.evaluations_bodies_max,
            evaluations_soil: m.evaluations_soil,
            evaluations_soil_max: m.evaluations_soil_max,
            not_converged: m.not_converged,
            max_gap_m: known(m.max_gap_m),
            max_action_reaction_gap_n: m.max_action_reaction_gap_n,
            estimate_gap_n: m.estimate_gap_n,
            interface_work_error_j: known(m.interface_work_error_j).unwrap_or(f64::NAN),
        }
    }
}
