//! MuJoCo's column: its Python package in a virtual environment of its own, `target/peers`.

use super::reference;
use crate::process::{Outcome, command as start, root, target};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

const SCRIPT: &str = "tests/validation/src/rigid_body/peers/peer_mujoco.py";

/// The command that measures it; `parts`: only these.
pub fn command(parts: &[&str]) -> Outcome<Command> {
    let folder = reference("").display().to_string();
    let mut command = start(python()?, &[&root().join(SCRIPT).display().to_string(), &folder]);
    command.args(parts);
    // it leaves a log where it runs
    command.current_dir(target().join("peers"));
    Ok(command)
}

/// The Python of `target/peers`, with MuJoCo.
fn python() -> Outcome<PathBuf> {
    let folder = target().join("peers/python");
    let python = folder.join("bin/python");
    let run = |program: &Path, arguments: &[&str]| {
        let done = start(program, arguments).stdout(Stdio::null()).stderr(Stdio::null()).status();
        done.is_ok_and(|s| s.success())
    };
    let has = || run(&python, &["-c", "import mujoco"]);
    if has() {
        return Ok(python);
    }
    let place = folder.display().to_string();
    let made = run("python3".as_ref(), &["-m", "venv", "--clear", &place]);
    if made && run(&python, &["-m", "pip", "install", "--quiet", "mujoco"]) && has() {
        return Ok(python);
    }
    Err("MuJoCo is not here: `pip install mujoco` did not work".into())
}
