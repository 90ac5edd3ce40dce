//! `cargo xtask docs`: everything in docs/, README and headers of scenarios that is made from code or measured by it, made again. The
//! tests hold the same against the code.

use crate::{architecture, header, schema, test, validation};
use xtask_start::process::{Outcome, cargo, command, must, program};

/// Makes all of it; about ten minutes.
pub fn write_all() -> Outcome {
    must(&mut cargo(&["build", "--workspace"]))?;
    schema::write_files(false)?;
    header::run(false)?;
    architecture::run(false)?;
    must(&mut validation(&["pictures"])?)?;
    must(&mut validation(&["faults"])?)?;
    must(&mut validation(&["validate", "--quick", "--write-docs"])?)?;
    claims()
}

/// The figures quoted in sentences.
fn claims() -> Outcome {
    let python = test::virtual_environment()?;
    let mut write = command(python, &["tests/python/claims.py", "--write"]);
    must(write.env("TERRAGLUE_BIN", program("debug")).env("PYTHONDONTWRITEBYTECODE", "1"))
}
