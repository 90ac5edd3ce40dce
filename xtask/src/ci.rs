//! `cargo xtask ci`: what CI runs. The format and every test; on request lints, unused dependencies and licences.

use crate::test;
use std::path::PathBuf;
use std::process::Command;
use xtask_start::process::{Outcome, cargo, command, must, target};

/// What CI is asked for.
#[derive(clap::Args, Debug)]
pub struct Arguments {
    /// Run clippy and rustdoc with warnings as errors, too: the code has some left.
    #[arg(long)]
    lints: bool,
    /// Look for unused dependencies, too, by cargo-machete.
    #[arg(long)]
    machete: bool,
    /// Check licences, bans and sources of all dependencies, too; the checker compiles for minutes the first time.
    #[arg(long)]
    deny: bool,
}

/// Runs all of it; stops at the first that fails. `cargo test` runs the examples in the documentation.
pub fn run(arguments: &Arguments) -> Outcome {
    must(&mut cargo(&["fmt", "--all", "--check"]))?;
    if arguments.lints {
        must(&mut cargo(&["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"]))?;
        must(cargo(&["doc", "--workspace", "--no-deps"]).env("RUSTDOCFLAGS", "-D warnings"))?;
    }
    if arguments.machete {
        with_tool("cargo-machete", |program| command(program, &["--with-metadata"]))?;
    }
    if arguments.deny {
        with_tool("cargo-deny", |program| command(program, &["check", "licenses", "bans", "sources"]))?;
    }
    test::test()
}

/// Runs a tool that cargo installs by its name into the target folder; says `skip` where it cannot be installed.
fn with_tool(name: &str, check: impl Fn(&PathBuf) -> Command) -> Outcome {
    let place = target().join("tools");
    let program = place.join("bin").join(name);
    if !program.is_file() {
        let root = place.display().to_string();
        let installed = must(&mut cargo(&["install", "--locked", "--quiet", "--root", &root, name]));
        if let Err(why) = installed {
            println!("skip\t{name}\tit cannot be installed here: {why}");
            return Ok(());
        }
    }
    must(&mut check(&program))
}
