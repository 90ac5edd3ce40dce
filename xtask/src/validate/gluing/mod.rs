//! Area `gluing`: the strategies against exact solutions, independent programs and each other.
//!
//! [`table`] evaluates `tests/reference/gluing/acceptance.csv`, or with `--table` any file of the same columns; the
//! other parts measure what a table of values cannot say. Models, integrators, signs:
//! `tests/reference/gluing/README.md`.

mod extrapolate;
mod feet;
mod foot;
mod holds;
mod linear;
mod mechanisms;
mod oscillator;
mod parameters;
mod planar;
mod rig;
mod six_feet;
mod squeezer;
mod step_control;
mod table;
mod walk_forms;

use super::{Context, Figure, Limit};
use crate::process::{Outcome, root};

type Part = fn(&Context) -> Outcome<Vec<Figure>>;

/// The parts, in the order of the table.
const PARTS: [Part; 7] = [
    linear::figures,
    mechanisms::figures,
    holds::figures,
    squeezer::figures,
    step_control::figures,
    feet::figures,
    walk_forms::figures,
];

/// All figures of the area, or those of the file that `--table` names.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    if let Some(file) = &context.table {
        return table::figures(file);
    }
    let mut all = table::figures(&root().join("tests/reference/gluing/acceptance.csv"))?;
    for part in PARTS {
        all.extend(part(context)?);
    }
    Ok(all)
}
