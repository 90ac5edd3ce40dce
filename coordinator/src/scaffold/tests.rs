//! Names, languages and the number of files; the acceptance tests build, run and check what is made.

use super::*;

fn place() -> Place {
    Place { program: "terraglue".into(), interfaces: Some("/src/interfaces".into()) }
}

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
                let refused = scaffold(kind, language, "loose-sand", &place());
                assert!(matches!(refused, Err(ScaffoldError::Language { .. })), "{kind:?} {language:?}");
                continue;
            }
            let made = scaffold(kind, language, "loose-sand", &place()).expect("offered");
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
fn rust_needs_the_crates_and_nothing_is_overwritten() {
    let nowhere = Place { interfaces: None, ..place() };
    assert!(matches!(scaffold(Kind::Soil, Language::Rust, "a", &nowhere), Err(ScaffoldError::NoCrates)));
    let made = scaffold(Kind::Soil, Language::C, "a", &nowhere).expect("C needs no crates");
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
        let refused = scaffold(Kind::Soil, language, name, &place());
        assert!(
            matches!(&refused, Err(e @ ScaffoldError::Reserved { .. }) if e.to_string().contains("my-")),
            "{name}"
        );
    }
    assert!(scaffold(Kind::Soil, Language::C, "math", &place()).is_ok());
    assert!(scaffold(Kind::Soil, Language::Python, "my-math", &place()).is_ok());
}
