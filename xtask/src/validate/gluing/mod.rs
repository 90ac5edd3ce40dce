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
mod overhead;
mod parameters;
mod planar;
mod rig;
mod six_feet;
mod squeezer;
mod step_control;
mod stiffness;
mod table;
mod units;
mod walk_forms;

use super::{Context, Figure, Limit};
use crate::process::{Outcome, root};

type Part = fn(&Context) -> Outcome<Vec<Figure>>;

/// The parts by name, in the order of the table.
const PARTS: [(&str, Part); 10] = [
    ("linear", linear::figures),
    ("mechanisms", mechanisms::figures),
    ("holds", holds::figures),
    ("squeezer", squeezer::figures),
    ("step-control", step_control::figures),
    ("units", units::figures),
    ("feet", feet::figures),
    ("stiffness", stiffness::figures),
    ("overhead", overhead::figures),
    ("walk-forms", walk_forms::figures),
];

/// All figures of the area, or those of the file that `--table` names.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    if let Some(file) = &context.table {
        return table::figures(file);
    }
    if let Some(part) = context.part.as_deref().filter(|p| *p != "values" && PARTS.iter().all(|n| n.0 != *p))
    {
        let names: Vec<&str> = PARTS.iter().map(|p| p.0).collect();
        return Err(format!("--part {part}: the parts are values, {}", names.join(", ")));
    }
    let wanted = |name: &str| context.part.as_deref().is_none_or(|part| part == name);
    let mut all = Vec::new();
    if wanted("values") {
        all = table::figures(&root().join("tests/reference/gluing/acceptance.csv"))?;
    }
    for (_, part) in PARTS.iter().filter(|(name, _)| wanted(name)) {
        all.extend(part(context)?);
    }
    Ok(all)
}
