//! Actuators from the scenario: a preset, then single numbers, each for all joints or by name pattern.

use super::battery::{POINTS, Supply};
use super::settings::Group;
use super::{Actuator, Drivetrain, Item, SETTINGS};
use crate::model::Model;
use crate::placement::matches;
use serde_json::Value;
use terraglue_subsystem::{Config, Error, Parameter, ParameterType, Result};

/// A drive train with numbers from a public source.
struct Preset {
    name: &'static str,
    kind: Drivetrain,
    numbers: &'static [(Item, f64)],
}

/// `mars-space-climber`: the current of a joint of the robot SpaceClimber as the MARS simulator (DFKI Robotics
/// Innovation Center) estimates it, I = 0.027813·|τ·ω| + 0.0074559·|τ| + 0.057296·|ω| + 0.025 (τ in N m and ω in
/// rad/s at the joint, I in A); form in MARS, `sim/src/core/SimMotor.cpp`, function `SpaceClimberCurrent`. The source
/// gives no voltage: that is `supply.voltage`.
const PRESETS: [Preset; 1] = [Preset {
    name: "mars-space-climber",
    kind: Drivetrain::CurrentFormula,
    numbers: &[
        (Item::FormulaPower, 0.027813),
        (Item::FormulaTorque, 0.0074559),
        (Item::FormulaRate, 0.057296),
        (Item::FormulaIdle, 0.025),
    ],
}];

/// Parameters of the scenario for actuators and supply.
pub(crate) fn parameters() -> Vec<Parameter> {
    let by_name = "; a table gives it by joint name, `*` stands for any text";
    let names: Vec<&str> = PRESETS.iter().map(|p| p.name).collect();
    let preset = format!("Drive train and numbers from a public source: {}{by_name}", names.join(", "));
    let kind = format!("Drive train: {}{by_name}", Drivetrain::NAMES.join(", "));
    let mut all = vec![
        Parameter::of("actuator.preset", ParameterType::TextByName, &preset).optional().choices(&names),
        Parameter::of("actuator.kind", ParameterType::TextByName, &kind)
            .optional()
            .choices(&Drivetrain::NAMES),
    ];
    for s in &SETTINGS {
        let help = format!("{} (default {}){by_name}", s.help, s.default);
        let of = Parameter::of(&format!("actuator.{}", s.key), ParameterType::NumberByName, &help).optional();
        all.push(Parameter { unit: s.unit.into(), ..of });
    }
    let number = |key: &str, unit: &str, default: f64, help: &str| {
        Parameter::number(key, unit, default, help).within(0.0, f64::INFINITY)
    };
    all.push(number("supply.voltage", "V", 48.0, "Voltage of an ideal supply; ignored with a battery"));
    all.push(number("battery.capacity_a_h", "A h", 0.0, "Capacity of the battery; 0: an ideal supply"));
    all.push(
        number("battery.charge", "", 1.0, "Charge at the start, share of the capacity").within(0.0, 1.0),
    );
    all.push(
        number("battery.internal_resistance", "ohm", 0.05, "Internal resistance of the battery").positive(),
    );
    let help = "Open-circuit voltage at evenly spaced charges from 0 to 1";
    let curve = Parameter::of("battery.open_circuit_v", ParameterType::Numbers, help).optional();
    all.push(Parameter { unit: "V".into(), ..curve });
    all
}

/// Value of a parameter for a joint: one value for all, or the one of the best pattern.
pub(crate) fn for_joint<'a>(value: &'a Value, joint: &str) -> Option<&'a Value> {
    let Value::Object(table) = value else { return Some(value) };
    let fits = table.iter().filter(|(pattern, _)| matches(pattern, joint));
    fits.max_by_key(|(pattern, _)| (*pattern == joint, pattern.len())).map(|(_, value)| value)
}

/// Every pattern of a parameter must fit a moving joint.
fn check_patterns(model: &Model, name: &str, value: &Value) -> Result {
    let Value::Object(table) = value else { return Ok(()) };
    for pattern in table.keys() {
        if !model.joints.iter().any(|j| j.moves() && matches(pattern, &j.name)) {
            return Err(Error::Refused(format!("parameter `{name}`: no moving joint is called `{pattern}`")));
        }
    }
    Ok(())
}

/// The number that a parameter gives a joint.
pub(crate) fn number(config: &Config, model: &Model, name: &str, joint: &str) -> Result<Option<f64>> {
    let Some(value) = config.get(name).filter(|v| !v.is_null()) else { return Ok(None) };
    check_patterns(model, name, value)?;
    for_joint(value, joint)
        .map(|v| v.as_f64().ok_or_else(|| Error::Refused(format!("parameter `{name}`: {v} is not a number"))))
        .transpose()
}

/// The text that a parameter gives a joint.
pub(crate) fn text<'a>(
    config: &'a Config,
    model: &Model,
    name: &str,
    joint: &str,
) -> Result<Option<&'a str>> {
    let Some(value) = config.get(name).filter(|v| !v.is_null()) else { return Ok(None) };
    check_patterns(model, name, value)?;
    for_joint(value, joint)
        .map(|v| v.as_str().ok_or_else(|| Error::Refused(format!("parameter `{name}`: {v} is not text"))))
        .transpose()
}

/// The actuator of a joint; `given` holds the data of the robot file.
pub(crate) fn actuator(config: &Config, model: &Model, joint: &str, given: Actuator) -> Result<Actuator> {
    let mut actuator = given;
    if let Some(name) = text(config, model, "actuator.preset", joint)? {
        let preset = PRESETS.iter().find(|p| p.name == name).ok_or_else(|| {
            let names: Vec<&str> = PRESETS.iter().map(|p| p.name).collect();
            Error::Refused(format!("parameter `actuator.preset` = `{name}` is none of {names:?}"))
        })?;
        actuator.kind = preset.kind;
        preset.numbers.iter().for_each(|(item, x)| actuator.settings[*item as usize] = *x);
    }
    if let Some(name) = text(config, model, "actuator.kind", joint)? {
        actuator.kind = Drivetrain::from_name(name).ok_or_else(|| {
            let names = Drivetrain::NAMES;
            Error::Refused(format!("parameter `actuator.kind` = `{name}` is none of {names:?}"))
        })?;
    }
    for (slot, s) in actuator.settings.iter_mut().zip(&SETTINGS) {
        let name = format!("actuator.{}", s.key);
        let Some(x) = number(config, model, &name, joint)? else { continue };
        if !(x.is_finite() && s.range.accepts(x)) {
            return Err(Error::Refused(format!("parameter `{name}` = {x} {} is out of range", s.unit)));
        }
        *slot = x;
    }
    let ambient = actuator[Item::AmbientTemperature];
    (actuator.winding_k, actuator.housing_k) = (ambient, ambient);
    Ok(actuator)
}

impl Actuator {
    /// Whether a setting means something for this actuator.
    pub fn has(&self, group: Group) -> bool {
        match group {
            Group::All | Group::Friction => true,
            Group::Dc => self.kind == Drivetrain::Dc,
            Group::Thermal => self.kind == Drivetrain::Dc && self[Item::WindingCapacity] > 0.0,
            Group::Formula => self.kind == Drivetrain::CurrentFormula,
        }
    }
}

/// The supply of the robot.
pub(crate) fn supply(config: &Config) -> Result<Supply> {
    let capacity = 3600.0 * config.number("battery.capacity_a_h")?;
    if capacity <= 0.0 {
        return Ok(Supply::ideal(config.number("supply.voltage")?));
    }
    let voltages = config.numbers("battery.open_circuit_v")?;
    let falls = voltages.windows(2).any(|w| w[1] < w[0]);
    if voltages.is_empty() || voltages.len() > POINTS || falls || voltages.iter().any(|v| !(*v > 0.0)) {
        return Err(Error::Refused(format!(
            "parameter `battery.open_circuit_v` = {voltages:?} is not a list of 1 to {POINTS} positive voltages that \
             rise with the charge; write e.g. [42.0, 46.0, 50.0]"
        )));
    }
    let mut open_circuit = [0.0; POINTS];
    open_circuit[..voltages.len()].copy_from_slice(&voltages);
    let resistance = config.number("battery.internal_resistance")?;
    let charge = config.number("battery.charge")?;
    let mut supply =
        Supply { open_circuit, points: voltages.len(), resistance, capacity, charge, ..Supply::default() };
    supply.voltage = supply.open_circuit_v();
    supply.limit = supply.voltage;
    Ok(supply)
}
