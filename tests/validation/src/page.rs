//! `docs/validation.md`: the figures that miss their limits, and how many figures each area has. It follows from `tests/figures.tsv`
//! and `tests/known-failures.tsv` alone, so that a test can hold it without measuring.

use crate::documents::{cell, replace};
use crate::known::{KnownFailure, KnownFailures};
use crate::process::Outcome;
use crate::stored::{StoredFigure, StoredFigures};
use crate::{AREAS, Part};

const PAGE: &str = "docs/validation.md";
/// A reason is shown up to the sentence with this letter.
const SHOWN: usize = 60;

/// Writes the page anew.
///
/// # Errors
/// A table that cannot be read, or a page that cannot be written.
pub fn write_page() -> Outcome {
    replace(PAGE, &blocks()?)
}

/// The blocks of the page, by name.
fn blocks() -> Outcome<[(&'static str, String); 2]> {
    Ok([("failures", failures(&KnownFailures::read()?)), ("counts", counts(&StoredFigures::read()?))])
}

fn failures(known: &KnownFailures) -> String {
    let row = |(id, f): (&String, &KnownFailure)| {
        format!("| `{id}` | {} | {} | {} |\n", cell(&f.reached), f.limit, cell(beginning(&f.reason)))
    };
    let head = "| figure | reached | limit | reason |\n|---|---|---|---|\n".to_owned();
    std::iter::once(head).chain(known.iter().map(row)).collect()
}

/// The first sentences of a reason.
fn beginning(reason: &str) -> &str {
    let ends = reason.match_indices(". ").map(|(k, _)| k + 1);
    ends.chain([reason.len()]).find(|end| *end >= SHOWN).map_or(reason, |end| &reason[..end])
}

fn counts(stored: &StoredFigures) -> String {
    let head = "| area | figures | within their limit | beyond it | without a limit | not measured |\n\
                |---|---|---|---|---|---|\n";
    let row = |(area, _): &(&str, &[Part])| {
        let of_area: Vec<&StoredFigure> = stored.of_area(area).map(|(_, figure)| figure).collect();
        let count = |is: &dyn Fn(&StoredFigure) -> bool| of_area.iter().filter(|figure| is(figure)).count();
        let [within, beyond] = [true, false].map(|held| count(&|f| f.holds() == Some(held)));
        let (open, absent) = (count(&StoredFigure::is_without_limit), count(&|f| f.value.is_none()));
        format!("| {area} | {} | {within} | {beyond} | {open} | {absent} |\n", of_area.len())
    };
    std::iter::once(head.to_owned()).chain(AREAS.iter().map(row)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::documents::replaced;
    use crate::process::{read, root};

    #[test]
    fn the_page_follows_from_the_stored_figures() {
        let shown = read(&root().join(PAGE)).expect("the page");
        let made = replaced(shown.clone(), &blocks().expect("tables that read")).expect("its blocks");
        assert_eq!(shown, made, "run `cargo run --bin terraglue-validation -- page`");
    }

    #[test]
    fn every_failure_of_the_quick_run_is_listed() {
        let (known, stored) = (KnownFailures::read().expect("reads"), StoredFigures::read().expect("reads"));
        for (area, _) in AREAS {
            for (id, figure) in stored.of_area(area) {
                let listed = known.iter().find(|(listed, _)| *listed == id).map(|(_, failure)| failure.limit);
                let wanted = (figure.holds() == Some(false)).then_some(figure.limit);
                assert_eq!(listed, wanted, "{id}");
            }
        }
    }

    #[test]
    fn reasons_begin_with_whole_sentences() {
        let long = "Long form. ".to_owned() + &"word ".repeat(12) + "end. And so on.";
        assert!(beginning(&long).ends_with("word end."), "{}", beginning(&long));
        assert_eq!(beginning("As on the automaton."), "As on the automaton.");
    }
}
