//! `cargo xtask test`: every test, the Python ones in a virtual environment of their own.

use crate::validation;
use std::path::PathBuf;
use xtask_start::process::{Outcome, cargo, command, must, program, read, root, target, write};

/// Builds once, then runs Rust tests, Python tests and the quick figures.
pub fn test() -> Outcome {
    must(&mut cargo(&["build", "--workspace"]))?;
    must(&mut cargo(&["test", "--workspace", "--no-fail-fast"]))?;
    let python = virtual_environment()?;
    // a file is the work of one process: its tests share its fixtures
    let in_parallel = ["-n", "auto", "--maxprocesses", "4", "--dist", "loadfile", "--durations", "20"];
    let tests = [&["-m", "pytest", "-q", "tests/python"], &in_parallel[..]].concat();
    must(command(python, &tests).env("TERRAGLUE_BIN", program("debug")).env("PYTHONDONTWRITEBYTECODE", "1"))?;
    must(&mut validation(&["validate", "--quick", "--check-docs"])?)
}

/// The Python of `target/venv`, with what `tests/python/requirements.txt` asks for.
pub fn virtual_environment() -> Outcome<PathBuf> {
    let venv = target().join("venv");
    let python = venv.join("bin/python");
    let requirements = root().join("tests/python/requirements.txt");
    // Large wheels that not every platform has; tests that need one are skipped with a reason.
    let optional = root().join("tests/python/requirements-optional.txt");
    let wanted = read(&requirements)? + &read(&optional)?;
    let stamp = venv.join("requirements.txt");
    if python.is_file() && std::fs::read_to_string(&stamp).is_ok_and(|installed| installed == wanted) {
        return Ok(python);
    }
    make(&venv)?;
    let install = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check"];
    let pip = |what: &[&str]| must(&mut command(&python, &[&install[..], what].concat()));
    pip(&["-r", &requirements.display().to_string()])?;
    if pip(&["-r", &optional.display().to_string()]).is_err() {
        for package in read(&optional)?.lines().filter(|line| !line.is_empty() && !line.starts_with('#')) {
            if pip(&[package]).is_err() {
                eprintln!("{package} cannot be installed; the tests that need it are skipped");
            }
        }
    }
    write(&stamp, &wanted)?;
    Ok(python)
}

fn make(venv: &std::path::Path) -> Outcome {
    let probe = command("python3", &["-c", "import sys, venv, ensurepip; assert sys.version_info >= (3, 9)"])
        .stderr(std::process::Stdio::null())
        .status();
    match probe {
        Err(e) => Err(format!("cannot start python3 ({e}): install the package `python3`")),
        Ok(status) if !status.success() => {
            Err("this Python (3.9 or newer is needed) cannot make virtual environments: install the package \
             `python3-venv` (Debian, Ubuntu: sudo apt install python3-venv)"
                .into())
        }
        Ok(_) => must(&mut command("python3", &["-m", "venv", "--clear", &venv.display().to_string()])),
    }
}
