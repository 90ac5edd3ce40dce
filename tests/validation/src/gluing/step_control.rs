//! Steps set by the energy residual of the interface against steps of one length at the same cost.

use super::extrapolate::steps_to;
use super::fixture::{Setting, build, read, step, subsystem};
use super::{Context, Figure, Limit};
use crate::process::Outcome;
use std::f64::consts::PI;
use terraglue_numerics::extremes::larger;

/// Longest step, s.
const LONGEST: f64 = 0.02;
const UNTIL: f64 = 4.0;

/// Two damped oscillators on a spring: the motion dies out.
fn oscillator(strategy: &'static str, h: f64, gluing: &str) -> String {
    let half = |name: &str, place: f64| {
        let keys = [
            ("mass_kg", "[1.0]".into()),
            ("spring_n_m", format!("[{:?}]", 4.0 * PI * PI)),
            ("damper_n_s_m", "[4.0]".into()),
            ("position_m", format!("[{place:?}]")),
        ];
        subsystem(name, "mass-chain", &keys)
    };
    let setting = Setting { strategy, gluing: gluing.into(), ..Setting::iterative(h, [0.0; 3]) };
    let glue = format!(
        "[[glue]]\nside_1 = \"a.m0\"\nside_2 = \"b.m0\"\ncomponents = \"x\"\ncompliance_m_n = {:?}\n",
        1.0 / (16.0 * PI * PI)
    );
    setting.text() + &half("a", 1.0) + &half("b", 0.0) + &glue
}

/// Places of both masses at multiples of the longest step, and how many steps it took.
fn places(text: &str, h: f64) -> Outcome<(Vec<[f64; 2]>, f64)> {
    let mut testbed = build(text)?;
    let (mut out, mut count) = (Vec::new(), 0);
    step(&mut testbed, steps_to(UNTIL, h), |testbed| {
        count += 1;
        if count % steps_to(LONGEST, h) == 0 {
            out.push([read(testbed, "a.m0.x")?, read(testbed, "b.m0.x")?]);
        }
        Ok(())
    })?;
    Ok((out, testbed.step_index() as f64))
}

fn apart(a: &[[f64; 2]], b: &[[f64; 2]]) -> f64 {
    a.as_flattened().iter().zip(b.as_flattened()).fold(0.0, |m, (a, b)| larger(m, (a - b).abs()))
}

/// A foot of 5 kg that meets soil with 0.5 m/s: deepest place and number of steps.
fn foot(h: f64, gluing: &str) -> Outcome<(f64, f64)> {
    let setting = Setting {
        strategy: "gauss-seidel",
        gluing: gluing.into(),
        ..Setting::iterative(h, [0.0, 0.0, -9.81])
    };
    let body = [("mass_kg", "5.0".into()), ("start", "[0.0, 0.0, 0.0, 0.5]".into())];
    let soil = [("K", "[8340.0]".into()), ("n", "[1.0]".into()), ("k_u", "[2e5]".into())];
    let glue = "[[glue]]\nkind = \"contact\"\nside_1 = \"foot.foot0\"\nside_2 = \"soil.c0\"\n";
    let text = setting.text()
        + &subsystem("foot", "table-on-feet", &body)
        + &subsystem("soil", "power-columns", &soil)
        + glue;
    let mut testbed = build(&text)?;
    step(&mut testbed, steps_to(0.2, h), |_| Ok(()))?;
    Ok((read(&testbed, "soil.max_sinkage")?, testbed.step_index() as f64))
}

/// All figures of the part.
pub fn figures(_: &Context) -> Outcome<Vec<Figure>> {
    let (truth, _) = places(&oscillator("iterative", 5e-4, ""), 5e-4)?;
    let control = "energy_residual_j = 1e-5\nstep_min_s = 1e-4";
    let (own, steps) = places(&oscillator("gauss-seidel", LONGEST, control), LONGEST)?;
    // as many steps of one length, rounded up
    let parts = (steps / (UNTIL / LONGEST)).ceil();
    let (fixed, equal_steps) = places(&oscillator("gauss-seidel", LONGEST / parts, ""), LONGEST / parts)?;
    let (error, other) = (apart(&own, &truth), apart(&fixed, &truth));
    let what = format!(
        "damped oscillators by gauss-seidel: error of {equal_steps} equal steps ({other:.2e} m) over that of {steps} steps set by the energy residual ({error:.2e} m)"
    );
    let id = "gluing.step_control.oscillator";
    let mut all = vec![Figure::new(id, other / error, Limit::AtLeast(2.0), what)];
    let (z_max, longest) = (0.01946325823806, 0.002);
    let (deep, steps) = foot(longest, "energy_residual_j = 5e-5\nstep_min_s = 1e-5")?;
    let parts = (steps / (0.2 / longest)).ceil();
    let (equal, equal_steps) = foot(longest / parts, "")?;
    let (error, other) = ((deep / z_max - 1.0).abs(), (equal / z_max - 1.0).abs());
    let what = format!(
        "a falling foot by gauss-seidel: relative error of the deepest place with {equal_steps} equal steps ({other:.2e}) over that with {steps} steps set by the energy residual ({error:.2e})"
    );
    all.push(Figure::new("gluing.step_control.foot", other / error, Limit::None, what));
    Ok(all)
}
