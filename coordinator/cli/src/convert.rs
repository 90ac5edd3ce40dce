//! `terraglue convert`: a system structure (SSP) as a scenario, or a scenario as a system structure.

use super::Exit;
use super::arguments::ConvertArguments;
use super::output::outln;
use super::structure;
use std::path::{Path, PathBuf};
use terraglue_diagnostics::{Error, Result};
use terraglue_fmi::ssp::Package;
use terraglue_scenario::ssp;
use terraglue_scenario::{InputError, Scenario};

/// Writes the scenario, and the FMUs of an archive beside it.
pub fn convert(arguments: &ConvertArguments) -> Result<Exit> {
    let path = &arguments.structure;
    if let (Some(to), false) =
        (arguments.output.as_deref().filter(|to| Package::is_one(to)), Package::is_one(path))
    {
        return structure::write(path, to);
    }
    let out = arguments.output.clone().unwrap_or_else(|| path.with_extension("toml"));
    if !Package::is_one(path) {
        let message = format!("`{}` is no system structure (.ssp, .ssd)", path.display());
        let help =
            "an archive ends in .ssp, a single description in .ssd; a scenario of FMUs becomes one with `-o system.ssp`".to_owned();
        return Err(InputError::plain(message, Some(help)).into());
    }
    let wrong = |e: terraglue_fmi::Error| InputError::plain(e.to_string(), None);
    let package = Package::open(path).map_err(wrong)?;
    let prefix = prefix(&package, &out)?;
    let converted = ssp::convert(&package, &prefix).map_err(wrong)?;
    let folder = folder_of(&out);
    if package.is_archive() {
        for fmu in &converted.fmus {
            let to = folder.join(format!("{prefix}{fmu}"));
            let made = std::fs::create_dir_all(folder_of(&to));
            made.and_then(|()| std::fs::copy(package.folder().join(fmu), &to)).map_err(|e| at(&to, e))?;
        }
    }
    terraglue_subsystem::files::can_create(&out)
        .and_then(|()| std::fs::write(&out, &converted.text))
        .map_err(|e| at(&out, e))?;
    converted.notes.iter().for_each(|note| eprintln!("note: {note}"));
    let scenario = Scenario::load(&out, &[])?;
    let (fmus, connections) = (scenario.subsystems.len(), scenario.connections.len());
    outln!("{}: {fmus} FMUs, {connections} connections", out.display());
    Ok(Exit::Done)
}

/// Prefix of the files of FMUs, seen from the scenario: a folder for those of an archive.
fn prefix(package: &Package, out: &Path) -> Result<String> {
    if package.is_archive() {
        let stem = out.file_stem().unwrap_or_default().to_string_lossy();
        return Ok(format!("{stem}/"));
    }
    let [from, to] = [package.folder(), &folder_of(out)].map(|f| f.canonicalize().map_err(|e| at(f, e)));
    let (from, to) = (from?, to?);
    if from == to {
        return Ok(String::new());
    }
    let inside = from.strip_prefix(&to).map(Path::to_path_buf);
    Ok(format!("{}/", inside.unwrap_or(from).display()))
}

fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.to_owned(),
        _ => PathBuf::from("."),
    }
}

fn at(path: &Path, source: std::io::Error) -> Error {
    Error::File { path: path.display().to_string(), source }
}
