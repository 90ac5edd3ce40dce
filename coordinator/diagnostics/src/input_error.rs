//! Wrong input with file, line and the offending words.

use miette::{NamedSource, SourceSpan};
use std::path::Path;

/// Wrong input: what, where, and the way out.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
#[error("{message}")]
pub struct InputError {
    /// Description of the problem, with the offending value.
    pub message: String,
    /// File with its text.
    #[source_code]
    pub source_code: NamedSource<String>,
    /// Where.
    #[label("here")]
    pub span: Option<SourceSpan>,
    /// The way out, e.g. the nearest valid name.
    #[help]
    pub help: Option<String>,
}

impl InputError {
    /// An error about an input that has no text to show, e.g. a file that cannot be read.
    pub fn plain(message: impl Into<String>, help: Option<String>) -> Box<Self> {
        let source_code = NamedSource::new("", String::new());
        Box::new(Self { message: message.into(), source_code, span: None, help })
    }

    /// An error whose message begins with file and line, where there is such a file: a robot's, as its reader says it. `whole`: what
    /// is shown.
    pub fn of_file(message: &str, whole: &str) -> Option<Box<Self>> {
        message.match_indices(':').find_map(|(at, _)| {
            let (line, _) = message[at + 1..].split_once(':')?;
            let (file, line) = (Path::new(&message[..at]), line.parse().ok()?);
            let text = file.is_file().then(|| std::fs::read_to_string(file).ok())??;
            Some(Self::in_file(file, &text, line, whole))
        })
    }

    /// An error about line `line` (from 1) of another input file, e.g. an elevation grid or a robot.
    pub fn in_file(path: &Path, text: &str, line: usize, message: impl Into<String>) -> Box<Self> {
        let start: usize = text.split_inclusive('\n').take(line.saturating_sub(1)).map(str::len).sum();
        let length = text.get(start..).and_then(|rest| rest.lines().next()).map_or(0, str::len);
        Box::new(Self {
            message: message.into(),
            source_code: NamedSource::new(path.display().to_string(), text.to_owned()),
            span: Some((start..start + length).into()),
            help: None,
        })
    }
}
