//! `tests/known-failures.tsv`: figures that are known to fail, each with the figure reached, its limit, a bound beyond which it fails
//! all the same, and the reason.

use super::{Figure, Limit};
use crate::process::{Outcome, read, root};
use std::collections::BTreeMap;

/// A figure that may fail.
#[derive(Debug, PartialEq)]
pub struct KnownFailure {
    /// The figure reached, with its unit.
    pub reached: String,
    /// The limit that it misses.
    pub limit: Limit,
    /// How far it may miss it; no number: the figure may be none.
    pub bound: f64,
    /// Why it misses it.
    pub reason: String,
}

/// Figures that may fail, by id.
#[derive(Debug, Default)]
pub struct KnownFailures(BTreeMap<String, KnownFailure>);

impl KnownFailures {
    /// Reads `tests/known-failures.tsv`.
    pub fn read() -> Outcome<Self> {
        let path = root().join("tests/known-failures.tsv");
        Self::parse(&read(&path)?).map_err(|e| format!("{}: {e}", path.display()))
    }

    /// Reads a header line, then id, figure reached, limit, bound, reason.
    fn parse(text: &str) -> Outcome<Self> {
        let rows = text.lines().enumerate().skip(1).filter(|(_, line)| !line.trim().is_empty());
        let row = |(i, line): (usize, &str)| parsed(line).map_err(|e| format!("line {}: {e}", i + 1));
        rows.map(row).collect::<Outcome<_>>().map(Self)
    }

    /// All of them, by id.
    pub fn iter(&self) -> impl Iterator<Item = (&String, &KnownFailure)> {
        self.0.iter()
    }

    /// Complaint about a figure: it fails unlisted or beyond its bound, or passes although listed.
    pub fn judge(&self, figure: &Figure) -> Option<String> {
        let told = || format!("{} = {} ({})", figure.id, figure.value_text(), figure.limit);
        match (figure.pass, self.0.get(&figure.id)) {
            (Some(false), None) => Some(told()),
            (Some(false), Some(known)) if known.limit != figure.limit => {
                Some(format!("{}: tests/known-failures.tsv has the limit {}", told(), known.limit))
            }
            (Some(false), Some(known)) if is_beyond(figure, known.bound) => {
                Some(format!("{} is beyond {}, the bound of tests/known-failures.tsv", told(), known.bound))
            }
            (Some(true), Some(_)) => {
                Some(format!("{} passes: take it out of tests/known-failures.tsv", figure.id))
            }
            _ => None,
        }
    }
}

fn parsed(line: &str) -> Outcome<(String, KnownFailure)> {
    let [id, reached, limit, bound, reason] = line.split('\t').collect::<Vec<_>>()[..] else {
        return Err("five fields are needed: id, figure reached, limit, bound, reason".into());
    };
    if [id, reached, reason].iter().any(|field| field.trim().is_empty()) {
        return Err("id, figure reached and reason are needed".into());
    }
    let limit = limit.parse()?;
    let bound = bound.parse().map_err(|e| format!("bound `{bound}`: {e}"))?;
    Ok((id.to_owned(), KnownFailure { reached: reached.to_owned(), limit, bound, reason: reason.to_owned() }))
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

    const HEAD: &str = "id\tfigure reached\tlimit\tbound\treason\n";

    #[test]
    fn listed_failures_pass_and_listed_passes_fail() {
        let known = KnownFailures::parse(&format!("{HEAD}a\t0.9\t>= 1\t0.8\ttoo slow\n")).expect("reads");
        let figure = |id: &str, value: f64| Figure::new(id, value, Limit::AtLeast(1.0), "");
        assert_eq!((known.judge(&figure("a", 0.9)), known.judge(&figure("b", 1.0))), (None, None));
        assert!(known.judge(&figure("b", 0.9)).is_some() && known.judge(&figure("a", 1.0)).is_some());
        let beyond = known.judge(&figure("a", 0.7)).expect("beyond its bound");
        assert!(beyond.contains("beyond 0.8"), "{beyond}");
        assert!(known.judge(&figure("a", f64::NAN)).is_some());
    }

    #[test]
    fn bounds_are_on_the_side_of_the_limit() {
        let judged = |id: &str, value, limit: Limit| {
            let known = format!("{HEAD}a\t2\t{limit}\t3\tx\nn\tnone\t{limit}\tnan\tx\n");
            let known = KnownFailures::parse(&known).expect("reads");
            known.judge(&Figure::new(id, value, limit, "")).is_none()
        };
        assert!(judged("a", 2.0, Limit::AtMost(1.0)) && !judged("a", 4.0, Limit::AtMost(1.0)));
        assert!(judged("a", -2.0, Limit::Equal(0.0)) && !judged("a", -4.0, Limit::Equal(0.0)));
        assert!(judged("n", f64::NAN, Limit::AtMost(1.0)) && judged("n", 9.0, Limit::AtMost(1.0)));
    }

    #[test]
    fn a_limit_that_has_changed_is_told() {
        let known = KnownFailures::parse(&format!("{HEAD}a\t0.9\t>= 1\t0.8\ttoo slow\n")).expect("reads");
        let told = known.judge(&Figure::new("a", 0.9, Limit::AtLeast(2.0), "")).expect("another limit");
        assert!(told.contains("has the limit >= 1"), "{told}");
    }

    #[test]
    fn a_row_without_a_reason_a_limit_or_a_bound_is_refused() {
        for row in
            ["a\t0.9\t>= 1\t0.8\t", "a\t0.9\t>= 1\tfew\tslow", "a\t0.9\t1\t0.8\tslow", "a\t0.9\t0.8\tslow"]
        {
            assert!(KnownFailures::parse(&format!("{HEAD}{row}\n")).is_err(), "{row}");
        }
    }
}
