//! The developer commands, the same as in CI: `cargo xtask test | docs | validate | architecture | freeze | faults | header | schema | install | dist`.

mod architecture;
mod docs;
mod faults;
mod freeze;
mod header;
mod process;
mod schema;
mod test;
mod validate;

use clap::{Parser, Subcommand};
use process::Outcome;
use std::process::ExitCode;
use xtask_start::Install;

/// Developer commands.
#[derive(Parser, Debug)]
#[command(name = "cargo xtask", disable_help_subcommand = true)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand, Debug)]
enum Command {
    /// Run every test: Rust, Python, and the quick figures.
    Test,
    /// Make everything in docs/, README and scenarios again that is made from code or measured by it (ten minutes).
    Docs,
    /// Measure the figures that the areas promise and hold them against their limits.
    Validate(validate::Arguments),
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
    /// Print a hash of the automaton's state after a fixed run: `validate soil` runs this in another environment.
    #[command(hide = true)]
    SoilHash {
        /// A shorter run.
        #[arg(long)]
        quick: bool,
    },
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
    let done: Outcome = match Arguments::parse().command {
        Command::Test => test::test(),
        Command::Validate(arguments) => validate::validate(&arguments),
        Command::Docs => docs::write_all(),
        Command::Architecture { check } => architecture::run(check),
        Command::Freeze(arguments) => freeze::freeze(&arguments),
        Command::Faults => faults::write_page(),
        Command::Header { check } => header::run(check),
        Command::Pictures => docs::pictures(),
        Command::SoilHash { quick } => {
            validate::print_soil_hash(quick);
            Ok(())
        }
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
