//! Cost of FMUs: per communication step against a bare loop in C and other masters, over two cores, and in isolation.

mod exchange;
pub mod peers;
mod steps;
mod two_cores;

use crate::process::Outcome;
use crate::{Context, Figure, Limit};
use std::path::Path;

pub fn figures(folder: &Path, context: &Context) -> Outcome<Vec<Figure>> {
    if !context.timing {
        return Ok(Vec::new());
    }
    let mut all = steps::figures(folder)?;
    all.push(two_cores::figure(folder)?);
    all.push(exchange::figure(folder)?);
    if !context.quick {
        all.extend(peers::figures(folder));
        all.extend(steps::CASES.iter().filter_map(|case| beside(folder, case, "fmucontainer")));
    }
    Ok(all.into_iter().map(Figure::timed).collect())
}

/// Times that both are measured, one after the other; the least counts.
const TURNS: u32 = 5;

/// Cost of a testbed over that of another master, measured in turns; no line where that one cannot be measured.
fn beside(folder: &Path, case: &steps::FmuCase, peer: &str) -> Option<Figure> {
    let (mut ours, mut theirs) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..TURNS {
        ours = ours.min(steps::blind(folder, case).ok()?);
        theirs = theirs.min(peers::cost(folder, case, peer).ok()?);
    }
    let what = format!(
        "a step of a testbed over one of {peer}, nothing recorded, in turns: {ours:.4} and {theirs:.4} µs"
    );
    Some(Figure::new(format!("fmi.cost.over_{peer}.{}", case.name), ours / theirs, Limit::AtMost(1.0), what))
}
