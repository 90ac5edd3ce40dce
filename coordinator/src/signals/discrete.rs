//! Connections of what is no f64: truth values, whole numbers, enumerations, texts and bytes, one value each.

use super::access::VariableRef;
use super::table::Table;
use crate::Result;
use crate::host::{Instance, Reply};
use terraglue_subsystem::{ValueType, Values, ValuesMut};

/// One connection.
#[derive(Clone, Debug)]
pub struct Discrete {
    from: VariableRef,
    to: VariableRef,
    table: Option<Table>,
}

/// A value on its way.
enum Value {
    Whole(i128),
    Single(f32),
    Text(String),
    Bytes(Vec<u8>),
}

/// Whether values of one type can become values of another.
pub fn fits(from: ValueType, to: ValueType) -> bool {
    let class = |t: ValueType| match t {
        ValueType::F64 => 0,
        ValueType::F32 => 1,
        ValueType::Bool => 2,
        ValueType::String => 3,
        ValueType::Binary => 4,
        ValueType::Clock => 5,
        ValueType::Enumeration => 6,
        _ => 7,
    };
    from != ValueType::Clock && class(from) == class(to)
}

impl Discrete {
    /// A connection whose types were found to fit.
    pub fn new(from: VariableRef, to: VariableRef, table: Option<Table>) -> Self {
        Self { from, to, table }
    }

    /// Whether values change on their way.
    pub fn has_table(&self) -> bool {
        self.table.is_some()
    }

    /// The variables on either side.
    pub fn ends(&self) -> [VariableRef; 2] {
        [self.from, self.to]
    }

    /// Whether it feeds a variable of a subsystem.
    pub fn feeds(&self, instances: &[Instance], slot: usize, id: u32) -> bool {
        self.to.slot == slot && self.to.describe(instances).id == id
    }

    /// Copies the committed value.
    pub fn transfer(&self, instances: &mut [Instance]) -> Result {
        let value = match (self.read(instances)?, &self.table) {
            (Value::Whole(w), Some(table)) => Value::Whole(*table.get(&w).ok_or_else(|| {
                let v = self.from.describe(instances);
                let shown = usize::try_from(w).ok().and_then(|k| v.enumeration.get(k).cloned());
                let shown = shown.unwrap_or_else(|| w.to_string());
                instances[self.from.slot]
                    .error("get", format!("`{}` is {shown}, for which `map` has no entry", v.name))
            })?),
            (value, _) => value,
        };
        let v = self.to.describe(instances);
        let (id, kind, name) = ([v.id], v.value_type, v.name.clone());
        let target = &mut instances[self.to.slot];
        let narrow = |w: i128| target.error("set", format!("{w} does not fit the variable `{name}`"));
        macro_rules! whole {
            ($variant:ident, $w:expr) => {{
                let own = $w.try_into().map_err(|_| narrow($w))?;
                target.set(&id, Values::$variant(&[own]))?
            }};
        }
        let reply = match (kind, value) {
            (ValueType::Bool, Value::Whole(w)) => target.set(&id, Values::Bool(&[w != 0]))?,
            (ValueType::I8, Value::Whole(w)) => whole!(I8, w),
            (ValueType::I16, Value::Whole(w)) => whole!(I16, w),
            (ValueType::I32, Value::Whole(w)) => whole!(I32, w),
            (ValueType::I64, Value::Whole(w)) => whole!(I64, w),
            (ValueType::U8, Value::Whole(w)) => whole!(U8, w),
            (ValueType::U16, Value::Whole(w)) => whole!(U16, w),
            (ValueType::U32, Value::Whole(w)) => whole!(U32, w),
            (ValueType::U64, Value::Whole(w)) => whole!(U64, w),
            (ValueType::Enumeration, Value::Whole(w)) => whole!(Enumeration, w),
            (_, Value::Single(x)) => target.set(&id, Values::F32(&[x]))?,
            (_, Value::Text(text)) => target.set(&id, Values::String(&[text]))?,
            (_, Value::Bytes(bytes)) => target.set(&id, Values::Binary(&[bytes]))?,
            (_, Value::Whole(w)) => return Err(narrow(w)),
        };
        match reply {
            Reply::Accepted => Ok(()),
            Reply::Refused(reason) => Err(target.error("set", reason)),
        }
    }

    fn read(&self, instances: &[Instance]) -> Result<Value> {
        let v = self.from.describe(instances);
        let (id, source) = ([v.id], &instances[self.from.slot]);
        macro_rules! whole {
            ($variant:ident, $zero:expr) => {{
                let mut out = [$zero];
                source.get(&id, ValuesMut::$variant(&mut out))?;
                Ok(Value::Whole(out[0].into()))
            }};
        }
        match v.value_type {
            ValueType::Bool => whole!(Bool, false),
            ValueType::I8 => whole!(I8, 0),
            ValueType::I16 => whole!(I16, 0),
            ValueType::I32 => whole!(I32, 0),
            ValueType::I64 => whole!(I64, 0),
            ValueType::U8 => whole!(U8, 0),
            ValueType::U16 => whole!(U16, 0),
            ValueType::U32 => whole!(U32, 0),
            ValueType::U64 => whole!(U64, 0),
            ValueType::Enumeration => whole!(Enumeration, 0),
            ValueType::F32 => {
                let mut out = [f32::NAN];
                source.get(&id, ValuesMut::F32(&mut out))?;
                match out[0].is_nan() {
                    true => Err(source.error("get", format!("the variable `{}` is NaN", v.name))),
                    false => Ok(Value::Single(out[0])),
                }
            }
            ValueType::Binary => {
                let mut out = [Vec::new()];
                source.get(&id, ValuesMut::Binary(&mut out))?;
                let [bytes] = out;
                Ok(Value::Bytes(bytes))
            }
            ValueType::String | ValueType::F64 | ValueType::Clock => {
                let mut out = [String::new()];
                source.get(&id, ValuesMut::String(&mut out))?;
                let [text] = out;
                Ok(Value::Text(text))
            }
        }
    }
}
