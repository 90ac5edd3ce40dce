//! Warnings about parts of a scenario that are valid but have no effect; never an error.

use super::choices::{FormChoice, JacobianChoice, LevelChoice, Relaxation, StartChoice, StrategyKind};
use super::isolation::IsolationSpec;
use super::model::{GluingSpec, Region, Scenario, SubsystemSpec, Trigger};
use super::parameters::check_own_table;
use super::source::Source;
use serde_json::{Map, Value};
use terraglue_diagnostics::InputError;
use terraglue_subsystem::{Advice, Schema};

/// Events and faults after the end of the run.
pub fn late_events(scenario: &Scenario) -> Vec<String> {
    let end = scenario.time.duration_s;
    let events = scenario.events.iter().map(|e| ("an event", &e.trigger, e.entry));
    let faults = scenario.faults.iter().map(|f| ("a fault", &f.start, f.entry));
    let late = events.chain(faults).filter_map(|(what, trigger, entry)| match trigger {
        Trigger::At(at) if *at > end => Some((what, at, entry)),
        _ => None,
    });
    late.map(|(what, at, entry)| {
        let message = format!("{what} at {at} s never happens: the run ends at {end} s");
        line_of(&scenario.source.error_in(entry, &[], message, None))
    })
    .collect()
}

/// Steps of a run beyond which a warning is given, and beyond which it is refused.
const MANY_STEPS: f64 = 1e8;
/// See [`MANY_STEPS`]: at a microsecond a step, which no subsystem needs less than, a quarter of an hour.
pub(super) const MOST_STEPS: f64 = 1e9;

/// A run of very many steps.
pub fn many_steps(scenario: &Scenario) -> Option<String> {
    let time = &scenario.time;
    let steps = time.duration_s / time.step_s;
    let message = || {
        format!(
            "the run has {steps:.3e} steps of {:?} s; at 10 µs of wall time each it takes {:.1} hours",
            time.step_s,
            steps * 1e-5 / 3600.0
        )
    };
    (steps > MANY_STEPS)
        .then(|| line_of(&scenario.source.error_at_value(&["time", "step_s"], message(), None)))
}

/// Keys of `[gluing]` that only some strategies read, and whether each differs from its default.
type Reader = (&'static str, fn(&GluingSpec) -> bool, &'static [StrategyKind]);
const READERS: [Reader; 6] = [
    ("form", |g| g.form != FormChoice::Auto, &[StrategyKind::Iterative, StrategyKind::CooperativeCompliant]),
    ("start", |g| g.start != StartChoice::Estimate, &[StrategyKind::Iterative]),
    ("relaxation", |g| g.relaxation != Relaxation::Anderson, &[StrategyKind::Relaxed]),
    (
        "jacobian",
        |g| g.jacobian != JacobianChoice::Analytic,
        &[StrategyKind::Iterative, StrategyKind::SemiImplicit],
    ),
    ("level", |g| g.level != LevelChoice::Position, &[StrategyKind::Iterative, StrategyKind::SemiImplicit]),
    ("stabilisation", |g| g.stabilisation != 0.0, &[StrategyKind::Iterative, StrategyKind::SemiImplicit]),
];

/// Keys of `[gluing]` that none of the scenario's strategies reads.
pub fn unread_keys(scenario: &Scenario) -> Vec<String> {
    let (gluing, glue) = (&scenario.gluing, &scenario.glue);
    let own = glue.iter().filter_map(|g| g.strategy);
    let used: Vec<StrategyKind> = own.chain([gluing.strategy]).collect();
    let warn = |key: &str, why: String| {
        line_of(&scenario.source.error_at_value(
            &["gluing", key],
            format!("`{key}` has no effect: {why}"),
            None,
        ))
    };
    let unread = READERS.iter().filter(|(_, said, by)| said(gluing) && !used.iter().any(|u| by.contains(u)));
    let mut all: Vec<String> = unread
        .map(|(key, _, by)| {
            let names: Vec<&str> = by.iter().map(|kind| kind.name()).collect();
            warn(key, format!("`{}` does not read it ({} does)", gluing.strategy, names.join(", ")))
        })
        .collect();
    if gluing.stabilisation != 0.0 && gluing.level == LevelChoice::Position {
        all.push(warn("stabilisation", "at position level nothing drifts that it could take out".into()));
    }
    if gluing.step_min_s.is_some() && gluing.energy_residual_j.is_none() {
        all.push(warn("step_min_s", "all steps are `time.step_s` long without `energy_residual_j`".into()));
    }
    all
}

/// Limits of a process that a subsystem does not have: it runs in that of the program.
pub fn idle_limits(scenario: &Scenario, spec: &SubsystemSpec, in_python: bool) -> Vec<String> {
    let (given, usual) = (spec.isolation, IsolationSpec::default());
    // a law in Python has a process within the soil
    if spec.isolate || in_python || spec.parameters.contains_key("law") {
        return Vec::new();
    }
    let keys = [
        ("load_timeout_s", given.load_timeout_s != usual.load_timeout_s),
        ("step_timeout_s", given.step_timeout_s != usual.step_timeout_s),
        ("memory_mb", given.memory_bytes != usual.memory_bytes),
    ];
    let said = |(key, is_given): (&str, bool)| {
        let name = spec.name.as_str();
        let message =
            format!("`{key}` has no effect: `{name}` has no process of its own without `isolate = true`");
        is_given.then(|| line_of(&scenario.source.error_at_value(&[name, key], message, None)))
    };
    keys.into_iter().filter_map(said).collect()
}

/// Keys of a module that is not chosen, in its own table `[NAME.MODULE]`: what is wrong with them shows when it is.
pub fn unchosen(schema: &Schema, spec: &SubsystemSpec, source: &Source) -> Option<String> {
    let wrong = check_own_table(schema, spec, source).err()?;
    let module = &spec.module;
    Some(format!("{} (no effect now: `{}` has `module = \"{module}\"`)", line_of(&wrong), spec.name))
}

/// Advice of a kind of module on its parameters, at the places of the keys.
pub fn of_module(scenario: &Scenario, spec: &SubsystemSpec, advice: Vec<Advice>) -> Vec<String> {
    let said = |Advice { key, message }: Advice| {
        line_of(&scenario.source.error_at_value(&[&spec.name, key], message, None))
    };
    advice.into_iter().map(said).collect()
}

/// The regions of a subsystem's mask: whose soil each is as messages say it, and its numbers.
pub fn regions(spec: &SubsystemSpec) -> Vec<(String, Map<String, Value>)> {
    let of =
        |region: &Region| (format!(" of label {} ({})", region.label, region.soil), region.numbers.clone());
    spec.regions.iter().map(of).collect()
}

/// Names of one's own in `[SOIL.law.parameters]` that no text of the law uses, or that hide a number of the soil.
pub fn law_parameters(schema: &Schema, spec: &SubsystemSpec, source: &Source) -> Vec<String> {
    let Some(law) = spec.parameters.get("law").and_then(|law| law.as_object()) else { return Vec::new() };
    let own = law.get("parameters").and_then(|own| own.as_object());
    let texts: Vec<&str> = ["pressure", "shear"].iter().filter_map(|k| law.get(*k)?.as_str()).collect();
    if texts.is_empty() {
        return Vec::new();
    }
    let uses = |text: &str, name: &str| {
        text.split(|c: char| !c.is_alphanumeric() && c != '_').any(|word| word == name)
    };
    let warn = |name: &str, why: String| {
        line_of(&source.error_at_value(&[&spec.name, "law", "parameters", name], why, None))
    };
    let said = |name: &String| {
        // The exponents of a unit may name a pure number: "820e3 N/m^(n+2)".
        let units = own.into_iter().flatten().filter(|(other, _)| *other != name);
        let mut all = texts.iter().copied().chain(units.filter_map(|(_, value)| value.as_str()));
        if !all.any(|text| uses(text, name)) {
            return Some(warn(name, format!("`{name}` has no effect: no text of the law uses it")));
        }
        let hides = schema.parameters.iter().any(|p| p.name == *name);
        hides.then(|| {
            let soil = &spec.name;
            warn(
                name,
                format!("`{name}` hides the `{name}` of `[{soil}]`: the law takes the number given here"),
            )
        })
    };
    own.into_iter().flat_map(|own| own.keys()).filter_map(said).collect()
}

/// An error as a line of a warning: `file:line: message`.
pub fn line_of(error: &InputError) -> String {
    let (file, text) = (error.source_code.name(), error.source_code.inner());
    if file.starts_with("--") {
        return format!("{file} {text}: {}", error.message);
    }
    let start = error.span.map_or(0, |s| s.offset());
    let line = text.get(..start).map_or(1, |head| head.matches('\n').count() + 1);
    format!("{file}:{line}: {}", error.message)
}
