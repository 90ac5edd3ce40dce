//! One measured figure and its limit.

use std::fmt;
use std::str::FromStr;

/// Limit of a figure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Limit {
    /// value ≤ limit.
    AtMost(f64),
    /// value ≥ limit.
    AtLeast(f64),
    /// value = limit, exactly.
    Equal(f64),
    /// Printed for comparison; fails only where it is no number.
    None,
}

impl Limit {
    /// Whether a value is within the limit; NaN never is.
    pub fn holds(self, value: f64) -> bool {
        match self {
            Self::AtMost(limit) => value <= limit,
            Self::AtLeast(limit) => value >= limit,
            Self::Equal(limit) => value == limit,
            Self::None => !value.is_nan(),
        }
    }
}

impl fmt::Display for Limit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::AtMost(x) => write!(f, "<= {x}"),
            Self::AtLeast(x) => write!(f, ">= {x}"),
            Self::Equal(x) => write!(f, "= {x}"),
            Self::None => write!(f, "-"),
        }
    }
}

impl FromStr for Limit {
    type Err = String;

    /// Reads the displayed form.
    fn from_str(text: &str) -> Result<Self, String> {
        let number = |x: &str| x.parse().map_err(|e| format!("limit `{text}`: {e}"));
        match text.split_once(' ') {
            Some(("<=", x)) => number(x).map(Self::AtMost),
            Some((">=", x)) => number(x).map(Self::AtLeast),
            Some(("=", x)) => number(x).map(Self::Equal),
            None if text == "-" => Ok(Self::None),
            _ => Err(format!("limit `{text}`: `<= x`, `>= x`, `= x` or `-` is needed")),
        }
    }
}

/// A figure of an area.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// Stable name, e.g. `walk.soil-bekker.iterative.distance`.
    pub id: String,
    /// Measured value; none: not measured here.
    pub value: Option<f64>,
    /// Its limit.
    pub limit: Limit,
    /// Whether it holds; none: not judged.
    pub pass: Option<bool>,
    /// Its meaning, with its unit.
    pub what: String,
    /// Whether the machine and the moment change it by factors, as they do times and memory: it is not held against its stored value.
    pub noisy: bool,
    /// Whether a clock measures it: it is judged under `--timing` only.
    pub timed: bool,
}

impl Figure {
    /// A measured figure.
    pub fn new(id: impl Into<String>, value: f64, limit: Limit, what: impl Into<String>) -> Self {
        let pass = Some(limit.holds(value));
        let (id, what) = (id.into(), what.into());
        Self { id, value: Some(value), limit, pass, what, noisy: false, timed: false }
    }

    /// The same, changed by factors by the machine and the moment.
    pub fn noisy(self) -> Self {
        Self { noisy: true, ..self }
    }

    /// The same, measured by a clock.
    pub fn timed(self) -> Self {
        Self { timed: true, ..self.noisy() }
    }

    /// The same, reported and not judged.
    pub fn unjudged(self) -> Self {
        Self { pass: None, ..self }
    }

    /// A figure that does not apply or cannot be measured here.
    pub fn skipped(id: impl Into<String>, why: impl Into<String>) -> Self {
        let (id, what) = (id.into(), why.into());
        Self { id, value: None, limit: Limit::None, pass: None, what, noisy: false, timed: false }
    }

    /// The value in words.
    pub fn value_text(&self) -> String {
        match self.value {
            None => "-".into(),
            Some(x) if x == 0.0 || (1e-3..1e6).contains(&x.abs()) => {
                let text = format!("{x:.4}");
                text.trim_end_matches('0').trim_end_matches('.').to_owned()
            }
            Some(x) => format!("{x:.3e}"),
        }
    }

    /// `pass`, `fail`, `info` (not judged, or nothing that it could fail) or `skip` (not measured).
    pub fn verdict(&self) -> &'static str {
        match self.pass {
            Some(true) if self.limit == Limit::None => "info",
            Some(true) => "pass",
            Some(false) => "fail",
            None if self.value.is_some() => "info",
            None => "skip",
        }
    }

    /// The line that is printed.
    pub fn line(&self) -> String {
        [&self.id, &self.value_text(), &self.limit.to_string(), self.verdict(), &self.what].join("\t")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_has_five_fields() {
        let figure = Figure::new("a.b", 0.25, Limit::AtMost(0.2), "share of x");
        assert_eq!(figure.line(), "a.b\t0.25\t<= 0.2\tfail\tshare of x");
        assert_eq!(Figure::skipped("a", "no soil").line(), "a\t-\t-\tskip\tno soil");
        assert_eq!(Figure::new("a", 2.0, Limit::None, "share").line(), "a\t2\t-\tinfo\tshare");
        assert_eq!(Figure::new("a", 2.0, Limit::AtMost(2.0), "share").verdict(), "pass");
        assert_eq!(Figure::new("a", 1.5e-9, Limit::None, "").value_text(), "1.500e-9");
        let slow = Figure::new("a", 2.0, Limit::AtMost(1.0), "s").timed();
        assert_eq!((slow.verdict(), slow.clone().unjudged().verdict()), ("fail", "info"));
    }

    #[test]
    fn a_limit_reads_as_it_is_displayed() {
        for limit in [Limit::AtMost(1e-12), Limit::AtLeast(-4.5), Limit::Equal(0.0), Limit::None] {
            assert_eq!(limit.to_string().parse(), Ok(limit));
        }
        for text in ["< 1", "<= one", "", "1"] {
            assert!(text.parse::<Limit>().is_err(), "{text}");
        }
    }

    #[test]
    fn what_is_not_a_number_fails() {
        for limit in [Limit::AtMost(1.0), Limit::AtLeast(1.0), Limit::Equal(1.0), Limit::None] {
            assert_eq!(Figure::new("a", f64::NAN, limit, "").pass, Some(false));
        }
    }
}
