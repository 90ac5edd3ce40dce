//! Every numbered message has its page, every page its message, and every page of the plugin documents is reachable.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

/// Numbers TGnn after `before` in a text.
fn numbers(text: &str, before: &str) -> BTreeSet<String> {
    let numbered = |rest: &&str| {
        let digits = rest.strip_prefix("TG").map(|digits| digits.chars().take(2));
        digits.is_some_and(|mut digits| digits.all(|c| c.is_ascii_digit()))
    };
    text.split(before).skip(1).filter(numbered).map(|rest| rest.chars().take(4).collect()).collect()
}

fn sources(folder: &Path, out: &mut String) {
    for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
        let path = entry.path();
        if path.is_dir() {
            sources(&path, out);
        } else if path.extension().is_some_and(|e| e == "rs") {
            out.push_str(&read(&path));
        }
    }
}

#[test]
fn every_number_has_a_page_and_every_page_a_message() {
    let mut code = String::new();
    for folder in ["coordinator", "interfaces/plugin/src", "modules/soil/laws/src"] {
        sources(&root().join(folder), &mut code);
    }
    let (said, told) = (numbers(&code, "["), numbers(&read(&root().join("docs/plugins/errors.md")), "\n## "));
    assert_eq!(said, told);
    assert!(said.len() >= 12, "{said:?}");
}

#[test]
fn every_page_about_plugins_is_reachable_from_the_first() {
    let folder = root().join("docs/plugins");
    let (mut reached, mut open) = (BTreeSet::new(), vec!["README.md".to_owned()]);
    while let Some(page) = open.pop() {
        if !reached.insert(page.clone()) || !page.ends_with(".md") {
            continue;
        }
        for link in read(&folder.join(&page)).split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            let file = link.split('#').next().unwrap_or_default();
            if file.is_empty() || file.contains("://") {
                continue;
            }
            assert!(folder.join(file).is_file(), "{page} links to {file}, which does not exist");
            if !file.contains('/') {
                open.push(file.to_owned());
            }
        }
    }
    for entry in std::fs::read_dir(&folder).expect("the folder of the documents").flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        assert!(reached.contains(&name), "docs/plugins/{name} cannot be reached from README.md");
    }
}
