//! Which runs a comparison takes: every combination, each checked before the first one starts.

use crate::arguments::{CompareArguments, RunArguments};
use crate::show::in_one_line;
use crate::{logger, soil_module, testbed};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use terraglue_compare::{CompareRow, Varied};
use terraglue_diagnostics::{Error, Result};
use terraglue_host::SearchPath;
use terraglue_scenario::{InputError, Scenario, did_you_mean, keys::STRATEGIES};
use terraglue_subsystem::Kind;

/// The reference of several steps runs with this part of the smallest: at half of it the reference's own error makes an
/// order of 2 look like 2.32, at an eighth like 2.02.
const REFERENCE_PART: f64 = 0.125;

/// The option that gives values of any key.
const VARY: &str = "--vary";

/// Begins the reason of a row that cannot run.
pub const REFUSED: &str = "refused: ";

/// One row before it ran.
pub struct Plan {
    /// Its row of the comparison.
    pub row: CompareRow,
    /// That of the row.
    pub name: String,
    pub scenario: Scenario,
    pub folder: PathBuf,
    /// Why it cannot run: a row of the comparison.
    pub refused: Option<Error>,
    /// Whether that is due to a value of `--vary`, which does not fit, and not to the strategy.
    pub is_wrong: bool,
}

impl Plan {
    /// Whether the iteration also runs from zero, to show what the estimate saves.
    pub fn has_cold_start(&self) -> bool {
        let row = &self.row;
        row.strategy == "iterative"
            && !row.is_reference
            && self.scenario.gluing.start == terraglue_scenario::StartChoice::Estimate
    }

    /// Steps of all its runs.
    pub fn steps(&self) -> u64 {
        let once = self.scenario.time.steps();
        if self.refused.is_some() {
            return 0;
        }
        if self.has_cold_start() { 2 * once } else { once }
    }
}

/// Values that are combined.
struct Wanted {
    strategies: Vec<String>,
    soils: Vec<String>,
    varied: Vec<Varied>,
    steps: Vec<Option<f64>>,
}

/// Strategy, soil, other keys and step of one run.
#[derive(Clone)]
struct Choice {
    strategy: String,
    soil: String,
    varied: Varied,
    step_s: Option<f64>,
    is_reference: bool,
}

/// All combinations in the order strategies × soils × other keys × steps, then the references, each checked.
pub fn plan(arguments: &CompareArguments) -> Result<Vec<Plan>> {
    let base = Scenario::load(&arguments.run.scenario.scenario, &arguments.run.sets())?;
    soil_module::check(&base, &arguments.run.scenario)?;
    let soil = soil_of(&base, &arguments.run)?;
    let wanted = wanted(arguments, &base, soil.as_ref())?;
    let mut choices = Vec::new();
    for strategy in &wanted.strategies {
        for (soil, varied) in wanted.things() {
            let (strategy, soil, varied) = (strategy.clone(), soil.clone(), varied.clone());
            let one = Choice { strategy, soil, varied, step_s: None, is_reference: false };
            choices.extend(wanted.steps.iter().map(|step_s| Choice { step_s: *step_s, ..one.clone() }));
        }
    }
    choices.extend(references(arguments, &wanted)?);
    let replaced = soil.filter(|_| !arguments.soils.is_empty());
    let one = |choice| planned(arguments, &base, replaced.as_ref(), choice, wanted.steps.len() > 1);
    let plans = choices.into_iter().map(one).collect::<Result<Vec<_>>>()?;
    if let Some(folder) = arguments.reference.as_deref().filter(|name| !STRATEGIES.contains(name)) {
        check_folder(&plans, Path::new(folder))?;
    }
    Ok(plans)
}

impl Wanted {
    /// All that is simulated: each soil with each choice of the other keys.
    fn things(&self) -> impl Iterator<Item = (&String, &Varied)> {
        self.soils.iter().flat_map(|soil| self.varied.iter().map(move |varied| (soil, varied)))
    }
}

/// Keys that have an option of their own.
const OWN_OPTIONS: [(&str, &str); 3] =
    [("gluing.strategy", "--strategies"), ("time.step_s", "--steps"), ("module", "--soils")];

/// The product of the values of all `--vary`.
fn varied(arguments: &CompareArguments, soil: Option<&Soil>) -> Result<Vec<Varied>> {
    let mut all = vec![Varied::new()];
    for (number, (key, values)) in arguments.vary.iter().enumerate() {
        let module = soil.map(|s| format!("{}.module", s.name));
        let own =
            OWN_OPTIONS.iter().find(|(k, _)| k == key || (*k == "module" && module.as_ref() == Some(key)));
        if let Some((_, option)) = own {
            let message = format!("--vary {key}: this key has an option of its own");
            return Err(
                InputError::plain(message, Some(format!("write {option} {}", values.join(",")))).into()
            );
        }
        if arguments.vary[..number].iter().any(|(k, _)| k == key) {
            let help = Some("write all of its values into one, separated by commas".into());
            return Err(InputError::plain(format!("--vary names `{key}` twice"), help).into());
        }
        let values = once("--vary", values, String::clone);
        let with = |before: &Varied, value: &String| {
            before.iter().cloned().chain([(key.clone(), value.clone())]).collect::<Varied>()
        };
        all = all.iter().flat_map(|before| values.iter().map(move |value| with(before, value))).collect();
    }
    Ok(all)
}

fn wanted(arguments: &CompareArguments, base: &Scenario, soil: Option<&Soil>) -> Result<Wanted> {
    for module in &arguments.soils {
        soil_module::require_soil(module, base, &arguments.run.scenario)?;
    }
    let strategies = match arguments.strategies.is_empty() {
        true if !arguments.vary.is_empty() => vec![base.gluing.strategy.name().to_owned()],
        true => STRATEGIES.iter().map(|s| (*s).to_owned()).collect(),
        false => once("--strategies", &arguments.strategies, String::clone),
    };
    if let Some(unknown) = strategies.iter().find(|s| !STRATEGIES.contains(&s.as_str())) {
        let help = did_you_mean(unknown, STRATEGIES.iter().copied());
        return Err(InputError::plain(format!("unknown strategy `{unknown}` in --strategies"), help).into());
    }
    let soils = match (soil, arguments.soils.is_empty()) {
        (Some(soil), true) => vec![soil.module.clone()],
        (Some(_), false) => once("--soils", &arguments.soils, String::clone),
        (None, true) => vec![String::new()],
        (None, false) => {
            let help = "leave --soils out, or give the scenario a soil".to_owned();
            return Err(InputError::plain("--soils: the scenario has no soil", Some(help)).into());
        }
    };
    let steps: Vec<Option<f64>> = match arguments.steps.is_empty() {
        true => vec![None],
        false => once("--steps", &arguments.steps, f64::to_string).into_iter().map(Some).collect(),
    };
    Ok(Wanted { strategies, soils, varied: varied(arguments, soil)?, steps })
}

/// Every value once, in the order given; a note says which came again.
fn once<T: Clone>(option: &str, given: &[T], name: impl Fn(&T) -> String) -> Vec<T> {
    let mut seen: Vec<String> = Vec::new();
    let mut all = Vec::new();
    for value in given {
        let name = name(value);
        if seen.contains(&name) {
            eprintln!("note: {option} names `{name}` more than once: it runs once");
        } else {
            seen.push(name);
            all.push(value.clone());
        }
    }
    all
}

/// The references that run beside the others; none where the reference is an earlier run.
fn references(arguments: &CompareArguments, wanted: &Wanted) -> Result<Vec<Choice>> {
    let given = arguments.reference_step;
    let Some(name) = &arguments.reference else { return Ok(Vec::new()) };
    if STRATEGIES.contains(&name.as_str()) {
        // of several steps the error is that against the step, so the reference must be finer than all of them
        let several = wanted.steps.len() > 1;
        let finest = wanted.steps.iter().copied().flatten().reduce(f64::min);
        let step_s = given.or(finest.map(|h| if several { REFERENCE_PART * h } else { h }));
        let one = |(soil, varied): (&String, &Varied)| Choice {
            strategy: name.clone(),
            soil: soil.clone(),
            varied: varied.clone(),
            step_s,
            is_reference: true,
        };
        return Ok(wanted.things().map(one).collect());
    }
    if !Path::new(name).exists() {
        let help = did_you_mean(name, STRATEGIES.iter().copied());
        let message = format!("--reference: `{name}` is no strategy and no folder or recording of a run");
        return Err(InputError::plain(message, help).into());
    }
    match given {
        Some(_) => {
            let help = "leave --reference-step out, or name a strategy with --reference".to_owned();
            Err(InputError::plain("--reference-step: an earlier run has its own step", Some(help)).into())
        }
        None => Ok(Vec::new()),
    }
}

fn planned(
    arguments: &CompareArguments,
    base: &Scenario,
    soil: Option<&Soil>,
    choice: Choice,
    name_step: bool,
) -> Result<Plan> {
    let mut sets = arguments.run.sets();
    let mut options = vec!["--set"; sets.len()];
    let mut add = |option, key: String, value| {
        sets.push((key, value));
        options.push(option);
    };
    add("--strategies", "gluing.strategy".into(), choice.strategy.clone());
    if let Some(step) = choice.step_s {
        add("--steps", "time.step_s".into(), format!("{step:?}"));
    }
    if let Some(soil) = soil {
        add("--soils", format!("{}.module", soil.name), choice.soil.clone());
    }
    choice.varied.iter().cloned().for_each(|(key, value)| add(VARY, key, value));
    let mut row = CompareRow {
        strategy: choice.strategy,
        soil: choice.soil,
        varied: choice.varied,
        is_reference: choice.is_reference,
        // without a step chosen it is the scenario's own, which is in no name
        step_s: choice.step_s.unwrap_or_default(),
        name_step: name_step && choice.step_s.is_some(),
        ..CompareRow::default()
    };
    let name = row.name();
    let _said = logger::of_run(&name);
    let loaded = Scenario::load_by(&arguments.run.scenario.scenario, &sets, &options);
    let (scenario, refused) = match loaded {
        Ok(scenario) => (scenario, None),
        // it does not run, so that any scenario will do
        Err(error) if !row.varied.is_empty() => (base.clone(), Some(error.into())),
        Err(error) => return Err(error.into()),
    };
    row.step_s = choice.step_s.unwrap_or(scenario.time.step_s);
    let is_wrong = refused.is_some();
    Ok(Plan { row, name, scenario, folder: PathBuf::new(), refused, is_wrong })
}

/// An earlier run must be one of the same thing as every row; rows that differ in strategy and step only are alike.
fn check_folder(plans: &[Plan], folder: &Path) -> Result {
    let same = |a: &Plan, b: &Plan| a.row.soil == b.row.soil && a.row.varied == b.row.varied;
    let first = |(k, plan): &(usize, &Plan)| !plans[..*k].iter().any(|p| same(p, plan));
    let mut firsts = plans.iter().enumerate().filter(|(_, plan)| plan.refused.is_none()).filter(first);
    firsts.try_for_each(|(_, plan)| terraglue_compare::check_reference(&plan.scenario, folder))
}

/// Wrong input shows before the first run starts; a strategy that cannot glue the scenario, or a value of `--vary` that does
/// not fit, is a row that says so, as long as another one can run. A reference must run wherever it is wanted.
pub fn refuse(plans: &mut [Plan], arguments: &RunArguments, cancel: &Arc<AtomicBool>) -> Result {
    for plan in plans.iter_mut().filter(|p| p.refused.is_none()) {
        let _said = logger::of_run(&plan.name);
        plan.refused = testbed::build(&plan.scenario, &testbed::options(arguments, cancel)).err();
    }
    let wrong: Vec<bool> = plans.iter().map(|plan| is_wrong(plan, plans)).collect();
    plans.iter_mut().zip(wrong).for_each(|(plan, wrong)| plan.is_wrong = wrong);
    let of_rows = |plan: &&mut Plan| !plan.row.is_reference;
    if plans.iter_mut().filter(of_rows).all(|plan| plan.refused.is_some()) {
        let first = plans.iter_mut().filter(of_rows).find_map(|plan| plan.refused.take());
        return first.map_or(Ok(()), Err);
    }
    let mut references = plans.iter_mut().filter(|plan| plan.row.is_reference && !plan.is_wrong);
    match references.find_map(|plan| Some((plan.refused.take()?, plan))) {
        Some((error, plan)) => Err(refused_reference(plan, error)),
        None => Ok(()),
    }
}

/// Whether a row is refused for a value of `--vary`: the error points there, or the same row runs with another value.
fn is_wrong(plan: &Plan, all: &[Plan]) -> bool {
    let Some(error) = &plan.refused else { return false };
    let points = matches!(error, Error::Input(input) if input.source_code.name() == VARY);
    let (a, step_s) = (&plan.row, plan.row.step_s);
    let same = |b: &CompareRow| {
        (&b.strategy, &b.soil, b.is_reference) == (&a.strategy, &a.soil, a.is_reference) && b.step_s == step_s
    };
    let runs_otherwise = || all.iter().any(|other| other.refused.is_none() && same(&other.row));
    plan.is_wrong || points || !a.varied.is_empty() && runs_otherwise()
}

/// Text of the table for a row that cannot run.
pub fn reason(error: &Error) -> String {
    format!("{REFUSED}{}", in_one_line(error))
}

fn refused_reference(plan: &Plan, error: Error) -> Error {
    let help = match &error {
        Error::Input(input) => input.help.clone(),
        _ => None,
    };
    InputError::plain(format!("--reference: `{}` cannot run: {error}", plan.row.strategy), help).into()
}

/// Name and module of the only subsystem of kind soil.
struct Soil {
    name: String,
    module: String,
}

fn soil_of(scenario: &Scenario, arguments: &RunArguments) -> Result<Option<Soil>> {
    let search = SearchPath::standard(&arguments.scenario.module_path, &scenario.folder);
    let mut soils = Vec::new();
    for spec in &scenario.subsystems {
        let module = terraglue_fmu::library().find(&spec.module, &search, &scenario.folder).map_err(|e| {
            let help = e.nearest().map(|n| format!("did you mean `{n}`?"));
            scenario.source.error_at_value(&[&spec.name, "module"], e.to_string(), help)
        })?;
        if module.schema().kind == Kind::Soil {
            soils.push(Soil { name: spec.name.clone(), module: spec.module.clone() });
        }
    }
    if soils.len() > 1 {
        let message = "the scenario has several soils: it is not clear which one --soils replaces";
        let help = "take one of them out: the terrain can belong to one only".to_owned();
        return Err(InputError::plain(message, Some(help)).into());
    }
    Ok(soils.pop())
}
