//! Levels of the condition, holds of the wrench, and stabilisation: gap, order and growth with each.

use super::extrapolate::steps_to;
use super::fixture::{Setting, Tally, build, read, step, subsystem, wrench};
use super::mechanisms::{MechanismCase, cases, largest, reference};
use super::planar::{ALPHA, GRAVITY};
use super::{Context, Figure, Limit};
use crate::process::Outcome;

/// All figures of the part.
pub fn figures(_: &Context) -> Outcome<Vec<Figure>> {
    let mut all = levels()?;
    all.extend(holds()?);
    Ok(all)
}

/// A double pendulum cut and glued at the three levels, with and without stabilisation.
fn levels() -> Outcome<Vec<Figure>> {
    let [_, case, ..] = cases();
    let truth = reference(&case)?;
    let mut all = Vec::new();
    let mut gaps = Vec::new();
    for (level, share, limit) in [
        ("position", 0.0, Limit::AtMost(1e-10)),
        ("velocity", 0.0, Limit::None),
        ("velocity", 0.2, Limit::None),
        ("acceleration", 0.0, Limit::None),
        ("acceleration", 0.2, Limit::None),
    ] {
        let name = if share > 0.0 { format!("{level}_stabilised") } else { level.to_owned() };
        let id = |what: &str| format!("gluing.level.{name}.{what}");
        let gluing = format!("level = \"{level}\"\nstabilisation = {share:?}");
        let (coarse, _) = run(&case, 0.0025, &gluing)?;
        let (fine, tally) = run(&case, 0.00125, &gluing)?;
        let (error, finer) = (largest(&coarse, &truth, 1), largest(&fine, &truth, 1));
        let what = format!(
            "double pendulum, condition at {level} level: order from 2.5 and 1.25 ms, errors {error:.2e} and {finer:.2e} rad"
        );
        all.push(Figure::new(id("order"), (error / finer).log2(), Limit::AtLeast(1.9), what));
        let what = format!("largest gap in 1 s at 1.25 ms, {share} of the error taken out per step, m");
        all.push(Figure::new(id("gap"), tally.gap, limit, what));
        gaps.push(tally.gap);
    }
    for (level, k) in [("velocity", 1), ("acceleration", 3)] {
        let what = "gap with stabilisation 0.2 over the gap without";
        let id = format!("gluing.level.{level}.stabilisation");
        all.push(Figure::new(id, gaps[k + 1] / gaps[k], Limit::AtMost(0.35), what));
    }
    Ok(all)
}

/// The angles at every 5 ms and the cost of the run.
fn run(case: &MechanismCase, h: f64, gluing: &str) -> Outcome<(Vec<Vec<f64>>, Tally)> {
    let setting = Setting { gluing: gluing.into(), ..Setting::iterative(h, GRAVITY) };
    let mut testbed = build(&case.mechanism.cut(&setting, ALPHA))?;
    let (mut samples, mut tally, mut count) = (Vec::new(), Tally::default(), 0);
    step(&mut testbed, steps_to(1.0, h), |testbed| {
        tally.add(testbed);
        count += 1;
        if count % steps_to(0.005, h) == 0 {
            samples.push(case.angles.iter().map(|a| read(testbed, a)).collect::<Outcome<Vec<f64>>>()?);
        }
        Ok(())
    })?;
    Ok((samples, tally))
}

/// Two free masses that integrate exactly inside the step, of different speed when they are glued.
fn masses(gluing: &str) -> String {
    let mass = |name: &str, mass: f64, speed: f64| {
        let keys = [
            ("mass_kg", format!("[{mass:?}]")),
            ("velocity_m_s", format!("[{speed:?}]")),
            ("integrator", "\"exact\"".into()),
        ];
        subsystem(name, "mass-chain", &keys)
    };
    let setting = Setting { gluing: gluing.into(), ..Setting::iterative(0.01, [0.0; 3]) };
    let glue = "[[glue]]\nside_1 = \"a.m0\"\nside_2 = \"b.m0\"\ncomponents = \"x\"\n";
    setting.text() + &mass("a", 1.0, 1.0) + &mass("b", 3.0, 0.0) + glue
}

fn holds() -> Outcome<Vec<Figure>> {
    let mut all = Vec::new();
    let figure = |name: &str, value: f64, limit: Limit, what: &str| {
        Figure::new(format!("gluing.hold.{name}"), value, limit, what)
    };
    for (name, gluing) in [("constant.position", ""), ("constant.velocity", "level = \"velocity\"")] {
        let mut testbed = build(&masses(gluing))?;
        let (mut forces, mut tally) = (Vec::new(), Tally::default());
        step(&mut testbed, 20, |testbed| {
            forces.push(wrench(testbed, 0, 0).abs());
            tally.add(testbed);
            Ok(())
        })?;
        let apart = (read(&testbed, "a.m0.x")? - read(&testbed, "b.m0.x")?).abs();
        let rate = (read(&testbed, "a.m0.v")? - read(&testbed, "b.m0.v")?).abs();
        let growth = forces[19] / forces[0].max(1e-6);
        let what = "two masses joined at different speed: force in the 20th step over that in the first";
        // at velocity level the force comes to rest, at position level it rings
        let limit = if name == "constant.velocity" { 1e-9 } else { 2.0 };
        all.push(figure(&format!("{name}.growth"), growth, Limit::AtMost(limit), what));
        let limit = if name.ends_with("velocity") { 0.01 } else { 1e-12 };
        all.push(figure(&format!("{name}.gap"), apart, Limit::AtMost(limit), "the same: gap, m"));
        let rings = name == "constant.position";
        let limit = if rings { Limit::AtLeast(0.1) } else { Limit::AtMost(1e-12) };
        all.push(figure(&format!("{name}.rate"), rate, limit, "the same: difference of the speeds, m/s"));
        let what = "the same: evaluations per step";
        all.push(figure(&format!("{name}.evaluations"), tally.mean(), Limit::AtMost(2.0), what));
    }
    Ok(all)
}
