//! Gain by a second core for FMUs that cost more than 20 µs a step.

use super::super::{fmus, testbed_on};
use crate::process::Outcome;
use crate::{Figure, Limit};
use std::path::Path;
use std::time::Instant;
use terraglue::Testbed;
use terraglue_numerics::extremes::smaller;

const FMUS: usize = 10;
const STEPS: u32 = 100;
/// Pairs of measurements; the best of each counts, because others use the machine too.
const TURNS: u32 = 25;

pub fn figure(folder: &Path) -> Outcome<Figure> {
    // a few thousand dependent operations: 20 to 40 µs
    let work = "double x = v[1]; for (int i = 0; i < 16000; i++) x = x * 0.999 + h * v[0]; v[1] = x;";
    fmus::build(folder, "heavy", &[("u", 'i', 1.0), ("y", 'o', 0.0)], "", work)?;
    let tables: String =
        (0..FMUS).map(|k| format!("[u{k}]\nfmu = \"heavy.fmu\"\nrollback = false\n")).collect();
    let text = format!("[time]\nstep_s = 0.001\nduration_s = 10000.0\n{tables}");
    let on = |threads: usize| testbed_on(folder, &text, threads).map_err(|e| e.to_string());
    let (mut one, mut two) = (on(1)?, on(2)?);
    let mut best = [f64::INFINITY; 2];
    // in the first steps a testbed measures the cost of its FMUs
    took(&mut one, 130)?;
    took(&mut two, 130)?;
    for _ in 0..TURNS {
        best[0] = smaller(best[0], took(&mut one, STEPS)?);
        best[1] = smaller(best[1], took(&mut two, STEPS)?);
    }
    let per_fmu = best[0] * 1e6 / f64::from(STEPS) / FMUS as f64;
    let what = format!(
        "{FMUS} FMUs of {per_fmu:.0} µs a step: wall time of one thread over that of two, least of {TURNS}"
    );
    Ok(Figure::new("fmi.cost.two_cores", best[0] / best[1], Limit::AtLeast(1.7), what))
}

fn took(testbed: &mut Testbed, steps: u32) -> Outcome<f64> {
    let start = Instant::now();
    for _ in 0..steps {
        testbed.step().map_err(|e| e.to_string())?;
    }
    Ok(start.elapsed().as_secs_f64())
}
