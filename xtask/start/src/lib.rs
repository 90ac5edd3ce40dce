//! The commands that install, apart from the other developer commands: those depend on all of Terraglue, which an install
//! would then compile twice.

mod install;
pub mod process;

use clap::Subcommand;
use process::Outcome;
use std::path::PathBuf;

/// The commands that build the release profile and nothing else.
#[derive(Subcommand, Debug)]
pub enum Install {
    /// Build and pack program, modules, models, scenarios and docs: target/dist/terraglue-….tar.gz.
    Dist {
        /// Pack an existing build: debug or release.
        #[arg(long, value_name = "PROFILE", value_parser = ["debug", "release"])]
        built: Option<String>,
    },
    /// Build and lay out bin, lib, include and share below PREFIX.
    Install {
        /// Where to, e.g. ~/.local.
        prefix: PathBuf,
        /// Lay out an existing build: debug or release.
        #[arg(long, value_name = "PROFILE", value_parser = ["debug", "release"])]
        built: Option<String>,
    },
}

impl Install {
    /// Does the command.
    ///
    /// # Errors
    /// The step of the installation that failed.
    pub fn done(&self) -> Outcome {
        match self {
            Self::Dist { built } => install::dist(built.as_deref()),
            Self::Install { prefix, built } => install::install(prefix, built.as_deref()),
        }
    }
}
