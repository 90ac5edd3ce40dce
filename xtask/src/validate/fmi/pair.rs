//! Two oscillators in two units, glued: the same as one oscillator with the sums of masses, springs and dampers.

use super::{built, units};
use crate::process::Outcome;
use crate::validate::{Figure, Limit};
use std::path::Path;

const STEPS: u32 = 2000;
const H: f64 = 1e-3;
/// m, k, d of both.
const SIDES: [[f64; 3]; 2] = [[1.0, 40.0, 0.3], [10.0, 1000.0, 0.1]];
const X0: f64 = 0.1;

/// Backward Euler: what the units do, and one unit with the sums.
const STEP: &str =
    "v[4] = (v[0] * v[4] + h * (v[5] - v[1] * v[3])) / (v[0] + h * v[2] + h * h * v[1]); v[3] += h * v[4];";

pub fn figures(folder: &Path) -> Outcome<Vec<Figure>> {
    for (name, [m, k, d]) in ["left", "right"].iter().zip(SIDES) {
        let variables =
            [("m", 'p', m), ("k", 'p', k), ("d", 'p', d), ("x", 'o', X0), ("v", 'o', 0.0), ("f", 'i', 0.0)];
        units::build(folder, name, &variables, "", STEP)?;
    }
    let glued = |form: &str| {
        worst(folder, &format!("[gluing]\nstrategy = \"iterative\"\nform = \"{form}\"\ntolerance = 1e-8\n"))
    };
    let what = "two oscillators as units, glued T-T, against one oscillator: largest difference of x over its largest value";
    Ok(vec![Figure::new("fmi.pair.tt", glued("tt")?, Limit::AtMost(1e-10), what)])
}

/// Largest difference of either unit from the whole, relative to the largest excursion.
fn worst(folder: &Path, gluing: &str) -> Outcome<f64> {
    let body = "position = [\"x\"]\nvelocity = [\"v\"]\nforce = [\"f\"]\n";
    let text = format!(
        "[time]\nstep_s = {H}\nduration_s = 2.0\n{gluing}[left]\nfmu = \"left.fmu\"\n[left.bodies.mass]\n{body}\
         [right]\nfmu = \"right.fmu\"\n[right.bodies.mass]\n{body}[[glue]]\nside_1 = \"left.mass\"\nside_2 = \"right.mass\"\n\
         components = [\"x\"]\n"
    );
    let mut testbed = built(folder, &text)?;
    let [m, k, d] = [0, 1, 2].map(|i| SIDES[0][i] + SIDES[1][i]);
    let (mut x, mut v, mut worst) = (X0, 0.0, 0.0_f64);
    for _ in 0..STEPS {
        testbed.step().map_err(|e| e.to_string())?;
        v = (m * v - H * k * x) / (m + H * d + H * H * k);
        x += H * v;
        for name in ["left.x", "right.x"] {
            let found = testbed.read(name).unwrap_or(f64::NAN);
            worst = if found.is_nan() { f64::NAN } else { worst.max((found - x).abs()) };
        }
    }
    Ok(worst / X0)
}
