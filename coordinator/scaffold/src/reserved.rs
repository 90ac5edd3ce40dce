//! Names that a language has taken: a module of that name would hide what its own code imports, or not compile.

use super::Language;

/// Modules of the standard library of Python 3.11 (`sys.stdlib_module_names`), lower-case ones without underscore in front.
const PYTHON: &str = include_str!("reserved/python_modules.txt");

/// Words of the language Python.
const PYTHON_WORDS: &str = include_str!("reserved/python_words.txt");

/// Crates that come with the compiler, and words of the language Rust.
const RUST: &str = include_str!("reserved/rust_words.txt");

/// The thing that a module of this name would hide; None: nothing.
pub(super) fn taken(name: &str, language: Language) -> Option<&'static str> {
    let file = name.replace('-', "_");
    let among = |words: &str| words.split_ascii_whitespace().any(|word| word == file);
    match language {
        Language::Python if file == "terraglue" || file.starts_with("terraglue_") => {
            Some("the library that a module in Python imports")
        }
        Language::Python if among(PYTHON) => Some("a module of Python's standard library"),
        Language::Python if among(PYTHON_WORDS) => Some("a word of the language Python"),
        Language::Rust if among(RUST) => Some("a crate or a word of the language Rust"),
        _ => None,
    }
}
