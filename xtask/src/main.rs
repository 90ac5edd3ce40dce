//! The developer commands, the same as in CI: `cargo xtask test | lint | ci | docs | validate | architecture | freeze | faults | header | schema | install | dist`.
//! Figures are measured by the program `terraglue-validation` (`tests/validation`), which the other commands do not compile.

mod architecture;
mod ci;
mod docs;
mod freeze;
mod header;
mod schema;
mod shape;
mod test;

use clap::{Parser, Subcommand};
use std::ffi::OsString;
use std::os::unix::process::CommandExt;
use std::process::ExitCode;
use xtask_start::Install;
use xtask_start::process::{Outcome, built, command};

/// Developer commands.
#[derive(Parser, Debug)]
#[command(name = "cargo xtask", disable_help_subcommand = true)]
struct CommandLine {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand, Debug)]
enum Command {
    /// Run every test: Rust, Python, and the quick figures.
    Test,
    /// Check the format, unused dependencies, licences and sources, and run clippy and rustdoc with warnings as errors.
    Lint,
    /// Run what CI runs: `lint` and `test`.
    Ci,
    /// Make everything in docs/, README and scenarios again that is made from code or measured by it (ten minutes).
    Docs,
    /// Measure the figures that the areas promise and hold them against their limits.
    #[command(disable_help_flag = true)]
    Validate {
        /// See `cargo xtask validate --help`.
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        arguments: Vec<OsString>,
    },
    /// Write the table and the drawing of the crates in docs/architecture.md from their manifests.
    Architecture {
        /// Change nothing; fail when the page is out of date.
        #[arg(long)]
        check: bool,
    },
    /// Write hashes of all decoded numbers to tests/freeze.tsv, or hold the numbers against them with --check.
    Freeze(freeze::Arguments),
    /// Run the fault scenarios and write the tables and the picture of docs/faults.md (some minutes).
    Faults,
    /// Write interfaces/plugin/include/terraglue.h from the Rust definitions of the C ABI.
    Header {
        /// Change nothing; fail when the file is out of date.
        #[arg(long)]
        check: bool,
    },
    /// Draw the pictures of docs/ that are computed: docs/images/moon_walk.svg, automaton_crater.svg, …
    Pictures,
    /// Write docs/scenario.schema.json and the key tables of docs/scenario.md.
    Schema {
        /// Change nothing; fail when a file is out of date.
        #[arg(long)]
        check: bool,
    },
    #[command(flatten)]
    Install(Install),
}

fn main() -> ExitCode {
    let done: Outcome = match CommandLine::parse().command {
        Command::Test => test::test(),
        Command::Lint => ci::lint(),
        Command::Ci => ci::run(),
        Command::Validate { arguments } => handed_on("validate", &arguments),
        Command::Docs => docs::write_all(),
        Command::Architecture { check } => architecture::run(check),
        Command::Freeze(arguments) => freeze::freeze(&arguments),
        Command::Faults => handed_on("faults", &[]),
        Command::Header { check } => header::run(check),
        Command::Pictures => handed_on("pictures", &[]),
        Command::Schema { check } => schema::write_files(check),
        Command::Install(install) => install.done(),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("error: {message}");
            ExitCode::FAILURE
        }
    }
}

/// The program that measures, up to date, in the root of the workspace.
fn validation(arguments: &[&str]) -> Outcome<std::process::Command> {
    Ok(command(built("terraglue-validation")?, arguments))
}

/// Becomes the program that measures, in the folder of the caller, whose paths the arguments may hold.
fn handed_on(name: &str, arguments: &[OsString]) -> Outcome {
    let mut command = validation(&[name])?;
    let here = std::env::current_dir().map_err(|e| format!("current folder: {e}"))?;
    Err(format!("cannot start the validation: {}", command.args(arguments).current_dir(here).exec()))
}
