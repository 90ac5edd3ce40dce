//! A system structure as plain data: systems, components, connectors, connections, parameters.

use terraglue_subsystem::unit::Unit;

/// `SystemStructure.ssd`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Structure {
    /// Name.
    pub name: String,
    /// The outermost system.
    pub system: System,
    /// Start of the default experiment, s.
    pub start_s: Option<f64>,
    /// End of the default experiment, s.
    pub stop_s: Option<f64>,
}

/// A system: elements, and how they are connected.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct System {
    /// Name.
    pub name: String,
    /// Its own connectors.
    pub connectors: Vec<Connector>,
    /// Parameters for all that is inside.
    pub bindings: Vec<Binding>,
    /// Components and systems.
    pub elements: Vec<SystemElement>,
    /// Between connectors of elements and its own.
    pub connections: Vec<Connection>,
    /// Signals that it and all systems inside may share.
    pub dictionaries: Vec<Dictionary>,
}

/// An element of a system.
#[derive(Clone, Debug, PartialEq)]
pub enum SystemElement {
    /// An FMU.
    Component(Component),
    /// A nested system.
    System(System),
    /// The signals of a dictionary of this system or one around it.
    Dictionary(DictionaryReference),
}

impl SystemElement {
    /// Name.
    pub fn name(&self) -> &str {
        match self {
            Self::Component(c) => &c.name,
            Self::System(s) => &s.name,
            Self::Dictionary(d) => &d.name,
        }
    }
}

/// A list of signals that everything below its system can connect to: each has one source and any number of readers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Dictionary {
    /// Name.
    pub name: String,
    /// Its signals.
    pub entries: Vec<Connector>,
}

/// A place where the signals of a dictionary are connected.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DictionaryReference {
    /// Name as an element.
    pub name: String,
    /// Name of the dictionary.
    pub dictionary: String,
}

/// A functional mock-up unit inside a system.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Component {
    /// Name.
    pub name: String,
    /// File, relative to the structure's folder.
    pub source: String,
    /// Connectors.
    pub connectors: Vec<Connector>,
    /// Parameters.
    pub bindings: Vec<Binding>,
}

/// A connector.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Connector {
    /// Name: that of a variable of the FMU.
    pub name: String,
    /// Unit where the structure gives one that has a meaning; it goes before that of the FMU.
    pub unit: Option<Unit>,
}

/// A connection.
#[derive(Clone, Debug, PartialEq)]
pub struct Connection {
    /// Where it comes from.
    pub start: End,
    /// Where it goes to.
    pub end: End,
    /// How the value changes on the way.
    pub transformation: Transformation,
}

/// An end of a connection.
#[derive(Clone, Debug, PartialEq)]
pub struct End {
    /// Element; none: the system itself.
    pub element: Option<String>,
    /// Connector.
    pub connector: String,
}

/// How a value changes: target = factor · value + offset, after the conversion of units, or by a table.
#[derive(Clone, Debug, PartialEq)]
pub struct Transformation {
    /// Factor.
    pub factor: f64,
    /// Offset.
    pub offset: f64,
    /// Whether units are left alone.
    pub keeps_unit: bool,
    /// New value of each truth value, whole number or item of an enumeration.
    pub table: Option<Table>,
}

impl Default for Transformation {
    fn default() -> Self {
        Self { factor: 1.0, offset: 0.0, keeps_unit: false, table: None }
    }
}

impl Transformation {
    /// Whether nothing changes.
    pub fn is_plain(&self) -> bool {
        self.factor == 1.0 && self.offset == 0.0 && self.table.is_none()
    }
}

/// A mapping of single values: pairs of value and new value, each value once.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table(pub Vec<(Value, Value)>);

impl Table {
    /// The new value of a value; none where the table does not have it.
    pub fn of(&self, value: &Value) -> Option<&Value> {
        self.0.iter().find(|(source, _)| source == value).map(|(_, target)| target)
    }

    /// This table after another one; values whose way ends are gone.
    pub fn after(&self, first: &Self) -> Self {
        let both = |(source, between): &(Value, Value)| Some((source.clone(), self.of(between)?.clone()));
        Self(first.0.iter().filter_map(both).collect())
    }

    /// This table after value · a + b; values that become none of its whole numbers are gone. Nothing where the table is not
    /// one of whole numbers, or where all values become the same.
    pub fn after_linear(&self, (a, b): (f64, f64)) -> Option<Self> {
        let whole =
            |x: f64| (x.is_finite() && (x - x.round()).abs() <= 1e-9 * x.abs().max(1.0)).then(|| x.round());
        let mut entries = Vec::new();
        for (source, target) in &self.0 {
            let Value::Integer(k) = source else { return None };
            if let Some(before) = whole((*k as f64 - b) / a) {
                entries.push((Value::Integer(before as i64), target.clone()));
            }
        }
        (a != 0.0).then_some(Self(entries))
    }

    /// This table before value · a + b. Nothing where its new values are no numbers.
    pub fn before_linear(&self, (a, b): (f64, f64)) -> Option<Self> {
        let changed = |(source, target): &(Value, Value)| {
            let x = match target {
                Value::Integer(k) => a * *k as f64 + b,
                Value::Real(x) => a * x + b,
                Value::Boolean(_) | Value::Text(_) => return None,
            };
            let exact = x.fract() == 0.0 && x.abs() < 9e15;
            Some((source.clone(), if exact { Value::Integer(x as i64) } else { Value::Real(x) }))
        };
        self.0.iter().map(changed).collect::<Option<_>>().map(Self)
    }
}

/// A parameter set that is bound to a system or a component.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Binding {
    /// Stands before the names of all parameters.
    pub prefix: String,
    /// Values.
    pub parameters: Vec<Parameter>,
    /// Which parameter goes where; none: each to its own name.
    pub mapping: Option<Vec<MappingEntry>>,
}

/// A parameter with its value.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Name.
    pub name: String,
    /// Value.
    pub value: Value,
    /// Unit of the value, where it has a meaning.
    pub unit: Option<Unit>,
}

/// A value.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// Real.
    Real(f64),
    /// Integer.
    Integer(i64),
    /// Truth value.
    Boolean(bool),
    /// Text, or the name of an item of an enumeration.
    Text(String),
}

/// An entry of a parameter mapping.
#[derive(Clone, Debug, PartialEq)]
pub struct MappingEntry {
    /// Parameter of the set.
    pub source: String,
    /// Parameter of the system or component.
    pub target: String,
    /// How the value changes on the way.
    pub transformation: Transformation,
}
