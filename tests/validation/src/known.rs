//! `tests/known-failures.tsv`: figures that are known to fail, each with the figure reached, a bound beyond which it fails all the same,
//! and the reason.

use super::{Figure, Limit};
use crate::process::{Outcome, read};
use std::collections::BTreeMap;
use std::path::Path;

/// Figures that may fail, each as far as its bound; a bound that is no number: the figure may be none.
#[derive(Debug, Default)]
pub struct KnownFailures {
    bounds: BTreeMap<String, f64>,
}

impl KnownFailures {
    /// Reads the table: a header line, then id, figure reached, bound, reason.
    pub fn read(path: &Path) -> Outcome<Self> {
        Self::parse(&read(path)?).map_err(|e| format!("{}: {e}", path.display()))
    }

    fn parse(text: &str) -> Outcome<Self> {
        let rows = text.lines().enumerate().skip(1).filter(|(_, line)| !line.trim().is_empty());
        let bounds = rows.map(|(i, line)| match line.split('\t').collect::<Vec<_>>()[..] {
            [id, figure, bound, reason] if ![id, figure, reason].iter().any(|f| f.trim().is_empty()) => {
                let number = bound.parse().map_err(|e| format!("line {}: bound `{bound}`: {e}", i + 1))?;
                Ok((id.to_owned(), number))
            }
            _ => Err(format!("line {}: four fields are needed: id, figure reached, bound, reason", i + 1)),
        });
        Ok(Self { bounds: bounds.collect::<Outcome<_>>()? })
    }

    /// What is wrong about a figure: it fails unlisted or beyond its bound, or passes although listed.
    pub fn judge(&self, figure: &Figure) -> Option<String> {
        let told = || format!("{} = {} ({})", figure.id, figure.value_text(), figure.limit);
        match (figure.pass, self.bounds.get(&figure.id)) {
            (Some(false), None) => Some(told()),
            (Some(false), Some(bound)) if is_beyond(figure, *bound) => {
                Some(format!("{} is beyond {bound}, the bound of tests/known-failures.tsv", told()))
            }
            (Some(true), Some(_)) => {
                Some(format!("{} passes: take it out of tests/known-failures.tsv", figure.id))
            }
            _ => None,
        }
    }
}

fn is_beyond(figure: &Figure, bound: f64) -> bool {
    let value = figure.value.unwrap_or(f64::NAN);
    if value.is_nan() || bound.is_nan() {
        return value.is_nan() && !bound.is_nan();
    }
    match figure.limit {
        Limit::AtMost(_) => value > bound,
        Limit::AtLeast(_) => value < bound,
        Limit::Equal(x) => (value - x).abs() > (bound - x).abs(),
        Limit::None => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn listed_failures_pass_and_listed_passes_fail() {
        let known =
            KnownFailures::parse("id\tfigure\tbound\treason\na\t0.9\t0.8\ttoo slow\n").expect("reads");
        let figure = |id: &str, value: f64| Figure::new(id, value, Limit::AtLeast(1.0), "");
        assert_eq!((known.judge(&figure("a", 0.9)), known.judge(&figure("b", 1.0))), (None, None));
        assert!(known.judge(&figure("b", 0.9)).is_some() && known.judge(&figure("a", 1.0)).is_some());
        let beyond = known.judge(&figure("a", 0.7)).expect("beyond its bound");
        assert!(beyond.contains("beyond 0.8"), "{beyond}");
        assert!(known.judge(&figure("a", f64::NAN)).is_some());
    }

    #[test]
    fn bounds_are_on_the_side_of_the_limit() {
        let known = KnownFailures::parse("id\tfigure\tbound\treason\na\t2\t3\tx\nn\tnone\tnan\tx\n");
        let known = known.expect("reads");
        let judged = |id: &str, value, limit| known.judge(&Figure::new(id, value, limit, "")).is_none();
        assert!(judged("a", 2.0, Limit::AtMost(1.0)) && !judged("a", 4.0, Limit::AtMost(1.0)));
        assert!(judged("a", -2.0, Limit::Equal(0.0)) && !judged("a", -4.0, Limit::Equal(0.0)));
        assert!(judged("n", f64::NAN, Limit::AtMost(1.0)) && judged("n", 9.0, Limit::AtMost(1.0)));
    }

    #[test]
    fn a_row_without_a_reason_or_a_bound_is_refused() {
        assert!(KnownFailures::parse("id\tfigure\tbound\treason\na\t0.9\t0.8\t\n").is_err());
        assert!(KnownFailures::parse("id\tfigure\tbound\treason\na\t0.9\tfew\tslow\n").is_err());
    }
}
