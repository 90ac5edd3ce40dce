//! Inputs of an FMU that is run alone, from the columns of a table: numbers, arrays, texts and clocks, at communication
//! points and – numbers of FMUs that follow their inputs – within steps.

use super::limits;
use super::map::{effect, element_name, find};
use super::table::Table;
use std::sync::Arc;
use terraglue_fmi::description::{Variability, Variable, hexadecimal};
use terraglue_fmi::{Error, FmuInstance, ModelDescription, Result, Version};
use terraglue_subsystem::{Effect, ValueType, Values};

/// All that a table feeds.
pub struct Inputs {
    table: Arc<Table>,
    all: Vec<Input>,
    /// Inputs whose slopes are set (FMI 2), and their columns.
    slopes: Vec<u32>,
    columns: Vec<usize>,
}

/// A variable and what feeds it.
struct Input {
    variable: Variable,
    /// Columns, with the element of an array where that has its own.
    columns: Vec<(usize, Option<usize>)>,
    /// Elements, of which those stay so that have no column.
    rest: Vec<f64>,
    /// Whether the FMU follows it within steps.
    followed: bool,
}

/// Inputs with columns that an FMU of FMI 3 sets at intermediate times, as far as that is known before arrays have their
/// sizes.
pub fn followed(description: &ModelDescription, table: &Table) -> Vec<String> {
    let fed = |v: &Variable| {
        let own = |name: &String| {
            name.strip_prefix(v.name.as_str()).is_some_and(|r| r.is_empty() || r.starts_with('['))
        };
        table.names.iter().any(own)
    };
    let three = description.version == Version::V3;
    let followed = description.variables.iter().filter(|v| three && description.follows(v) && fed(v));
    followed.map(|v| v.name.clone()).collect()
}

impl Inputs {
    /// Finds what the columns of a table feed: variables, whole arrays or elements of arrays of f64. The FMU is in
    /// initialisation mode; `hold`: it follows nothing within steps.
    ///
    /// # Errors
    /// A column that is no variable of the FMU.
    pub fn find(instance: &FmuInstance, table: &Arc<Table>, hold: bool) -> Result<Self> {
        let description = instance.description();
        let mut all: Vec<Input> = Vec::new();
        for (column, name) in table.names.iter().enumerate() {
            let (v, element) = place(description, name)?;
            check(v, name)?;
            let same =
                |i: &&mut Input| (i.variable.reference, i.variable.value_type) == (v.reference, v.value_type);
            match all.iter_mut().find(same) {
                Some(input)
                    if input
                        .columns
                        .iter()
                        .any(|(_, e)| e.is_none() || element.is_none() || *e == element) =>
                {
                    let text = format!("`{name}`: two columns of the input feed `{}`", v.name);
                    return Err(Error::WrongInput(text));
                }
                Some(input) => input.columns.push((column, element)),
                None => all.push(Input {
                    variable: v.clone(),
                    columns: vec![(column, element)],
                    rest: vec![f64::NAN; v.len()],
                    followed: !hold && description.follows(v),
                }),
            }
        }
        for input in &mut all {
            if input.columns.iter().any(|(_, element)| element.is_some()) {
                instance.get_f64(&[input.variable.reference], &mut input.rest)?;
            }
        }
        let told = all.iter().filter(|i| i.followed && description.version == Version::V2);
        let (slopes, columns) = told.map(|i| (i.variable.reference, i.last())).unzip();
        Ok(Self { table: table.clone(), all, slopes, columns })
    }

    /// Lets an FMU of FMI 3 ask for its inputs within steps.
    pub fn follow(&self, instance: &mut FmuInstance) -> Result {
        if instance.description().version != Version::V3 {
            return Ok(());
        }
        for input in self.all.iter().filter(|i| i.followed) {
            let (table, columns, rest) = (self.table.clone(), input.columns.clone(), input.rest.clone());
            instance.follow(&input.variable, move |t, out| {
                out.copy_from_slice(&rest);
                columns.iter().for_each(|(column, element)| table.write(t, *column, *element, out));
            })?;
        }
        Ok(())
    }

    /// Sets all inputs to what they are at t.
    ///
    /// # Errors
    /// A cell that is no value of its variable, or a value that the FMU does not take.
    pub fn set(&self, instance: &mut FmuInstance, t: f64) -> Result {
        self.all.iter().try_for_each(|input| input.set(instance, &self.table, t))
    }

    /// The error of a step to `end` with what may be tried; that of the table where it holds no number for what the FMU asks.
    pub fn way_out(&self, error: Error, end: f64) -> Error {
        let mut followed = self.all.iter().filter(|i| i.followed);
        match error {
            Error::Call { .. } if followed.any(|input| input.numbers(&self.table, end).is_err()) => {
                Error::WrongInput(error.to_string())
            }
            Error::Call { function, outcome, log, fatal } if self.all.iter().any(|i| i.followed) => {
                Error::Call { function, outcome: format!("{outcome} ({WAY_OUT})"), log, fatal }
            }
            other => other,
        }
    }

    /// Begins a part of a step, from t to `end`: sets slopes and, where the part is not the first, the inputs that the FMU
    /// follows.
    pub fn begin_part(&self, instance: &mut FmuInstance, (t, end): (f64, f64), first: bool) -> Result {
        if !first {
            let mut followed = self.all.iter().filter(|i| i.followed);
            followed.try_for_each(|input| input.set(instance, &self.table, t))?;
        }
        if self.slopes.is_empty() {
            return Ok(());
        }
        let slope = |column: &usize| {
            let slope = self.table.slope(t, end, *column);
            if slope.is_finite() { Ok(slope) } else { Err(self.table.none(*column, end)) }
        };
        let slopes = self.columns.iter().map(slope).collect::<Result<Vec<f64>>>()?;
        instance.foreign().set_slopes(&self.slopes, &slopes)
    }
}

/// Advice where an FMU fails that follows its inputs.
const WAY_OUT: &str = "it follows its inputs within steps; --hold-inputs holds them over each step instead";

/// The variable of a column or a start value, and the element of it: elements of arrays of Float64 have names of their own.
///
/// # Errors
/// [`Error::WrongInput`]: there is no variable of this name.
pub fn place<'a>(description: &'a ModelDescription, name: &str) -> Result<(&'a Variable, Option<usize>)> {
    let array = |v: &&Variable| {
        v.value_type == ValueType::F64
            && name.strip_prefix(v.name.as_str()).is_some_and(|r| r.starts_with('['))
    };
    let element = |v: &Variable| (0..v.len()).find(|k| element_name(v, *k) == *name);
    let mut elements = description.variables.iter().filter(array).filter_map(|v| Some((v, element(v)?)));
    match elements.next().filter(|_| description.position(name).is_none()) {
        Some((v, k)) => Ok((v, Some(k))),
        None => Ok((find(description, name)?, None)),
    }
}

/// Refuses a column of a variable that cannot be set while the FMU runs.
fn check(v: &Variable, name: &str) -> Result {
    let why = match effect(v) {
        Effect::Live => return Ok(()),
        Effect::ReadOnly => "it can be read only: columns are inputs and tunable parameters".to_owned(),
        _ => format!("it is fixed while the FMU runs: `--start {name}=VALUE` sets it before"),
    };
    Err(Error::WrongInput(format!("the column `{name}` of the input: {why}")))
}

impl Input {
    /// The column that counts where several feed it whole.
    fn last(&self) -> usize {
        self.columns.last().map_or(0, |(column, _)| *column)
    }

    fn set(&self, instance: &mut FmuInstance, table: &Table, t: f64) -> Result {
        let (v, column, reference) = (&self.variable, self.last(), [self.variable.reference]);
        if v.value_type == ValueType::Clock {
            instance.trigger(v, matches!(table.cell(t, column), "1" | "true"))?;
            return Ok(());
        }
        if instance.clocks().waits_for_clock(v.reference) {
            let (v, cell) = (v.clone(), table.cell(t, column).to_owned());
            instance.clocks_mut().hold(v.reference, move |instance| {
                set_text(|references, values| instance.set(references, values), &v, &cell)
            });
            return Ok(());
        }
        match v.value_type {
            ValueType::F64 => instance.set_f64(&reference, &self.numbers(table, t)?),
            ValueType::F32 => {
                let narrow: Vec<f32> = self.numbers(table, t)?.into_iter().map(|x| x as f32).collect();
                instance.set(&reference, Values::F32(&narrow))
            }
            _ => set_text(|references, values| instance.set(references, values), v, table.cell(t, column)),
        }
    }

    fn numbers(&self, table: &Table, t: f64) -> Result<Vec<f64>> {
        let mut out = self.rest.clone();
        for (column, element) in &self.columns {
            match self.variable.variability {
                Variability::Discrete | Variability::Tunable => {
                    hold(table.cell(t, *column), *element, &mut out)
                }
                _ => table.write(t, *column, *element, &mut out),
            }
            let written = element.map_or(&out[..], |k| &out[k..=k]);
            if written.iter().any(|x| !x.is_finite()) {
                return Err(match written.len() {
                    1 => table.none(*column, t),
                    n => Error::WrongInput(format!(
                        "`{}`: the input is not {n} numbers beside t = {t} s",
                        self.variable.name
                    )),
                });
            }
        }
        Ok(out)
    }
}

/// Writes the numbers of a cell into a variable, or the one of an element: a discrete variable has nothing between two rows.
fn hold(cell: &str, element: Option<usize>, out: &mut [f64]) {
    let mut words = cell.split_whitespace().map(|word| word.parse().unwrap_or(f64::NAN));
    let place = element.map_or(0..out.len(), |k| k..k + 1);
    out[place].iter_mut().for_each(|x| *x = words.next().unwrap_or(f64::NAN));
    if words.next().is_some() {
        out.fill(f64::NAN);
    }
}

/// Sets a variable from text; arrays take their elements separated by spaces.
///
/// # Errors
/// [`Error::WrongInput`]: no values of its type, or not so many.
pub fn set_text(set: impl Fn(&[u32], Values) -> Result, v: &Variable, text: &str) -> Result {
    let wrong = || Error::WrongInput(format!("`{}` = {text}: it takes {}", v.name, limits::kind(v)));
    let words: Vec<&str> = text.split_whitespace().collect();
    macro_rules! parsed {
        ($variant:ident, $t:ty) => {{
            let values: Option<Vec<$t>> = words.iter().map(|w| w.parse().ok()).collect();
            let values = values.filter(|x| x.len() == v.len()).ok_or_else(wrong)?;
            set(&[v.reference], Values::$variant(&values))
        }};
    }
    match v.value_type {
        ValueType::F64 => parsed!(F64, f64),
        ValueType::F32 if words.iter().all(|w| w.parse().is_ok_and(f32::is_finite)) => parsed!(F32, f32),
        ValueType::I8 => parsed!(I8, i8),
        ValueType::I16 => parsed!(I16, i16),
        ValueType::I32 => parsed!(I32, i32),
        ValueType::I64 => parsed!(I64, i64),
        ValueType::U8 => parsed!(U8, u8),
        ValueType::U16 => parsed!(U16, u16),
        ValueType::U32 => parsed!(U32, u32),
        ValueType::U64 => parsed!(U64, u64),
        ValueType::Enumeration => {
            let items: Option<Vec<i64>> = match limits::named_item(v, text.trim()) {
                Some(item) => Some(vec![item]),
                None => words.iter().map(|w| w.parse().ok()).collect(),
            };
            let items =
                items.filter(|all| all.len() == v.len() && all.iter().all(|n| limits::is_item(v, *n)));
            let none = || Error::WrongInput(format!("`{}` = {text}: {}", v.name, limits::items(v)));
            set(&[v.reference], Values::Enumeration(&items.ok_or_else(none)?))
        }
        ValueType::Bool => {
            let value = match text {
                "true" | "1" => true,
                "false" | "0" => false,
                _ => return Err(wrong()),
            };
            set(&[v.reference], Values::Bool(&[value]))
        }
        ValueType::String => set(&[v.reference], Values::String(&[text.to_owned()])),
        ValueType::Binary => {
            let rows: Option<Vec<Vec<u8>>> = words.iter().map(|w| hexadecimal(w)).collect();
            let rows = match v.len() {
                // no bytes at all
                1 if words.is_empty() => vec![Vec::new()],
                count => rows.filter(|rows| rows.len() == count).ok_or_else(wrong)?,
            };
            set(&[v.reference], Values::Binary(&rows))
        }
        ValueType::F32 | ValueType::Clock => Err(wrong()),
    }
}
