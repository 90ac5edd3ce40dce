//! Inputs over time of a unit that is run alone: a table of numbers, arrays, texts and clocks.

use super::map::element_name;
use super::simulate::find;
use terraglue_fmi::description::Variable;
use terraglue_fmi::{Error, ModelDescription, Result, Slave};
use terraglue_subsystem::{ValueType, Values};

/// Inputs over time. Cells stay as they are written, because whole numbers of 64 bits do not fit into f64.
#[derive(Clone, Debug, Default)]
pub struct Table {
    /// Names after `time`.
    pub names: Vec<String>,
    /// Rows, ascending in time.
    pub rows: Vec<Row>,
}

/// Inputs at a time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Row {
    /// s.
    pub time: f64,
    /// A cell for each name.
    pub cells: Vec<String>,
    /// The same as numbers; NaN where they are none.
    pub numbers: Vec<f64>,
}

impl Table {
    /// The last row at or before t, or the first of all, and the row after it.
    fn around(&self, t: f64) -> Option<(&Row, Option<&Row>)> {
        let next = self.rows.partition_point(|r| r.time <= t);
        match next.checked_sub(1) {
            Some(k) => Some((&self.rows[k], self.rows.get(next))),
            None => self.rows.first().map(|row| (row, None)),
        }
    }

    /// A number at t by straight lines between the rows; the first and last row hold beyond.
    fn number(&self, t: f64, column: usize) -> f64 {
        match self.around(t) {
            Some((a, Some(b))) => {
                let s = (t - a.time) / (b.time - a.time);
                a.numbers[column] + s * (b.numbers[column] - a.numbers[column])
            }
            Some((row, None)) => row.numbers[column],
            None => 0.0,
        }
    }

    /// Numbers of an array at t, written with spaces between them; nothing where a cell has not so many.
    fn numbers(&self, t: f64, column: usize, count: usize) -> Option<Vec<f64>> {
        let read = |row: &Row| {
            let words = row.cells[column].split_whitespace();
            let all: Option<Vec<f64>> =
                words.map(|w| w.parse().ok().filter(|x: &f64| x.is_finite())).collect();
            all.filter(|x| x.len() == count)
        };
        let Some((a, b)) = self.around(t) else { return Some(vec![0.0; count]) };
        let (first, Some(b)) = (read(a)?, b) else { return read(a) };
        let s = (t - a.time) / (b.time - a.time);
        Some(first.iter().zip(read(b)?).map(|(x, y)| x + s * (y - x)).collect())
    }

    /// The cell that holds at t.
    fn cell(&self, t: f64, column: usize) -> &str {
        self.around(t).map_or("0", |(row, _)| &row.cells[column])
    }
}

/// A column of a table and what it feeds.
pub struct Input {
    column: usize,
    variable: Variable,
    /// Of an array.
    element: Option<usize>,
}

/// Finds what the columns of a table feed: variables, whole arrays or elements of arrays of f64.
///
/// # Errors
/// A column that is no variable of the unit.
pub fn find_all(description: &ModelDescription, table: &Table) -> Result<Vec<Input>> {
    let one = |(column, name): (usize, &String)| {
        let array = |v: &&Variable| {
            v.value_type == ValueType::F64
                && name.strip_prefix(v.name.as_str()).is_some_and(|r| r.starts_with('['))
        };
        let element = |v: &Variable| (0..v.len()).find(|k| element_name(v, *k) == *name);
        let mut elements = description.variables.iter().filter(array).filter_map(|v| Some((v, element(v)?)));
        if description.position(name).is_none()
            && let Some((v, k)) = elements.next()
        {
            return Ok(Input { column, variable: v.clone(), element: Some(k) });
        }
        Ok(Input { column, variable: find(description, name)?.clone(), element: None })
    };
    table.names.iter().enumerate().map(one).collect()
}

/// Sets all inputs to what they are at t.
///
/// # Errors
/// What is no value of its variable, or what the unit does not take.
pub fn set_all(slave: &mut Slave, inputs: &[Input], table: &Table, t: f64) -> Result {
    inputs.iter().try_for_each(|input| set(slave, input, table, t))
}

fn set(slave: &mut Slave, input: &Input, table: &Table, t: f64) -> Result {
    let (column, v, reference) = (input.column, &input.variable, [input.variable.reference]);
    let none =
        || Error::Refused(format!("`{}`: the input is no number beside t = {t} s", table.names[column]));
    let number = || Some(table.number(t, column)).filter(|x| x.is_finite()).ok_or_else(none);
    if v.value_type == ValueType::Clock {
        slave.can_trigger(v)?;
        slave.trigger(v.reference, matches!(table.cell(t, column), "1" | "true"));
        return Ok(());
    }
    if slave.waits_for_clock(v.reference) {
        let (v, cell) = (v.clone(), table.cell(t, column).to_owned());
        slave.hold(v.reference, move |slave| set_text(slave, &v, &cell));
        return Ok(());
    }
    match (v.value_type, input.element) {
        (ValueType::F64, Some(k)) => {
            let mut whole = vec![f64::NAN; v.len()];
            slave.get_f64(&reference, &mut whole)?;
            whole[k] = number()?;
            slave.set_f64(&reference, &whole)
        }
        (ValueType::F64, None) if !v.sizes.is_empty() => {
            let whole = table.numbers(t, column, v.len()).ok_or_else(|| {
                Error::Refused(format!("`{}`: the input is not {} numbers beside t = {t} s", v.name, v.len()))
            })?;
            slave.set_f64(&reference, &whole)
        }
        (ValueType::F64, None) => slave.set_f64(&reference, &[number()?]),
        (ValueType::F32, _) if v.sizes.is_empty() => slave.set(&reference, Values::F32(&[number()? as f32])),
        _ => set_text(slave, v, table.cell(t, column)),
    }
}

/// Sets a variable from text; arrays take their elements separated by spaces.
pub fn set_text(slave: &Slave, v: &Variable, text: &str) -> Result {
    let wrong =
        || Error::Refused(format!("`{}` = {text}: it takes {} values of another kind", v.name, v.len()));
    let words: Vec<&str> = text.split_whitespace().collect();
    macro_rules! parsed {
        ($variant:ident, $t:ty) => {{
            let values: Option<Vec<$t>> = words.iter().map(|w| w.parse().ok()).collect();
            let values = values.filter(|x| x.len() == v.len()).ok_or_else(wrong)?;
            slave.set(&[v.reference], Values::$variant(&values))
        }};
    }
    match v.value_type {
        ValueType::F64 => parsed!(F64, f64),
        ValueType::F32 => parsed!(F32, f32),
        ValueType::I8 => parsed!(I8, i8),
        ValueType::I16 => parsed!(I16, i16),
        ValueType::I32 => parsed!(I32, i32),
        ValueType::I64 => parsed!(I64, i64),
        ValueType::U8 => parsed!(U8, u8),
        ValueType::U16 => parsed!(U16, u16),
        ValueType::U32 => parsed!(U32, u32),
        ValueType::U64 => parsed!(U64, u64),
        ValueType::Enumeration => parsed!(Enumeration, i64),
        ValueType::Bool => {
            let value = match text {
                "true" | "1" => true,
                "false" | "0" => false,
                _ => return Err(wrong()),
            };
            slave.set(&[v.reference], Values::Bool(&[value]))
        }
        ValueType::String => slave.set(&[v.reference], Values::String(&[text.to_owned()])),
        ValueType::Binary | ValueType::Clock => Err(wrong()),
    }
}
