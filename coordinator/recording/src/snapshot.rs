//! The scalar variables of all subsystems and the elements of arrays, read once per recorded step for every writer that wants them.

use terraglue_diagnostics::error::{Error, Result};
use terraglue_engine::observer::{SubsystemView, View};
use terraglue_subsystem::{Causality, Subsystem, ValueType, ValuesMut, Variable};

/// How a scalar is written.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum ScalarKind {
    /// A floating-point number.
    Real,
    /// A whole number.
    Integer,
    /// true or false.
    Bool,
    /// A whole number with names.
    Enumeration(Vec<String>),
}

/// A recorded variable.
#[derive(Clone, Debug)]
pub(crate) struct Column {
    pub name: String,
    pub unit: String,
    pub help: String,
    pub kind: ScalarKind,
    /// Set from outside and constant between changes: written when it changes.
    pub held: bool,
    /// Can be fed by a connection.
    pub input: bool,
    /// Whether `[recording]` wants it.
    pub recorded: bool,
}

impl Column {
    /// A column that is written at every record.
    pub fn new(name: String, unit: String, help: String, kind: ScalarKind) -> Self {
        Self { name, unit, help, kind, held: false, input: false, recorded: true }
    }
}

/// The variables of one subsystem.
pub(crate) struct Scalars {
    pub name: String,
    pub columns: Vec<Column>,
    /// Values of the last `read`, in the order of the columns.
    pub values: Vec<f64>,
    batches: Vec<Batch>,
}

/// Variables of one type, read in one call.
struct Batch {
    ids: Vec<u32>,
    columns: Vec<usize>,
    room: Room,
}

macro_rules! rooms {
    ($($variant:ident: $element:ty),*) => {
        enum Room { $($variant(Vec<$element>)),* }

        impl Batch {
            fn read(&mut self, instance: &dyn Subsystem, values: &mut [f64]) -> terraglue_subsystem::Result {
                match &mut self.room {
                    $(Room::$variant(room) => {
                        instance.get(&self.ids, ValuesMut::$variant(room))?;
                        for (column, value) in self.columns.iter().zip(room.iter()) {
                            values[*column] = AsNumber::number(*value);
                        }
                    })*
                }
                Ok(())
            }
        }
    };
}

rooms!(F64: f64, F32: f32, I8: i8, I16: i16, I32: i32, I64: i64, U8: u8, U16: u16, U32: u32, U64: u64,
       Bool: bool, Enumeration: i64);

/// A value as the f64 in which all writers carry it (whole numbers beyond 2^53 are rounded).
trait AsNumber {
    fn number(self) -> f64;
}

macro_rules! as_number {
    ($($t:ty),*) => { $(impl AsNumber for $t { fn number(self) -> f64 { self as f64 } })* };
}

as_number!(f64, f32, i8, i16, i32, i64, u8, u16, u32, u64);

impl AsNumber for bool {
    fn number(self) -> f64 {
        f64::from(u8::from(self))
    }
}

fn room(value_type: ValueType, n: usize) -> Option<Room> {
    Some(match value_type {
        ValueType::F64 => Room::F64(vec![0.0; n]),
        ValueType::F32 => Room::F32(vec![0.0; n]),
        ValueType::I8 => Room::I8(vec![0; n]),
        ValueType::I16 => Room::I16(vec![0; n]),
        ValueType::I32 => Room::I32(vec![0; n]),
        ValueType::I64 => Room::I64(vec![0; n]),
        ValueType::U8 => Room::U8(vec![0; n]),
        ValueType::U16 => Room::U16(vec![0; n]),
        ValueType::U32 => Room::U32(vec![0; n]),
        ValueType::U64 => Room::U64(vec![0; n]),
        ValueType::Bool => Room::Bool(vec![false; n]),
        ValueType::Enumeration => Room::Enumeration(vec![0; n]),
        ValueType::String | ValueType::Binary | ValueType::Clock => return None,
    })
}

fn kind(variable: &Variable) -> ScalarKind {
    match variable.value_type {
        ValueType::F64 | ValueType::F32 => ScalarKind::Real,
        ValueType::Bool => ScalarKind::Bool,
        ValueType::Enumeration => ScalarKind::Enumeration(variable.enumeration.clone()),
        _ => ScalarKind::Integer,
    }
}

impl Scalars {
    fn new(view: &SubsystemView) -> Self {
        let mut scalars =
            Self { name: view.name.into(), columns: Vec::new(), values: Vec::new(), batches: Vec::new() };
        let mut by_type: Vec<(ValueType, Vec<u32>, Vec<usize>)> = Vec::new();
        for variable in view.instance.variables() {
            if room(variable.value_type, 0).is_none() {
                continue;
            }
            let place = by_type.iter().position(|b| b.0 == variable.value_type).unwrap_or_else(|| {
                by_type.push((variable.value_type, Vec::new(), Vec::new()));
                by_type.len() - 1
            });
            by_type[place].1.push(variable.id);
            for element in 0..variable.len() {
                by_type[place].2.push(scalars.columns.len());
                scalars.columns.push(Column {
                    name: variable.element_name(element),
                    unit: variable.unit.clone(),
                    help: variable.help.clone(),
                    kind: kind(variable),
                    held: variable.causality == Causality::Parameter,
                    input: variable.causality == Causality::Input,
                    recorded: true,
                });
            }
        }
        scalars.values = vec![0.0; scalars.columns.len()];
        scalars.batches = by_type
            .into_iter()
            .filter_map(|(t, ids, columns)| Some(Batch { room: room(t, columns.len())?, ids, columns }))
            .collect();
        scalars
    }

    fn read(&mut self, view: &SubsystemView, t_s: f64) -> Result {
        for batch in &mut self.batches {
            batch
                .read(view.instance, &mut self.values)
                .map_err(|e| failed(view, t_s, "get", e.to_string()))?;
        }
        match self.values.iter().position(|v| v.is_nan()) {
            None => Ok(()),
            Some(k) => {
                let message = format!("variable `{}` is not a number (NaN)", self.columns[k].name);
                Err(failed(view, t_s, "get", message))
            }
        }
    }
}

/// An error of a subsystem.
pub(crate) fn failed(view: &SubsystemView, time_s: f64, function: &'static str, message: String) -> Error {
    Error::Module { subsystem: view.name.into(), module: view.module.into(), function, time_s, message }
}

/// All subsystems in the order of the view.
#[derive(Default)]
pub(crate) struct Snapshot {
    pub subsystems: Vec<Scalars>,
}

impl Snapshot {
    /// Room for the variables of a testbed.
    pub fn new(view: &View) -> Self {
        Self { subsystems: view.subsystems.iter().map(Scalars::new).collect() }
    }

    /// Reads the committed values. Fails where one is NaN, naming subsystem and variable.
    pub fn read(&mut self, view: &View) -> Result {
        for (scalars, subsystem) in self.subsystems.iter_mut().zip(view.subsystems) {
            scalars.read(subsystem, view.t_s)?;
        }
        Ok(())
    }
}

/// Id of an f64 scalar by name.
pub(crate) fn real_id(instance: &dyn Subsystem, name: &str) -> Option<u32> {
    instance
        .variables()
        .iter()
        .find(|v| v.name == name && v.value_type == ValueType::F64 && v.dims.is_empty())
        .map(|v| v.id)
}

/// Value of one f64 scalar.
pub(crate) fn real(view: &SubsystemView, id: u32, t_s: f64) -> Result<f64> {
    let mut value = [f64::NAN];
    view.instance
        .get(&[id], ValuesMut::F64(&mut value))
        .map_err(|e| failed(view, t_s, "get", e.to_string()))?;
    Ok(value[0])
}
