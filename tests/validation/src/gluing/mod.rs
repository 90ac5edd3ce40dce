//! Area `gluing`: the strategies against exact solutions, independent programs and each other.
//!
//! [`table`] evaluates `tests/reference/gluing/acceptance.csv`, or with `--table` any file of the same columns; the
//! other parts measure quantities beyond a table of values. Models, integrators, signs:
//! `tests/reference/gluing/README.md`.

mod answers;
mod extrapolate;
mod feet;
mod fixture;
mod fmus;
mod foot;
mod holds;
mod linear;
mod mechanisms;
mod oscillator;
mod overhead;
mod parameters;
mod planar;
mod six_feet;
mod squeezer;
mod step_control;
mod stiffness;
mod table;
mod walk_forms;

use super::{Context, Figure, Limit, Part};
use crate::process::{Outcome, root};

/// The parts by name, in the order of the table.
pub const PARTS: [Part; 11] = [
    ("values", values),
    ("linear", linear::figures),
    ("mechanisms", mechanisms::figures),
    ("holds", holds::figures),
    ("squeezer", squeezer::figures),
    ("step-control", step_control::figures),
    ("units", fmus::figures),
    ("feet", feet::figures),
    ("stiffness", stiffness::figures),
    ("overhead", overhead::figures),
    ("walk-forms", walk_forms::figures),
];

/// The values of the table of the project, or of the file that `--table` names.
fn values(context: &Context) -> Outcome<Vec<Figure>> {
    let own = || root().join("tests/reference/gluing/acceptance.csv");
    table::figures(&context.table.clone().unwrap_or_else(own))
}
