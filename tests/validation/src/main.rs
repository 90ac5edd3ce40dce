//! The program behind `cargo xtask validate | faults | pictures`.

use clap::{Parser, Subcommand};
use std::process::ExitCode;

/// Measured figures, and the pictures and tables of docs/.
#[derive(Parser, Debug)]
#[command(name = "cargo xtask", bin_name = "cargo xtask", disable_help_subcommand = true)]
struct CommandLine {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand, Debug)]
enum Command {
    /// Measure the figures that the areas promise and hold them against their limits.
    Validate(terraglue_validation::Arguments),
    /// Run the fault scenarios and write the tables and the picture of docs/faults.md (some minutes).
    Faults,
    /// Draw the pictures of docs/ that are computed: docs/images/moon_walk.svg, automaton_crater.svg, …
    Pictures,
    /// Write docs/validation.md from the stored figures, without measuring.
    #[command(hide = true)]
    Page,
    /// Print the bits of the quick figures, for `cargo xtask freeze`.
    #[command(hide = true)]
    Bits,
    /// Print a hash of the automaton's state after a fixed run: `validate soil` runs this in another environment.
    #[command(hide = true)]
    SoilHash {
        /// A shorter run.
        #[arg(long)]
        quick: bool,
    },
}

fn main() -> ExitCode {
    let done = match CommandLine::parse().command {
        Command::Validate(arguments) => terraglue_validation::validate(&arguments),
        Command::Faults => terraglue_validation::write_faults_page(),
        Command::Pictures => terraglue_validation::write_pictures(),
        Command::Page => terraglue_validation::write_summary_page(),
        Command::Bits => terraglue_validation::print_bits(),
        Command::SoilHash { quick } => {
            terraglue_validation::print_soil_hash(quick);
            Ok(())
        }
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("error: {message}");
            ExitCode::FAILURE
        }
    }
}
