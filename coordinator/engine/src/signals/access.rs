//! Variables of all subsystems by their full names, read and written as what a scenario can hold.

use serde_json::Value;
use std::collections::HashMap;
use terraglue_diagnostics::{closest, largest_plausible};
use terraglue_host::{Instance, Reply};
use terraglue_subsystem::{Effect, Error, Result, ValueType, Values, ValuesMut, Variable};

/// A variable of one instance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VariableRef {
    /// Index of the instance.
    pub slot: usize,
    /// Index into its `variables()`.
    pub variable: usize,
}

/// Full names (`subsystem.variable`) of everything that can be read or set.
#[derive(Debug, Default)]
pub struct Directory {
    names: Vec<String>,
    refs: Vec<VariableRef>,
    /// Places of the names among all.
    places: HashMap<String, usize>,
    /// Full names of all streams, in the order in which they are counted.
    streams: Vec<String>,
}

/// Full names (`subsystem.stream`) of all streams with the slots of their subsystems and their numbers in them, in the
/// order in which they are counted.
pub fn streams(instances: &[Instance]) -> impl Iterator<Item = (String, (usize, usize))> {
    instances.iter().enumerate().flat_map(|(slot, instance)| {
        let all = instance.subsystem().streams().iter().enumerate();
        all.map(move |(k, info)| (format!("{}.{}", instance.name(), info.name), (slot, k)))
    })
}

impl Directory {
    /// Lists the variables of all instances.
    pub fn new(instances: &[Instance]) -> Self {
        let mut directory = Self::default();
        for (slot, instance) in instances.iter().enumerate() {
            for (variable, v) in instance.variables().iter().enumerate() {
                let name = format!("{}.{}", instance.name(), v.name);
                directory.places.entry(name.clone()).or_insert(directory.names.len());
                directory.names.push(name);
                directory.refs.push(VariableRef { slot, variable });
            }
        }
        directory.streams = streams(instances).map(|(name, _)| name).collect();
        directory
    }

    /// Full names of all streams, in the order in which they are counted.
    pub fn streams(&self) -> &[String] {
        &self.streams
    }

    /// All full names, in the order of instances and variables.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// Variable of a full name.
    pub fn find(&self, name: &str) -> Option<VariableRef> {
        self.places.get(name).map(|k| self.refs[*k])
    }

    /// A line of help for a variable that does not exist: the one that looks most like it.
    pub fn hint(&self, name: &str) -> Option<String> {
        nearest(self.names.iter(), name)
    }

    /// The same where the name may be that of a stream.
    pub fn hint_with_streams(&self, name: &str) -> Option<String> {
        nearest(self.names.iter().chain(&self.streams), name)
    }

    /// Names and variables in order.
    pub fn iter(&self) -> impl Iterator<Item = (&str, VariableRef)> {
        self.names.iter().map(String::as_str).zip(self.refs.iter().copied())
    }
}

fn nearest<'a>(names: impl Iterator<Item = &'a String>, name: &str) -> Option<String> {
    closest(name, names.map(String::as_str)).map(|n| format!("did you mean `{n}`?"))
}

impl VariableRef {
    /// Its subsystem, by number.
    pub fn slot(self) -> usize {
        self.slot
    }

    /// Description.
    pub fn describe(self, instances: &[Instance]) -> &Variable {
        &instances[self.slot].variables()[self.variable]
    }

    /// Committed value of a scalar number, boolean or enumeration as f64.
    ///
    /// # Errors
    /// A variable that is an array, a text or bytes, or a module that cannot give the value.
    pub fn number(self, instances: &[Instance]) -> Result<f64> {
        let instance = &instances[self.slot];
        let v = &instance.variables()[self.variable];
        let ids = [v.id];
        macro_rules! read {
            ($variant:ident, $t:ty, $convert:expr) => {{
                let mut out = [<$t>::default()];
                instance.peek(&ids, ValuesMut::$variant(&mut out))?;
                Ok($convert(out[0]))
            }};
        }
        match v.value_type {
            ValueType::F64 => read!(F64, f64, |x| x),
            ValueType::F32 => read!(F32, f32, f64::from),
            ValueType::I8 => read!(I8, i8, f64::from),
            ValueType::I16 => read!(I16, i16, f64::from),
            ValueType::I32 => read!(I32, i32, f64::from),
            ValueType::I64 => read!(I64, i64, |x| x as f64),
            ValueType::U8 => read!(U8, u8, f64::from),
            ValueType::U16 => read!(U16, u16, f64::from),
            ValueType::U32 => read!(U32, u32, f64::from),
            ValueType::U64 => read!(U64, u64, |x| x as f64),
            ValueType::Bool => read!(Bool, bool, |x| f64::from(u8::from(x))),
            ValueType::Enumeration => read!(Enumeration, i64, |x| x as f64),
            ValueType::String | ValueType::Binary | ValueType::Clock => Err(Error::Unsupported),
        }
    }

    /// Number of this variable for a value from a scenario, an operator or a script; the reason if it cannot be set:
    /// read-only, out of range or of the wrong type. Texts have no number.
    fn number_for(v: &Variable, value: &Value) -> std::result::Result<Option<f64>, String> {
        if v.effect == Effect::ReadOnly {
            return Err(format!("`{}` is read-only", v.name));
        }
        let refused = || {
            let range = if v.min > f64::NEG_INFINITY || v.max < f64::INFINITY {
                format!(" between {} and {}", v.min, v.max)
            } else {
                String::new()
            };
            format!("`{}` takes {}{range}, not {value}", v.name, type_name(v))
        };
        let number = match (value, v.value_type) {
            (Value::String(_), ValueType::String) => return Ok(None),
            (_, ValueType::String | ValueType::Binary | ValueType::Clock) => return Err(refused()),
            (Value::Bool(b), ValueType::Bool) => f64::from(u8::from(*b)),
            (Value::String(name), _) => {
                v.enumeration.iter().position(|n| n == name).ok_or_else(refused)? as f64
            }
            (other, _) => other.as_f64().ok_or_else(refused)?,
        };
        if !(number >= v.min && number <= v.max && fits(v, number)) {
            return Err(refused());
        }
        implausible(v, number, value).map_or(Ok(Some(number)), Err)
    }

    /// Why a value could never be set, if so.
    pub fn objection(self, instances: &[Instance], value: &Value) -> Option<String> {
        Self::number_for(self.describe(instances), value).err()
    }

    /// Sets a value from a scenario, an operator or a script. Refuses with the reason: read-only, out of range,
    /// wrong type, or too late.
    ///
    /// # Errors
    /// A module that fails; a value that is not accepted is [`Reply::Refused`].
    pub fn set(
        self,
        instances: &mut [Instance],
        started: bool,
        value: &Value,
    ) -> terraglue_diagnostics::Result<Reply> {
        let v = self.describe(instances).clone();
        let instance = &mut instances[self.slot];
        if started && v.effect == Effect::NeedsReset {
            let reason = format!("`{}` can only be set before the first step", v.name);
            return Ok(Reply::Refused(reason));
        }
        match Self::number_for(&v, value) {
            Err(reason) => Ok(Reply::Refused(reason)),
            Ok(Some(number)) => write_number(instance, &v, number),
            Ok(None) => {
                let text = value.as_str().unwrap_or_default().to_owned();
                instance.set(&[v.id], Values::String(&[text]))
            }
        }
    }
}

/// Why a number cannot be meant, where the variable has no bound of its own on that side: as of a parameter.
fn implausible(v: &Variable, number: f64, value: &Value) -> Option<String> {
    let real = matches!(v.value_type, ValueType::F64 | ValueType::F32);
    let bound = if number > 0.0 { v.max } else { v.min };
    let largest = largest_plausible(&v.unit);
    (real && bound.is_infinite() && number.abs() > largest).then(|| {
        let unit = if ["", "1"].contains(&v.unit.as_str()) { String::new() } else { format!(" {}", v.unit) };
        let directions = if v.min >= 0.0 { "" } else { " in either direction" };
        format!("`{}` = {value} is out of range: plausible is at most {largest:e}{unit}{directions}", v.name)
    })
}

/// Whether the variable's type can hold the number exactly.
fn fits(v: &Variable, number: f64) -> bool {
    let (low, high) = match v.value_type {
        ValueType::F64 | ValueType::F32 => return true,
        ValueType::I8 => (f64::from(i8::MIN), f64::from(i8::MAX)),
        ValueType::I16 => (f64::from(i16::MIN), f64::from(i16::MAX)),
        ValueType::I32 => (f64::from(i32::MIN), f64::from(i32::MAX)),
        ValueType::I64 => (i64::MIN as f64, i64::MAX as f64),
        ValueType::U8 => (0.0, f64::from(u8::MAX)),
        ValueType::U16 => (0.0, f64::from(u16::MAX)),
        ValueType::U32 => (0.0, f64::from(u32::MAX)),
        ValueType::U64 => (0.0, u64::MAX as f64),
        ValueType::Bool => (0.0, 1.0),
        ValueType::Enumeration => (0.0, v.enumeration.len() as f64 - 1.0),
        ValueType::String | ValueType::Binary | ValueType::Clock => return false,
    };
    number.fract() == 0.0 && number >= low && number <= high
}

/// Writes a number that [`fits`] in the variable's own type.
fn write_number(instance: &mut Instance, v: &Variable, number: f64) -> terraglue_diagnostics::Result<Reply> {
    let id = [v.id];
    match v.value_type {
        ValueType::F64 => instance.set(&id, Values::F64(&[number])),
        ValueType::F32 => instance.set(&id, Values::F32(&[number as f32])),
        ValueType::I8 => instance.set(&id, Values::I8(&[number as i8])),
        ValueType::I16 => instance.set(&id, Values::I16(&[number as i16])),
        ValueType::I32 => instance.set(&id, Values::I32(&[number as i32])),
        ValueType::I64 => instance.set(&id, Values::I64(&[number as i64])),
        ValueType::U8 => instance.set(&id, Values::U8(&[number as u8])),
        ValueType::U16 => instance.set(&id, Values::U16(&[number as u16])),
        ValueType::U32 => instance.set(&id, Values::U32(&[number as u32])),
        ValueType::U64 => instance.set(&id, Values::U64(&[number as u64])),
        ValueType::Bool => instance.set(&id, Values::Bool(&[number == 1.0])),
        ValueType::Enumeration => instance.set(&id, Values::Enumeration(&[number as i64])),
        ValueType::String | ValueType::Binary | ValueType::Clock => {
            Ok(Reply::Refused(format!("`{}` is no number", v.name)))
        }
    }
}

fn type_name(v: &Variable) -> String {
    match v.value_type {
        ValueType::F64 | ValueType::F32 => "a number".into(),
        ValueType::Bool => "true or false".into(),
        ValueType::Enumeration => format!("one of {}", v.enumeration.join(", ")),
        ValueType::String => "text".into(),
        ValueType::Binary | ValueType::Clock => "nothing that a scenario can hold".into(),
        _ => "a whole number".into(),
    }
}
