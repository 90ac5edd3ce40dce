//! Tests of controllers: they are functions of time and inputs, not of how often they are called.

use crate::definition::Test;
use crate::finding::{Stop, Verdict};
use crate::fixture::{numbers, outputs, set_numbers};
use crate::scope::{Area, Level};
use crate::test_context::TestContext;
use terraglue_host::Instance;
use terraglue_subsystem::{Causality, Input, Kind, Motion, Response, Step};

const fn test(name: &'static str, promise: &'static str, run: fn(&TestContext) -> Verdict) -> Test {
    let (area, level, after) = (Area::Physics, Level::Quick, &["steps"]);
    Test { name, area, level, kinds: &[Kind::Controller], after, promise, run }
}

/// The tests of this area.
pub const TESTS: &[Test] = {
    &[
        test(
            "time-not-calls",
            "half the step gives nearly the same outputs at the same times",
            time_not_calls,
        ),
        test("bounded", "outputs stay finite and in their ranges under inputs at their bounds", bounded),
        test("bounded-power", "forces, torques and powers have declared bounds", bounded_power),
        test("reads-time", "a run that starts an hour later is answered", reads_time),
    ]
};

fn step(instance: &mut Instance, t: f64, h: f64, index: u64) -> Verdict {
    let step = Step::free(t, h, index);
    let input = Input::Force { t: &[], motion: None };
    let mut out = Response { x: &mut [], v: &mut [], a: &mut [], t: &mut [], reached: t + h, flags: 0 };
    instance.advance(&step, &input, &mut out)?;
    instance.commit(&step, &[], &Motion { x: &[], v: &[] })?;
    Ok(())
}

/// Outputs every 10 ms over two seconds.
fn run(context: &TestContext, h: f64, start: f64) -> Verdict<Vec<Vec<f64>>> {
    let mut instance = context.instance()?;
    set_numbers(&mut instance, |k| 0.3 + 0.1 * k as f64)?;
    let per_sample = (0.01 / h).round() as u64;
    let mut all = Vec::new();
    for index in 0..200 * per_sample {
        step(&mut instance, start + h * index as f64, h, index)?;
        if (index + 1) % per_sample == 0 {
            all.push(outputs(&instance)?);
        }
    }
    Ok(all)
}

fn time_not_calls(context: &TestContext) -> Verdict {
    let (coarse, fine) = (run(context, 2e-3, 0.0)?, run(context, 1e-3, 0.0)?);
    let names = numbers(&context.instance()?);
    let mut k = 0;
    for v in names.iter() {
        for _ in 0..v.len() {
            let column = |all: &[Vec<f64>]| all.iter().map(|row| row[k]).collect::<Vec<f64>>();
            let (a, b) = (column(&coarse), column(&fine));
            let range = b.iter().fold(0.0f64, |m, x| m.max((x - b[0]).abs()));
            // A sample that jumps between two calls may come one call later: most samples count.
            let apart = a.iter().zip(&b).filter(|(a, b)| (**a - **b).abs() > 0.05 * range + 1e-9).count();
            if apart > a.len() / 4 {
                let got = format!(
                    "`{}` differs by more than 5 % of its range in {apart} of {} samples",
                    v.name,
                    a.len()
                );
                return Err(Stop::fail(
                    "advance",
                    "two seconds with h = 2 ms instead of 1 ms",
                    got,
                    "the same course",
                ));
            }
            k += 1;
        }
    }
    Ok(())
}

fn bounded(context: &TestContext) -> Verdict {
    let mut instance = context.instance()?;
    for (round, way) in [1e6, -1e6, 0.0, 1e6].into_iter().enumerate() {
        // Kept inside the range of each input.
        set_numbers(&mut instance, |_| way)?;
        for index in 0..50 {
            let at = 50 * round as u64 + index;
            step(&mut instance, 1e-3 * at as f64, 1e-3, at)?;
        }
        let mut values = outputs(&instance)?.into_iter();
        for v in numbers(&instance) {
            for x in values.by_ref().take(v.len()) {
                let slack = 1e-9 * x.abs();
                if !x.is_finite() || x < v.min - slack || x > v.max + slack {
                    let given = format!("`{}` with every input at {way:e} or at its bound", v.name);
                    return Err(Stop::fail(
                        "get",
                        given,
                        x.to_string(),
                        format!("a value in {} to {}", v.min, v.max),
                    ));
                }
            }
        }
    }
    Ok(())
}

fn bounded_power(context: &TestContext) -> Verdict {
    let instance = context.instance()?;
    let powerful = ["N", "N m", "W", "V", "A"];
    let open: Vec<String> = numbers(&instance)
        .into_iter()
        .filter(|v| v.causality == Causality::Output && powerful.contains(&v.unit.as_str()))
        .filter(|v| !(v.min.is_finite() && v.max.is_finite()))
        .map(|v| v.name)
        .collect();
    if open.is_empty() {
        return Ok(());
    }
    Err(Stop::Warning(format!(
        "no bounds are declared for {}: nothing limits what it asks of a motor",
        open.join(", ")
    )))
}

/// Time is counted from the start of the instance, or read from the step: a shift of an hour must not throw it off.
fn reads_time(context: &TestContext) -> Verdict {
    let late = run(context, 2e-3, 3600.0)?;
    match late.iter().flatten().all(|x| x.is_finite()) {
        true => Ok(()),
        false => Err(Stop::fail(
            "advance",
            "a run from t = 3600 s on",
            "a value that is not finite",
            "finite outputs",
        )),
    }
}
