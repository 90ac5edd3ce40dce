//! Variables and actions.

use super::life_cycle::same;
use crate::definition::Test;
use crate::finding::{Stop, Verdict};
use crate::fixture::{committed, numbers, script};
use crate::scope::{Area, Level};
use crate::test_context::TestContext;
use terraglue_host::{Instance, Reply, described};
use terraglue_plugin::describe::{variable_line, words};
use terraglue_subsystem::{Effect, ValueType, Values, ValuesMut, Variable, unit::Unit};

const fn test(
    name: &'static str,
    after: &'static [&'static str],
    promise: &'static str,
    run: fn(&TestContext) -> Verdict,
) -> Test {
    Test { name, area: Area::Values, level: Level::Quick, kinds: &[], after, promise, run }
}

/// The tests of this area.
pub const TESTS: &[Test] = {
    &[
        test(
            "variables",
            &["instantiates"],
            "ids, names, units and ranges of the variables agree",
            variables,
        ),
        Test {
            level: Level::Standard,
            ..test(
                "described",
                &["variables"],
                "its section names what an instance can do, and its variables",
                described_truly,
            )
        },
        test(
            "readable",
            &["steps", "variables"],
            "every variable can be read and lies in its range",
            readable,
        ),
        test("wrong-reference", &["variables"], "an unknown id or a wrong type is refused", wrong_reference),
        test("read-only", &["variables"], "what is read-only cannot be set", read_only),
        test("range", &["variables"], "values outside the range, NaN among them, are refused", range),
        test("set-and-get", &["variables"], "what is set can be read back", set_and_get),
        test(
            "unknown-action",
            &["instantiates"],
            "an unknown action is refused and changes nothing",
            unknown_action,
        ),
    ]
};

fn variables(context: &TestContext) -> Verdict {
    let instance = context.instance()?;
    let mut names: Vec<&str> = Vec::new();
    let mut last = None;
    for v in instance.subsystem().variables() {
        let wrong = |got: String, expected: &str| {
            Err(Stop::fail("variables", format!("variable `{}`", v.name), got, expected))
        };
        if last.is_some_and(|id| v.id <= id) {
            return wrong(format!("id {} after id {:?}", v.id, last), "ascending ids");
        }
        last = Some(v.id);
        if v.name.is_empty() || names.contains(&v.name.as_str()) {
            return wrong("its name is empty or taken".into(), "a name of its own");
        }
        names.push(&v.name);
        if let Err(e) = Unit::parse(&v.unit) {
            return wrong(
                format!("its unit `{}`: {e}", v.unit),
                "SI symbols separated by spaces, e.g. \"N m\"",
            );
        }
        if v.min > v.max || v.min.is_nan() || v.max.is_nan() {
            return wrong(format!("its range runs from {} to {}", v.min, v.max), "min ≤ max");
        }
        if v.value_type == ValueType::Enumeration && v.enumeration.is_empty() {
            return wrong("an enumeration without names".into(), "a name per value");
        }
    }
    Ok(())
}

fn described_truly(context: &TestContext) -> Verdict {
    let instance = context.instance()?;
    let section = described(&context.path).unwrap_or_default();
    if !section.is_whole() {
        let kind = context.kind().map_or_else(String::new, |k| format!("kind={k:?}").to_lowercase());
        let can = format!("can={}", words(instance.capabilities()).join(" "));
        let variables =
            instance.subsystem().variables().iter().map(|v| format!("variable={}", variable_line(v)));
        return Err(not_told(&[kind, can].into_iter().chain(variables).collect::<Vec<_>>()));
    }
    match section.contradiction(instance.capabilities(), instance.subsystem().variables()) {
        None => Ok(()),
        Some((said, does)) => {
            Err(Stop::fail("capabilities, variables", "the section .terraglue", said, does))
        }
    }
}

/// A module that keeps part of itself to itself: modules of earlier versions do.
pub fn not_told(lines: &[String]) -> Stop {
    let some = lines.iter().take(12).map(|line| format!("\n  {line}")).collect::<String>();
    let more = if lines.len() > 12 { format!("\n  … {} more", lines.len() - 12) } else { String::new() };
    Stop::Warning(format!(
        "`terraglue modules` cannot show its kind, capabilities and variables: its section has no such lines \
         (TG_IS, TG_CAN, TG_HAS in C, export_subsystem! in Rust, the docstring in Python):{some}{more}"
    ))
}

fn readable(context: &TestContext) -> Verdict {
    let (_, instance) = script(context.instance()?, 50, 0)?;
    for v in numbers(&instance) {
        let mut values = vec![0.0; v.len()];
        instance.get(&[v.id], ValuesMut::F64(&mut values))?;
        let slack = 1e-12 * v.max.abs().min(v.min.abs());
        if let Some(x) = values.iter().find(|x| **x < v.min - slack || **x > v.max + slack) {
            let expected = format!("a value in its range, {} to {}", v.min, v.max);
            return Err(Stop::fail("get", format!("`{}` after 50 steps", v.name), x.to_string(), expected));
        }
    }
    Ok(())
}

fn wrong_reference(context: &TestContext) -> Verdict {
    let mut instance = context.instance()?;
    let unknown = instance.subsystem().variables().iter().map(|v| v.id).max().map_or(0, |id| id + 1000);
    let mut room = [0.0];
    let read = instance.get(&[unknown], ValuesMut::F64(&mut room));
    if read.is_ok() {
        let got = format!("success, value {}", room[0]);
        return Err(Stop::fail("get", format!("the unknown id {unknown}"), got, "TG_REFUSED"));
    }
    if let Ok(Reply::Accepted) = instance.set(&[unknown], Values::F64(&[1.0])) {
        return Err(Stop::fail("set", format!("the unknown id {unknown}"), "success", "TG_REFUSED"));
    }
    if let Some(v) = numbers(&instance).first() {
        let mut room = vec![0i32; v.len()];
        if instance.get(&[v.id], ValuesMut::I32(&mut room)).is_ok() {
            let given = format!("`{}`, a double, as TG_I32", v.name);
            return Err(Stop::fail("get", given, "success", "TG_REFUSED: a wrong type"));
        }
    }
    // The instance is usable.
    committed(&instance).map(drop)
}

fn read_only(context: &TestContext) -> Verdict {
    let mut instance = context.instance()?;
    for v in numbers(&instance).into_iter().filter(|v| v.effect == Effect::ReadOnly) {
        let before = read(&instance, &v)?;
        if let Ok(Reply::Accepted) = instance.set(&[v.id], Values::F64(&vec![inside(&v); v.len()])) {
            let given = format!("the read-only variable `{}`", v.name);
            return Err(Stop::fail("set", given, "success", "TG_REFUSED"));
        }
        if read(&instance, &v)?.iter().zip(&before).any(|(a, b)| a.to_bits() != b.to_bits()) {
            let given = format!("the read-only variable `{}`", v.name);
            return Err(Stop::fail("set", given, "refused, but the value changed", "no change"));
        }
    }
    Ok(())
}

fn range(context: &TestContext) -> Verdict {
    let mut instance = context.instance()?;
    for v in settable(&instance) {
        let before = read(&instance, &v)?;
        let beyond = |bound: f64, way: f64| (bound.is_finite()).then(|| bound + way * bound.abs().max(1.0));
        let bad = [Some(f64::NAN), beyond(v.max, 1.0), beyond(v.min, -1.0)];
        for x in bad.into_iter().flatten() {
            if let Ok(Reply::Accepted) = instance.set(&[v.id], Values::F64(&vec![x; v.len()])) {
                let given = format!("`{}` = {x}", v.name);
                let expected = format!("TG_REFUSED: the range is {} to {}", v.min, v.max);
                return Err(Stop::fail("set", given, "success", expected));
            }
            if read(&instance, &v)? != before {
                let given = format!("`{}` = {x}", v.name);
                return Err(Stop::fail("set", given, "refused, but the value changed", "no change"));
            }
        }
    }
    Ok(())
}

fn set_and_get(context: &TestContext) -> Verdict {
    let mut instance = context.instance()?;
    for v in settable(&instance) {
        let x = inside(&v);
        if let Reply::Refused(reason) = instance.set(&[v.id], Values::F64(&vec![x; v.len()]))? {
            let given = format!("`{}` = {x}, inside its range {} to {}", v.name, v.min, v.max);
            return Err(Stop::fail("set", given, format!("refused: {reason}"), "acceptance"));
        }
        if let Some(back) = read(&instance, &v)?.iter().find(|b| (**b - x).abs() > 1e-12 * x.abs()) {
            let given = format!("`{}` after set to {x}", v.name);
            return Err(Stop::fail("get", given, back.to_string(), "the value that was set"));
        }
    }
    Ok(())
}

fn unknown_action(context: &TestContext) -> Verdict {
    let mut instance = context.instance()?;
    let before = committed(&instance)?;
    if let Ok(Reply::Accepted) = instance.act("no.such.action", "{}") {
        return Err(Stop::fail(
            "act",
            "the action `no.such.action`",
            "success",
            "TG_REFUSED or TG_UNSUPPORTED",
        ));
    }
    same("committed values after an action that was refused", &before, &committed(&instance)?)
}

fn settable(instance: &Instance) -> Vec<Variable> {
    numbers(instance).into_iter().filter(|v| v.effect == Effect::Live).collect()
}

fn read(instance: &Instance, v: &Variable) -> Verdict<Vec<f64>> {
    let mut values = vec![0.0; v.len()];
    instance.get(&[v.id], ValuesMut::F64(&mut values))?;
    Ok(values)
}

/// A value inside the range that is neither bound.
fn inside(v: &Variable) -> f64 {
    match (v.min.is_finite(), v.max.is_finite()) {
        (true, true) => 0.25 * v.min + 0.75 * v.max,
        (true, false) => v.min + v.min.abs().max(1.0),
        (false, true) => v.max - v.max.abs().max(1.0),
        (false, false) => 0.25,
    }
}
