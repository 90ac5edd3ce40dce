//! Names, languages and the number of files; the acceptance tests build, run and check what is made.

use super::*;

const PROGRAM: &str = "/bin/terraglue";

#[test]
fn names_that_files_and_crates_can_carry() {
    for good in ["my-soil", "soil2", "a"] {
        assert!(check_name(good).is_ok(), "{good}");
    }
    for bad in ["", "-a", "a-", "a--b", "Soil", "my_soil", "2soil", "a/b", "ä"] {
        assert!(matches!(check_name(bad), Err(ScaffoldError::Name(_))), "{bad}");
    }
    assert!(matches!(check_name("soil-bekker"), Err(ScaffoldError::Taken(_))));
}

#[test]
fn at_most_eight_files_and_nothing_left_to_fill_in() {
    for kind in Kind::ALL {
        for language in Language::ALL {
            if language == Language::Scenario && kind != Kind::Law {
                let refused = scaffold(kind, language, "loose-sand", PROGRAM);
                assert!(matches!(refused, Err(ScaffoldError::Language { .. })), "{kind:?} {language:?}");
                continue;
            }
            let made = scaffold(kind, language, "loose-sand", PROGRAM).expect("offered");
            assert!(made.files.len() <= 8, "{kind:?} {language:?}");
            let source = made.files.iter().find(|(path, _)| {
                path.ends_with(".c")
                    || path.ends_with(".cpp")
                    || path == "src/lib.rs"
                    || path == "loose_sand.py"
            });
            if let Some((path, text)) = source.filter(|_| kind == Kind::Law) {
                assert!(text.lines().count() <= 40, "{path}: {} lines", text.lines().count());
            }
            for (path, text) in &made.files {
                for word in ["my-module", "my_module", "@terraglue@", "@module@", "@kind@", "@source@"] {
                    assert!(
                        !text.contains(word) && !path.contains(word),
                        "{kind:?} {language:?} {path}: {word}"
                    );
                }
            }
            let readme = &made.files.iter().find(|(path, _)| path == "README.md").expect("a page").1;
            assert!((15..=20).contains(&readme.lines().count()), "{}", readme.lines().count());
        }
    }
}

#[test]
fn a_module_in_rust_brings_the_crates_and_names_no_folder_of_the_machine() {
    let made = scaffold(Kind::Soil, Language::Rust, "a", PROGRAM).expect("offered");
    let paths: Vec<&str> = made.crates.iter().map(|(path, _)| *path).collect();
    for path in ["Cargo.lock", "terraglue/plugin/Cargo.toml", "terraglue/subsystem/src/lib.rs"] {
        assert!(paths.contains(&path), "{path} is not in {paths:?}");
    }
    let own = made.files.iter().map(|(path, text)| (path.as_str(), text.as_str()));
    for (path, text) in own.chain(made.crates.iter().copied()) {
        assert!(!text.contains("/bin/terraglue") && !text.contains(env!("CARGO_MANIFEST_DIR")), "{path}");
        assert!(!path.ends_with("Cargo.toml") || !text.contains("workspace = true"), "{path}: {text}");
    }
}

#[test]
fn nothing_is_overwritten() {
    let made = scaffold(Kind::Soil, Language::C, "a", PROGRAM).expect("offered");
    assert!(made.crates.is_empty());
    let folder = tempfile::tempdir().expect("folder");
    assert!(matches!(made.write(folder.path()), Err(ScaffoldError::Exists(_))));
    made.write(&folder.path().join("a")).expect("written");
    assert!(folder.path().join("a/terraglue.h").is_file());
}

#[test]
fn names_that_the_language_has_taken() {
    for (name, language) in [
        ("terraglue", Language::Python),
        ("terraglue-soil", Language::Python),
        ("math", Language::Python),
        ("py-compile", Language::Python),
        ("class", Language::Python),
        ("test", Language::Rust),
        ("proc-macro", Language::Rust),
    ] {
        let refused = scaffold(Kind::Soil, language, name, PROGRAM);
        assert!(
            matches!(&refused, Err(e @ ScaffoldError::Reserved { .. }) if e.to_string().contains("my-")),
            "{name}"
        );
    }
    assert!(scaffold(Kind::Soil, Language::C, "math", PROGRAM).is_ok());
    assert!(scaffold(Kind::Soil, Language::Python, "my-math", PROGRAM).is_ok());
}
