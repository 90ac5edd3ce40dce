//! Kind and parameters of a module; the scenario is checked against them, docs are made from them.

use serde::{Deserialize, Serialize};

/// Kind of subsystem that a module makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[repr(u32)]
pub enum Kind {
    /// Owns ground and answers contact ports on side 2.
    Soil = 1,
    /// Bodies with shapes; side 1 of contact ports.
    Robot = 2,
    /// Signals only.
    Controller = 3,
    /// Pressure and shear over arrays of nodes, state owned by the host.
    Law = 4,
    /// Looks at the world of the others and answers with signals and streams.
    Sensor = 5,
}

/// Static description of a module.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Schema {
    /// Module name, e.g. `soil-bekker`.
    pub name: String,
    /// Kind of its subsystems.
    pub kind: Kind,
    /// One line for people.
    pub help: String,
    /// Parameters it takes from its scenario table.
    pub parameters: Vec<Parameter>,
}

/// One parameter of a module.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    /// Key in the scenario; dotted for sub-tables. A trailing `.*` admits any key below.
    pub name: String,
    /// Type.
    #[serde(rename = "type")]
    pub parameter_type: ParameterType,
    /// SI unit; empty: pure number.
    #[serde(default)]
    pub unit: String,
    /// One line for people.
    pub help: String,
    /// Value when the scenario does not set it; null: required unless `optional`.
    #[serde(default)]
    pub default: serde_json::Value,
    /// May be left out although there is no default.
    #[serde(default)]
    pub optional: bool,
    /// Smallest number accepted.
    #[serde(default)]
    pub min: Option<f64>,
    /// Largest number accepted.
    #[serde(default)]
    pub max: Option<f64>,
    /// Whether the value `min` itself is refused.
    #[serde(default)]
    pub above_min: bool,
    /// Texts accepted; empty: any.
    #[serde(default)]
    pub choices: Vec<String>,
    /// Values that are usual; others are accepted with a warning.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub usual: Option<Usual>,
}

/// The usual span of a quantity: a value far from it is most often in another unit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Usual {
    /// Its unit, also where it depends on another parameter, e.g. `N/m^(n+1)`.
    pub unit: String,
    /// Smallest and largest usual value; 0 is always usual.
    pub span: [f64; 2],
}

impl Usual {
    /// Values from `low` to `high` of that unit.
    pub fn new(unit: &str, low: f64, high: f64) -> Self {
        Self { unit: unit.into(), span: [low, high] }
    }
}

/// Type of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ParameterType {
    /// A floating-point number.
    Number,
    /// A whole number.
    Integer,
    /// true or false.
    Bool,
    /// Text.
    Text,
    /// A path relative to the scenario file; must exist.
    Path,
    /// A list of numbers.
    Numbers,
    /// A table of numbers by name.
    NumberTable,
    /// A number for all, or a table of numbers by name pattern (`*` stands for any text).
    NumberByName,
    /// A text for all, or a table of texts by name pattern.
    TextByName,
    /// A list of tables, whose keys the module checks.
    Tables,
}

impl Parameter {
    /// A number with a default.
    pub fn number(name: &str, unit: &str, default: f64, help: &str) -> Self {
        Self { unit: unit.into(), default: default.into(), ..Self::of(name, ParameterType::Number, help) }
    }

    /// A parameter of any type without a default: required.
    pub fn of(name: &str, parameter_type: ParameterType, help: &str) -> Self {
        Self {
            name: name.into(),
            parameter_type,
            unit: String::new(),
            help: help.into(),
            default: serde_json::Value::Null,
            optional: false,
            min: None,
            max: None,
            above_min: false,
            choices: Vec::new(),
            usual: None,
        }
    }

    /// The same with a default.
    pub fn or(mut self, default: impl Into<serde_json::Value>) -> Self {
        self.default = default.into();
        self
    }

    /// The same, may be left out.
    pub fn optional(mut self) -> Self {
        self.optional = true;
        self
    }

    /// The same with inclusive bounds.
    pub fn within(mut self, min: f64, max: f64) -> Self {
        (self.min, self.max) = (min.is_finite().then_some(min), max.is_finite().then_some(max));
        self
    }

    /// The same, larger than zero.
    pub fn positive(mut self) -> Self {
        (self.min, self.above_min) = (Some(0.0), true);
        self
    }

    /// The same with the values that are usual, in that unit.
    pub fn usually(mut self, unit: &str, low: f64, high: f64) -> Self {
        self.usual = Some(Usual::new(unit, low, high));
        self
    }

    /// The same with a closed list of texts.
    pub fn choices(mut self, choices: &[&str]) -> Self {
        self.choices = choices.iter().map(|c| (*c).into()).collect();
        self
    }
}
