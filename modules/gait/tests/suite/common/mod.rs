//! A gait on its own: stepped as the coordinator does it, read and set by name.

#![allow(dead_code)]

use terraglue_gait::Gait;
use terraglue_subsystem::{
    Config, Input, Motion, Response, Result, Step, Subsystem, ValueType, Values, ValuesMut,
};

/// Step used by most tests, s.
pub const H: f64 = 0.001;

/// A gait from JSON parameters.
pub fn gait(json: &str) -> Gait {
    Gait::new(&Config::parse(json).expect("JSON"), 2).expect("parameters are right")
}

/// A trial without a commit.
pub fn trial(gait: &mut Gait, h: f64) -> Result {
    let mut out = Response { x: &mut [], v: &mut [], a: &mut [], t: &mut [], reached: f64::NAN, flags: 0 };
    gait.advance(&Step::free(0.0, h, 0), &Input::Force { t: &[], motion: None }, &mut out)
}

/// One accepted step.
pub fn step(gait: &mut Gait, h: f64) {
    trial(gait, h).expect("a step");
    gait.commit(&Step::free(0.0, h, 0), &[], &Motion { x: &[], v: &[] }).expect("a commit");
}

/// Steps of `H` for a time, s.
pub fn run(gait: &mut Gait, time: f64) {
    for _ in 0..(time / H).round() as usize {
        step(gait, H);
    }
}

fn find(gait: &Gait, name: &str) -> (u32, ValueType) {
    let v = gait.variables().iter().find(|v| v.name == name).unwrap_or_else(|| panic!("no variable {name}"));
    (v.id, v.value_type)
}

/// A number, or 0 and 1 for a flag.
pub fn read(gait: &Gait, name: &str) -> f64 {
    let (id, value_type) = find(gait, name);
    if value_type == ValueType::Bool {
        let mut out = [false];
        gait.get(&[id], ValuesMut::Bool(&mut out)).expect("a flag");
        return f64::from(out[0]);
    }
    let mut out = [f64::NAN];
    gait.get(&[id], ValuesMut::F64(&mut out)).expect("a number");
    out[0]
}

/// Sets a number, a flag or an enumeration.
pub fn set(gait: &mut Gait, name: &str, value: f64) -> Result {
    let (id, value_type) = find(gait, name);
    match value_type {
        ValueType::Bool => gait.set(&[id], Values::Bool(&[value != 0.0])),
        ValueType::Enumeration => gait.set(&[id], Values::Enumeration(&[value as i64])),
        _ => gait.set(&[id], Values::F64(&[value])),
    }
}

/// All 24 targets, rad.
pub fn targets(gait: &Gait) -> [f64; 24] {
    gait.walker().targets
}

/// Number of feet that are meant to stand.
pub fn standing(gait: &Gait) -> usize {
    gait.walker().feet.iter().filter(|f| !f.airborne).count()
}
