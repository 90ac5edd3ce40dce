//! Two FMUs in C glued by their directional derivatives: the interface Jacobian costs no trial.

use super::super::fmi::fmus::{Variable, build_with_slope};
use super::{Context, Figure, Limit};
use crate::process::Outcome;
use std::fmt::Write;
use terraglue::Testbed;
use terraglue::scenario::Scenario;
use terraglue::testbed::Options;
use terraglue_numerics::extremes::smaller;

/// A mass on a spring, as exact within a step as ½·h²·a: force, place, speed, evaluations of its derivative, acceleration.
const VARIABLES: [Variable; 5] =
    [("f", 'i', 0.0), ("x", 'o', 1.0), ("v", 'o', 0.0), ("asked", 'o', 0.0), ("a", 'o', 0.0)];
/// The rule of the step, with the share of h² that a force has in the place.
const RULES: [(&str, &str); 2] = [
    ("half", "double a = (v[0] - K * v[1]) / M; v[1] += h * v[2] + 0.5 * h * h * a; v[2] += h * a;"),
    ("whole", "double a = (v[0] - K * v[1]) / M; v[2] += h * a; v[1] += h * v[2];"),
];

/// Results of a run.
struct FmuRun {
    x: f64,
    evaluations: f64,
    differences: u32,
    asked: f64,
}

fn run(context: &Context, rule: &str, jacobian: &str) -> Outcome<FmuRun> {
    let folder = context.scratch.join(format!("units-{rule}-{jacobian}"));
    std::fs::create_dir_all(&folder).map_err(|e| e.to_string())?;
    let step = RULES.iter().find(|r| r.0 == rule).map_or("", |r| r.1);
    let mut text = format!(
        "[time]\nstep_s = 0.01\nduration_s = 1.0\n[world]\ngravity_m_s2 = [0.0, 0.0, 0.0]\n[gluing]\nstrategy = \"iterative\"\n\
         tolerance = 1e-10\njacobian = \"{jacobian}\"\n"
    );
    for (name, m, k) in [("left", 1.0, 40.0), ("right", 3.0, 10.0)] {
        let with = |code: &str| code.replace('K', &format!("{k:?}")).replace('M', &format!("{m:?}"));
        let calc = with("v[4] = (v[0] - K * v[1]) / M;");
        build_with_slope(&folder, name, &VARIABLES, (&calc, &with(step)), &format!("{:?}", 1.0 / m))?;
        let _ = write!(
            text,
            "[{name}]\nfmu = \"{name}.fmu\"\n[{name}.bodies.m]\nposition = [\"x\"]\nvelocity = [\"v\"]\n\
             acceleration = [\"a\"]\nforce = [\"f\"]\n"
        );
    }
    text += "[[glue]]\nside_1 = \"left.m\"\nside_2 = \"right.m\"\ncomponents = \"x\"\n";
    let path = folder.join("scenario.toml").display().to_string();
    let scenario = Scenario::parse(&text, &path, &[]).map_err(|e| format!("{e}\n{text}"))?;
    let options = Options { threads: 1, ..Options::default() };
    let mut testbed = Testbed::build_with(&scenario, &options, &terraglue::library())
        .map_err(|e| format!("{e}\n{text}"))?;
    let (mut evaluations, mut differences) = (0, 0);
    for _ in 0..100 {
        testbed.step().map_err(|e| e.to_string())?;
        evaluations += testbed.report().evaluations_bodies;
        differences += testbed.report().evaluations_jacobian;
    }
    let read = |name: &str| testbed.read(name).ok_or_else(|| format!("no variable {name}"));
    Ok(FmuRun {
        x: read("left.x")?,
        evaluations: f64::from(evaluations) / 100.0,
        differences,
        asked: smaller(read("left.asked")?, read("right.asked")?),
    })
}

/// All figures of the part.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    let mut all = Vec::new();
    for (rule, _) in RULES {
        let by_trials = run(context, rule, "finite-differences")?;
        for jacobian in ["analytic", "directional"] {
            let told = run(context, rule, jacobian)?;
            let what = format!(
                "two FMUs whose force has {rule} of h^2 in the place, jacobian = {jacobian}: difference of x(1 s) to differences \
                 of trials, m; {:.2} evaluations per step and {} trials for differences ({:.2} and {})",
                told.evaluations, told.differences, by_trials.evaluations, by_trials.differences
            );
            // an FMU whose derivative was not evaluated, or trials in addition to the derivatives, are a failure
            let good = told.asked >= 1.0 && told.differences == 0;
            let off = if good { (told.x - by_trials.x).abs() } else { f64::NAN };
            all.push(Figure::new(format!("gluing.units.{rule}.{jacobian}"), off, Limit::AtMost(1e-8), what));
        }
    }
    Ok(all)
}
