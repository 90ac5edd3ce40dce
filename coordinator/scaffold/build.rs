//! Takes the sources of the interface crates, which new modules in Rust get a copy of.

use std::fmt::Write;
use std::fs::{read_dir, read_to_string};
use std::path::{Path, PathBuf};

/// Crates of the interface, each without what a module does not need.
const CRATES: [&str; 2] = ["plugin", "subsystem"];

fn main() {
    // where cargo builds it now: the script itself may come from another checkout that shares the target folder
    let root = PathBuf::from(std::env::var_os("CARGO_MANIFEST_DIR").expect("cargo sets it")).join("../..");
    let root = root.canonicalize().expect("the root of the workspace");
    println!("cargo:rerun-if-changed=build.rs");
    let out = PathBuf::from(std::env::var_os("OUT_DIR").expect("cargo sets it"));
    std::fs::write(out.join("crates.rs"), crates(&root)).expect("OUT_DIR can be written");
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

/// A self-contained manifest: keys inherited from the workspace are written out.
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
