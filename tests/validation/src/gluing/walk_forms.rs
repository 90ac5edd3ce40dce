//! Both forms of `iterative` from the same states of `moon_walk`: the forces must not depend on the form.

use super::{Context, Figure, Limit};
use crate::process::{Outcome, root};
use terraglue::Testbed;
use terraglue::scenario::{FormChoice, GluingSpec, Scenario};
use terraglue::testbed::Options;
use terraglue_numerics::extremes::larger;

const SOILS: [&str; 2] = ["soil-cellular-automaton", "soil-bekker"];

/// Largest difference of a component of a wrench over the sampled steps in which both forms converge, and the others, on both soils.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    Ok(SOILS.iter().map(|soil| forms(soil, context)).collect::<Outcome<Vec<_>>>()?.concat())
}

fn forms(soil: &str, context: &Context) -> Outcome<Vec<Figure>> {
    let (samples, stride) = if context.quick { (100, 15) } else { (1000, 10) };
    let sets = [
        ("gluing.strategy", "iterative"),
        ("gluing.tolerance", "1e-10"),
        ("gluing.max_iterations", "60"),
        // a form that fails is not to be helped by halves of the step
        ("gluing.max_halvings", "0"),
        ("soil.module", soil),
    ];
    let sets = sets.map(|(k, v)| (k.to_owned(), v.to_owned()));
    let scenario =
        Scenario::load(&root().join("scenarios/moon_walk.toml"), &sets).map_err(|e| e.to_string())?;
    let options = Options { threads: 1, ..Options::default() };
    let mut testbed =
        Testbed::build_with(&scenario, &options, &terraglue::library()).map_err(|e| e.to_string())?;
    let form = |form: FormChoice| GluingSpec { form, ..scenario.gluing.clone() };
    let (mut worst, mut failed, mut why): (f64, u32, String) = (0.0, 0, String::new());
    for _ in 0..samples {
        let mut forces = Vec::new();
        for _ in 1..stride {
            testbed.step().map_err(|e| e.to_string())?;
        }
        let here = testbed.snapshot(0).map_err(|e| e.to_string())?;
        for name in [FormChoice::Tt, FormChoice::Xt] {
            testbed.restore(&here).map_err(|e| e.to_string())?;
            testbed.set_gluing(&form(name)).map_err(|e| e.to_string())?;
            match testbed.step() {
                Ok(()) => forces.push(wrenches(&testbed)),
                Err(e) => {
                    failed += 1;
                    why = format!(": {name}, {e}");
                }
            }
        }
        if let [tt, xt] = forces.as_slice() {
            worst = tt.iter().zip(xt).fold(worst, |m, (a, b)| larger(m, (a - b).abs()));
        }
        testbed.restore(&here).map_err(|e| e.to_string())?;
        testbed.set_gluing(&form(FormChoice::Auto)).map_err(|e| e.to_string())?;
        testbed.step().map_err(|e| e.to_string())?;
    }
    let id = format!("gluing.forms.{soil}.{samples}_steps");
    let what = format!(
        "largest difference of a force between the T-T and the X-T form, {samples} steps of moon_walk, N"
    );
    let left = format!("steps of {samples} of moon_walk that one of both forms does not solve{why}");
    Ok(vec![
        Figure::new(&id, worst, Limit::AtMost(1e-6), what),
        Figure::new(format!("{id}.not_converged"), f64::from(failed), Limit::Equal(0.0), left),
    ])
}

fn wrenches(testbed: &Testbed) -> Vec<f64> {
    testbed.report().ports.iter().flat_map(|p| p.wrench).collect()
}
