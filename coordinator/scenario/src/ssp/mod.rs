//! System structures (SSP) as scenarios: every FMU becomes a subsystem, every way between two a connection.
//!
//! The scenario is equivalent to the structure in our keys, so that it can be kept, read and edited.

mod network;
mod values;

use network::{Network, Part, Way};
use std::fmt::Write;
use terraglue_fmi::Result;
use terraglue_fmi::ssp::{Package, Table, Value};

/// A structure as a scenario.
pub struct Converted {
    /// TOML.
    pub text: String,
    /// Notes on omitted parts and on assumptions.
    pub notes: Vec<String>,
    /// Files of all FMUs, relative to the structure.
    pub fmus: Vec<String>,
}

/// Steps of a run that nobody asks for a step.
const STEPS: f64 = 1000.0;

/// Says a structure as a scenario; `prefix` goes before the files of its FMUs.
///
/// # Errors
/// A part of the structure, its FMUs or its parameters that does not fit.
pub fn convert(package: &Package, prefix: &str) -> Result<Converted> {
    let network = Network::new(package)?;
    let mut values = values::values(package, &network)?;
    let mut text = String::new();
    let file = package.path().file_name().unwrap_or_default().to_string_lossy();
    let (duration, step) = times(package, &network, &mut values.notes)?;
    // A `String` takes everything that is written into it.
    let _ = write!(
        text,
        "# {file}: {}\n\n[time]\nstep_s = {step:?}\nduration_s = {duration:?}\n\n[recording]\nevery_steps = 1\n",
        package.structure().name.replace(['\n', '\r'], " ")
    );
    for part in &network.parts {
        let file = format!("{prefix}{}", part.component.source);
        let _ = write!(text, "\n[{}]\nfmu = {}\n", part.name, quoted(&file));
        let own: Vec<_> = values.start.iter().filter(|(key, _)| key.0 == part.path).collect();
        if !own.is_empty() {
            let _ = writeln!(text, "[{}.start]", part.name);
        }
        for (key, value) in own {
            let _ = writeln!(text, "{} = {}", quoted(&key.1), shown(value));
        }
    }
    for way in network.ways(package)? {
        let parts = network.part(&way.from.0).zip(network.part(&way.to.0));
        let Some((from, to)) = parts else { continue };
        let [start, end] =
            [(from, &way.from.1), (to, &way.to.1)].map(|(p, v)| quoted(&format!("{}.{v}", p.name)));
        let _ = write!(text, "\n[[connect]]\nfrom = {start}\nto = {end}\n");
        if let Some(table) = &way.table {
            let _ = writeln!(text, "map = {{ {} }}", entries(table));
        } else if way.affine != usual(from, to, &way) {
            let (a, b) = way.affine;
            let _ = write!(text, "factor = {a:?}\noffset = {b:?}\nconvert = false\n");
        }
    }
    let mut fmus: Vec<String> = network.parts.iter().map(|p| p.component.source.clone()).collect();
    fmus.sort();
    fmus.dedup();
    Ok(Converted { text, notes: values.notes, fmus })
}

/// Factor and offset of a connection without settings, by the units of the FMUs.
fn usual(from: &Part, to: &Part, way: &Way) -> (f64, f64) {
    match (from.own_unit(&way.from.1), to.own_unit(&way.to.1)) {
        (Some(from), Some(to)) => from.conversion_to(&to).unwrap_or((f64::NAN, f64::NAN)),
        _ => (1.0, 0.0),
    }
}

/// Duration and step, s.
fn times(package: &Package, network: &Network, notes: &mut Vec<String>) -> Result<(f64, f64)> {
    let structure = package.structure();
    if structure.start_s.is_some_and(|t| t != 0.0) {
        return Err(network::refused(
            package,
            "its default experiment does not start at 0 s, a scenario does".into(),
        ));
    }
    let experiments = || network.parts.iter().map(|p| p.description.experiment);
    let longest = experiments().filter_map(|e| e.stop).reduce(f64::max);
    let duration = structure.stop_s.or(longest).unwrap_or_else(|| {
        notes.push("the system gives no stop time: time.duration_s is 1, unless --set gives another".into());
        1.0
    });
    let own = network
        .parts
        .iter()
        .filter_map(|p| p.description.experiment.step.or(p.description.capabilities.fixed_step));
    let wanted = own.filter(|s| *s > 0.0).reduce(f64::min).unwrap_or_else(|| {
        notes.push(
            "no FMU names a step: time.step_s is a thousandth of the duration, unless --set gives another"
                .into(),
        );
        duration / STEPS
    });
    if !(duration > 0.0 && duration.is_finite() && wanted.is_finite()) {
        return Err(network::refused(package, format!("stopTime = {duration} s cannot be run")));
    }
    let steps = duration / wanted;
    let whole = (steps - steps.round()).abs() < 1e-9 * steps;
    let step = if whole { wanted } else { duration / steps.ceil().max(1.0) };
    Ok((duration, step))
}

/// A table as a connection of a scenario takes it.
fn entries(table: &Table) -> String {
    let one = |(source, target): &(Value, Value)| {
        let key = if let Value::Text(text) = source { text.clone() } else { shown(source) };
        format!("{} = {}", quoted(&key), shown(target))
    };
    table.0.iter().map(one).collect::<Vec<_>>().join(", ")
}

fn shown(value: &Value) -> String {
    match value {
        Value::Real(x) => format!("{x:?}"),
        Value::Integer(n) => n.to_string(),
        Value::Boolean(b) => b.to_string(),
        Value::Text(text) => quoted(text),
    }
}

/// A text as TOML writes it.
fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            c if c.is_control() => out.push_str(&format!("\\u{:04X}", u32::from(c))),
            c => out.push(c),
        }
    }
    out.push('"');
    out
}
