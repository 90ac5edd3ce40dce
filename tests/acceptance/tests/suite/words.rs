//! The words of the project: names that are gone stay gone, a few words are wrong everywhere, and terms of the code's own are in
//! `docs/glossary.md`.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Types, functions and modules that have another name now. Nothing may be declared by one of these.
const GONE: &[&str] = &[
    "Book",
    "Errand",
    "Exchange",
    "Happening",
    "Lab",
    "LogBook",
    "Nursery",
    "Partings",
    "Patience",
    "Rig",
    "Slave",
    "SlaveOptions",
    "SlaveState",
    "Surroundings",
    "Turn",
    "Unglued",
    "Will",
    "elsewhere",
    "leave_will",
    "orphans",
    "run_errand",
    "settle_bodies",
    "settle_closures",
    "settle_events",
    "settle_loops",
];

/// Files and folders that have another name now, as the end of a path.
const GONE_FILES: &[&str] = &[
    "conformance/src/elsewhere.rs",
    "conformance/src/lab.rs",
    "engine/src/testbed/unglued.rs",
    "fmi/src/slave",
    "fmu/src/feet",
    "gluing/src/exchange.rs",
    "gluing/src/side.rs",
    "host/src/orphans.rs",
    "host/src/patience.rs",
    "host/src/surroundings.rs",
    "isolation/nursery.rs",
];

/// Words that no text of the project has a use for.
const WRONG: &[&str] =
    &["errand", "errands", "happening", "happenings", "nurseries", "nursery", "partings", "slave", "slaves"];

/// Words of the glossary that the pages and the code lean on.
const EXPLAINED: &[&str] = &[
    "active set",
    "commit",
    "communication step",
    "contact patch",
    "energy ledger",
    "FMU instance",
    "participant",
    "port",
    "strategy",
    "T*",
    "T1",
    "trial",
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().expect("the workspace")
}

/// Texts of the workspace with one of the extensions, by their path in it. Built and hidden folders are left out.
fn texts() -> Vec<(String, String)> {
    let (mut all, mut folders) = (Vec::new(), vec![root()]);
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).expect("a folder").flatten() {
            let (path, name) = (entry.path(), entry.file_name().to_string_lossy().into_owned());
            if path.is_dir() && name != "target" && !name.starts_with('.') {
                folders.push(path);
            } else if [".rs", ".py", ".md", ".toml"].iter().any(|end| name.ends_with(end)) {
                let inside = path.strip_prefix(root()).expect("inside").display().to_string();
                all.extend(std::fs::read_to_string(&path).ok().map(|text| (inside, text)));
            }
        }
    }
    all.retain(|(name, _)| {
        name != "CHANGELOG.md" && !name.starts_with("docs/decisions/") && !name.ends_with("suite/words.rs")
    });
    assert!(all.len() > 500, "{} files are not the workspace", all.len());
    all
}

/// Whole words: runs of letters, digits and underscores.
fn words(line: &str) -> impl Iterator<Item = &str> {
    line.split(|c: char| !c.is_alphanumeric() && c != '_').filter(|word| !word.is_empty())
}

#[test]
fn no_name_that_is_gone_comes_back() {
    const DECLARE: &[&str] = &["struct", "enum", "trait", "type", "fn", "mod", "class", "def", "union"];
    let mut back = Vec::new();
    for (name, text) in texts().iter().filter(|(name, _)| name.ends_with(".rs") || name.ends_with(".py")) {
        back.extend(GONE_FILES.iter().filter(|gone| name.contains(**gone)).map(|_| name.clone()));
        for (k, line) in text.lines().enumerate() {
            let all: Vec<&str> = words(line).collect();
            let declares = |pair: &[&str]| DECLARE.contains(&pair[0]) && GONE.contains(&pair[1]);
            if all.windows(2).any(declares) && !line.trim_start().starts_with("//") {
                back.push(format!("{name}:{}: {}", k + 1, line.trim()));
            }
        }
    }
    assert!(back.is_empty(), "these have another name now (docs/glossary.md):\n{}", back.join("\n"));
}

#[test]
fn the_words_that_are_wrong_everywhere_stand_nowhere() {
    let mut found = Vec::new();
    for (name, text) in texts() {
        for (k, line) in text.lines().enumerate() {
            if let Some(word) = words(line).find(|word| WRONG.contains(&word.to_lowercase().as_str())) {
                found.push(format!("{name}:{}: {word}", k + 1));
            }
        }
    }
    assert!(found.is_empty(), "say it in the words of docs/glossary.md:\n{}", found.join("\n"));
}

#[test]
fn the_glossary_explains_each_word_once_and_in_order() {
    let text = std::fs::read_to_string(root().join("docs/glossary.md")).expect("the glossary");
    let rows = text.lines().filter(|line| line.starts_with("| ") && !line.starts_with("| word"));
    let explained: Vec<String> =
        rows.map(|line| line[2..].split(" |").next().unwrap_or_default().replace("`", "")).collect();
    let unique: BTreeSet<&String> = explained.iter().collect();
    assert_eq!(unique.len(), explained.len(), "a word stands twice");
    let mut sorted = explained.clone();
    sorted.sort_by_key(|word| word.to_lowercase());
    assert_eq!(explained, sorted, "the words stand in the order of the alphabet");
    let missing: Vec<&&str> =
        EXPLAINED.iter().filter(|word| !explained.iter().any(|w| w == **word)).collect();
    assert!(missing.is_empty(), "not explained: {missing:?}");
}
