//! The structure that both versions are read into.

use terraglue_subsystem::unit::Unit;
use terraglue_subsystem::{Causality as Role, ValueType};

/// Version of the standard.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Version {
    /// FMI 2.0.
    #[default]
    V2,
    /// FMI 3.0.
    V3,
}

/// The description of an FMU.
#[derive(Clone, Debug, Default)]
pub struct ModelDescription {
    /// Version of the standard.
    pub version: Version,
    /// Name of the model.
    pub model_name: String,
    /// `guid` or `instantiationToken`.
    pub token: String,
    /// One line for people.
    pub description: String,
    /// Who made the model.
    pub author: String,
    /// Tool that generated the FMU.
    pub generation_tool: String,
    /// Name of its library.
    pub identifier: String,
    /// Its capabilities.
    pub capabilities: Capabilities,
    /// Whether it also is for model exchange.
    pub model_exchange: bool,
    /// Whether it also is for scheduled execution.
    pub scheduled_execution: bool,
    /// Its default experiment.
    pub experiment: Experiment,
    /// Its units by name.
    pub units: Vec<(String, Unit)>,
    /// Names of its units whose base unit is not given.
    pub plain_units: Vec<String>,
    /// Categories of its log.
    pub log_categories: Vec<String>,
    /// Its declared types.
    pub types: Vec<DeclaredType>,
    /// Variables in the order of the file, aliases of FMI 3 among them.
    pub variables: Vec<Variable>,
    /// Positions of the outputs of the model structure, with their dependencies.
    pub outputs: Vec<Unknown>,
    /// Positions of the initial unknowns, likewise.
    pub initial_unknowns: Vec<Unknown>,
    /// Terminals of FMI 3.
    pub terminals: Vec<Terminal>,
    /// Harmless deviations from the standard.
    pub problems: Vec<String>,
    /// Defects of attributes that nothing else here needs.
    pub(super) details: Vec<Defect>,
}

impl ModelDescription {
    /// The unit of a variable: its name where our own reading of it agrees with the description's definition, or else the
    /// definition in SI symbols with factor and offset. Empty where the unit is not defined, so that no connection
    /// converts by a guess.
    pub fn unit_of(&self, variable: &Variable) -> String {
        let Some(name) = &variable.unit else { return String::new() };
        let theirs = self.units.iter().find(|(n, _)| n == name).map(|(_, unit)| *unit);
        match (Unit::parse(name), theirs) {
            (Ok(ours), Some(theirs)) if ours == theirs => name.clone(),
            (_, Some(theirs)) => theirs.to_string(),
            (Ok(_), None) => name.clone(),
            (Err(_), None) => String::new(),
        }
    }
}

/// Capabilities of an FMU.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Capabilities {
    /// Its state can be saved and restored.
    pub state: bool,
    /// Its state can be turned into bytes.
    pub serialize: bool,
    /// Directional derivatives.
    pub directional_derivatives: bool,
    /// Adjoint derivatives.
    pub adjoint_derivatives: bool,
    /// Steps of any length.
    pub variable_step: bool,
    /// Length of its inner step where it is fixed, s.
    pub fixed_step: Option<f64>,
    /// One instance per process only.
    pub once_per_process: bool,
    /// Needs the tool that made it.
    pub needs_tool: bool,
    /// Event mode (FMI 3).
    pub event_mode: bool,
    /// May end a step early (FMI 3).
    pub may_return_early: bool,
    /// Intermediate update (FMI 3).
    pub intermediate_update: bool,
    /// Ends a step early on request in an intermediate update (FMI 3).
    pub return_early: bool,
    /// Takes derivatives of its inputs (FMI 2).
    pub interpolates_inputs: bool,
    /// Provides the first derivatives of its outputs.
    pub output_derivatives: bool,
}

impl Capabilities {
    /// Whether derivatives of outputs by inputs are known: directional or adjoint ones.
    pub fn tells_derivatives(self) -> bool {
        self.directional_derivatives || self.adjoint_derivatives
    }
}

/// Default experiment of an FMU.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Experiment {
    /// s.
    pub start: Option<f64>,
    /// s.
    pub stop: Option<f64>,
    /// Relative.
    pub tolerance: Option<f64>,
    /// s.
    pub step: Option<f64>,
}

/// A declared type.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DeclaredType {
    /// Name.
    pub name: String,
    /// Unit of its values.
    pub unit: Option<String>,
    /// Names and values of an enumeration.
    pub items: Vec<(String, i64)>,
    /// Smallest value.
    pub min: Option<f64>,
    /// Largest value.
    pub max: Option<f64>,
}

/// Causality of a variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Causality {
    Parameter,
    CalculatedParameter,
    StructuralParameter,
    Input,
    Output,
    Local,
    Independent,
}

impl Causality {
    /// Role in a scenario.
    pub fn role(self) -> Role {
        match self {
            Self::Parameter | Self::StructuralParameter => Role::Parameter,
            Self::Input => Role::Input,
            Self::Output => Role::Output,
            Self::CalculatedParameter | Self::Local | Self::Independent => Role::Local,
        }
    }
}

/// Variability of a variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Variability {
    Constant,
    Fixed,
    Tunable,
    Discrete,
    Continuous,
}

/// Initial of a variable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Initial {
    Exact,
    Approx,
    Calculated,
}

/// Start value.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Start {
    /// None given.
    #[default]
    None,
    /// Numbers, also truth values and enumerations.
    Numbers(Vec<f64>),
    /// Whole numbers, exactly.
    Integers(Vec<i128>),
    /// Texts.
    Texts(Vec<String>),
    /// Bytes.
    Bytes(Vec<Vec<u8>>),
}

/// A dimension of an array.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dimension {
    /// So many elements.
    Fixed(u64),
    /// The value of the structural parameter with this reference.
    Parameter(u32),
}

/// A variable.
#[derive(Clone, Debug, PartialEq)]
pub struct Variable {
    /// Name.
    pub name: String,
    /// Number in calls.
    pub reference: u32,
    /// Type of an element.
    pub value_type: ValueType,
    /// Role.
    pub causality: Causality,
    /// When it may change.
    pub variability: Variability,
    /// How it starts.
    pub initial: Option<Initial>,
    /// Start value.
    pub start: Start,
    /// Smallest value, −∞: none.
    pub min: f64,
    /// Largest value, ∞: none.
    pub max: f64,
    /// Name of its unit.
    pub unit: Option<String>,
    /// Names and values of an enumeration.
    pub items: Vec<(String, i64)>,
    /// Dimensions; empty: a scalar.
    pub dimensions: Vec<Dimension>,
    /// Sizes of the dimensions with the start values of the structural parameters.
    pub sizes: Vec<u32>,
    /// One line for people.
    pub description: String,
    /// Line in the description.
    pub line: u32,
    /// Whether this is another name of an earlier variable.
    pub alias: bool,
    /// When it ticks, of an input clock whose times are known beforehand.
    pub ticks: Option<Ticks>,
    /// When it first ticks and how it goes on, of an input clock whose intervals the FMU reports while it runs.
    pub told: Option<Told>,
    /// Whether it reports them as fractions too, of an input clock.
    pub fraction: bool,
    /// Whether it is a clock that others make tick: an output clock, or a triggered input clock.
    pub triggered: bool,
    /// Clocks by number in calls with which it changes; empty: at any time.
    pub clocks: Vec<u32>,
    /// The variable of which it is the derivative: its place from 1 in FMI 2, its number in calls in FMI 3.
    pub derivative_of: Option<u32>,
    /// Whether a structural parameter changed its shape, so that the start values of the description are not for it.
    pub resized: bool,
    /// Whether it can be read, or set where it is an input, at intermediate times.
    pub intermediate: bool,
}

/// A clock whose intervals the FMU reports.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Told {
    /// It first ticks here, s; each tick reports the time to the next.
    Each(f64),
    /// Any event may report the time to one tick.
    Countdown,
}

/// Times of a periodic clock: shift, shift + interval, …
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ticks {
    /// s.
    pub interval: f64,
    /// s.
    pub shift: f64,
}

impl Ticks {
    /// The number of the tick that is nearest to t, and how far t is behind it, s.
    fn nearest(self, t: f64) -> (f64, f64) {
        let k = ((t - self.shift) / self.interval).round().max(0.0);
        (k, t - (self.shift + k * self.interval))
    }

    fn slack(self, t: f64) -> f64 {
        1e-9 * self.interval + 4.0 * f64::EPSILON * t.abs()
    }

    /// Whether it ticks at t.
    pub fn at(self, t: f64) -> bool {
        self.nearest(t).1.abs() <= self.slack(t)
    }

    /// The first tick after t, s.
    pub fn after(self, t: f64) -> f64 {
        let (k, behind) = self.nearest(t);
        let k = if behind >= -self.slack(t) { k + 1.0 } else { k };
        self.shift + k * self.interval
    }
}

impl Variable {
    /// Number of elements.
    pub fn len(&self) -> usize {
        self.sizes.iter().map(|d| *d as usize).product()
    }

    /// Whether a dimension is zero.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// An unknown of the model structure.
#[derive(Clone, Debug, PartialEq)]
pub struct Unknown {
    /// Position in [`ModelDescription::variables`].
    pub variable: usize,
    /// Positions of the variables that it depends on; none: all of them.
    pub dependencies: Option<Vec<usize>>,
}

/// A terminal of FMI 3.
#[derive(Clone, Debug, PartialEq)]
pub struct Terminal {
    /// Name.
    pub name: String,
    /// Kind, e.g. `org.terraglue.foot`.
    pub kind: String,
    /// Rule by which members are matched.
    pub rule: String,
    /// Member name and position of its variable.
    pub members: Vec<(String, usize)>,
}

impl ModelDescription {
    /// Position of a variable.
    pub fn position(&self, name: &str) -> Option<usize> {
        self.variables.iter().position(|v| v.name == name)
    }

    /// Whether the FMU follows this input within its steps: by its slope in FMI 2, in its intermediate update in FMI 3.
    pub fn follows(&self, v: &Variable) -> bool {
        let able = match self.version {
            Version::V2 => self.capabilities.interpolates_inputs && v.value_type == ValueType::F64,
            Version::V3 => {
                let float = matches!(v.value_type, ValueType::F64 | ValueType::F32);
                self.capabilities.intermediate_update && v.intermediate && float
            }
        };
        able && v.causality == Causality::Input && v.variability == Variability::Continuous
    }
}

/// Kinds of defects; of each, a run warns once.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[allow(missing_docs)]
pub enum DefectKind {
    Enumeration,
    Range,
    StartRange,
    StartCount,
    StartMissing,
    StartCalculated,
    Unit,
    BaseUnit,
    Clock,
    Role,
    Continuous,
    Derivative,
    ClockReference,
    Structure,
    DisplayUnit,
    DependencyKind,
    Experiment,
    Attribute,
    Alias,
    InitialUnknowns,
}

impl DefectKind {
    /// Whether a run warns of it and `strict` refuses it. Co-simulation needs no list of initial unknowns, and many tools write none.
    pub fn concerns_a_run(self) -> bool {
        self != Self::InitialUnknowns
    }
}

/// A defect of a description.
#[derive(Clone, Debug, PartialEq)]
pub struct Defect {
    /// Its kind.
    pub kind: DefectKind,
    /// Line in `modelDescription.xml`; none where an element is missing.
    pub line: Option<u32>,
    /// One sentence with the name of the variable.
    pub message: String,
}

impl std::fmt::Display for Defect {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.line {
            Some(line) => write!(f, "line {line}: {}", self.message),
            None => f.write_str(&self.message),
        }
    }
}
