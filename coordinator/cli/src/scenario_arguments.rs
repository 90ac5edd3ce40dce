//! Arguments of every command that takes a scenario.

use clap::Args;
use std::path::PathBuf;

/// A scenario with its edits.
#[derive(Args, Debug, Clone)]
pub struct ScenarioArguments {
    /// Scenario file (TOML).
    pub scenario: PathBuf,
    /// Edit the scenario before it is checked; a bare word is text. May be repeated.
    #[arg(long = "set", value_name = "KEY.PATH=VALUE", value_parser = parse_set)]
    pub sets: Vec<(String, String)>,
    /// Search this folder for modules first; may be repeated.
    #[arg(long, value_name = "DIR", value_parser = parse_folder)]
    pub module_path: Vec<PathBuf>,
}

pub fn parse_set(text: &str) -> Result<(String, String), String> {
    terraglue_scenario::split_set(text).ok_or_else(|| "there is no `=`: write KEY.PATH=VALUE".into())
}

/// A folder that is there; one with a wrong name would hold no modules without a word.
pub fn parse_folder(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    match path.is_dir() {
        true => Ok(path),
        false => Err(format!("there is no folder `{text}`; modules are looked for in folders")),
    }
}
