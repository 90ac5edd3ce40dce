//! A scenario file: TOML in, checked [`Scenario`] out, errors with file, line and key.

mod model;

pub use model::*;

/// A scenario's text, kept for errors.
#[derive(Clone, Debug, Default)]
pub struct Source {
    /// Path as the user gave it.
    pub path: String,
    /// Contents after `--set`.
    pub text: String,
}

/// Wrong input: what, where, and the way out.
#[derive(Debug, thiserror::Error, miette::Diagnostic)]
#[error("{message}")]
pub struct InputError {
    /// What is wrong, with the offending value.
    pub message: String,
    /// File with its text.
    #[source_code]
    pub source_code: miette::NamedSource<String>,
    /// Where.
    #[label("here")]
    pub span: Option<miette::SourceSpan>,
    /// The way out, e.g. the nearest valid name.
    #[help]
    pub help: Option<String>,
}
