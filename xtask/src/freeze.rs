//! `cargo xtask freeze`: hashes of the decoded numbers of all scenarios, of exported FMUs and of the quick figures.
//!
//! Code that is moved, split, renamed or deleted must leave every number equal to the bit; a change of physics or of
//! numerics writes the file anew in a separate commit that states it. Scenario texts, metadata and timings do not
//! count. Numbers are equal on one kind of processor only, so CI does not check them.

mod digest;
mod exported;
mod runs;

use crate::validation;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use xtask_start::process::{Outcome, cargo, must, program, read, root, target, write};

/// Arguments of `cargo xtask freeze`.
#[derive(clap::Args, Debug)]
pub struct Arguments {
    /// Change nothing; fail where a number differs.
    #[arg(long)]
    check: bool,
    /// Leave the quick figures out (they take most of the time).
    #[arg(long)]
    no_figures: bool,
    /// Measure this program instead of building one, without the quick figures.
    #[arg(long, value_name = "FILE")]
    program: Option<PathBuf>,
}

/// Hash by name, e.g. `run.moon_walk.soil-bekker.iterative.energy`.
pub type Hashes = BTreeMap<String, String>;

fn file() -> PathBuf {
    root().join("tests/freeze.tsv")
}

/// Measures; then writes `tests/freeze.tsv`, or compares with it.
pub fn freeze(arguments: &Arguments) -> Outcome {
    let built = program("debug");
    let program = arguments.program.as_deref().unwrap_or(&built);
    if arguments.program.is_none() {
        must(&mut cargo(&["build", "--workspace"]))?;
    }
    let no_figures = arguments.no_figures || arguments.program.is_some();
    let scratch = target().join("freeze");
    let mut found = runs::hashes(program, &scratch)?;
    found.extend(exported::hashes(program, &scratch)?);
    if !no_figures {
        found.extend(figures()?);
    }
    if arguments.check { compare(&found, no_figures) } else { store(&found, no_figures) }
}

/// Bits of the quick figures, as the validators print them.
fn figures() -> Outcome<Hashes> {
    let output = validation(&["bits"])?.stderr(Stdio::inherit()).output();
    let output = output.map_err(|e| format!("cannot start the validation: {e}"))?;
    if !output.status.success() {
        return Err("the quick figures could not be measured".into());
    }
    let text = String::from_utf8_lossy(&output.stdout);
    let rows = text.lines().filter_map(|line| line.split_once('\t'));
    Ok(rows.map(|(id, bits)| (format!("figure.{id}"), bits.to_owned())).collect())
}

fn stored(path: &Path) -> Outcome<Hashes> {
    let text = read(path)?;
    Ok(text
        .lines()
        .filter_map(|line| line.split_once('\t'))
        .map(|(name, hash)| (name.to_owned(), hash.to_owned()))
        .collect())
}

fn is_figure(name: &str) -> bool {
    name.starts_with("figure.")
}

fn store(found: &Hashes, keep_figures: bool) -> Outcome {
    let mut all = found.clone();
    if keep_figures && file().is_file() {
        all.extend(stored(&file())?.into_iter().filter(|(name, _)| is_figure(name)));
    }
    let lines: String = all.iter().map(|(name, hash)| format!("{name}\t{hash}\n")).collect();
    write(&file(), &lines)
}

fn compare(found: &Hashes, without_figures: bool) -> Outcome {
    let mut wanted = stored(&file())?;
    wanted.retain(|name, _| !(without_figures && is_figure(name)));
    let names: std::collections::BTreeSet<&String> = wanted.keys().chain(found.keys()).collect();
    let total = names.len();
    let changed: Vec<&str> =
        names.into_iter().filter(|n| wanted.get(*n) != found.get(*n)).map(String::as_str).collect();
    println!("{} of {total} hashes are equal", total - changed.len());
    match changed.is_empty() {
        true => Ok(()),
        false => Err(format!("numbers differ from tests/freeze.tsv:\n       {}", changed.join("\n       "))),
    }
}
