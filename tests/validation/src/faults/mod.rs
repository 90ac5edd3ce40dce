//! `cargo xtask faults`: runs the fault scenarios and writes the tables and the picture of `docs/faults.md`.
//!
//! The walks are run as a user runs them, by the program; the figures of the page are computed from their
//! `variables.csv` and `summary.json` alone.

mod crater;
mod legs;
mod picture;
mod walk;

use crate::process::between;
use crate::process::{Outcome, cargo, must, program, read, root, write};

/// Runs everything and writes the page; fails where a fault does not show against the length of the step.
///
/// # Errors
/// A run that fails, or a page that cannot be written.
pub fn write_page() -> Outcome {
    must(&mut cargo(&["build", "--workspace"]))?;
    let scratch = tempfile::tempdir().map_err(|e| format!("temporary folder: {e}"))?;
    let place = walk::Place { program: program("debug"), folder: scratch.path().to_owned() };
    let legs = legs::Legs::run(&place)?;
    picture::draw(&legs, &root().join("docs/images/leg_faults.svg"))?;
    replace("legs", &legs.table()?)?;
    replace("crater", &crater::table(&place)?)?;
    legs.hold()
}

/// Replaces the table between the marks of `name` in `docs/faults.md`.
fn replace(name: &str, table: &str) -> Outcome {
    let path = root().join("docs/faults.md");
    let (begin, end) = (format!("<!-- {name}: begin -->\n"), format!("<!-- {name}: end -->"));
    let text = between(&read(&path)?, (&begin, &end), table);
    write(&path, &text.ok_or_else(|| format!("{} has no table `{name}`", path.display()))?)
}
