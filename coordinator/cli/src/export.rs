//! `terraglue export`: a module or a scenario as a functional mock-up unit.

use super::Exit;
use super::arguments::ExportArguments;
use super::output::outln;
use terraglue_diagnostics::Result;
use terraglue_fmi::Version;
use terraglue_fmu::export::{Request, write};

/// Writes the FMU and says what it can do.
pub fn export(arguments: &ExportArguments) -> Result<Exit> {
    let exported = write(&Request {
        target: arguments.target.clone(),
        sets: arguments.sets.clone(),
        module_paths: arguments.module_path.clone(),
        version: if arguments.fmi == 2 { Version::V2 } else { Version::V3 },
        scalars: arguments.scalars,
        out: arguments.output.clone(),
    })?;
    let states = match exported.states {
        [true, true] => "its state can be saved, restored and serialised",
        [true, false] => "its state can be saved and restored",
        _ => "its state cannot be saved",
    };
    let (path, fmi, count) = (exported.path.display(), arguments.fmi, exported.variables);
    outln!("{path}: FMI {fmi}.0 co-simulation, {count} variables; {states}");
    for name in exported.left_out {
        eprintln!("warning: `{name}` is left out: FMI {fmi}.0 has no type for it");
    }
    Ok(Exit::Done)
}
