//! What units cost: per communication step beside a bare loop in C and other masters, over two cores, and in isolation.

mod exchange;
pub mod peers;
mod steps;
mod two_cores;

use crate::process::Outcome;
use crate::validate::{Context, Figure, Limit};
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
        let beside = beside(&all, "fmucontainer");
        all.extend(beside);
    }
    Ok(all)
}

/// What a testbed costs over what another master costs in the same run; no line where that one was not measured.
fn beside(all: &[Figure], peer: &str) -> Vec<Figure> {
    let value = |id: String| all.iter().find(|f| f.id == id).and_then(|f| f.value);
    let ratio = |case: &steps::Case| {
        let ours = value(format!("fmi.cost.{}.step", case.name))?;
        let theirs = value(format!("fmi.cost.peer.{peer}.{}", case.name))?;
        let what = format!("a step of a testbed over one of {peer}, nothing recorded");
        let id = format!("fmi.cost.over_{peer}.{}", case.name);
        Some(Figure::new(id, ours / theirs, Limit::AtMost(1.0), what))
    };
    steps::CASES.iter().filter_map(ratio).collect()
}
