//! What units cost: per communication step beside a bare loop in C and other masters, over two cores, and in isolation.

mod exchange;
pub mod peers;
mod steps;
mod two_cores;

use crate::process::Outcome;
use crate::validate::{Context, Figure};
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
    }
    Ok(all)
}
