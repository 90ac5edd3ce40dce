//! Which strategies hold how stiff a ground under six feet of one body, and which of them rebound.

use super::fixture::{Setting, Tally, build, read};
use super::six_feet::{Table, columns};
use super::{Context, Figure, Limit};
use crate::process::Outcome;
use terraglue_numerics::extremes::larger;

const STRATEGIES: [&str; 8] = [
    "cooperative",
    "cooperative-compliant",
    "iterative",
    "xt-newton",
    "relaxed",
    "gauss-seidel",
    "jacobi",
    "monolithic",
];

/// Results of a run of 0.1 s with h = 10 ms.
struct StiffnessRun {
    /// When and why it ended early.
    failed: Option<String>,
    tally: Tally,
    soil: u32,
    /// Deepest place and heave at the end, m.
    deepest: f64,
    heave: f64,
    /// Largest upward speed, m/s.
    rebound: f64,
    /// Largest κ that the strategy formed.
    kappa: f64,
}

fn run(strategy: &'static str, factor: f64) -> Outcome<StiffnessRun> {
    let gluing = "max_halvings = 0\nmax_iterations = 200".into();
    let setting = Setting { strategy, gluing, ..Setting::iterative(0.01, [0.0; 3]) };
    let text = Table::standard("implicit-euler", 0.3).text(&setting, &columns(factor, false));
    let mut testbed = build(&text)?;
    let mut run = StiffnessRun {
        failed: None,
        tally: Tally::default(),
        soil: 0,
        deepest: 0.0,
        heave: 0.0,
        rebound: 0.0,
        kappa: 0.0,
    };
    for _ in 0..10 {
        let before = run.heave;
        if let Err(error) = testbed.step() {
            let why = error.to_string();
            run.failed = Some(why.split("; the step was").next().unwrap_or_default().to_owned());
            break;
        }
        run.tally.add(&testbed);
        run.soil += testbed.report().evaluations_soil;
        run.kappa = larger(run.kappa, testbed.report().kappa_max);
        run.heave = read(&testbed, "table.heave")?;
        run.deepest = larger(run.deepest, run.heave);
        run.rebound = larger(run.rebound, (before - run.heave) / 0.01);
        if !(run.heave.abs() < 1.0) {
            run.failed = Some(format!("heave of {} m at t = {} s", run.heave, testbed.t_s()));
            break;
        }
    }
    Ok(run)
}

/// All figures of the part.
pub fn figures(_: &Context) -> Outcome<Vec<Figure>> {
    let mut all = Vec::new();
    for factor in [0.1, 1.0, 10.0, 100.0, 1000.0] {
        let (truth, kappa) = (run("monolithic", factor)?, run("iterative", factor)?.kappa);
        for strategy in STRATEGIES {
            let own = run(strategy, factor)?;
            let steps = f64::from(own.tally.steps.max(1));
            let soil = f64::from(own.soil) / steps;
            let id = format!("gluing.stiffness.{factor}.{strategy}");
            let what = match &own.failed {
                Some(why) => format!("six feet, stiffness x {factor}, h = 10 ms: fails: {why}"),
                None => format!(
                    "six feet, stiffness x {factor}, h = 10 ms: error of the deepest place in parts of it; {:.1} and {soil:.1} evaluations per step, kappa {kappa:.3}, upward speed {:.4} m/s, {:.4} by monolithic",
                    own.tally.mean(),
                    own.rebound,
                    truth.rebound
                ),
            };
            let error = (own.deepest / truth.deepest - 1.0).abs();
            // whatever the stiffness these two must reach the reference, the others where they converge
            let limit = match (strategy, &own.failed) {
                ("iterative" | "cooperative-compliant", _) => Limit::AtMost(1e-6),
                ("xt-newton" | "relaxed" | "monolithic", None) => Limit::AtMost(1e-6),
                _ => Limit::None,
            };
            let value = if own.failed.is_some() { 1.0 } else { error };
            all.push(Figure::new(id, value, limit, what));
        }
    }
    Ok(all)
}
