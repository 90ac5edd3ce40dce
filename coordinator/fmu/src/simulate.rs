//! One FMU alone: from its start to its end in equal steps, its outputs as rows of a table.

use super::adapter::opening::other_length;
use super::array_starts::ArrayStarts;
use super::inputs::{self, Inputs, set_text};
use super::limits;
use super::map::{effect, element_name, find};
use super::settings::OnNan;
use std::cell::Cell;
use std::sync::Arc;
use terraglue_fmi::description::{Causality, Variable};
use terraglue_fmi::instance::{Sink, Trace};
use terraglue_fmi::{Advance, Error, Fmu, FmuInstance, FmuState, InstanceOptions, ModelDescription, Result};
use terraglue_subsystem::{Effect, ValueType, ValuesMut};

pub use super::table::{InputRow, Table};

/// How an FMU is run.
#[derive(Default)]
pub struct Settings {
    /// Start values by name, as text.
    pub start: Vec<(String, String)>,
    /// s; none: that of the FMU.
    pub start_time: Option<f64>,
    /// s.
    pub stop: Option<f64>,
    /// s.
    pub step: Option<f64>,
    /// Relative.
    pub tolerance: Option<f64>,
    /// Names to write; empty: all outputs.
    pub outputs: Vec<String>,
    /// Whether events are handled in event mode.
    pub event_mode: bool,
    /// Inputs over time.
    pub input: Arc<Table>,
    /// Whether inputs are held over each step, also of FMUs that follow them within.
    pub hold_inputs: bool,
    /// Whether the state of the FMU is not saved before a step, so that none is made again in halves.
    pub no_rollback: bool,
    /// Categories of the log that are switched on.
    pub log_categories: Vec<String>,
    /// Whether defects of the description are errors.
    pub strict: bool,
    /// Takes a line for each call of the FMU.
    pub trace: Option<Trace>,
    /// Reaction to a value that is no number.
    pub on_nan: OnNan,
}

/// Takes a line of a table.
pub type Line<'a> = &'a mut dyn FnMut(&str) -> Result;

/// Where the tables of a run go, line by line, the header first.
pub struct Tables<'a> {
    /// Outputs at communication points.
    pub rows: Line<'a>,
    /// Outputs that the FMU shows at intermediate times, of the steps that stand.
    pub intermediate: Option<Line<'a>>,
    /// Hands all lines to the system: called before the FMU is ended.
    pub keep: &'a dyn Fn() -> Result,
}

/// Share of a step that a number of steps may be off a whole one: it was typed with so many digits.
const NEARLY_WHOLE: f64 = 1e-5;
/// Share of a step that is rounding.
const ROUNDED: f64 = 1e-9;
/// Longest run, in steps.
const STEPS: f64 = 1e9;

/// Whether the times of a run and the names in its settings are those of the FMU, before any of its code runs and any file
/// is made; `between`: outputs are wanted at intermediate times.
///
/// # Errors
/// [`Error::WrongInput`]: what of the settings does not fit.
pub fn check(fmu: &Fmu, settings: &Settings, between: bool) -> Result {
    let description = fmu.description();
    if let (true, Some(first)) = (settings.strict, description.warnings().first()) {
        return Err(Error::WrongInput(format!(
            "its description has defects, which --strict refuses: {first}"
        )));
    }
    plan(fmu, settings)?;
    columns(description, &settings.outputs, settings.event_mode)?;
    if between {
        shown_between(description, &settings.outputs)?;
    }
    settings.start.iter().try_for_each(|(name, _)| can_start(description, name))
}

/// Refuses a start value of a variable that has none to be set. Elements are looked for where structural parameters have given arrays
/// their sizes.
fn can_start(description: &ModelDescription, name: &str) -> Result {
    let owner = name.split_once('[').map_or(name, |(owner, _)| owner);
    let array = |v: &&Variable| v.name == owner && !v.dimensions.is_empty();
    let v = match description.variables.iter().find(array) {
        Some(v) => v,
        None => find(description, name)?,
    };
    match effect(v) {
        Effect::ReadOnly => Err(Error::WrongInput(format!(
            "`{name}` cannot be set: start values are those of parameters, inputs, and outputs and local variables with initial = \"exact\""
        ))),
        _ => Ok(()),
    }
}

/// Runs an FMU and writes its tables. Answers when the FMU itself asked for the end of the run before its time, s.
///
/// # Errors
/// Errors of the FMU or its input, with the time.
pub fn run(fmu: &Arc<Fmu>, settings: &Settings, sink: Sink, tables: &mut Tables) -> Result<Option<f64>> {
    let row = &mut *tables.rows;
    let plan = plan(fmu, settings)?;
    let Plan { start, stop, steps, .. } = plan;
    let intermediate = match &tables.intermediate {
        Some(_) => shown_between(fmu.description(), &settings.outputs)?,
        None => Vec::new(),
    };
    let mut instance = instance(fmu, settings, sink, intermediate.clone())?;
    configure(&mut instance, &settings.start)?;
    let description = instance.description().clone();
    let columns = columns(&description, &settings.outputs, settings.event_mode)?;
    let inputs = initialize(&mut instance, settings, (start, stop))?;
    // with event mode a last column says how many events were handled since the row before
    let marked = |text: String, events: u32| match settings.event_mode {
        true if text.starts_with("time") => text + ",events",
        true => format!("{text},{events}"),
        false => text,
    };
    if let Some(write) = &mut tables.intermediate {
        let all = self::columns(&description, &intermediate, false)?;
        write(&(header(&all) + ",step_finished"))?;
    }
    let variable = description.capabilities.variable_step;
    note_lengths(&instance, &plan);
    let values = Row { columns: &columns, on_nan: settings.on_nan, warned: Cell::new(false) };
    row(&marked(header(&columns), 0))?;
    row(&marked(values.at(&instance, start)?, 0))?;
    let mut before =
        Before { state: FmuState::default(), saves: description.capabilities.state && !settings.no_rollback };
    let mut ended = None;
    let outcome = (0..steps as u64).try_for_each(|k| {
        if ended.is_some() {
            return Ok(());
        }
        let (from, to, nominal) = plan.interval(k, variable);
        let (t, end) = (start + from, start + to);
        let at = |e: Error| named(e, t);
        inputs.set(&mut instance, t).map_err(at)?;
        instance.clocks_mut().forget_ticks();
        let events;
        let step = halving(
            &mut instance,
            &inputs,
            &mut before,
            (start, from, to, nominal),
            &mut tables.intermediate,
        );
        (ended, events) = step.map_err(|e| at(inputs.way_out(e, end)))?;
        let now = ended.unwrap_or(end);
        row(&marked(values.at(&instance, now).map_err(|e| named(e, now))?, events))
    });
    (tables.keep)()?;
    drop(instance.release(&mut before.state));
    outcome?;
    instance.terminate()?;
    Ok(ended)
}

/// An instance that shows these outputs at intermediate times.
fn instance(
    fmu: &Arc<Fmu>,
    settings: &Settings,
    sink: Sink,
    intermediate: Vec<String>,
) -> Result<FmuInstance> {
    let followed = match settings.hold_inputs {
        true => Vec::new(),
        false => inputs::followed(fmu.description(), &settings.input),
    };
    let options = InstanceOptions {
        event_mode: settings.event_mode,
        intermediate,
        followed,
        log_categories: settings.log_categories.clone(),
        trace: settings.trace.clone(),
        ..InstanceOptions::new("unit", sink)
    };
    FmuInstance::instantiate(fmu, options)
}

/// The steps of a run.
struct Plan {
    start: f64,
    stop: f64,
    step: f64,
    steps: f64,
}

impl Plan {
    /// Step k: from when to when after the start, on the grid of a scenario, whose FMUs make the same steps, and its length by the
    /// plan. The last one ends at the stop, where the FMU takes steps of any length.
    fn interval(&self, k: u64, variable: bool) -> (f64, f64, f64) {
        let (from, to) = (k as f64 * self.step, (k + 1) as f64 * self.step);
        let length = self.stop - self.start;
        match variable && k + 1 == self.steps as u64 && (to - length).abs() > ROUNDED * self.step {
            true => (from, length, length - from),
            false => (from, to, self.step),
        }
    }

    /// Note on a run that ends before its time.
    fn early(&self) -> String {
        let (end, stop) = (self.start + self.steps * self.step, self.stop);
        format!("the run ends at t = {end} s, before {stop} s: the FMU takes steps of one length only")
    }
}

/// From when to when, and in how many steps: as the settings say, else the FMU.
fn plan(fmu: &Fmu, settings: &Settings) -> Result<Plan> {
    let experiment = fmu.description().experiment;
    let start = settings.start_time.or(experiment.start).unwrap_or(0.0);
    let stop = settings.stop.or(experiment.stop).unwrap_or(start + 1.0);
    let step = settings.step.or(experiment.step).or(fmu.description().capabilities.fixed_step);
    let step = step.unwrap_or((stop - start) / 500.0);
    let exact = (stop - start) / step;
    let whole = (exact - exact.round()).abs() <= NEARLY_WHOLE;
    let variable = fmu.description().capabilities.variable_step;
    let steps = if whole {
        exact.round()
    } else if variable {
        exact.ceil()
    } else {
        exact.floor()
    };
    if !(step > 0.0 && (1.0..=STEPS).contains(&steps)) {
        return Err(Error::WrongInput(no_steps(start, stop, step)));
    }
    Ok(Plan { start, stop, step, steps })
}

/// Sets start values but those of structural parameters.
fn set_starts(instance: &FmuInstance, start: &[(String, String)]) -> Result {
    let description = instance.description().clone();
    let mut elements = ArrayStarts::default();
    for (name, text) in start {
        let (v, element) = inputs::place(&description, name)?;
        let Some(k) = element else {
            set_start(instance, v, text)?;
            continue;
        };
        if start.iter().any(|(other, _)| *other == v.name) {
            let message = format!("`{}` is given whole and by element: `{name}`", v.name);
            return Err(Error::WrongInput(message));
        }
        let wrong = || Error::WrongInput(format!("`{name}` = {text}: it takes a number"));
        let number: f64 = text.trim().parse().map_err(|_| wrong())?;
        limits::check(v, name, &[number])?;
        elements.give(v.reference, (k, v.len()), number);
    }
    elements.set(instance)
}

/// Sets the start value of a whole variable; structural parameters have theirs already.
fn set_start(instance: &FmuInstance, v: &Variable, text: &str) -> Result {
    if v.causality == Causality::StructuralParameter {
        return Ok(());
    }
    if !matches!(v.value_type, ValueType::String | ValueType::Enumeration) {
        let numbers = text.split_whitespace().filter_map(|word| word.parse().ok());
        limits::check(v, &v.name, &numbers.collect::<Vec<f64>>())?;
    }
    set_text(|references, values| instance.set(references, values), v, text)
}

/// Start values and the initialisation from a start to a stop; the inputs over time, which are set.
fn initialize(instance: &mut FmuInstance, settings: &Settings, (start, stop): (f64, f64)) -> Result<Inputs> {
    let description = instance.description().clone();
    set_starts(instance, &settings.start)?;
    let tolerance = settings.tolerance.or(description.experiment.tolerance);
    instance.enter_initialization(start, Some(stop), tolerance)?;
    let inputs = Inputs::find(instance, &settings.input, settings.hold_inputs)?;
    inputs.set(instance, start)?;
    instance.exit_initialization()?;
    inputs.follow(instance)?;
    Ok(inputs)
}

/// Notes where an FMU with steps of one length ends before the run, or gets other steps than its description names.
fn note_lengths(instance: &FmuInstance, plan: &Plan) {
    let (description, step) = (instance.description(), plan.step);
    let ends_early = plan.stop - plan.start - plan.steps * step > ROUNDED * step;
    if !description.capabilities.variable_step && ends_early {
        instance.note(&plan.early());
    }
    if let Some(named) = other_length(description, step) {
        instance.note(&format!(
            "the FMU makes steps of one length, and its description says {named} s; it is stepped by {step} s: --step {named} fits"
        ));
    }
}

/// The state before a step.
struct Before {
    state: FmuState,
    /// Whether the FMU can save it.
    saves: bool,
}

impl Before {
    /// Saves it, where that is possible: it is needed for steps that the FMU discards only.
    fn save(&mut self, instance: &FmuInstance) -> Result {
        match instance.save(&mut self.state) {
            Err(Error::Refused(why)) => {
                instance.note(&format!("{why}; a step that it discards cannot be halved"));
                self.saves = false;
                Ok(())
            }
            other => other,
        }
    }
}

/// A step between two times after the start, in halves where the FMU discards it and can go back, as a scenario halves it. Answers
/// when the FMU asked for the end, and how many events there were.
fn halving(
    instance: &mut FmuInstance,
    inputs: &Inputs,
    before: &mut Before,
    (start, from, end, nominal): (f64, f64, f64, f64),
    between: &mut Option<Line>,
) -> Result<(Option<f64>, u32)> {
    let variable_step = instance.description().capabilities.variable_step;
    let (mut t, mut longest, mut halvings, mut events) = (from, nominal, 0, 0);
    while end - t > 1e-6 * nominal {
        if before.saves {
            before.save(instance)?;
        }
        let left = end - t;
        let h = if left - longest <= ROUNDED * nominal { left } else { longest };
        let next = if h == left { end } else { t + h };
        inputs.begin_part(instance, (start + t, start + next), t == from && halvings == 0)?;
        let made = instance.do_step(Advance { t: start + t, h, for_good: true });
        if let (Ok(_), Some(write)) = (&made, &mut *between) {
            for row in instance.take_intermediate() {
                let values: String = row.values.iter().map(|x| format!(",{}", exact(*x))).collect();
                write(&format!("{}{values},{}", exact(row.t), u8::from(row.finished)))?;
            }
        }
        if made.is_ok() {
            instance.clocks_mut().forget_triggers();
        }
        match made {
            Ok(done) if done.terminate => return Ok((Some(done.reached), events + done.events)),
            Ok(done) => {
                events += done.events;
                t = next;
            }
            Err(Error::Discard { .. }) if before.saves && variable_step && halvings < 10 => {
                instance.restore(&before.state)?;
                (longest, halvings) = (0.5 * longest.min(left), halvings + 1);
            }
            Err(error) => return Err(error),
        }
    }
    Ok((None, events))
}

fn named(error: Error, t: f64) -> Error {
    let message = format!("at t = {t} s: {error}");
    match error {
        Error::WrongInput(_) => Error::WrongInput(message),
        _ => Error::Refused(message),
    }
}

/// Sets the structural parameters among the start values.
fn configure(instance: &mut FmuInstance, start: &[(String, String)]) -> Result {
    let mut values: Vec<(&str, i128)> = Vec::new();
    for (name, text) in start {
        let structural = |v: &Variable| v.name == *name && v.causality == Causality::StructuralParameter;
        if !instance.description().variables.iter().any(structural) {
            continue;
        }
        let wrong =
            || Error::WrongInput(format!("`{name}` = {text}: a structural parameter takes a whole number"));
        values.push((name, text.trim().parse().map_err(|_| wrong())?));
    }
    instance.configure(&values)
}

fn columns<'a>(
    description: &'a ModelDescription,
    names: &[String],
    event_mode: bool,
) -> Result<Vec<&'a Variable>> {
    if !names.is_empty() {
        return names.iter().map(|n| find(description, n)).collect();
    }
    let output =
        |v: &&Variable| v.causality == Causality::Output && (event_mode || v.value_type != ValueType::Clock);
    Ok(description.variables.iter().filter(output).collect())
}

/// Those of the outputs that can be read at intermediate times.
fn shown_between(description: &ModelDescription, names: &[String]) -> Result<Vec<String>> {
    let shown = |v: &&Variable| v.intermediate && v.value_type == ValueType::F64;
    let all: Vec<String> =
        columns(description, names, false)?.into_iter().filter(shown).map(|v| v.name.clone()).collect();
    match all.is_empty() {
        false => Ok(all),
        true => Err(Error::WrongInput(
            "none of the outputs is a Float64 with intermediateUpdate = \"true\", which can be read at intermediate times"
                .into(),
        )),
    }
}

fn header(columns: &[&Variable]) -> String {
    let names = columns.iter().flat_map(|v| (0..v.len()).map(|k| quoted(&element_name(v, k))));
    std::iter::once("time".to_owned()).chain(names).collect::<Vec<_>>().join(",")
}

fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}

/// A number with as many digits as reading it needs to give the same bits.
fn exact(x: f64) -> String {
    short(x, x.abs())
}

/// The shortest digits of a number of this size, with an exponent where it is very small or large.
fn short<T: std::fmt::Display + std::fmt::LowerExp>(x: T, size: f64) -> String {
    match size == 0.0 || (1e-5..1e16).contains(&size) {
        true => x.to_string(),
        false => format!("{x:e}"),
    }
}

/// Makes the lines of the table.
struct Row<'a> {
    columns: &'a [&'a Variable],
    on_nan: OnNan,
    /// Whether a value that is no number was told.
    warned: Cell<bool>,
}

impl Row<'_> {
    /// The line of t; numbers are written so that reading them gives the same bits.
    fn at(&self, instance: &FmuInstance, t: f64) -> Result<String> {
        let mut text = exact(t);
        for v in self.columns {
            for value in read(instance, v, |wrong| self.not_finite(instance, v, t, wrong))? {
                text.push(',');
                text.push_str(&quoted(&value));
            }
        }
        Ok(text)
    }

    #[cold]
    fn not_finite(&self, instance: &FmuInstance, v: &Variable, t: f64, wrong: f64) -> Result {
        let text = format!("the variable `{}` is {wrong}", v.name);
        match self.on_nan {
            OnNan::Stop => return Err(Error::Refused(format!("{text}; --on-nan warn lets the run go on"))),
            OnNan::Warn if !self.warned.replace(true) => instance.note(&format!("at t = {t} s: {text}")),
            OnNan::Warn => {}
        }
        Ok(())
    }
}

/// The values of a variable as text; `not_finite` decides about one that is no number.
fn read(instance: &FmuInstance, v: &Variable, not_finite: impl Fn(f64) -> Result) -> Result<Vec<String>> {
    macro_rules! values {
        ($variant:ident, $zero:expr, $show:expr) => {{
            let mut out = vec![$zero; v.len()];
            instance.get(&[v.reference], ValuesMut::$variant(&mut out))?;
            Ok(out.iter().map($show).collect())
        }};
    }
    macro_rules! numbers {
        ($variant:ident, $zero:expr, $show:expr) => {{
            let mut out = vec![$zero; v.len()];
            instance.get(&[v.reference], ValuesMut::$variant(&mut out))?;
            if let Some(wrong) = out.iter().find(|x| !x.is_finite()) {
                not_finite((*wrong).into())?;
            }
            Ok(out.iter().map($show).collect())
        }};
    }
    match v.value_type {
        ValueType::F64 => numbers!(F64, f64::NAN, |x: &f64| exact(*x)),
        ValueType::F32 => numbers!(F32, f32::NAN, |x: &f32| short(*x, x.abs() as f64)),
        ValueType::I8 => values!(I8, 0, |x: &i8| x.to_string()),
        ValueType::I16 => values!(I16, 0, |x: &i16| x.to_string()),
        ValueType::I32 => values!(I32, 0, |x: &i32| x.to_string()),
        ValueType::I64 => values!(I64, 0, |x: &i64| x.to_string()),
        ValueType::U8 => values!(U8, 0, |x: &u8| x.to_string()),
        ValueType::U16 => values!(U16, 0, |x: &u16| x.to_string()),
        ValueType::U32 => values!(U32, 0, |x: &u32| x.to_string()),
        ValueType::U64 => values!(U64, 0, |x: &u64| x.to_string()),
        ValueType::Bool => values!(Bool, false, |x: &bool| u8::from(*x).to_string()),
        ValueType::Enumeration => values!(Enumeration, 0, |x: &i64| x.to_string()),
        ValueType::String => values!(String, String::new(), |x: &String| x.clone()),
        ValueType::Binary => values!(Binary, Vec::new(), |x: &Vec<u8>| {
            x.iter().map(|b| format!("{b:02x}")).collect::<String>()
        }),
        ValueType::Clock => Ok(vec![u8::from(instance.clocks().ticks(v.reference)).to_string()]),
    }
}

/// Why a run from `start` to `stop` in steps of `step`, all in s, is none.
fn no_steps(start: f64, stop: f64, step: f64) -> String {
    match () {
        () if !(stop.is_finite() && stop > start) => {
            format!("the run would end at {stop} s, and begins at {start} s: give a later --stop")
        }
        () if !(step.is_finite() && step > 0.0) => {
            format!("a step of {step} s is none: --step takes a number above 0")
        }
        () if stop - start < step => {
            format!(
                "the step of {step} s is longer than the run from {start} s to {stop} s: give a shorter --step"
            )
        }
        () => format!(
            "from {start} s to {stop} s there are {:.3e} steps of {step:?} s, at most {STEPS:.0e} are run: give a longer --step",
            (stop - start) / step
        ),
    }
}
