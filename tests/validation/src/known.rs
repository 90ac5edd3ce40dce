//! `tests/known-failures.tsv`: figures that are known to fail, each with the figure reached and the reason.

use super::Figure;
use crate::process::{Outcome, read};
use std::path::Path;

/// Ids of the figures that may fail.
#[derive(Debug, Default)]
pub struct KnownFailures {
    ids: Vec<String>,
}

impl KnownFailures {
    /// Reads the table: a header line, then id, figure reached, reason.
    pub fn read(path: &Path) -> Outcome<Self> {
        Self::parse(&read(path)?).map_err(|e| format!("{}: {e}", path.display()))
    }

    fn parse(text: &str) -> Outcome<Self> {
        let rows = text.lines().enumerate().skip(1).filter(|(_, line)| !line.trim().is_empty());
        let ids = rows.map(|(i, line)| match line.split('\t').collect::<Vec<_>>()[..] {
            [id, figure, reason] if ![id, figure, reason].iter().any(|f| f.trim().is_empty()) => {
                Ok(id.to_owned())
            }
            _ => Err(format!("line {}: three fields are needed: id, figure reached, reason", i + 1)),
        });
        Ok(Self { ids: ids.collect::<Outcome<_>>()? })
    }

    /// What is wrong about a figure: it fails unlisted, or passes although listed.
    pub fn judge(&mut self, figure: &Figure) -> Option<String> {
        match (figure.pass, self.ids.contains(&figure.id)) {
            (Some(false), false) => {
                Some(format!("{} = {} ({})", figure.id, figure.value_text(), figure.limit))
            }
            (Some(true), true) => {
                Some(format!("{} passes: take it out of tests/known-failures.tsv", figure.id))
            }
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Limit;
    use super::*;

    #[test]
    fn listed_failures_pass_and_listed_passes_fail() {
        let mut known = KnownFailures::parse("id\tfigure\treason\na\t0.9\ttoo slow\n").expect("reads");
        let good = |id: &str| Figure::new(id, 1.0, Limit::AtLeast(1.0), "");
        let bad = |id: &str| Figure::new(id, 0.9, Limit::AtLeast(1.0), "");
        assert_eq!((known.judge(&bad("a")), known.judge(&good("b"))), (None, None));
        assert!(known.judge(&bad("b")).is_some() && known.judge(&good("a")).is_some());
    }

    #[test]
    fn a_row_without_a_reason_is_refused() {
        assert!(KnownFailures::parse("id\tfigure\treason\na\t0.9\t\n").is_err());
    }
}
