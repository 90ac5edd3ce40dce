//! Holds `docs/architecture.md` true: the arrows between crates, places of unsafe code, limits of numeric crates, and a
//! header in every file.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().expect("the workspace")
}

/// All files below a folder with that extension, as paths relative to the root.
fn files(folder: &str, extension: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut open = vec![root().join(folder)];
    while let Some(folder) = open.pop() {
        for entry in std::fs::read_dir(&folder).expect("a folder").flatten() {
            let path = entry.path();
            match path.is_dir() {
                true if path.file_name().is_some_and(|n| n != "target") => open.push(path),
                false if path.extension().is_some_and(|e| e == extension) => {
                    found.push(path.strip_prefix(root()).expect("below").to_owned());
                }
                _ => {}
            }
        }
    }
    found.sort();
    found
}

fn rust_files() -> Vec<PathBuf> {
    let folders = ["interfaces", "coordinator", "modules", "examples", "tests", "xtask"];
    folders.iter().flat_map(|folder| files(folder, "rs")).collect()
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(root().join(path)).expect("readable")
}

/// Crate name → (folder, names of its dependencies on crates of the workspace, tests excepted).
fn crates() -> BTreeMap<String, (PathBuf, Vec<String>)> {
    let manifests = ["interfaces", "coordinator", "modules", "tests"].iter().flat_map(|f| files(f, "toml"));
    let mut all: BTreeMap<String, (PathBuf, Vec<String>)> = manifests
        .filter(|path| path.file_name().is_some_and(|n| n == "Cargo.toml"))
        .map(|path| {
            let manifest: toml::Table = read(&path).parse().expect("TOML");
            let name = manifest["package"]["name"].as_str().expect("a name").to_owned();
            let keys = |table: &str| {
                manifest.get(table).and_then(|t| t.as_table()).into_iter().flat_map(|t| t.keys())
            };
            let dependencies = keys("dependencies").chain(keys("build-dependencies")).cloned().collect();
            (name, (path.parent().expect("a folder").to_owned(), dependencies))
        })
        .collect();
    let names: Vec<String> = all.keys().cloned().collect();
    for (_, dependencies) in all.values_mut() {
        dependencies.retain(|d| names.contains(d));
    }
    all
}

#[test]
fn every_readme_of_a_crate_begins_with_its_sentence() {
    for path in ["interfaces", "coordinator", "modules"].iter().flat_map(|folder| files(folder, "toml")) {
        let Ok(manifest) = read(&path).parse::<toml::Table>() else { continue };
        let Some(package) = manifest.get("package").filter(|_| path.ends_with("Cargo.toml")) else {
            continue;
        };
        let [name, sentence] = ["name", "description"].map(|key| package[key].as_str().expect("a text"));
        let page = read(&path.with_file_name("README.md"));
        assert!(page.starts_with(&format!("# {name}\n\n{sentence}\n")), "{}", path.display());
    }
}

#[test]
fn what_cargo_xtask_starts_builds_nothing_of_ours() {
    let aliases: toml::Table = read(Path::new(".cargo/config.toml")).parse().expect("TOML");
    let started = aliases["alias"]["xtask"].as_str().expect("an alias").split_whitespace().nth(2);
    let manifests =
        files("xtask", "toml").into_iter().map(|path| read(&path).parse::<toml::Table>().expect("TOML"));
    let mut named = manifests.filter(|m| m["package"]["name"].as_str() == started);
    let manifest = named.next().expect("the package of the alias");
    let ours = crates();
    let names = manifest["dependencies"].as_table().expect("dependencies").keys();
    let built: Vec<&String> = names.filter(|name| ours.contains_key(*name)).collect();
    assert!(built.is_empty(), "`cargo xtask install` compiles these twice: {built:?}");
}

#[test]
fn the_coordinator_uses_no_plugin_in_code() {
    let plugins =
        ["rigid_body_plugin", "soil_cellular_automaton_plugin", "soil_bekker_plugin", "gait_plugin"];
    for path in files("coordinator", "rs") {
        let text = read(&path);
        for line in text.lines().filter(|l| l.trim_start().starts_with("use ")) {
            assert!(!plugins.iter().any(|p| line.contains(p)), "{}: {line}", path.display());
        }
    }
}

/// Lines of a file without comments and without what `//` and string quotes hide.
fn code_lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    text.lines().enumerate().map(|(i, line)| (i + 1, line.split("//").next().unwrap_or_default()))
}

fn has_word(line: &str, word: &str) -> bool {
    line.split(|c: char| !c.is_alphanumeric() && c != '_').any(|w| w == word)
}

#[test]
fn unsafe_code_stands_only_at_the_borders() {
    let borders = [
        "interfaces/plugin",
        "interfaces/fmi",
        "coordinator/host",
        "coordinator/fmu/library",
        "tests/acceptance",
    ];
    for path in rust_files().iter().filter(|p| !borders.iter().any(|b| p.starts_with(b))) {
        let text = read(path);
        // names of options of other programs are no code
        let code = |line: &str| line.split('"').step_by(2).collect::<String>();
        let found = code_lines(&text).find(|(_, line)| has_word(&code(line), "unsafe"));
        assert!(found.is_none(), "{}:{}: unsafe code", path.display(), found.map_or(0, |f| f.0));
    }
}

/// Sources of the crates whose manifests say `[package.metadata.terraglue] numeric = true`.
fn numeric_folders() -> Vec<String> {
    let manifests = ["interfaces", "modules"].iter().flat_map(|f| files(f, "toml"));
    let numeric = |path: PathBuf| {
        let manifest: toml::Table = read(&path).parse().ok()?;
        let marked = manifest.get("package")?.get("metadata")?.get("terraglue")?.get("numeric")?.as_bool()?;
        marked.then(|| path.with_file_name("src").display().to_string())
    };
    manifests.filter_map(numeric).collect()
}

#[test]
fn every_module_that_steps_is_numeric() {
    let numeric = numeric_folders();
    for folder in
        ["modules/gait", "modules/rigid-body", "modules/soil/cellular-automaton", "modules/soil/bekker"]
    {
        assert!(numeric.contains(&format!("{folder}/src")), "{folder} is not marked `numeric = true`");
    }
}

#[test]
fn numeric_crates_touch_no_clock_no_file_and_no_thread() {
    let forbidden = ["Instant", "SystemTime", "std::fs", "std::thread", "HashMap", "std::net", "std::env"];
    let numeric = numeric_folders();
    assert!(numeric.len() > 8, "only {numeric:?} are marked `numeric = true`");
    let is_test = |p: &PathBuf| {
        p.components()
            .any(|c| matches!(c.as_os_str().to_str(), Some("tests" | "tests.rs" | "benches" | "examples")))
    };
    let all = numeric.iter().flat_map(|folder| files(folder, "rs"));
    for path in all.filter(|p| !is_test(p)) {
        let text = read(&path);
        let before_tests = text.split("#[cfg(test)]").next().unwrap_or_default();
        for (number, line) in code_lines(before_tests) {
            let found = forbidden.iter().find(|f| match f.contains(':') {
                true => line.contains(*f),
                false => has_word(line, f),
            });
            assert!(found.is_none(), "{}:{number}: {}", path.display(), found.unwrap_or(&""));
        }
    }
}

/// `test = false` saves a program for each crate without tests of its own; a test in such a crate would never run.
#[test]
fn sources_whose_tests_are_not_built_have_none() {
    let manifests = ["interfaces", "coordinator", "modules", "tests", "xtask"];
    let mut left_out = 0;
    for path in manifests.iter().flat_map(|folder| files(folder, "toml")) {
        let manifest: toml::Table = read(&path).parse().expect("TOML");
        let library = manifest.get("lib").and_then(|lib| lib.get("test"));
        if library.and_then(toml::Value::as_bool) != Some(false) {
            continue;
        }
        left_out += 1;
        for source in files(&path.with_file_name("src").display().to_string(), "rs") {
            let text = read(&source);
            let found =
                code_lines(&text).find(|(_, line)| line.contains("#[test]") || line.contains("proptest!"));
            let line = found.map_or(0, |(number, _)| number);
            assert!(found.is_none(), "{}:{line}: {} says `test = false`", source.display(), path.display());
        }
    }
    assert!(left_out > 20, "{left_out}");
}

#[test]
fn every_file_says_what_it_is() {
    for path in rust_files() {
        let text = read(&path);
        assert!(text.starts_with("//!"), "{} does not open with `//!`", path.display());
        assert!(!text.starts_with("//! Filled in below"), "{} is empty", path.display());
    }
}

#[test]
fn files_stay_readable() {
    for path in rust_files() {
        let lines = read(&path).lines().count();
        assert!(lines <= 700, "{} has {lines} lines: split it", path.display());
    }
}

#[test]
fn the_map_names_only_what_exists() {
    let map = read(Path::new("docs/architecture.md"));
    let named =
        map.split('`').skip(1).step_by(2).filter(|w| w.contains('/') && !w.contains([' ', '<', '*', '…']));
    let mut count = 0;
    for name in named {
        assert!(root().join(name).exists(), "docs/architecture.md names `{name}`, which does not exist");
        count += 1;
    }
    assert!(count > 15, "only {count} folders found in the map");
}
