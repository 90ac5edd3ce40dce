//! Errors of robot files; every message names the place, the value and a way out.

/// A robot file that cannot be simulated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The file cannot be read.
    #[error("{file}: the robot file cannot be read: {reason}")]
    Read {
        /// Path.
        file: String,
        /// Message of the operating system.
        reason: String,
    },
    /// The text is not URDF or MJCF.
    #[error("{file}{}: the robot file cannot be read: {reason}", at(*.line))]
    Syntax {
        /// Path.
        file: String,
        /// Line, from 1; 0: unknown.
        line: usize,
        /// Message of the reader.
        reason: String,
    },
    /// A link is wrong.
    #[error("{file}{}: link `{link}`: {problem}", at(*.line))]
    Link {
        /// Path.
        file: String,
        /// Line of the element, from 1; 0: unknown.
        line: usize,
        /// Name.
        link: String,
        /// Value and way out.
        problem: String,
    },
    /// A joint is wrong.
    #[error("{file}{}: joint `{joint}`: {problem}", at(*.line))]
    Joint {
        /// Path.
        file: String,
        /// Line of the element, from 1; 0: unknown.
        line: usize,
        /// Name.
        joint: String,
        /// Value and way out.
        problem: String,
    },
    /// An element is wrong.
    #[error("{file}:{line}: {element}: {problem}")]
    Element {
        /// Path.
        file: String,
        /// Line of the element, from 1.
        line: usize,
        /// Tag and name.
        element: String,
        /// Value and way out.
        problem: String,
    },
    /// There is a warning, and none is wanted.
    #[error("{first}{}; refused because of `strict`", more(*.count))]
    Strict {
        /// The first warning, with its place.
        first: String,
        /// Their number.
        count: usize,
    },
    /// Links and joints do not form one tree.
    #[error("{file}: {problem}")]
    Tree {
        /// Path.
        file: String,
        /// The defect of the tree and a way out.
        problem: String,
    },
}

fn more(count: usize) -> String {
    if count > 1 { format!(" (and {} more warnings)", count - 1) } else { String::new() }
}

fn at(line: usize) -> String {
    if line > 0 { format!(":{line}") } else { String::new() }
}

/// File name and text, for errors that point to a line.
pub(crate) struct Source<'a> {
    pub(crate) file: &'a str,
    pub(crate) text: &'a str,
}

impl Source<'_> {
    pub(crate) fn link(&self, link: &str, problem: impl Into<String>) -> Error {
        let (file, line) = (self.file.into(), self.line("<link", link));
        Error::Link { file, line, link: link.into(), problem: problem.into() }
    }

    pub(crate) fn joint(&self, joint: &str, problem: impl Into<String>) -> Error {
        let (file, line) = (self.file.into(), self.line("<joint", joint));
        Error::Joint { file, line, joint: joint.into(), problem: problem.into() }
    }

    pub(crate) fn syntax(&self, line: usize, reason: String) -> Error {
        let reason = match reason.contains("DTD") {
            true => "it has a <!DOCTYPE …>, which is not read; delete it, and write its entities out".into(),
            false => reason,
        };
        Error::Syntax { file: self.file.into(), line, reason }
    }

    pub(crate) fn tree(&self, problem: impl Into<String>) -> Error {
        Error::Tree { file: self.file.into(), problem: problem.into() }
    }

    /// Line of the first element `tag` with this name.
    fn line(&self, tag: &str, name: &str) -> usize {
        let wanted = [format!("name=\"{name}\""), format!("name='{name}'")];
        let found = self.text.match_indices(tag).find(|(at, _)| {
            let element = &self.text[*at..];
            let end = element.find('>').unwrap_or(element.len());
            wanted.iter().any(|w| element[..end].contains(w))
        });
        found.map_or(0, |(at, _)| self.text[..at].matches('\n').count() + 1)
    }
}
