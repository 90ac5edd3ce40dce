//! Takes the commit that the program is built from.

use std::path::{Path, PathBuf};
use std::process::Command;

fn main() {
    // where cargo builds it now: the script itself may come from another checkout that shares the target folder
    let root = PathBuf::from(std::env::var_os("CARGO_MANIFEST_DIR").expect("cargo sets it")).join("../..");
    let root = root.canonicalize().expect("the root of the workspace");
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rustc-env=TERRAGLUE_VERSION={}", version(&root));
}

/// `0.1.0 (a546a18d01)`. Where git or its folder is missing the variable `TERRAGLUE_COMMIT` gives the commit, if it is set.
fn version(root: &Path) -> String {
    println!("cargo:rerun-if-env-changed=TERRAGLUE_COMMIT");
    let number = env!("CARGO_PKG_VERSION");
    let given = std::env::var("TERRAGLUE_COMMIT").ok().filter(|c| !c.is_empty());
    let Some(commit) = given.or_else(|| commit(root)) else { return number.into() };
    // a build of the developers does not begin again with every commit
    let debug = std::env::var("PROFILE").is_ok_and(|p| p == "debug");
    format!("{number} ({commit}{})", if debug { " or later, debug build" } else { "" })
}

fn commit(root: &Path) -> Option<String> {
    // the sources may lie, without a repository of their own, inside one of somebody else
    let top = PathBuf::from(git(root, &["rev-parse", "--show-toplevel"])?);
    if top.canonicalize().ok()? != root {
        return None;
    }
    if std::env::var("PROFILE").is_ok_and(|p| p == "release") {
        let log = git(root, &["rev-parse", "--path-format=absolute", "--git-path", "logs/HEAD"])?;
        println!("cargo:rerun-if-changed={log}");
    }
    git(root, &["rev-parse", "--short=10", "HEAD"])
}

fn git(root: &Path, words: &[&str]) -> Option<String> {
    let done = Command::new("git").arg("-C").arg(root).args(words).output().ok()?;
    let text = String::from_utf8(done.stdout).ok()?.trim().to_owned();
    (done.status.success() && !text.is_empty()).then_some(text)
}
