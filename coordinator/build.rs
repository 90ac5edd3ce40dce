//! Takes the commit that the program is built from, and the sources of the interface crates, which new modules in Rust get
//! a copy of.

use std::fmt::Write;
use std::fs::{read_dir, read_to_string};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Crates of the interface, each without what a module does not need.
const CRATES: [&str; 2] = ["plugin", "subsystem"];

fn main() {
    // where cargo builds it now: the script itself may come from another checkout that shares the target folder
    let root = PathBuf::from(std::env::var_os("CARGO_MANIFEST_DIR").expect("cargo sets it")).join("..");
    let root = root.canonicalize().expect("the root of the workspace");
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rustc-env=TERRAGLUE_VERSION={}", version(&root));
    let out = PathBuf::from(std::env::var_os("OUT_DIR").expect("cargo sets it"));
    std::fs::write(out.join("crates.rs"), crates(&root)).expect("OUT_DIR can be written");
}

/// `0.1.0 (a546a18d01)`. Where git or its folder is missing the variable `TERRAGLUE_COMMIT` says the commit, or nothing does.
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

/// A list of paths in a new folder and texts, as Rust.
fn crates(root: &Path) -> String {
    let workspace = text(&root.join("Cargo.toml"));
    let mut list = String::from("&[\n");
    let mut add = |path: String, text: String| writeln!(list, "({path:?}, {text}),").expect("a text grows");
    for name in CRATES {
        let folder = root.join("interfaces").join(name);
        add(format!("terraglue/{name}/Cargo.toml"), format!("{:?}", manifest(&folder, &workspace)));
        for file in sources(&folder.join("src")) {
            println!("cargo:rerun-if-changed={}", file.display());
            let place = file.strip_prefix(&folder).expect("below").display();
            add(
                format!("terraglue/{name}/{place}"),
                format!("include_str!({:?})", file.display().to_string()),
            );
        }
    }
    // the versions that the program was built with, so that what is cached is used
    add("Cargo.lock".into(), format!("{:?}", text(&root.join("Cargo.lock"))));
    list + "]"
}

/// A manifest that stands alone: what it takes from the workspace is written out.
fn manifest(folder: &Path, workspace: &str) -> String {
    let own = text(&folder.join("Cargo.toml")).replace("[lints]\nworkspace = true\n", "");
    let line = |line: &str| match line.split_once(".workspace = true") {
        None => line.to_owned(),
        Some((key, _)) => {
            let found = workspace.lines().find(|l| l.split(" = ").next() == Some(key));
            found.expect("the workspace has the key").replace("interfaces/", "../")
        }
    };
    own.lines().map(|l| line(l) + "\n").collect()
}

fn sources(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in read_dir(folder).expect("a folder of sources").flatten() {
        match entry.path() {
            path if path.is_dir() => found.extend(sources(&path)),
            path => found.push(path),
        }
    }
    found.sort();
    found
}

fn text(path: &Path) -> String {
    println!("cargo:rerun-if-changed={}", path.display());
    read_to_string(path).expect("a file of the workspace")
}
