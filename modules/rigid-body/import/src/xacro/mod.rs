//! xacro by its Python package: a process with bounds of its own, without a shell.
//!
//! xacro is Python inside XML, so Python evaluates it (docs/decisions/0018-xacro-runs-in-python-meshes-are-hulls.md).

use crate::Options;
use crate::error::Error;
use roxmltree::{Document, Node};
use std::ffi::OsString;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

const EXPAND: &str = include_str!("expand.py");

/// Exit code of `expand.py` if the package is missing.
const MISSING: i32 = 77;

/// Signal that ends a process that has used up its time.
const ALARM: i32 = 14;

/// Whether a text is xacro: an element of it, or one of its expressions.
pub(crate) fn is_xacro(document: &Document) -> bool {
    const EXPRESSIONS: [&str; 7] =
        ["${", "$(arg ", "$(find ", "$(eval ", "$(env ", "$(optenv ", "$(dirname)"];
    let expression = |text: &str| EXPRESSIONS.iter().any(|e| text.contains(e));
    let of_it = |node: Node| {
        node.tag_name().namespace().is_some_and(|s| s.contains("xacro"))
            || node.attributes().any(|a| expression(a.value()))
    };
    document.descendants().any(of_it)
}

/// The name of the expanded text in messages: its lines are not those of the file.
pub(crate) fn expanded_name(file: &str) -> String {
    format!("{file} (expanded by xacro)")
}

/// The URDF that a file expands to.
pub(crate) fn expand(path: &Path, options: &Options) -> Result<String, Error> {
    let wrong = |reason: String| Error::Read { file: path.display().to_string(), reason };
    let named = options.packages.iter().map(|(name, folder)| {
        let mut argument = OsString::from(format!("{name}="));
        argument.push(std::path::absolute(folder).unwrap_or_else(|_| folder.clone()));
        argument
    });
    let done = Command::new(interpreter())
        .args(["-c", EXPAND])
        .arg(path)
        .args(named)
        .args(&options.package_path)
        .stdin(Stdio::null())
        .output()
        .map_err(|e| wrong(format!("it is xacro, which needs Python 3: {e}; {}", way_out(path))))?;
    if !done.status.success() {
        return Err(wrong(failure(path, &done)));
    }
    String::from_utf8(done.stdout).map_err(|e| wrong(format!("xacro wrote what is no text: {e}")))
}

/// Python of the virtual environment, else that of the path.
fn interpreter() -> PathBuf {
    let environment = std::env::var_os("VIRTUAL_ENV").map(|folder| PathBuf::from(folder).join("bin/python"));
    environment.unwrap_or_else(|| "python3".into())
}

fn failure(path: &Path, done: &Output) -> String {
    if done.status.code() == Some(MISSING) {
        return format!("it is xacro, and the Python package of that name is not there; {}", way_out(path));
    }
    if done.status.signal() == Some(ALARM) {
        return "xacro did not end within 30 s; look for a macro that calls itself".into();
    }
    let said = String::from_utf8_lossy(&done.stderr);
    let said: Vec<&str> = said.lines().map(str::trim).filter(|l| !l.is_empty()).collect();
    // The last lines give the reason; those before are of no use to the author of the file.
    format!("xacro says: {}", said[said.len().saturating_sub(4)..].join("; "))
}

/// The command that gets it.
fn way_out(path: &Path) -> String {
    format!("`python3 -m pip install xacro` gets it (then read {} again)", path.display())
}
