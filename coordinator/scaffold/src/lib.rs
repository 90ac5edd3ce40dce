//! Makes the folder of a new module that builds, runs and is checked at once: `terraglue new`.
//!
//! The texts below `templates/` are whole programs in which the name `my-module` (`my_module` in file names) and the
//! words between at signs are replaced.

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod program;
mod reserved;
mod standing;
mod template;

pub use program::spoken_program;
pub use standing::Standing;
pub use template::{Kind, Language};

use std::path::{Path, PathBuf};

/// A folder to be written.
#[derive(Debug)]
pub struct Scaffold {
    /// Files with their texts, relative to the folder.
    pub files: Vec<(String, String)>,
    /// Files that a module in Rust brings with it: the crates of the interface, and the versions of what they use.
    pub crates: &'static [(&'static str, &'static str)],
    /// The next commands to type, inside the folder.
    pub commands: [String; 2],
}

/// Why a folder cannot be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ScaffoldError {
    /// The name is not one that files, crates and scenarios can all carry.
    #[error(
        "`{0}` is no name for a module: use up to 64 lower-case letters, digits and single hyphens, a letter first, e.g. my-soil"
    )]
    Name(String),
    /// A module of the program has the name.
    #[error("`{0}` is a module of Terraglue itself; choose another name")]
    Taken(String),
    /// The language has taken the name.
    #[error("`{name}` is the name of {what}, which it would hide; choose another one, e.g. my-{name}")]
    Reserved {
        /// The name.
        name: String,
        /// Whose name it is.
        what: &'static str,
    },
    /// This kind cannot be written in this language.
    #[error("a {kind} in {language} is not offered; languages: {offered}")]
    Language {
        /// The kind that was asked for.
        kind: &'static str,
        /// The language that was asked for.
        language: &'static str,
        /// Languages that are offered.
        offered: String,
    },
    /// There is something in the way.
    #[error("{0} exists already; nothing was written")]
    Exists(PathBuf),
    /// A file cannot be written.
    #[error("cannot write {path}: {reason}")]
    Write {
        /// The file.
        path: PathBuf,
        /// The system's words.
        reason: String,
    },
}

/// The files of a new module; the commands to type call the program `program`, the files call it `terraglue`.
///
/// # Errors
/// A name that cannot be used, a language that is not offered.
pub fn scaffold(
    kind: Kind,
    language: Language,
    name: &str,
    program: &str,
) -> Result<Scaffold, ScaffoldError> {
    check_name(name)?;
    if let Some(what) = reserved::taken(name, language) {
        return Err(ScaffoldError::Reserved { name: name.into(), what });
    }
    template::fill(kind, language, name, program)
}

/// Longest name of a module; files and crates are called by it.
const LONGEST_NAME: usize = 64;

fn check_name(name: &str) -> Result<(), ScaffoldError> {
    let parts_good = name.split('-').all(|part| !part.is_empty());
    let letters_good = name.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'-');
    if !(parts_good
        && letters_good
        && name.len() <= LONGEST_NAME
        && name.starts_with(|c: char| c.is_ascii_lowercase()))
    {
        return Err(ScaffoldError::Name(name.into()));
    }
    if terraglue_scenario::SHIPPED_MODULES.contains(&name) {
        return Err(ScaffoldError::Taken(name.into()));
    }
    Ok(())
}

impl Scaffold {
    /// Writes the files into a folder that does not exist yet.
    ///
    /// # Errors
    /// The folder exists, or a file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<(), ScaffoldError> {
        if folder.exists() {
            return Err(ScaffoldError::Exists(folder.into()));
        }
        let own = self.files.iter().map(|(file, text)| (file.as_str(), text.as_str()));
        for (file, text) in own.chain(self.crates.iter().copied()) {
            let path = folder.join(file);
            let made = path.parent().map_or(Ok(()), std::fs::create_dir_all);
            made.and_then(|()| std::fs::write(&path, text))
                .map_err(|e| ScaffoldError::Write { path: path.clone(), reason: e.to_string() })?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
