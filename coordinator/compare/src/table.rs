//! The comparison as text: for a terminal and as CSV.

use crate::{CompareRow, columns};
use comfy_table::{Cell, CellAlignment, Color, Table, presets};
use std::path::Path;
use terraglue_recording::report::energy_card;

/// More runs than this do not fit side by side.
const SIDE_BY_SIDE: usize = 5;
/// Columns that are kept where every run is a line, so that the lines fit; the files have all.
const SHORT: [&str; 9] = [
    "step_s",
    "reference_error_m",
    "order",
    "evaluations_mean",
    "evaluations_soil_mean",
    "max_gap_m",
    "max_action_reaction_gap_n",
    "max_sinkage_m",
    "cpu_per_step_s",
];

/// All figures with one column per run; of many runs the main figures with one line per run.
pub(crate) fn terminal(rows: &[CompareRow]) -> String {
    let mut table = Table::new();
    table.load_preset(presets::UTF8_FULL_CONDENSED);
    let many = rows.len() > SIDE_BY_SIDE;
    let shown: Vec<&columns::FigureColumn> = columns::ALL
        .iter()
        .filter(|c| !many || SHORT.contains(&c.key))
        .filter(|c| c.is_shown(rows))
        .collect();
    let cells: Vec<Vec<String>> = shown
        .iter()
        .map(|column| {
            let mark = |(r, best): (&CompareRow, bool)| {
                let text = column.text(r);
                if best { format!("* {text}") } else { text }
            };
            rows.iter().zip(columns::best(column, rows)).map(mark).collect()
        })
        .collect();
    let form = |r: &CompareRow| r.summary.as_ref().map_or_else(|| "–".to_owned(), |s| s.gluing.form.clone());
    let strategy = |r: &CompareRow| match r.is_reference {
        true => format!("{} (reference)", r.strategy),
        false => r.strategy.clone(),
    };
    let mut words: Vec<(String, Vec<String>)> = vec![
        ("strategy".into(), rows.iter().map(strategy).collect()),
        ("soil".into(), rows.iter().map(|r| r.soil.clone()).collect()),
        ("form".into(), rows.iter().map(form).collect()),
    ];
    for (k, key) in varied_keys(rows).into_iter().enumerate() {
        words.insert(2 + k, (key.into(), rows.iter().map(|r| varied(r, key).to_owned()).collect()));
    }
    let names = words.iter().map(|w| w.0.clone()).chain(shown.iter().map(|c| c.name()));
    let columns: Vec<&Vec<String>> = words.iter().map(|w| &w.1).chain(&cells).collect();
    if many {
        table.set_header(names);
        (0..rows.len()).for_each(|k| {
            table.add_row(columns.iter().map(|c| c[k].clone()));
        });
    } else {
        for (k, (name, cells)) in names.zip(columns).enumerate() {
            let line = std::iter::once(name).chain(cells.iter().cloned());
            if k == 0 {
                table.set_header(line)
            } else {
                table.add_row(line)
            };
        }
    }
    for column in table.column_iter_mut().skip(if many { words.len() } else { 1 }) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    let best = if many {
        "* best of its column; all columns are in compare.html and compare.csv"
    } else {
        "* best of the line"
    };
    format!("{}\n{table}\n{best}\n{}", energies(rows), failures(rows))
}

/// A line for every run that did not reach its end.
pub(crate) fn failures(rows: &[CompareRow]) -> String {
    rows.iter().filter_map(|row| Some(format!("{}: {}\n", row.name(), row.failure()?))).collect()
}

/// The keys that `--vary` names, in its order.
pub(crate) fn varied_keys(rows: &[CompareRow]) -> Vec<&str> {
    rows.first().into_iter().flat_map(|r| r.varied.iter().map(|(key, _)| key.as_str())).collect()
}

/// The value of such a key.
pub(crate) fn varied<'a>(row: &'a CompareRow, key: &str) -> &'a str {
    row.varied.iter().find(|(k, _)| k == key).map_or("", |(_, value)| value)
}

/// Where the energy of every run went, one line per run; drifts beyond 1 % are red and marked with `!`.
fn energies(rows: &[CompareRow]) -> Table {
    let mut table = Table::new();
    table.load_preset(presets::UTF8_FULL_CONDENSED);
    let heads = energy_card::LINES.iter().map(|l| l.0);
    table.set_header(std::iter::once("energy of").chain(heads).chain(["drift against"]));
    for row in rows {
        let Some(e) = row.summary.as_ref().map(|s| &s.energy.energies) else { continue };
        let last = energy_card::LINES.len() - 1;
        let mut cells = vec![Cell::new(row.name())];
        cells.extend(energy_card::LINES.iter().enumerate().map(|(k, (_, value))| {
            let text = energy_card::text(value(e));
            let cell = if k == last && e.is_off() {
                Cell::new(format!("! {text}")).fg(Color::Red)
            } else {
                Cell::new(text)
            };
            cell.set_alignment(CellAlignment::Right)
        }));
        cells.push(Cell::new(energy_card::judgement(e)));
        table.add_row(cells);
    }
    table
}

/// One line per run, plain numbers in SI units.
pub(crate) fn write_csv(path: &Path, rows: &[CompareRow]) -> csv::Result<()> {
    let mut out = csv::Writer::from_path(path)?;
    let keys = columns::ALL.iter().map(|c| c.key);
    let more = varied_keys(rows);
    let heads = ["strategy", "soil", "form"].into_iter().chain(keys).chain(["error"]);
    out.write_record(heads.chain(more.iter().copied()))?;
    for row in rows {
        let form = row.summary.as_ref().map_or("", |s| &s.gluing.form);
        let words = [row.strategy.as_str(), &row.soil, form].map(str::to_owned);
        let figures = columns::ALL.iter().map(|c| (c.value)(row).map_or_else(String::new, |v| v.to_string()));
        let failure = row.failure().unwrap_or_default();
        let others = more.iter().map(|key| varied(row, key).to_owned());
        out.write_record(words.into_iter().chain(figures).chain([failure]).chain(others))?;
    }
    out.flush()?;
    Ok(())
}
