//! Loads of joints at rest, against sums of weights.

use crate::process::Outcome;
use crate::rigid_body::fixture::{Fixture, G};
use crate::{Figure, Limit};
use terraglue_numerics::extremes::larger;

const CHAIN: &str = "tests/reference/multibody/chain8_planar.urdf";

/// All of them.
pub fn figures() -> Outcome<Vec<Figure>> {
    Ok(vec![hanging()?, held()?])
}

/// Largest error over all joints and schemes; `expected` gives force up and moment about y for the links below a joint.
fn error(more: &str, expected: impl Fn(f64) -> [f64; 2]) -> Outcome<f64> {
    let mut worst = 0.0_f64;
    for scheme in ["symplectic-euler", "generalized-alpha", "energy-momentum"] {
        let mut fixture = Fixture::new(
            &format!(r#"{{"model": "{CHAIN}", "integrator": "{scheme}", {more}}}"#),
            [0.0, 0.0, -G],
            1e-3,
        )?;
        fixture.run(0.02, |_| Ok(()))?;
        for k in 1..=8 {
            let [force, moment] = expected(f64::from(9 - k));
            for (what, value) in
                [("x", 0.0), ("y", 0.0), ("z", force), ("mx", 0.0), ("my", moment), ("mz", 0.0)]
            {
                let id = fixture.id(&format!("j{k}.reaction_{what}"))?;
                worst = larger(worst, (fixture.get(id)? - value).abs());
            }
        }
    }
    Ok(worst)
}

fn hanging() -> Outcome<Figure> {
    let more = format!(r#""motor": "off", "joints": {{"j1": {}}}"#, -std::f64::consts::FRAC_PI_2);
    let what =
        "hanging chain of eight, all integrators: reactions less the weight below each joint, N and N m";
    Ok(Figure::new(
        "rigid-body.reactions.hanging",
        error(&more, |n| [n * G, 0.0])?,
        Limit::AtMost(1e-6),
        what,
    ))
}

fn held() -> Outcome<Figure> {
    let what = "the same chain held level by its motors: reactions less weight and bending moment, N and N m";
    let more = r#""motor": "velocity", "max_torque": 1e6"#;
    let value = error(more, |n| [n * G, -0.125 * n * n * G])?;
    Ok(Figure::new("rigid-body.reactions.held", value, Limit::AtMost(1e-6), what))
}
