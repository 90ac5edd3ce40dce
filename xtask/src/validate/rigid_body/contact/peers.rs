//! The same cases on MuJoCo, measured in the same run: installed by name into a virtual environment of its own.
//!
//! Only in the long run with timing; where it cannot be had the column says `skip`.

use crate::process::{Outcome, command, root, target};
use crate::validate::{Context, Figure, Limit};
use std::process::Stdio;

const SCRIPT: &str = "xtask/src/validate/rigid_body/contact/peer_mujoco.py";
const REFERENCE: &str = "tests/reference/multibody";

/// All figures of the peer; none of them is judged.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    if !context.timing || context.quick {
        return Ok(Vec::new());
    }
    Ok(measured().unwrap_or_else(|why| vec![Figure::skipped("rigid-body.peer.mujoco", why)]))
}

fn measured() -> Outcome<Vec<Figure>> {
    let python = python()?;
    let file = |name: &str| root().join(REFERENCE).join(name).display().to_string();
    let (model, gait) = (file("hexapod.xml"), file("gait_tripod.csv"));
    let script = root().join(SCRIPT).display().to_string();
    let output = command(python, &[&script, &model, &gait]).output().map_err(|e| format!("{script}: {e}"))?;
    if !output.status.success() {
        let text = String::from_utf8_lossy(&output.stderr);
        return Err(format!("MuJoCo did not run: {}", text.trim().lines().last().unwrap_or("")));
    }
    let text = String::from_utf8_lossy(&output.stdout);
    Ok(text.lines().filter_map(figure).collect())
}

/// A line `name value what`.
fn figure(line: &str) -> Option<Figure> {
    let mut fields = line.split('\t');
    let (name, value, what) = (fields.next()?, fields.next()?, fields.next()?);
    let id = format!("rigid-body.peer.mujoco.{name}");
    Some(Figure::new(id, value.parse().ok()?, Limit::None, format!("MuJoCo: {what}")))
}

/// The Python of `target/peers`, with MuJoCo.
fn python() -> Outcome<std::path::PathBuf> {
    let folder = target().join("peers");
    let python = folder.join("bin/python");
    let has = |python: &std::path::Path| {
        let probe = command(python, &["-c", "import mujoco"]).stderr(Stdio::null()).status();
        probe.is_ok_and(|s| s.success())
    };
    if has(&python) {
        return Ok(python);
    }
    let run = |program: &std::path::Path, arguments: &[&str]| {
        let done = command(program, arguments).stdout(Stdio::null()).stderr(Stdio::null()).status();
        done.is_ok_and(|s| s.success())
    };
    let place = folder.display().to_string();
    let made = run("python3".as_ref(), &["-m", "venv", "--clear", &place]);
    if made && run(&python, &["-m", "pip", "install", "--quiet", "mujoco"]) && has(&python) {
        return Ok(python);
    }
    Err("MuJoCo is not here: `pip install mujoco` did not work".into())
}
