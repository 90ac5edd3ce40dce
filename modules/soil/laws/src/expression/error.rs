//! Errors in the text of a law, with their place.

use std::fmt;
use std::ops::Range;

/// A mistake in the text of a law.
#[derive(Clone, Debug, PartialEq)]
pub struct ExpressionError {
    /// The whole text.
    pub text: String,
    /// Bytes of the offending part.
    pub span: Range<usize>,
    /// Description of the error.
    pub message: String,
    /// The way out, where one is known.
    pub help: Option<String>,
}

impl ExpressionError {
    pub(super) fn new(text: &str, span: Range<usize>, message: impl Into<String>) -> Box<Self> {
        Box::new(Self { text: text.into(), span, message: message.into(), help: None })
    }

    pub(super) fn help(mut self: Box<Self>, help: impl Into<String>) -> Box<Self> {
        self.help = Some(help.into());
        self
    }

    /// Column of the first offending character, from 1.
    pub fn column(&self) -> usize {
        self.text.get(..self.span.start).map_or(0, |before| before.chars().count()) + 1
    }
}

impl fmt::Display for ExpressionError {
    /// The message, the text, and a line of carets under the offending part.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let length = self.text.get(self.span.clone()).map_or(1, |part| part.chars().count()).max(1);
        writeln!(f, "{} (column {})", self.message, self.column())?;
        writeln!(f, "    {}", self.text)?;
        write!(f, "    {}{}", " ".repeat(self.column() - 1), "^".repeat(length))?;
        match &self.help {
            Some(help) => write!(f, "\n  help: {help}"),
            None => Ok(()),
        }
    }
}

impl std::error::Error for ExpressionError {}
