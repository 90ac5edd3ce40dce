//! What of a scenario has no effect although nothing is wrong with it: said in warnings, never an error.

use super::choices::{FormChoice, JacobianChoice, LevelChoice, Relaxation, StartChoice, StrategyKind};
use super::model::{GluingSpec, Scenario, SubsystemSpec, Trigger};
use super::parameters::check_own_table;
use super::source::Source;
use serde_json::Value;
use terraglue_diagnostics::InputError;
use terraglue_soil_law::{Family, PressureLaw, SMALL_CONTACT, SoilExpressions, SoilParameters};
use terraglue_subsystem::{Config, Schema};

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

/// Steps of a run beyond which it is said before it starts, and beyond which it is refused.
const MANY_STEPS: f64 = 1e8;
/// See [`MANY_STEPS`]: at a microsecond a step, which no subsystem needs less than, a quarter of an hour.
pub(super) const MOST_STEPS: f64 = 1e9;

/// A run of very many steps.
pub fn many_steps(scenario: &Scenario) -> Option<String> {
    let time = &scenario.time;
    let steps = time.duration_s / time.step_s;
    let message = || {
        format!(
            "the run has {steps:.3e} steps of {} s; at 10 µs of wall time each it takes {:.1} hours",
            time.step_s,
            steps * 1e-5 / 3600.0
        )
    };
    (steps > MANY_STEPS)
        .then(|| line_of(&scenario.source.error_at_value(&["time", "step_s"], message(), None)))
}

/// Keys of `[gluing]` that only some strategies read, with what they say where they say nothing.
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

/// Keys of a module that is not chosen, in its own table `[NAME.MODULE]`: what is wrong with them shows when it is.
pub fn unchosen(schema: &Schema, spec: &SubsystemSpec, source: &Source) -> Option<String> {
    let wrong = check_own_table(schema, spec, source).err()?;
    let module = &spec.module;
    Some(format!("{} (no effect now: `{}` has `module = \"{module}\"`)", line_of(&wrong), spec.name))
}

/// Depth up to which nobody minds that the elastic line stands for the law, m.
const UNNOTICED: f64 = 1e-4;

/// Soils of a subsystem whose law the elastic line of unloading changes at depths that matter: it stands for the start of a
/// power law, and bounds the slope of any. Of laws that are modules the soil speaks itself. `gravity` in m/s².
pub fn replaced_laws(
    scenario: &Scenario,
    spec: &SubsystemSpec,
    config: &Config,
    gravity: f64,
) -> Vec<String> {
    if config.get("law.plugin").is_some_and(|v| !v.is_null())
        || config.get(STIFFNESS).is_none_or(Value::is_null)
    {
        return Vec::new();
    }
    let said = soils(spec, config).filter_map(|(whose, config)| replaced_law(&config, &whose, gravity));
    said.flatten()
        .map(|message| line_of(&scenario.source.error_at_value(&[&spec.name, STIFFNESS], message, None)))
        .collect()
}

/// The tables of a subsystem's own soil and of those of its regions, and whose each is as messages say it.
fn soils<'a>(spec: &'a SubsystemSpec, config: &'a Config) -> impl Iterator<Item = (String, Config)> + 'a {
    let own = std::iter::once((String::new(), config.clone()));
    let regions = spec.regions.iter().filter_map(|region| {
        let merged = SoilParameters::of_region(config, &region.numbers).ok()?;
        Some((format!(" of label {} ({})", region.label, region.soil), merged))
    });
    own.chain(regions)
}

/// What the elastic line does to one soil.
fn replaced_law(config: &Config, whose: &str, gravity: f64) -> Option<Vec<String>> {
    let soil = SoilParameters::from_config(config, gravity).ok()?;
    let stiffness = soil.elastic_stiffness_pa_m?;
    let text = SoilExpressions::from_config(config).ok()?;
    let law = match text.and_then(|text| text.pressure(&soil).transpose()) {
        Some(law) => PressureLaw::Expression(law.ok()?),
        None => soil.pressure(),
    };
    let mut all: Vec<String> = law.softened(stiffness).map(|s| s.message(whose)).into_iter().collect();
    let depth = law.curve(SMALL_CONTACT, stiffness).ok()?.elastic_limit();
    if depth > UNNOTICED && !matches!(law, PressureLaw::Expression(_)) {
        let needed = stiffness * (depth / UNNOTICED).powf(1.0 - soil.n);
        all.push(format!(
            "`{STIFFNESS}` = {stiffness:e} takes the place of the soil's law{whose} down to {:.2} mm under a contact of b = {} \
             mm; {needed:.1e} would down to {} mm",
            1e3 * depth,
            1e3 * SMALL_CONTACT,
            1e3 * UNNOTICED
        ));
    }
    Some(all)
}

const STIFFNESS: &str = "elastic_stiffness_pa_m";

/// Soils whose moduli were measured under another gravity than that of the scenario (m/s²), and are not scaled.
pub fn foreign_gravity(
    scenario: &Scenario,
    spec: &SubsystemSpec,
    config: &Config,
    gravity: f64,
) -> Vec<String> {
    let said = soils(spec, config).filter_map(|(whose, config)| {
        let soil = SoilParameters::from_config(&config, gravity).ok()?;
        let measured = soil.measured_gravity.filter(|g| (g - gravity).abs() > SAME_GRAVITY * gravity)?;
        let own_law = spec.parameters.contains_key("law");
        (soil.family == Family::Bekker && soil.k_phi > 0.0 && !soil.gravity_scaling && !own_law).then(|| {
            format!(
                "`k_phi`{whose} was measured under {measured} m/s², the scenario has {gravity:.4}: soil of this weight bears \
                 {:.2} of it; `gravity_scaling = true` scales it (Reece 1965)",
                gravity / measured
            )
        })
    });
    said.map(|message| line_of(&scenario.source.error_at_value(&[&spec.name, "parameters"], message, None)))
        .collect()
}

/// Relative difference of gravities from which on they are different ones.
const SAME_GRAVITY: f64 = 0.01;

/// Names of one's own in `[SOIL.law.parameters]` that no text of the law uses, or that stand for a number of the soil.
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
