//! `cargo xtask lint`: all checks that are no tests. `cargo xtask ci`: the same and every test, as in CI.

use crate::test;
use std::path::PathBuf;
use xtask_start::process::{Outcome, cargo, command, must, target};

/// Runs all of it; stops at the first that fails. `cargo test` runs the examples in the documentation.
pub fn run() -> Outcome {
    lint()?;
    test::test()
}

/// The format, unused dependencies, licences and sources, clippy and rustdoc with warnings as errors.
pub fn lint() -> Outcome {
    must(&mut cargo(&["fmt", "--all", "--check"]))?;
    with_tool("cargo-machete", &[], None)?;
    // it reads the manifests of all dependencies, those of other platforms, too
    let licences = ["check", "licenses", "bans", "sources"];
    with_tool("cargo-deny", &licences, Some(&["fetch", "--quiet", "--locked"]))?;
    must(&mut cargo(&["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"]))?;
    must(cargo(&["doc", "--workspace", "--no-deps"]).env("RUSTDOCFLAGS", "-D warnings"))
}

/// Runs a tool, after a preparation by cargo; reports `skip` where one of them needs the network and has none.
fn with_tool(name: &str, arguments: &[&str], prepared: Option<&[&str]>) -> Outcome {
    let ready = prepared.map_or(Ok(()), |arguments| must(&mut cargo(arguments)));
    match ready.and_then(|()| tool(name)) {
        Ok(program) => must(&mut command(program, arguments)),
        Err(why) => {
            println!("skip\t{name}\t{why}");
            Ok(())
        }
    }
}

/// A tool as it is found on the path, or as cargo installs it by its name into the target folder: in the profile that compiles quickly.
fn tool(name: &str) -> Outcome<PathBuf> {
    let place = target().join("tools");
    let own = place.join("bin").join(name);
    let path = std::env::var_os("PATH").unwrap_or_default();
    let mut places = std::env::split_paths(&path).map(|folder| folder.join(name)).chain([own.clone()]);
    if let Some(found) = places.find(|program| program.is_file()) {
        return Ok(found);
    }
    let root = place.display().to_string();
    must(&mut cargo(&["install", "--locked", "--quiet", "--debug", "--root", &root, name]))?;
    Ok(own)
}
