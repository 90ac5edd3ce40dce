//! `tests/figures.tsv`: the value of every judged figure when it was last written, in the quick form. A figure that has become
//! [`TIMES`] times worse fails, whatever its limit: most limits leave far more room than that.

use crate::process::{Outcome, read, root, write};
use crate::{Figure, Limit};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// How many times worse a figure may become.
const TIMES: f64 = 30.0;
/// No bound is lower than this: smaller numbers are rounding whatever they measure.
const LEAST: f64 = 1e-14;

fn file() -> PathBuf {
    root().join("tests/figures.tsv")
}

/// Value by id.
#[derive(Debug, Default)]
pub struct StoredFigures(BTreeMap<String, f64>);

impl StoredFigures {
    /// Reads the table: a header line, then id and value.
    pub fn read() -> Outcome<Self> {
        Self::parse(&read(&file())?).map_err(|e| format!("{}: {e}", file().display()))
    }

    fn parse(text: &str) -> Outcome<Self> {
        let rows = text.lines().enumerate().skip(1).map(|(i, line)| {
            let fields = line.split_once('\t').and_then(|(id, x)| Some((id.to_owned(), x.parse().ok()?)));
            fields.ok_or_else(|| format!("line {}: `id<TAB>value` is needed", i + 1))
        });
        rows.collect::<Outcome<_>>().map(Self)
    }

    /// Writes the figures of an area in place of those that were stored of it.
    pub fn write_area(mut self, area: &str, figures: &[Figure]) -> Outcome {
        self.0.retain(|id, _| !id.starts_with(&format!("{area}.")));
        self.0.extend(figures.iter().filter_map(|f| Some((f.id.clone(), kept(f)?))));
        let lines: String = self.0.iter().map(|(id, value)| format!("{id}\t{value:e}\n")).collect();
        write(&file(), &("id\tvalue\n".to_owned() + &lines))
    }

    /// What is wrong about a figure: it is far worse than it was, or was never written. A value that is no number fails by its limit.
    pub fn judge(&self, figure: &Figure) -> Option<String> {
        let value = kept(figure)?;
        let Some(stored) = self.0.get(&figure.id) else {
            return Some(format!("{} is not in tests/figures.tsv: run `cargo xtask docs`", figure.id));
        };
        let bound = bound(*stored, figure.limit)?;
        let worse = match figure.limit {
            Limit::AtLeast(_) => value < bound,
            _ => value > bound,
        };
        worse.then(|| {
            format!(
                "{} = {} was {stored:.3e} when it was written: {TIMES} times worse fails, though it were within {}; \
                 `cargo xtask docs` writes it anew",
                figure.id,
                figure.value_text(),
                figure.limit
            )
        })
    }
}

/// The value to be stored of a figure: it has a limit, is a number, and is the same wherever it is measured.
fn kept(figure: &Figure) -> Option<f64> {
    let judged = !figure.noisy && !matches!(figure.limit, Limit::None | Limit::Equal(_));
    figure.value.filter(|x| judged && x.is_finite())
}

/// From where on a figure counts as far worse.
///
/// Where `limit` is an upper bound the stored value counts as no less than a floor. A value at round-off, a residual of 3e-16 beside a
/// limit of 1e-9, changes by factors with the processor and with the order of a sum. The limits of such figures are chosen by their
/// units and scales, so a thousandth of the limit, though no more than 1e-9, is taken for the size of rounding. An exact 0 (a count, or
/// a difference of what is equal to the bit) has no size, and there a thousandth of the limit alone is the floor.
fn bound(stored: f64, limit: Limit) -> Option<f64> {
    match limit {
        Limit::AtMost(most) => {
            let thousandth = 1e-3 * most.abs();
            let floor = if stored == 0.0 { thousandth } else { thousandth.min(1e-9) };
            Some((TIMES * stored.abs().max(floor)).max(LEAST))
        }
        // what should be large and is not positive has no factor
        Limit::AtLeast(_) => (stored > 0.0).then(|| stored / TIMES),
        Limit::Equal(_) | Limit::None => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn complains(stored: f64, now: f64, limit: Limit) -> bool {
        let table = StoredFigures(BTreeMap::from([("a".to_owned(), stored)]));
        table.judge(&Figure::new("a", now, limit, "")).is_some()
    }

    #[test]
    fn thirty_times_worse_fails_within_the_limit() {
        assert!(complains(1e-3, 3.1e-2, Limit::AtMost(5.0)) && !complains(1e-3, 2.9e-2, Limit::AtMost(5.0)));
        assert!(complains(0.9, 0.02, Limit::AtLeast(0.01)) && !complains(0.9, 0.04, Limit::AtLeast(0.01)));
    }

    #[test]
    fn rounding_is_not_worse() {
        // a residual at round-off may be 1e-14 elsewhere, and a plate a hundred million times worse may not
        assert!(!complains(3e-16, 2e-14, Limit::AtMost(1e-9)));
        assert!(complains(3e-16, 3.1e-8, Limit::AtMost(1.0)) && !complains(3e-16, 2e-8, Limit::AtMost(1.0)));
        assert!(complains(0.0, 0.2, Limit::AtMost(5.0)) && !complains(0.0, 0.1, Limit::AtMost(5.0)));
        assert!(!complains(0.0, 8e-15, Limit::AtMost(1e-14)));
    }

    #[test]
    fn a_figure_that_was_never_written_is_told() {
        let table = StoredFigures::parse("id\tvalue\nb\t1e-3\n").expect("reads");
        assert!(table.judge(&Figure::new("a", 1.0, Limit::AtMost(2.0), "")).is_some());
        assert!(table.judge(&Figure::new("a", 1.0, Limit::None, "")).is_none());
        assert!(table.judge(&Figure::new("a", 1.0, Limit::AtMost(2.0), "").noisy()).is_none());
        assert!(StoredFigures::parse("id\tvalue\nb\tone\n").is_err());
    }
}
