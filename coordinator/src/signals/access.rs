//! Variables of all subsystems by their full names, read and written as what a scenario can hold.

use crate::host::{Instance, Reply};
use serde_json::Value;
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
}

impl Directory {
    /// Lists the variables of all instances.
    pub fn new(instances: &[Instance]) -> Self {
        let mut directory = Self::default();
        for (slot, instance) in instances.iter().enumerate() {
            for (variable, v) in instance.subsystem().variables().iter().enumerate() {
                directory.names.push(format!("{}.{}", instance.name(), v.name));
                directory.refs.push(VariableRef { slot, variable });
            }
        }
        directory
    }

    /// All full names, in the order of instances and variables.
    pub fn names(&self) -> &[String] {
        &self.names
    }

    /// What a full name stands for.
    pub fn find(&self, name: &str) -> Option<VariableRef> {
        self.names.iter().position(|n| n == name).map(|k| self.refs[k])
    }

    /// The full name that looks most like `name`.
    pub fn nearest(&self, name: &str) -> Option<&str> {
        let distance = |n: &&String| strsim::damerau_levenshtein(n, name);
        self.names.iter().min_by_key(distance).map(String::as_str)
    }

    /// Names and variables in order.
    pub fn iter(&self) -> impl Iterator<Item = (&str, VariableRef)> {
        self.names.iter().map(String::as_str).zip(self.refs.iter().copied())
    }
}

impl VariableRef {
    /// Description.
    pub fn describe(self, instances: &[Instance]) -> &Variable {
        &instances[self.slot].subsystem().variables()[self.variable]
    }

    /// Committed value of a scalar number, boolean or enumeration as f64.
    pub fn number(self, instances: &[Instance]) -> Result<f64> {
        let subsystem = instances[self.slot].subsystem();
        let v = &subsystem.variables()[self.variable];
        let ids = [v.id];
        macro_rules! read {
            ($variant:ident, $t:ty, $convert:expr) => {{
                let mut out = [<$t>::default()];
                subsystem.get(&ids, ValuesMut::$variant(&mut out))?;
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

    /// Sets a value from a scenario, an operator or a script. Refuses with the reason: read-only, out of range,
    /// wrong type, or too late.
    pub fn set(self, instances: &mut [Instance], started: bool, value: &Value) -> crate::Result<Reply> {
        let instance = &mut instances[self.slot];
        let v = instance.subsystem().variables()[self.variable].clone();
        match v.effect {
            Effect::ReadOnly => return refuse(format!("`{}` is read-only", v.name)),
            Effect::NeedsReset if started => {
                return refuse(format!("`{}` can only be set before the first step", v.name));
            }
            _ => {}
        }
        let refused = || {
            let range = if v.min > f64::NEG_INFINITY || v.max < f64::INFINITY {
                format!(" between {} and {}", v.min, v.max)
            } else {
                String::new()
            };
            refuse(format!("`{}` takes {}{range}, not {value}", v.name, type_name(&v)))
        };
        if let ValueType::String = v.value_type {
            let Some(text) = value.as_str() else { return refused() };
            return instance.set(&[v.id], Values::String(&[text.to_owned()]));
        }
        let number = match value {
            Value::Bool(b) if v.value_type == ValueType::Bool => f64::from(u8::from(*b)),
            Value::String(name) => {
                let Some(k) = v.enumeration.iter().position(|n| n == name) else { return refused() };
                k as f64
            }
            other => {
                let Some(number) = other.as_f64() else { return refused() };
                number
            }
        };
        if !(number >= v.min && number <= v.max) {
            return refused();
        }
        write_number(instance, &v, number).unwrap_or_else(refused)
    }
}

fn refuse(reason: String) -> crate::Result<Reply> {
    Ok(Reply::Refused(reason))
}

/// Writes a number in the variable's own type; `None` where the type cannot hold it.
fn write_number(instance: &mut Instance, v: &Variable, number: f64) -> Option<crate::Result<Reply>> {
    let whole = number.fract() == 0.0;
    let (id, s) = ([v.id], instance);
    macro_rules! write {
        ($variant:ident, $t:ty) => {{
            let fits = whole && number >= <$t>::MIN as f64 && number <= <$t>::MAX as f64;
            fits.then(|| s.set(&id, Values::$variant(&[number as $t])))
        }};
    }
    match v.value_type {
        ValueType::F64 => Some(s.set(&id, Values::F64(&[number]))),
        ValueType::F32 => Some(s.set(&id, Values::F32(&[number as f32]))),
        ValueType::I8 => write!(I8, i8),
        ValueType::I16 => write!(I16, i16),
        ValueType::I32 => write!(I32, i32),
        ValueType::I64 => write!(I64, i64),
        ValueType::U8 => write!(U8, u8),
        ValueType::U16 => write!(U16, u16),
        ValueType::U32 => write!(U32, u32),
        ValueType::U64 => write!(U64, u64),
        ValueType::Bool => {
            (number == 0.0 || number == 1.0).then(|| s.set(&id, Values::Bool(&[number == 1.0])))
        }
        ValueType::Enumeration => {
            let known = whole && number >= 0.0 && (number as usize) < v.enumeration.len();
            known.then(|| s.set(&id, Values::Enumeration(&[number as i64])))
        }
        ValueType::String | ValueType::Binary | ValueType::Clock => None,
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
