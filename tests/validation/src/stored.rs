//! `tests/figures.tsv`: every figure of the quick form as it was when it was last written. A judged figure that has become [`TIMES`]
//! times worse fails, whatever its limit: most limits leave far more room than that. `--check-docs` fails where any figure is another.

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

/// A figure as it was when it was last written.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredFigure {
    /// Its value; none: not measured.
    pub value: Option<f64>,
    /// Its limit.
    pub limit: Limit,
    /// Its meaning, or why it was not measured.
    what: String,
}

impl StoredFigure {
    fn of(figure: &Figure) -> Self {
        Self { value: figure.value, limit: figure.limit, what: figure.what.replace(['\t', '\n'], " ") }
    }

    /// Whether it is within its limit; none without a value or a limit.
    pub fn holds(&self) -> Option<bool> {
        self.value.filter(|_| self.limit != Limit::None).map(|x| self.limit.holds(x))
    }

    /// Whether it was measured and is held against nothing.
    pub fn is_without_limit(&self) -> bool {
        self.value.is_some() && self.limit == Limit::None
    }

    fn value_text(&self) -> String {
        self.value.map_or("-".to_owned(), |x| format!("{x:e}"))
    }

    /// Whether a measurement is the same, to 5 % or 1 % of the limit: the last bits differ between processors. Figures measured on some
    /// machines only (with other programs) agree where they are not, and noisy ones are held against their limit alone.
    fn agrees(&self, figure: &Figure) -> bool {
        let (Some(value), Some(stored)) = (figure.value, self.value) else { return true };
        if figure.noisy {
            return self.limit == figure.limit;
        }
        let bound = match figure.limit {
            Limit::AtMost(x) | Limit::AtLeast(x) => 0.01 * x.abs(),
            Limit::Equal(_) => 0.0,
            Limit::None => 1e-9,
        };
        let tolerance = f64::max(0.05 * value.abs().max(stored.abs()), bound);
        self.limit == figure.limit && (value - stored).abs() <= tolerance
    }
}

/// Figures by id.
#[derive(Debug, Default)]
pub struct StoredFigures(BTreeMap<String, StoredFigure>);

impl StoredFigures {
    /// Reads the table: a header line, then id, value, limit and meaning.
    pub fn read() -> Outcome<Self> {
        Self::parse(&read(&file())?).map_err(|e| format!("{}: {e}", file().display()))
    }

    fn parse(text: &str) -> Outcome<Self> {
        let rows = text.lines().enumerate().skip(1);
        let row = |(i, line): (usize, &str)| parsed(line).map_err(|e| format!("line {}: {e}", i + 1));
        rows.map(row).collect::<Outcome<_>>().map(Self)
    }

    /// The figures of an area.
    pub fn of_area(&self, area: &str) -> impl Iterator<Item = (&String, &StoredFigure)> {
        self.0.iter().filter(move |(id, _)| is_of(area, id))
    }

    /// Writes the figures of an area in place of those that were stored of it.
    pub fn write_area(&mut self, area: &str, figures: &[Figure]) -> Outcome {
        self.0.retain(|id, _| !is_of(area, id));
        self.0.extend(figures.iter().map(|f| (f.id.clone(), StoredFigure::of(f))));
        let line = |(id, f): (&String, &StoredFigure)| {
            format!("{id}\t{}\t{}\t{}\n", f.value_text(), f.limit, f.what)
        };
        write(
            &file(),
            &("id\tvalue\tlimit\twhat\n".to_owned() + &self.0.iter().map(line).collect::<String>()),
        )
    }

    /// Figures of an area that are not stored, are stored otherwise, or are stored but not measured.
    pub fn differences(&self, area: &str, figures: &[Figure]) -> Vec<String> {
        let cure = "run `cargo xtask docs` or `cargo xtask validate AREA --quick --write-docs`";
        let differs = figures.iter().filter_map(|figure| {
            let stored = match self.0.get(&figure.id) {
                None => "none".to_owned(),
                Some(stored) if stored.agrees(figure) => return None,
                Some(stored) => format!("{}, {}", stored.value_text(), stored.limit),
            };
            let measured = format!("{}, {}", figure.value_text(), figure.limit);
            Some(format!("tests/figures.tsv: {}: measured {measured}, stored {stored}: {cure}", figure.id))
        });
        let idle = self.of_area(area).filter(|(id, _)| figures.iter().all(|figure| figure.id != **id));
        let idle = idle.map(|(id, _)| format!("tests/figures.tsv has {id}, which nobody measures: {cure}"));
        differs.chain(idle).collect()
    }

    /// Complaint about a figure: it is far worse than it was, or was never written. A value that is no number fails by its limit.
    pub fn judge(&self, figure: &Figure) -> Option<String> {
        let value = kept(figure)?;
        let Some(stored) = self.0.get(&figure.id).and_then(|stored| stored.value) else {
            return Some(format!("{} is not in tests/figures.tsv: run `cargo xtask docs`", figure.id));
        };
        let bound = bound(stored, figure.limit)?;
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

fn is_of(area: &str, id: &str) -> bool {
    id.strip_prefix(area).is_some_and(|rest| rest.starts_with('.'))
}

fn parsed(line: &str) -> Outcome<(String, StoredFigure)> {
    let [id, value, limit, what] = line.splitn(4, '\t').collect::<Vec<_>>()[..] else {
        return Err("four fields are needed: id, value, limit, what it is".into());
    };
    let value = match value {
        "-" => None,
        x => Some(x.parse().map_err(|e| format!("value `{x}`: {e}"))?),
    };
    Ok((id.to_owned(), StoredFigure { value, limit: limit.parse()?, what: what.to_owned() }))
}

/// The value of a figure that is held against its stored one: it has a limit, is a number, and is the same wherever it is measured.
fn kept(figure: &Figure) -> Option<f64> {
    let judged = !figure.noisy && !matches!(figure.limit, Limit::None | Limit::Equal(_));
    figure.value.filter(|x| judged && x.is_finite())
}

/// From where on a figure counts as far worse.
///
/// Where `limit` is an upper bound the stored value counts as no less than a floor. A value at round-off, a residual of 3e-16 under a
/// limit of 1e-9, changes by factors with the processor and with the order of a sum. The limits of such figures are chosen by their
/// units and scales, so a thousandth of the limit, though no more than 1e-9, is taken for the size of rounding. An exact 0 (a count, or
/// a difference of values equal to the bit) has no size, and there a thousandth of the limit alone is the floor.
fn bound(stored: f64, limit: Limit) -> Option<f64> {
    match limit {
        Limit::AtMost(most) => {
            let thousandth = 1e-3 * most.abs();
            let floor = if stored == 0.0 { thousandth } else { thousandth.min(1e-9) };
            Some((TIMES * stored.abs().max(floor)).max(LEAST))
        }
        // a value that should be large and is not positive has no factor
        Limit::AtLeast(_) => (stored > 0.0).then(|| stored / TIMES),
        Limit::Equal(_) | Limit::None => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(figures: &[Figure]) -> StoredFigures {
        StoredFigures(figures.iter().map(|f| (f.id.clone(), StoredFigure::of(f))).collect())
    }

    fn complains(stored: f64, now: f64, limit: Limit) -> bool {
        let table = table(&[Figure::new("a", stored, limit, "")]);
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
        let table = StoredFigures::parse("id\tvalue\tlimit\twhat\nb\t1e-3\t<= 1\tx\n").expect("reads");
        assert!(table.judge(&Figure::new("a", 1.0, Limit::AtMost(2.0), "")).is_some());
        assert!(table.judge(&Figure::new("a", 1.0, Limit::None, "")).is_none());
        assert!(table.judge(&Figure::new("a", 1.0, Limit::AtMost(2.0), "").noisy()).is_none());
        for row in ["b\tone\t<= 1\tx", "b\t1\t1\tx", "b\t1"] {
            assert!(StoredFigures::parse(&format!("id\tvalue\tlimit\twhat\n{row}\n")).is_err(), "{row}");
        }
    }

    #[test]
    fn what_changes_with_the_moment_is_held_against_its_limit_alone() {
        let stored = StoredFigure::of(&Figure::new("a", 0.0, Limit::AtMost(1.0), ""));
        let measured = Figure::new("a", 0.06, Limit::AtMost(1.0), "");
        assert!(!stored.agrees(&measured) && stored.agrees(&measured.noisy()));
        assert!(!stored.agrees(&Figure::new("a", 0.06, Limit::AtMost(2.0), "").noisy()));
    }

    #[test]
    fn stored_figures_that_are_out_of_date_are_found() {
        let stored = [
            Figure::new("walk.a", 2.0, Limit::AtMost(3.0), ""),
            Figure::new("walk.b", 1e-14, Limit::AtMost(1e-9), ""),
            Figure::new("walk.c", 7.0, Limit::None, ""),
            Figure::new("walks.other", 7.0, Limit::None, ""),
        ];
        let table = table(&stored);
        assert!(table.differences("walk", &stored[..3]).is_empty());
        // rounding is no difference, and figures not measured here are left alone
        let here = [
            Figure::new("walk.a", 2.05, Limit::AtMost(3.0), ""),
            Figure::new("walk.b", 9e-13, Limit::AtMost(1e-9), ""),
            Figure::skipped("walk.c", "no"),
        ];
        assert!(table.differences("walk", &here).is_empty());
        let other = [
            Figure::new("walk.a", 2.3, Limit::AtMost(3.0), ""),
            Figure::new("walk.b", 1e-14, Limit::AtMost(1e-8), ""),
            Figure::new("walk.d", 7.0, Limit::None, ""),
        ];
        let wrong = table.differences("walk", &other);
        assert_eq!(wrong.len(), 4, "{wrong:#?}");
        assert!(
            wrong[0].contains("measured 2.3")
                && wrong[2].contains("stored none")
                && wrong[3].contains("has walk.c")
        );
    }
}
