//! `--write-docs` and `--check-docs`: the tables of `docs/validation.md`, so that documents and measurements cannot part ways.

use super::Figure;
use crate::process::between;
use crate::process::{Outcome, read, root, write};

/// Replaces the tables of an area.
pub fn write_area(area: &str, figures: &[Figure]) -> Outcome {
    replace("docs/validation.md", area, &table(figures))?;
    // the peers are measured in long runs only
    match super::rigid_body::comparison(figures) {
        Some(text) => replace("docs/rigid-body.md", "peers", &text),
        None => Ok(()),
    }
}

/// Replaces the table called `name` of a page.
fn replace(page: &str, name: &str, table: &str) -> Outcome {
    let path = root().join(page);
    let (begin, end) = (format!("<!-- {name}: begin -->\n"), format!("<!-- {name}: end -->"));
    let text = between(&read(&path)?, (&begin, &end), table);
    let text = text.ok_or_else(|| format!("{} has no table `{name}`", path.display()))?;
    write(&path, &text)
}

fn table(figures: &[Figure]) -> String {
    let row = |f: &Figure| {
        // a bar would end the cell
        let what = f.what.replace('|', "\\|");
        format!("| `{}` | {} | {} | {} | {what} |\n", f.id, f.value_text(), f.limit, f.verdict())
    };
    let head = "| figure | value | limit | verdict | what |\n|---|---|---|---|---|\n";
    std::iter::once(head.to_owned()).chain(figures.iter().map(row)).collect()
}

/// What the table of an area shows otherwise than it was measured.
pub fn check_area(area: &str, figures: &[Figure]) -> Outcome<Vec<String>> {
    let path = root().join("docs/validation.md");
    let text = read(&path)?;
    let table = text.split_once(&format!("<!-- {area}: begin -->\n")).map(|(_, rest)| rest);
    let table = table.and_then(|rest| rest.split_once(&format!("<!-- {area}: end -->")));
    let (table, _) = table.ok_or_else(|| format!("{} has no table `{area}`", path.display()))?;
    Ok(differences(table, figures))
}

/// Figures that a table does not show, shows otherwise, or shows and nobody measures.
fn differences(table: &str, figures: &[Figure]) -> Vec<String> {
    let cells = |line: &str| line.split(" | ").map(|c| c.trim_matches(['|', ' ', '`']).to_owned()).collect();
    let rows: Vec<Vec<String>> = table.lines().filter(|line| line.starts_with("| `")).map(cells).collect();
    let cure = "run `cargo xtask docs` or `cargo xtask validate AREA --quick --write-docs`";
    let mut wrong = Vec::new();
    for figure in figures {
        let shown = rows.iter().find(|row| row[0] == figure.id);
        let told = match shown {
            None => "no row".to_owned(),
            Some(row) if row.len() > 2 && agrees(&row[1], &row[2], figure) => continue,
            Some(row) => row[1..].iter().take(2).cloned().collect::<Vec<_>>().join(", "),
        };
        let measured = format!("{}, {}", figure.value_text(), figure.limit);
        wrong.push(format!("docs/validation.md: {}: measured {measured}, shown {told}: {cure}", figure.id));
    }
    let idle = rows.iter().filter(|row| figures.iter().all(|figure| figure.id != row[0]));
    wrong.extend(
        idle.map(|row| format!("docs/validation.md shows {}, which nobody measures: {cure}", row[0])),
    );
    wrong
}

/// Whether a row shows what was measured, to 5 % or 1 % of the limit: the last bits differ between processors. What is measured on some
/// machines only (with other programs) agrees where it is not.
fn agrees(shown: &str, limit: &str, figure: &Figure) -> bool {
    let (Some(value), Ok(shown)) = (figure.value, shown.parse::<f64>()) else {
        return figure.value.is_none() || shown == "-";
    };
    let bound = match figure.limit {
        super::Limit::AtMost(x) | super::Limit::AtLeast(x) => 0.01 * x.abs(),
        super::Limit::Equal(_) => 0.0,
        super::Limit::None => 1e-9,
    };
    let tolerance = f64::max(0.05 * value.abs().max(shown.abs()), bound);
    limit == figure.limit.to_string() && (value - shown).abs() <= tolerance
}

#[cfg(test)]
mod tests {
    use super::super::Limit;
    use super::*;

    #[test]
    fn a_table_that_is_out_of_date_is_found() {
        let figure = |id: &str, value, limit| Figure::new(id, value, limit, "a | b");
        let shown = [
            figure("a", 2.0, Limit::AtMost(3.0)),
            figure("b", 1e-14, Limit::AtMost(1e-9)),
            figure("c", 7.0, Limit::None),
        ];
        let table = table(&shown);
        assert!(differences(&table, &shown).is_empty());
        // rounding is none, and what is not measured here is left alone
        let here = [
            figure("a", 2.05, Limit::AtMost(3.0)),
            figure("b", 9e-13, Limit::AtMost(1e-9)),
            Figure::skipped("c", "no"),
        ];
        assert!(differences(&table, &here).is_empty());
        let other = [
            figure("a", 2.3, Limit::AtMost(3.0)),
            figure("b", 1e-14, Limit::AtMost(1e-8)),
            figure("d", 7.0, Limit::None),
        ];
        let wrong = differences(&table, &other);
        assert_eq!(wrong.len(), 4, "{wrong:#?}");
        assert!(
            wrong[0].contains("measured 2.3") && wrong[2].contains("no row") && wrong[3].contains("shows c")
        );
    }
}
