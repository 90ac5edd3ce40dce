//! `cargo xtask docs`: everything in docs/, README and headers of scenarios that is made from code or measured by it, made again. The
//! tests hold the same against the code.

use crate::process::{Outcome, cargo, command, must, program};
use crate::{architecture, faults, header, schema, test, validate};

/// Makes all of it; about ten minutes.
pub fn write_all() -> Outcome {
    must(&mut cargo(&["build", "--workspace"]))?;
    schema::write_files(false)?;
    header::run(false)?;
    architecture::run(false)?;
    pictures()?;
    faults::write_page()?;
    validate::validate(&validate::Arguments::quick_for_docs())?;
    claims()
}

/// The pictures that are computed.
pub fn pictures() -> Outcome {
    must(&mut cargo(&["build", "--package", "terraglue"]))?;
    validate::write_soil_pictures()?;
    validate::write_walk_picture(&program("debug"))
}

/// The figures that stand in sentences.
fn claims() -> Outcome {
    let python = test::virtual_environment()?;
    let mut write = command(python, &["tests/python/claims.py", "--write"]);
    must(write.env("TERRAGLUE_BIN", program("debug")).env("PYTHONDONTWRITEBYTECODE", "1"))
}
