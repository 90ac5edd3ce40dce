//! `terraglue check-module`: finds the mistakes of a module before a robot falls over.
//!
//! Named tests over what a module promises in `terraglue.h`, from symbols to physics. [`check`] runs each in a process of
//! its own with a time limit, so that a crash or an endless loop is a finding like any other; [`run_here`] runs one in
//! this process, which is what those processes do and what a debugger needs. A test names the tests that it builds
//! on: when one of those fails it is blocked, so that one mistake is one finding.
//!
//! * [`catalogue`]: all tests, by area.
//! * [`TestContext`]: what a test works with: the module, its parameters, a source of randomness.
//! * `fixture`: steps a soil below moving feet, a robot, a controller, without the rest of the coordinator.

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod areas;
mod catalogue;
mod check_file;
mod definition;
mod derivative;
mod finding;
mod fixture;
mod last;
mod options;
mod other_process;
mod report;
mod sanitize;
mod scope;
mod supervisor;
mod test_context;

pub use catalogue::catalogue;
pub use definition::Test;
pub use finding::{Finding, Outcome, Stop, Verdict};
pub use last::{LastCheck, last_check, remember};
pub use options::Options;
pub use other_process::{RemoteRun, run_remote};
pub use report::{Report, TestResult};
pub use sanitize::{Fault, Sanitized, sanitize, sources_of};
pub use scope::{Area, Level};
pub use supervisor::{Told, check};
pub use test_context::TestContext;

use std::path::Path;
use terraglue_host::{SearchPath, is_path};

/// Runs one test in this process.
///
/// # Errors
/// There is no test of this name; the nearest one is named.
pub fn run_here(name: &str, context: &TestContext) -> Result<Outcome, String> {
    let tests = catalogue();
    match tests.iter().find(|t| t.name == name) {
        Some(test) => Ok(Outcome::of((test.run)(context))),
        None => Err(unknown(name, tests)),
    }
}

fn unknown(name: &str, tests: &[Test]) -> String {
    let likeness = |t: &&Test| (strsim::jaro_winkler(t.name, name) * 1e6) as u64;
    let near = tests.iter().max_by_key(likeness).map_or("", |t| t.name);
    format!("there is no test `{name}`; the nearest is `{near}`")
}

/// The module file that a path means: the file itself, the only module in a folder, or the module of that name on the
/// search path.
///
/// # Errors
/// No file there, not exactly one module in the folder, no module of that name: every place tried and the nearest name.
pub fn module_file(path: &Path) -> Result<std::path::PathBuf, String> {
    if !path.is_dir() {
        return match path.is_file() {
            true => Ok(path.to_owned()),
            false => named(path),
        };
    }
    let is_module = |p: &Path| {
        if terraglue_host::describes_module(p) {
            return true;
        }
        let name = p.file_name().and_then(|n| n.to_str()).unwrap_or_default();
        name.starts_with(std::env::consts::DLL_PREFIX)
            && name.ends_with(&format!("_plugin{}", std::env::consts::DLL_SUFFIX))
    };
    let entries = std::fs::read_dir(path).map_err(|e| format!("{}: {e}", path.display()))?;
    let mut found: Vec<_> = entries.flatten().map(|e| e.path()).filter(|p| is_module(p)).collect();
    match (found.pop(), found.is_empty()) {
        (Some(one), true) => Ok(one),
        (Some(_), false) => Err(format!("{} holds several modules; name one", path.display())),
        (None, _) => Err(format!(
            "{} holds no module (lib…_plugin{}, or a file in Python)",
            path.display(),
            std::env::consts::DLL_SUFFIX
        )),
    }
}

fn named(path: &Path) -> Result<std::path::PathBuf, String> {
    let (search, name) = (SearchPath::standard(&[], Path::new(".")), path.to_string_lossy());
    if let Some(file) = search.locate(&name).filter(|_| !is_path(&name)) {
        return Ok(file);
    }
    match terraglue_host::Library::new().find(&name, &search, Path::new(".")) {
        Ok(_) => Err(format!("`{name}` is part of the program, not a file that can be checked")),
        Err(e) => Err(e.to_string()),
    }
}
