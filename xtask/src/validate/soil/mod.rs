//! Area `soil`: what both soils promise, part by part.

mod automaton;
#[path = "../../../../interfaces/soil-contact/tests/support/mod.rs"]
mod rig;

use super::{Context, Figure};
use crate::process::Outcome;

type Part = fn(&Context) -> Outcome<Vec<Figure>>;

/// The parts, in the order of the table.
const PARTS: [Part; 1] = [automaton::figures];

/// All figures of the area.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    let mut all = Vec::new();
    for part in PARTS {
        all.extend(part(context)?);
    }
    Ok(all)
}
