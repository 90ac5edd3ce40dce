//! `[[robot.object]]`: further robots and things in the same subsystem, where bodies touch each other.

use crate::closure::configure::{Entry, entries};
use crate::math::V3;
use crate::placement::base_pose;
use nalgebra::Isometry3;
use serde_json::Value;
use std::path::Path;
use terraglue_robot_import::{Options, Robot, read_robot};
use terraglue_subsystem::{Config, Error, Parameter, ParameterType, Result};

const KEYS: [&str; 5] = ["name", "model", "position_m", "heading_rad", "fixed_base"];

/// The parameter of the scenario.
pub(crate) fn parameter() -> Parameter {
    let help = "Further robots and things that bodies can touch: name, model, position_m, heading_rad, fixed_base; what \
                belongs to them is called NAME/…";
    Parameter::of("object", ParameterType::Tables, help).optional()
}

/// Adds them to the robot, whose file's frame stands at `base`; relative paths start from `folder`.
pub(crate) fn attach(
    config: &Config,
    (folder, options): (&Path, &Options),
    base: &Isometry3<f64>,
    robot: &mut Robot,
) -> Result<()> {
    let mut names: Vec<&str> = Vec::new();
    for (index, map) in entries(config, "object")?.into_iter().enumerate() {
        let entry = Entry { table: "object", index, map };
        entry.check_keys(&KEYS)?;
        let name = map.get("name").and_then(Value::as_str).unwrap_or_default();
        if name.is_empty() || name.contains(['.', '/', '*']) || names.contains(&name) {
            let problem = format!("`{name}` is empty, used twice or has one of . / *");
            return Err(entry.refuse("name", &problem));
        }
        names.push(name);
        let fixed = match map.get("fixed_base") {
            None => false,
            Some(value) => {
                value.as_bool().ok_or_else(|| entry.refuse("fixed_base", "true or false is needed"))?
            }
        };
        let options = Options { fixed_base: fixed, ..options.clone() };
        let other = read_robot(&folder.join(entry.text("model")?), &options);
        let other = other.map_err(|e| Error::Refused(e.to_string()))?;
        let position = entry.vector("position_m")?.unwrap_or_else(V3::zeros);
        let pose = base_pose(&position, entry.number("heading_rad")?.unwrap_or(0.0));
        robot.attach(other, name, &(base.inverse() * pose), fixed);
    }
    Ok(())
}
