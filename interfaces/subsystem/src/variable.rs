//! The standardised I/O model: everything worth reading or changing is a named, typed variable with a unit.

/// A variable of an instance. A name has dotted parts, e.g. `LF_j2.max_torque`.
///
/// ```
/// use terraglue_subsystem::{Causality, Effect, Variable};
///
/// let torque = Variable::real(7, "LF_j2.max_torque", "N m", Causality::Parameter, "Largest torque of the motor");
/// assert_eq!((torque.effect, torque.len()), (Effect::Live, 1));
/// let gains = Variable { dims: vec![2, 3], ..torque };
/// assert_eq!((gains.len(), gains.element_name(5)), (6, "LF_j2.max_torque[2,3]".to_owned()));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Variable {
    /// Number used by `get` and `set`; unique in the instance.
    pub id: u32,
    /// Dotted name, unique in the instance.
    pub name: String,
    /// Type of each element.
    pub value_type: ValueType,
    /// Role.
    pub causality: Causality,
    /// Effect of a change.
    pub effect: Effect,
    /// Unit in SI symbols separated by spaces, e.g. `N m`, `rad/s`; empty: a pure number.
    pub unit: String,
    /// One line for people.
    pub help: String,
    /// Smallest value that is accepted; −∞: no bound. Numbers only.
    pub min: f64,
    /// Largest value that is accepted; ∞: no bound. Numbers only.
    pub max: f64,
    /// Array dimensions; empty: a scalar.
    pub dims: Vec<u32>,
    /// Names of the values 0, 1, … of an enumeration.
    pub enumeration: Vec<String>,
}

/// `name[i,j]`, counted from 1, for an element of an array of these sizes, counted row by row from 0; `name` without sizes.
pub fn element_name(name: &str, sizes: &[u32], element: usize) -> String {
    if sizes.is_empty() {
        return name.to_owned();
    }
    let mut rest = element;
    let mut index: Vec<String> = Vec::with_capacity(sizes.len());
    for size in sizes.iter().rev().map(|size| (*size).max(1) as usize) {
        index.push((rest % size + 1).to_string());
        rest /= size;
    }
    index.reverse();
    format!("{name}[{}]", index.join(","))
}

impl Variable {
    /// A scalar f64 of the given role; refine it with struct update syntax.
    pub fn real(id: u32, name: impl Into<String>, unit: &str, causality: Causality, help: &str) -> Self {
        let effect = match causality {
            Causality::Parameter | Causality::Input => Effect::Live,
            Causality::Output | Causality::Local => Effect::ReadOnly,
        };
        Self {
            id,
            name: name.into(),
            value_type: ValueType::F64,
            causality,
            effect,
            unit: unit.into(),
            help: help.into(),
            min: f64::NEG_INFINITY,
            max: f64::INFINITY,
            dims: Vec::new(),
            enumeration: Vec::new(),
        }
    }

    /// The same variable with another type.
    pub fn typed(mut self, value_type: ValueType) -> Self {
        self.value_type = value_type;
        self
    }

    /// The same variable with bounds.
    pub fn within(mut self, min: f64, max: f64) -> Self {
        (self.min, self.max) = (min, max);
        self
    }

    /// The same variable as an enumeration with these names.
    pub fn named(mut self, names: &[&str]) -> Self {
        self.value_type = ValueType::Enumeration;
        self.enumeration = names.iter().map(|n| (*n).into()).collect();
        self
    }

    /// Number of elements.
    pub fn len(&self) -> usize {
        self.dims.iter().map(|d| *d as usize).product()
    }

    /// Name of an element, counted row by row from 0: `name[i,j]` with i and j from 1; of a scalar its own.
    pub fn element_name(&self, element: usize) -> String {
        element_name(&self.name, &self.dims, element)
    }

    /// Whether an array dimension is zero.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// Type of a variable's elements.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum ValueType {
    F64 = 0,
    F32 = 1,
    I8 = 2,
    I16 = 3,
    I32 = 4,
    I64 = 5,
    U8 = 6,
    U16 = 7,
    U32 = 8,
    U64 = 9,
    Bool = 10,
    String = 11,
    Binary = 12,
    /// Stored as i64; names in [`Variable::enumeration`].
    Enumeration = 13,
    /// Reserved.
    Clock = 14,
}

/// Role of a variable (FMI causality).
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Causality {
    /// Set from outside, constant between changes.
    Parameter = 0,
    /// Set before each step, e.g. by a connection.
    Input = 1,
    /// Offered to connections.
    Output = 2,
    /// To look at.
    Local = 3,
}

/// Effect of a change of a variable.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effect {
    /// Holds from the next step on.
    Live = 0,
    /// Accepted only before the first step.
    NeedsReset = 1,
    /// Never accepted.
    ReadOnly = 2,
}

/// Values to write; elements of consecutive ids (arrays element by element, row-major).
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs)]
pub enum Values<'a> {
    F64(&'a [f64]),
    F32(&'a [f32]),
    I8(&'a [i8]),
    I16(&'a [i16]),
    I32(&'a [i32]),
    I64(&'a [i64]),
    U8(&'a [u8]),
    U16(&'a [u16]),
    U32(&'a [u32]),
    U64(&'a [u64]),
    Bool(&'a [bool]),
    String(&'a [String]),
    Binary(&'a [Vec<u8>]),
    Enumeration(&'a [i64]),
}

/// Room for values to read; laid out as [`Values`].
#[derive(Debug)]
#[allow(missing_docs)]
pub enum ValuesMut<'a> {
    F64(&'a mut [f64]),
    F32(&'a mut [f32]),
    I8(&'a mut [i8]),
    I16(&'a mut [i16]),
    I32(&'a mut [i32]),
    I64(&'a mut [i64]),
    U8(&'a mut [u8]),
    U16(&'a mut [u16]),
    U32(&'a mut [u32]),
    U64(&'a mut [u64]),
    Bool(&'a mut [bool]),
    String(&'a mut [String]),
    Binary(&'a mut [Vec<u8>]),
    Enumeration(&'a mut [i64]),
}

/// Something to do that is not a value, e.g. `LF_j2.break`.
#[derive(Clone, Debug, PartialEq)]
pub struct Action {
    /// Dotted name, unique in the instance.
    pub name: String,
    /// One line for people.
    pub help: String,
}
