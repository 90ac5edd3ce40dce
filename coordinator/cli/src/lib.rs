//! The command line. No simulation logic: it reads arguments, drives the library and prints.
//!
//! Exit codes: 0 done, 1 the simulation or a check failed, 2 the input is wrong, 75 another process does it, 130 interrupted.

mod apart;
mod arguments;
mod browser;
mod check;
mod check_module;
mod compare;
mod convert;
mod export;
mod fit_files;
mod fit_soil;
mod fit_wheel;
mod fmu;
mod fmu_info;
mod folder;
mod interrupt;
mod list;
mod locate;
mod logger;
mod new;
mod output;
mod pace;
mod points;
mod progress;
mod report;
mod robot;
mod run;
mod scenario_arguments;
mod serve;
mod serve_arguments;
mod shorten;
mod shot;
mod shot_arguments;
mod show;
mod soil_module;
mod soils;
mod standard_output;
mod strict;
mod structure;
mod sweep;
mod sweep_arguments;
mod table_file;
mod testbed;
mod video;
mod video_arguments;
mod webm;
mod words;

use arguments::{Arguments, Command};
use clap::Parser;
use std::process::ExitCode;
use terraglue_diagnostics::Error;
use terraglue_host::{crash, descendants, exit_guard};

/// How a command ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exit {
    /// Done; diverged rows of a comparison are data.
    Done,
    /// The simulation or a check failed.
    Failed,
    /// The input is wrong.
    WrongInput,
    /// The user stopped it; the recording is closed.
    Interrupted,
    /// Another process does it now; later it can be tried again.
    Elsewhere,
}

impl Exit {
    /// Exit code of the program.
    fn code(self) -> u8 {
        match self {
            Self::Done => 0,
            Self::Failed => 1,
            Self::WrongInput => 2,
            Self::Interrupted => 130,
            // EX_TEMPFAIL of sysexits.h, a temporary failure
            Self::Elsewhere => 75,
        }
    }
}

/// Reads the arguments and does the command.
pub fn main() -> ExitCode {
    let arguments = Arguments::parse();
    if let Command::Worker { segment } = &arguments.command {
        return terraglue_host::isolation::serve(segment, &terraglue_fmu::library());
    }
    logger::install();
    standard_output::keep_apart_from_modules();
    descendants::adopt();
    // what the checker makes of modules that end the program is its own affair
    let armed = !matches!(arguments.command, Command::CheckModule(_) | Command::Modules { .. });
    if armed {
        crash::tell();
    }
    let armed = armed.then(exit_guard::arm);
    let exit = command(arguments.command);
    apart::done(exit.code());
    drop(armed);
    let left = descendants::end_all();
    if left > 0 {
        log::warn!("modules or FMUs left {left} processes behind; they were ended");
    }
    exit.code().into()
}

fn command(command: Command) -> Exit {
    let done = match command {
        Command::Run(arguments) => run::run(&arguments),
        Command::Compare(arguments) => compare::compare(&arguments),
        Command::Sweep(arguments) => sweep::sweep(&arguments),
        Command::Report { folder, points } => report::report(&folder, points.as_deref()),
        Command::Serve(arguments) => serve::serve(&arguments),
        Command::Shot(arguments) => shot::shot(&arguments),
        Command::Video(arguments) => video::video(&arguments),
        Command::Check(arguments) => check::check(&arguments),
        Command::CheckModule(arguments) => check_module::check_module(&arguments),
        Command::Modules { name, module_path, json, asked } => {
            list::modules(name.as_deref(), &module_path, json, asked)
        }
        Command::Variables(arguments) => list::variables(&arguments),
        Command::Fmu(command) => fmu::fmu(&command),
        Command::Export(arguments) => export::export(&arguments),
        Command::Convert(arguments) => convert::convert(&arguments),
        Command::Worker { .. } => Ok(Exit::Failed),
        Command::New(arguments) => new::new(&arguments),
        Command::Robot(arguments) => robot::robot(&arguments),
        Command::Soils { name, file, json } => soils::soils(name.as_deref(), file.as_deref(), json),
        Command::Locate(arguments) => locate::locate(&arguments),
        Command::FitSoil(arguments) => fit_soil::fit_soil(&arguments),
    };
    done.unwrap_or_else(|error| {
        show::error(&error);
        exit_of(&error)
    })
}

/// Exit of a command that an error ended.
pub fn exit_of(error: &Error) -> Exit {
    use std::io::ErrorKind::{InvalidInput, IsADirectory, NotADirectory, NotFound, PermissionDenied};
    match error {
        Error::Input(_) => Exit::WrongInput,
        // the path is wrong; a disk that is full or breaks is not the user's input
        Error::File { source, .. }
            if [NotFound, PermissionDenied, IsADirectory, NotADirectory, InvalidInput]
                .contains(&source.kind()) =>
        {
            Exit::WrongInput
        }
        _ => Exit::Failed,
    }
}
