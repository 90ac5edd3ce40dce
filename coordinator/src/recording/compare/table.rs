//! The comparison as text: for a terminal and as CSV.

use crate::recording::compare::{CompareRow, columns};
use crate::recording::report::html::{number, with_prefix};
use comfy_table::{CellAlignment, Table, presets};
use std::path::Path;

/// A figure with its unit in a suitable SI prefix.
pub(crate) fn cell(value: Option<f64>, unit: &str) -> String {
    match value {
        None => "–".into(),
        Some(v) if unit.is_empty() && v == v.trunc() && v.abs() < 1e6 => format!("{v}"),
        Some(v) if unit.is_empty() => number(v, 3),
        Some(v) => {
            let (text, unit) = with_prefix(v, unit, 3);
            format!("{text}\u{a0}{unit}")
        }
    }
}

/// One column per run.
pub(crate) fn terminal(rows: &[CompareRow]) -> String {
    let mut table = Table::new();
    table.load_preset(presets::UTF8_FULL_CONDENSED);
    let head = |f: fn(&CompareRow) -> &str| rows.iter().map(f).map(str::to_owned).collect::<Vec<_>>();
    let line = |name: &str, cells: Vec<String>| std::iter::once(name.to_owned()).chain(cells);
    table.set_header(line("strategy", head(|r| &r.strategy)));
    table.add_row(line("soil", head(|r| &r.soil)));
    table.add_row(line("form", head(|r| r.summary.as_ref().map_or("–", |s| &s.form))));
    for column in columns::ALL {
        if rows.iter().all(|r| (column.value)(r).is_none()) {
            continue;
        }
        let marks = columns::best(column, rows);
        let cells = rows.iter().zip(marks).map(|(r, best)| {
            let text = cell((column.value)(r), column.unit);
            if best { format!("* {text}") } else { text }
        });
        table.add_row(line(&column.name(), cells.collect()));
    }
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    let mut out = format!("{table}\n* best of the line\n");
    for row in rows {
        if let Some(failure) = row.failure() {
            out.push_str(&format!("{}: {failure}\n", row.name()));
        }
    }
    out
}

/// One line per run, plain numbers in SI units.
pub(crate) fn write_csv(path: &Path, rows: &[CompareRow]) -> csv::Result<()> {
    let mut out = csv::Writer::from_path(path)?;
    let keys = columns::ALL.iter().map(|c| c.key);
    out.write_record(["strategy", "soil", "form"].into_iter().chain(keys).chain(["error"]))?;
    for row in rows {
        let form = row.summary.as_ref().map_or("", |s| &s.form);
        let words = [row.strategy.as_str(), &row.soil, form].map(str::to_owned);
        let figures = columns::ALL.iter().map(|c| (c.value)(row).map_or_else(String::new, |v| v.to_string()));
        let failure = row.failure().unwrap_or_default();
        out.write_record(words.into_iter().chain(figures).chain([failure]))?;
    }
    out.flush()?;
    Ok(())
}
