//! Connections of what is no f64: truth values, whole numbers, enumerations, texts and bytes, one value each.

use super::access::VariableRef;
use super::table::Table;
use terraglue_diagnostics::{Error, Result};
use terraglue_host::{Instance, Reply};
use terraglue_scenario::ConnectionOrder;
use terraglue_subsystem::{ValueType, Values, ValuesMut};

/// Whole numbers up to here are exact in f64.
const EXACT: f64 = 9_007_199_254_740_992.0;

/// One connection.
#[derive(Clone, Debug)]
pub struct Discrete {
    from: VariableRef,
    to: VariableRef,
    table: Option<Table>,
    /// value_to = a·value_from + b of numbers, where that is another one.
    conversion: Option<(f64, f64)>,
    /// Whether it may pass values within a step.
    order: ConnectionOrder,
    /// Whether its target is stepped after its source, with the value at the end of the step.
    within: bool,
    value: Value,
}

/// A value on its way.
#[derive(Clone, Debug, PartialEq)]
enum Value {
    /// None was read yet.
    None,
    Whole(i128),
    Single([f32; 1]),
    Text([String; 1]),
    Bytes([Vec<u8>; 1]),
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

/// Whether a type is one of whole numbers.
pub fn is_whole(value_type: ValueType) -> bool {
    use ValueType::{I8, I16, I32, I64, U8, U16, U32, U64};
    matches!(value_type, I8 | I16 | I32 | I64 | U8 | U16 | U32 | U64)
}

impl Discrete {
    /// A connection whose types were found to fit.
    pub fn new(
        [from, to]: [VariableRef; 2],
        table: Option<Table>,
        conversion: (f64, f64),
        order: ConnectionOrder,
    ) -> Self {
        let conversion = Some(conversion).filter(|c| *c != (1.0, 0.0));
        Self { from, to, table, conversion, order, within: false, value: Value::None }
    }

    /// Whether it may pass values within a step where that avoids a delay.
    pub fn is_ordered(&self) -> bool {
        self.order == ConnectionOrder::Structure
    }

    /// Says that its target is stepped after its source.
    pub fn pass_within_the_step(&mut self) {
        self.within = true;
    }

    /// Whether its target is stepped after its source: then nothing is passed at the start of a step.
    pub fn is_within_the_step(&self) -> bool {
        self.within
    }

    /// Whether values change on their way.
    pub fn has_table(&self) -> bool {
        self.table.is_some()
    }

    /// value_to = a·value_from + b, where the value changes so on its way.
    pub fn conversion(&self) -> Option<(f64, f64)> {
        self.conversion
    }

    /// The variables on either side.
    pub fn ends(&self) -> [VariableRef; 2] {
        [self.from, self.to]
    }

    /// The value that its input has now, from and to itself; none where the input cannot be read.
    pub fn of_input(&self, instances: &[Instance]) -> Self {
        let mut own = Self::new([self.to; 2], None, (1.0, 0.0), self.order);
        if own.read(instances).is_err() {
            own.value = Value::None;
        }
        own
    }

    /// `a.n → b.n`.
    pub fn label(&self, instances: &[Instance]) -> String {
        let [from, to] =
            self.ends().map(|end| format!("{}.{}", instances[end.slot].name(), end.describe(instances).name));
        format!("{from} → {to}")
    }

    /// Subsystem and variable on either side.
    pub fn end_ids(&self, instances: &[Instance]) -> [(usize, u32); 2] {
        self.ends().map(|end| (end.slot, end.describe(instances).id))
    }

    /// Whether it feeds a variable of a subsystem.
    pub fn feeds(&self, instances: &[Instance], slot: usize, id: u32) -> bool {
        self.to.slot == slot && self.to.describe(instances).id == id
    }

    /// Takes the value; whether it is another one than the input was given last.
    ///
    /// # Errors
    /// As of [`Discrete::read`].
    pub fn read_anew(&mut self, instances: &[Instance]) -> Result<bool> {
        let before = std::mem::replace(&mut self.value, Value::None);
        self.read(instances)?;
        Ok(self.value != before)
    }

    /// Takes the committed value.
    ///
    /// # Errors
    /// A value without an entry in the table, a result that is no whole number, or NaN; a subsystem that fails.
    pub fn read(&mut self, instances: &[Instance]) -> Result {
        self.take(instances)?;
        if let (Value::Whole(w), Some(table)) = (&self.value, &self.table) {
            let target = table.get(w).copied().ok_or_else(|| self.unlisted(instances, *w))?;
            self.value = Value::Whole(target);
        }
        match (&mut self.value, self.conversion) {
            (Value::Whole(w), Some(conversion)) => {
                let w = *w;
                self.value = Value::Whole(self.converted(instances, w, conversion)?);
            }
            (Value::Single([x]), Some((a, b))) => *x = (a * f64::from(*x) + b) as f32,
            _ => {}
        }
        Ok(())
    }

    fn converted(&self, instances: &[Instance], w: i128, (a, b): (f64, f64)) -> Result<i128> {
        let x = a * w as f64 + b;
        if x.fract() == 0.0 && x.abs() <= EXACT {
            return Ok(x as i128);
        }
        let v = self.from.describe(instances);
        let text = format!(
            "`{}` is {w}, of which `factor` and `offset` make {x}: no whole number that f64 holds exactly",
            v.name
        );
        Err(instances[self.from.slot].error("get", text))
    }

    /// The error of a value for which the table has no entry.
    #[cold]
    fn unlisted(&self, instances: &[Instance], w: i128) -> Error {
        let v = self.from.describe(instances);
        let shown = usize::try_from(w).ok().and_then(|k| v.enumeration.get(k).cloned());
        let shown = shown.unwrap_or_else(|| w.to_string());
        let text = format!("`{}` is {shown}, for which `map` has no entry", v.name);
        instances[self.from.slot].error("get", text)
    }

    /// Sets the input to the value that was taken last.
    ///
    /// # Errors
    /// A value that does not fit the type of the input, or that the subsystem refuses.
    pub fn pass_on(&self, instances: &mut [Instance]) -> Result {
        let v = self.to.describe(instances);
        let (id, kind) = ([v.id], v.value_type);
        let to = self.to;
        let narrow = |instances: &[Instance], w: i128| {
            let name = &to.describe(instances).name;
            instances[to.slot].error("set", format!("{w} does not fit the variable `{name}`"))
        };
        macro_rules! whole {
            ($variant:ident, $w:expr) => {{
                let own = (*$w).try_into().map_err(|_| narrow(instances, *$w))?;
                instances[to.slot].set(&id, Values::$variant(&[own]))?
            }};
        }
        let reply = match (kind, &self.value) {
            (ValueType::Bool, Value::Whole(w)) => instances[to.slot].set(&id, Values::Bool(&[*w != 0]))?,
            (ValueType::I8, Value::Whole(w)) => whole!(I8, w),
            (ValueType::I16, Value::Whole(w)) => whole!(I16, w),
            (ValueType::I32, Value::Whole(w)) => whole!(I32, w),
            (ValueType::I64, Value::Whole(w)) => whole!(I64, w),
            (ValueType::U8, Value::Whole(w)) => whole!(U8, w),
            (ValueType::U16, Value::Whole(w)) => whole!(U16, w),
            (ValueType::U32, Value::Whole(w)) => whole!(U32, w),
            (ValueType::U64, Value::Whole(w)) => whole!(U64, w),
            (ValueType::Enumeration, Value::Whole(w)) => whole!(Enumeration, w),
            (_, Value::Single(x)) => instances[to.slot].set(&id, Values::F32(x))?,
            (_, Value::Text(text)) => instances[to.slot].set(&id, Values::String(text))?,
            (_, Value::Bytes(bytes)) => instances[to.slot].set(&id, Values::Binary(bytes))?,
            (_, Value::Whole(w)) => return Err(narrow(instances, *w)),
            (_, Value::None) => return Ok(()),
        };
        match reply {
            Reply::Accepted => Ok(()),
            Reply::Refused(reason) => Err(instances[to.slot].error("set", reason)),
        }
    }

    fn take(&mut self, instances: &[Instance]) -> Result {
        let v = self.from.describe(instances);
        let (id, source) = ([v.id], &instances[self.from.slot]);
        macro_rules! whole {
            ($variant:ident, $zero:expr) => {{
                let mut out = [$zero];
                source.get(&id, ValuesMut::$variant(&mut out))?;
                self.value = Value::Whole(out[0].into());
            }};
        }
        // texts and bytes stay in the room that they had in the step before
        macro_rules! kept {
            ($variant:ident, $kind:ident, $empty:expr) => {{
                if !matches!(self.value, Value::$variant(_)) {
                    self.value = Value::$variant([$empty]);
                }
                if let Value::$variant(out) = &mut self.value {
                    source.get(&id, ValuesMut::$kind(out))?;
                }
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
                kept!(Single, F32, f32::NAN);
                if matches!(self.value, Value::Single([x]) if x.is_nan()) {
                    return Err(source.error("get", format!("the variable `{}` is NaN", v.name)));
                }
            }
            ValueType::Binary => kept!(Bytes, Binary, Vec::new()),
            ValueType::String | ValueType::F64 | ValueType::Clock => kept!(Text, String, String::new()),
        }
        Ok(())
    }
}
