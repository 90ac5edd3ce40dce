//! Folders and files of the workspace, and child processes that must succeed.

use std::path::{Path, PathBuf};
use std::process::Command;

/// Success, or a message for the developer.
pub type Outcome<T = ()> = Result<T, String>;

/// Root of the workspace.
pub fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.ancestors().nth(2).unwrap_or(here).to_owned()
}

/// Cargo's target folder.
pub fn target() -> PathBuf {
    std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), |dir| root().join(dir))
}

/// The program `terraglue` of a profile (`debug` or `release`).
pub fn program(profile: &str) -> PathBuf {
    target().join(profile).join("terraglue")
}

/// A command in the root of the workspace.
pub fn command(program: impl AsRef<std::ffi::OsStr>, arguments: &[&str]) -> Command {
    let mut command = Command::new(program);
    command.args(arguments).current_dir(root());
    command
}

/// Cargo in the root of the workspace.
pub fn cargo(arguments: &[&str]) -> Command {
    command(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()), arguments)
}

/// A developer program of the workspace, up to date. It is built with the features that the whole workspace asks for, as `cargo build
/// --workspace` and `cargo test --workspace` build it: alone it would compile its dependencies once more.
///
/// # Errors
/// Cargo cannot be started, or the program does not compile.
pub fn built(name: &str) -> Outcome<PathBuf> {
    must(&mut cargo(&["build", "--workspace", "--bin", name]))?;
    Ok(target().join("debug").join(name))
}

/// Prints a command that must succeed, and runs it.
///
/// # Errors
/// The command cannot be started, or ends with another status than success.
pub fn must(command: &mut Command) -> Outcome {
    let words: Vec<_> = command.get_args().map(|a| a.to_string_lossy().into_owned()).collect();
    let name =
        Path::new(command.get_program()).file_name().unwrap_or_default().to_string_lossy().into_owned();
    eprintln!("$ {name} {}", words.join(" "));
    let status = command.status().map_err(|e| format!("cannot start `{name}`: {e}"))?;
    if status.success() { Ok(()) } else { Err(format!("`{name} {}` ended with {status}", words.join(" "))) }
}

/// Reads a file of the workspace.
///
/// # Errors
/// The file cannot be read.
pub fn read(path: &Path) -> Outcome<String> {
    std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))
}

/// Writes a file and the folders above it.
///
/// # Errors
/// The file cannot be written.
pub fn write(path: &Path, text: &str) -> Outcome {
    let made = path.parent().map_or(Ok(()), std::fs::create_dir_all);
    made.and_then(|()| std::fs::write(path, text)).map_err(|e| format!("{}: {e}", path.display()))
}

/// Replaces the text between two marks.
pub fn between(text: &str, (begin, end): (&str, &str), new: &str) -> Option<String> {
    let start = text.find(begin)? + begin.len();
    let stop = start + text[start..].find(end)?;
    Some(format!("{}{new}{}", &text[..start], &text[stop..]))
}
