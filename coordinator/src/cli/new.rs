//! `terraglue new`: the folder of a new module.

use super::Exit;
use super::arguments::NewArguments;
use super::output::outln;
use std::path::Path;
use terraglue::Result;
use terraglue::scaffold::{Kind, Language, scaffold, spoken_program};
use terraglue::scenario::InputError;

/// Writes the folder and says what to type next.
pub fn new(arguments: &NewArguments) -> Result<Exit> {
    let wrong = |e: terraglue::scaffold::ScaffoldError| InputError::plain(e.to_string(), None);
    let usual = if arguments.kind == Kind::Law { Language::Scenario } else { Language::Rust };
    let program = spoken_program();
    let language = arguments.lang.unwrap_or(usual);
    let made = scaffold(arguments.kind, language, &arguments.name, &program).map_err(wrong)?;
    let folder = Path::new(&arguments.name);
    made.write(folder).map_err(wrong)?;
    outln!("{} files in {}. Next:\n", made.files.len(), folder.display());
    let [build, run] = &made.commands;
    outln!("  cd {} && {build}\n  {run}", folder.display());
    if let Some(bin) = Path::new(&program).parent().filter(|bin| bin.is_absolute()) {
        outln!("\nThe files call the program `terraglue`: export PATH={}:$PATH", bin.display());
    }
    Ok(Exit::Done)
}
