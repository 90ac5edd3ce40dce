//! The values of a module whose variables are single numbers, truth values and choices: answers and refusals when they are read and
//! set.

use crate::error::{Error, Result};
use crate::variable::{Causality, ValueType, Values, ValuesMut, Variable};

/// Variables and their values; the id of a variable is its place.
///
/// ```
/// use terraglue_subsystem::{Causality, ValueTable, Values, Variable};
/// let speed = Variable::real(0, "speed", "m/s", Causality::Input, "How fast").within(0.0, 2.0);
/// let mut table = ValueTable::new(vec![speed]);
/// table.set(&[0], Values::F64(&[1.5]))?;
/// assert_eq!(table.values(), [1.5]);
/// assert!(table.set(&[0], Values::F64(&[2.5])).is_err());
/// assert!(table.set(&[0], Values::F64(&[f64::NAN])).is_err());
/// # Ok::<(), terraglue_subsystem::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct ValueTable {
    variables: Vec<Variable>,
    values: Vec<f64>,
}

impl ValueTable {
    /// All values are 0, or the nearest bound.
    pub fn new(variables: Vec<Variable>) -> Self {
        let start = |v: &Variable| 0.0_f64.max(v.min).min(v.max);
        let values = variables.iter().map(start).collect();
        Self { variables, values }
    }

    /// The variables.
    pub fn variables(&self) -> &[Variable] {
        &self.variables
    }

    /// The values, in the order of the ids.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// The value of a variable; not a number where there is none.
    pub fn value(&self, id: u32) -> f64 {
        self.values.get(id as usize).copied().unwrap_or(f64::NAN)
    }

    /// Shows a value, whatever may be set from outside.
    pub fn show(&mut self, id: u32, value: f64) {
        if let Some(place) = self.values.get_mut(id as usize) {
            *place = value;
        }
    }

    /// Back to values of before.
    ///
    /// # Errors
    /// [`Error::Refused`]: they are not as many.
    pub fn restore(&mut self, values: &[f64]) -> Result {
        if values.len() != self.values.len() {
            let why = format!("{} values for {} variables", values.len(), self.values.len());
            return Err(Error::Refused(why));
        }
        self.values.copy_from_slice(values);
        Ok(())
    }

    /// The answer to [`crate::Subsystem::get`].
    ///
    /// # Errors
    /// [`Error::Refused`]: an unknown id or another type.
    pub fn get(&self, ids: &[u32], out: ValuesMut) -> Result {
        match out {
            ValuesMut::F64(out) => self.read(ids, out, ValueType::F64, |v| v),
            ValuesMut::U64(out) => self.read(ids, out, ValueType::U64, |v| v as u64),
            ValuesMut::Bool(out) => self.read(ids, out, ValueType::Bool, |v| v > 0.5),
            ValuesMut::Enumeration(out) => self.read(ids, out, ValueType::Enumeration, |v| v as i64),
            _ => Err(Error::Refused("there are no variables of this type".into())),
        }
    }

    fn read<T>(&self, ids: &[u32], out: &mut [T], wanted: ValueType, value: impl Fn(f64) -> T) -> Result {
        if ids.len() != out.len() {
            return Err(Error::Refused(format!("{} variables but {} values", ids.len(), out.len())));
        }
        for (id, out) in ids.iter().zip(out) {
            self.known(*id, wanted)?;
            *out = value(self.values[*id as usize]);
        }
        Ok(())
    }

    fn known(&self, id: u32, wanted: ValueType) -> Result<&Variable> {
        let found = self.variables.get(id as usize).filter(|v| v.value_type == wanted);
        found.ok_or_else(|| Error::Refused(format!("there is no variable number {id} of this type")))
    }

    /// Sets inputs and parameters, all or none.
    ///
    /// # Errors
    /// [`Error::Refused`]: an unknown id, another type, an output, or a value out of its bounds.
    pub fn set(&mut self, ids: &[u32], values: Values) -> Result {
        match values {
            Values::F64(values) => self.write(ids, values, ValueType::F64, |v| v),
            Values::U64(values) => self.write(ids, values, ValueType::U64, |v| v as f64),
            Values::Bool(values) => self.write(ids, values, ValueType::Bool, |v| f64::from(u8::from(v))),
            Values::Enumeration(values) => self.write(ids, values, ValueType::Enumeration, |v| v as f64),
            _ => Err(Error::Refused("there are no variables of this type".into())),
        }
    }

    fn write<T: Copy>(
        &mut self,
        ids: &[u32],
        values: &[T],
        wanted: ValueType,
        number: impl Fn(T) -> f64,
    ) -> Result {
        if ids.len() != values.len() {
            return Err(Error::Refused(format!("{} variables but {} values", ids.len(), values.len())));
        }
        for (id, value) in ids.iter().zip(values) {
            let (variable, value) = (self.known(*id, wanted)?, number(*value));
            let name = &variable.name;
            if !matches!(variable.causality, Causality::Input | Causality::Parameter) {
                return Err(Error::Refused(format!("`{name}` is shown and cannot be set")));
            }
            let most = match wanted {
                ValueType::Enumeration => variable.enumeration.len() as f64 - 1.0,
                _ => variable.max,
            };
            let least = if wanted == ValueType::Enumeration { 0.0 } else { variable.min };
            if !(value >= least && value <= most) {
                return Err(Error::Refused(format!("`{name}` = {value} is not from {least} to {most}")));
            }
        }
        ids.iter().zip(values).for_each(|(id, value)| self.values[*id as usize] = number(*value));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_that_is_refused_changes_nothing() {
        let real = |id, name| Variable::real(id, name, "", Causality::Input, "").within(-1.0, 1.0);
        let shown = Variable::real(2, "c", "", Causality::Output, "").typed(ValueType::Bool);
        let mut table = ValueTable::new(vec![real(0, "a"), real(1, "b"), shown]);
        assert!(table.set(&[0, 1], Values::F64(&[0.5, 2.0])).is_err());
        assert!(
            table.set(&[2], Values::Bool(&[true])).is_err() && table.set(&[7], Values::F64(&[0.0])).is_err()
        );
        assert_eq!(table.values(), [0.0; 3]);
        table.show(2, 1.0);
        let mut flag = [false];
        table.get(&[2], ValuesMut::Bool(&mut flag)).expect("a flag");
        assert!(flag[0] && table.get(&[0], ValuesMut::Bool(&mut flag)).is_err());
        assert!(table.restore(&[1.0]).is_err() && table.value(9).is_nan());
    }
}
