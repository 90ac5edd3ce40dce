//! `terraglue export`: a module or a scenario as a functional mock-up unit.

use super::Exit;
use super::arguments::ExportArguments;
use super::output::outln;
use super::words::DATE;
use chrono::DateTime;
use std::path::{Path, PathBuf};
use terraglue_fmi::Version;
use terraglue_fmi::export::Origin;
use terraglue_fmu::export::{Request, write};

/// The date of reproducible builds (`SOURCE_DATE_EPOCH`), in the form of FMI.
fn source_date() -> Option<String> {
    let seconds = std::env::var("SOURCE_DATE_EPOCH").ok()?.parse().ok()?;
    Some(DateTime::from_timestamp(seconds, 0)?.format(DATE).to_string())
}

/// The FMU of a module or a scenario where no file is named.
fn named(target: &str) -> PathBuf {
    let name = Path::new(target).file_stem().unwrap_or_default();
    Path::new(name).with_extension("fmu")
}

/// Writes the FMU and says what it can do.
pub fn export(arguments: &ExportArguments) -> terraglue_diagnostics::Result<Exit> {
    let exported = write(&Request {
        target: arguments.target.clone(),
        sets: arguments.sets.clone(),
        module_paths: arguments.module_path.clone(),
        version: if arguments.fmi == 2 { Version::V2 } else { Version::V3 },
        scalars: arguments.scalars,
        origin: Origin {
            author: arguments.author.clone(),
            version: arguments.model_version.clone(),
            date: arguments.date.clone().or_else(source_date),
        },
        reference: !arguments.no_reference,
        out: arguments.output.clone().unwrap_or_else(|| named(&arguments.target)),
    })?;
    let states = match exported.states {
        [true, true] => "its state can be saved, restored and serialised",
        [true, false] => "its state can be saved and restored",
        _ => "its state cannot be saved",
    };
    let (path, fmi, count) = (exported.path.display(), arguments.fmi, exported.variables);
    let glibc = exported.glibc.map(|version| format!("; needs glibc {version} or later")).unwrap_or_default();
    outln!("{path}: FMI {fmi}.0 co-simulation, {count} variables; {states}{glibc}");
    if let Some(why) = exported.unproved {
        eprintln!("warning: it brings no results of its first steps with it: {why}");
    }
    for name in exported.isolated {
        eprintln!(
            "note: `{name}` runs in the process of the master that loads the FMU: `isolate` is left out"
        );
    }
    for name in exported.left_out {
        eprintln!("warning: `{name}` is left out: FMI {fmi}.0 has no type for it");
    }
    Ok(Exit::Done)
}
