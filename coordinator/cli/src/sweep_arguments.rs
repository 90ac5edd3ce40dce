//! Arguments of `sweep`.

use crate::scenario_arguments::{parse_folder, parse_set};
use clap::{Args, Subcommand};
use std::path::PathBuf;

/// Arguments of `sweep`.
#[derive(Args, Debug, Clone)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true, after_help = EXAMPLES)]
pub struct SweepArguments {
    /// Command for the sweep of a folder.
    #[command(subcommand)]
    pub command: Option<SweepCommand>,
    /// A scenario with `[sweep]`, or a plan of its own: `scenario = "FILE.toml"` and `[sweep]`.
    #[arg(required = true)]
    pub plan: Option<PathBuf>,
    /// The new folder of the sweep.
    #[arg(short, long, value_name = "DIR", required = true)]
    pub out: Option<PathBuf>,
    /// Edit the scenario of every case; `sweep.points=100` edits a plan. May be repeated.
    #[arg(long = "set", value_name = "KEY.PATH=VALUE", value_parser = parse_set)]
    pub sets: Vec<(String, String)>,
    /// Search this folder for modules first; may be repeated.
    #[arg(long, value_name = "DIR", value_parser = parse_folder)]
    pub module_path: Vec<PathBuf>,
    /// Print the script of a Slurm array with a task for each case.
    #[arg(long, conflicts_with = "commands")]
    pub slurm: bool,
    /// Print one command for each case, for GNU parallel, HTCondor, Snakemake and others.
    #[arg(long)]
    pub commands: bool,
}

const EXAMPLES: &str = "\
Examples:
  terraglue sweep scenarios/rover_slope.toml -o runs/slopes      writes the list of cases
  terraglue sweep run runs/slopes -j 8                           does what is missing; stop it and start it at will
  terraglue sweep collect runs/slopes                            sweep.csv and sweep.html
  terraglue sweep scenarios/rover_slope.toml -o runs/slopes --commands | parallel -j 8
  terraglue sweep scenarios/rover_slope.toml -o runs/slopes --slurm | sbatch";

/// Commands for a sweep.
#[derive(Subcommand, Debug, Clone)]
pub enum SweepCommand {
    /// Run the cases that are missing. A case is done when its result was renamed into place; one that was killed runs again.
    Run(SweepRunArguments),
    /// Put all results into one table and one page.
    Collect {
        /// Folder of the sweep.
        folder: PathBuf,
        /// Print the counts and the paths as JSON.
        #[arg(long)]
        json: bool,
    },
}

/// Arguments of `sweep run`.
#[derive(Args, Debug, Clone)]
pub struct SweepRunArguments {
    /// Folder of the sweep.
    pub folder: PathBuf,
    /// Cases that run at a time, each in a process of its own [default: one per core].
    #[arg(short = 'j', long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=4096))]
    pub jobs: Option<u16>,
    /// This case alone, in this process, as tasks of a cluster do.
    #[arg(long, value_name = "K", conflicts_with_all = ["jobs", "again"])]
    pub case: Option<usize>,
    /// Run the cases again that did not reach their end.
    #[arg(long)]
    pub again: bool,
    /// No progress bar, no table.
    #[arg(long)]
    pub quiet: bool,
    /// End with the process of this number, which has started this one.
    #[arg(long, value_name = "PID", hide = true)]
    pub with_parent: Option<i32>,
}
