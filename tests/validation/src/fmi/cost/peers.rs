//! The same FMUs in other masters, measured in the same run: installed by name into a virtual environment of its own.

use super::steps::{CASES, FmuCase, fmu};
use crate::process::{Outcome, command, target};
use crate::{Figure, Limit};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

const SCRIPT: &str = "tests/validation/src/fmi/cost/peers.py";
const PACKAGES: [&str; 6] =
    ["fmpy==0.3.32", "ecospy==0.7.2", "tbb", "libcosimpy==0.0.6", "fmu-manipulation-toolbox", "pyfmi"];

/// Figures of all peers; none of them is judged.
pub fn figures(folder: &Path) -> Vec<Figure> {
    measured(folder).unwrap_or_else(|why| vec![Figure::skipped("fmi.cost.peer", why)])
}

fn measured(folder: &Path) -> Outcome<Vec<Figure>> {
    python()?;
    let mut all = Vec::new();
    for peer in ["ecos", "libcosim", "fmpy", "fmucontainer"] {
        for case in &CASES {
            let id = format!("fmi.cost.peer.{peer}.{}", case.name);
            let what = format!("µs of CPU per FMU and step, nothing recorded: {peer}");
            all.push(match cost(folder, case, peer) {
                Ok(value) => Figure::new(id, value, Limit::None, what),
                Err(why) => Figure::skipped(id, why),
            });
        }
    }
    Ok(all)
}

/// Cost of a step of a case with another master, µs of CPU per FMU.
pub fn cost(folder: &Path, case: &FmuCase, peer: &str) -> Outcome<f64> {
    let file = folder.join(format!("{}.fmu", fmu(case)));
    let mut child = command(&python()?, &[SCRIPT, peer]);
    child.arg(&file).arg(case.fmus.to_string()).arg(if case.pair { "pair" } else { "chain" });
    child.arg(folder.join("bare_loop"));
    result(child).and_then(|t| t.trim().parse().map_err(|_| format!("it said {t}")))
}

/// The text that a script prints after `RESULT`, or the last line of its complaint.
pub fn result(mut script: Command) -> Outcome<String> {
    script.env("LD_LIBRARY_PATH", target().join("peers-fmi/lib"));
    let output = script.output().map_err(|e| e.to_string())?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let found = text.lines().find_map(|l| l.strip_prefix("RESULT ")).map(str::to_owned);
    found.ok_or_else(|| {
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        said.trim().lines().last().unwrap_or("it said nothing").to_owned()
    })
}

/// The Python of `target/peers-fmi`, with the peers that could be installed.
pub fn python() -> Outcome<PathBuf> {
    let folder = target().join("peers-fmi");
    let python = folder.join("bin/python");
    if python.exists() {
        return Ok(python);
    }
    let run = |program: &Path, arguments: &[&str]| {
        let done = command(program, arguments).stdout(Stdio::null()).stderr(Stdio::null()).status();
        done.is_ok_and(|s| s.success())
    };
    if !run("python3".as_ref(), &["-m", "venv", "--clear", &folder.display().to_string()]) {
        return Err("there is no python3 with venv for the peers".into());
    }
    for package in PACKAGES {
        if !run(&python, &["-m", "pip", "install", "--quiet", package]) {
            eprintln!("note: `pip install {package}` did not work");
        }
    }
    Ok(python)
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_script_is_there() {
        assert!(crate::process::root().join(super::SCRIPT).exists());
    }
}
