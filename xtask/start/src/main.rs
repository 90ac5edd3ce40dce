//! `cargo xtask`: installs by itself, and hands every other command to the package xtask, which takes long to compile.

use clap::{Parser, Subcommand};
use std::os::unix::process::CommandExt;
use std::process::{Command, ExitCode};
use xtask_start::Install;
use xtask_start::process::built;

/// Developer commands.
#[derive(Parser, Debug)]
#[command(name = "cargo xtask", bin_name = "cargo xtask", disable_help_subcommand = true)]
struct Arguments {
    #[command(subcommand)]
    command: Install,
}

fn main() -> ExitCode {
    let arguments: Vec<_> = std::env::args_os().skip(1).collect();
    let first = arguments.first().and_then(|a| a.to_str()).unwrap_or_default();
    let message = match Install::has_subcommand(first) {
        true => match Arguments::parse().command.done() {
            Ok(()) => return ExitCode::SUCCESS,
            Err(message) => message,
        },
        false => {
            // in the folder of the caller, whose paths the arguments may hold
            match built("xtask") {
                Ok(xtask) => format!("cannot start xtask: {}", Command::new(xtask).args(arguments).exec()),
                Err(message) => message,
            }
        }
    };
    eprintln!("error: {message}");
    ExitCode::FAILURE
}
