//! The comparison at a glance, for a terminal and the head of the page: one line per run with its distance, its prints, its energy balance and its cost. It
//! is no wider than the terminal; all figures are in the files and behind `--details`.

use crate::columns::cell;
use crate::table::failures;
use crate::{CompareRow, choice, columns};
use comfy_table::{Cell, CellAlignment, Color, ColumnConstraint, ContentArrangement, Table, presets};
use terraglue_recording::report::html::number;

/// Width where nobody looks through a terminal.
const WIDTH: u16 = 80;

/// The figures, by their keys in the files, with short heads.
pub(crate) const FIGURES: [(&str, &str); 4] = [
    ("distance_m", "distance"),
    ("print_depth_m", "median\nprint"),
    ("energy_drift_share", "energy\ndrift"),
    ("cpu_per_step_s", "CPU per\nstep"),
];

/// One line per run, and what all runs have in common above them.
pub(crate) fn terminal(rows: &[CompareRow]) -> String {
    let parts: Vec<Vec<String>> = rows.iter().map(parts).collect();
    let common: Vec<bool> = (0..parts.first().map_or(0, Vec::len))
        .map(|k| rows.len() > 1 && parts.iter().all(|p| p.get(k) == parts[0].get(k)))
        .collect();
    let pick = |own: &[String], shared: bool| {
        let some = own.iter().zip(&common).filter(|(text, common)| **common == shared && !text.is_empty());
        some.map(|(text, _)| text.as_str()).collect::<Vec<_>>().join(" · ")
    };
    let mut table = Table::new();
    table.load_preset(presets::UTF8_FULL_CONDENSED).set_content_arrangement(ContentArrangement::Dynamic);
    if table.width().is_none() {
        table.set_width(WIDTH);
    }
    table.set_header(std::iter::once("run").chain(FIGURES.iter().map(|f| f.1)));
    for (k, row) in rows.iter().enumerate() {
        let mut name = pick(&parts[k], false);
        if row.failure().is_some() {
            name += if row.summary.is_some() { " (ended early)" } else { " (did not run)" };
        }
        let figures = FIGURES.iter().map(|(key, _)| in_terminal(figure(key, k, rows)));
        table.add_row(std::iter::once(Cell::new(name.trim())).chain(figures));
    }
    for column in table.column_iter_mut().skip(1) {
        column.set_constraint(ColumnConstraint::ContentWidth);
        column.set_cell_alignment(CellAlignment::Right);
    }
    let head = parts.first().map(|first| pick(first, true)).filter(|head| !head.is_empty());
    let head = head.map_or_else(String::new, |head| format!("all runs: {head}\n"));
    format!(
        "{head}{table}\n* best of its column; ! more than 1 %; --details shows all figures\n{}",
        failures(rows)
    )
}

/// The parts of the name of a run.
fn parts(row: &CompareRow) -> Vec<String> {
    let reference = if row.is_reference { " (reference)" } else { "" };
    let step = if row.name_step { format!("{} ms", (1e9 * row.step_s).round() / 1e6) } else { String::new() };
    let mut all = vec![format!("{}{reference}", row.strategy), row.soil.clone(), step];
    all.extend(row.varied.iter().map(|(key, value)| choice(key, value)));
    all
}

/// Text of a cell, and how it is marked.
pub(crate) struct CellText {
    pub text: String,
    /// The best of its column.
    pub best: bool,
    /// An energy that drifts by more than 1 %.
    pub off: bool,
}

/// The figure of a run, by its key in the files.
pub(crate) fn figure(key: &str, k: usize, rows: &[CompareRow]) -> CellText {
    let plain = |text| CellText { text, best: false, off: false };
    let Some(column) = columns::ALL.iter().find(|c| c.key == key) else { return plain(String::new()) };
    let row = &rows[k];
    let energies = row.summary.as_ref().map(|s| &s.energy.energies);
    if key == "energy_drift_share" {
        let text = match (column.value)(row) {
            Some(share) => format!("{}\u{a0}%", number(100.0 * share, 3)),
            // nothing was turned over
            None => match energies.and_then(|e| e.drift_j) {
                Some(drift_j) => cell(Some(drift_j), "J"),
                None => column.text(row),
            },
        };
        return CellText { off: energies.is_some_and(|e| e.is_off()), ..plain(text) };
    }
    let best = columns::best(column, rows).get(k).copied().unwrap_or(false);
    CellText { best, ..plain(column.text(row)) }
}

fn in_terminal(figure: CellText) -> Cell {
    match figure {
        CellText { off: true, text, .. } => Cell::new(format!("! {text}")).fg(Color::Red),
        CellText { best: true, text, .. } => Cell::new(format!("* {text}")),
        CellText { text, .. } => Cell::new(text),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use terraglue_recording::PrintDepth;
    use terraglue_recording::{Status, SummaryObserver};
    use terraglue_scenario::Scenario;

    fn rows() -> Vec<CompareRow> {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/plate_sinkage.toml");
        let scenario = Scenario::load(path.as_ref(), &[]).expect("good");
        let mut summary = SummaryObserver::new(&scenario).summary(1.0, 1.0, None, Status::Done);
        summary.motion.distance_m = Some(1.234_567_89);
        summary.print_depth = Some(PrintDepth { count: 3, median_m: 0.012_345, p10_m: 0.01, p90_m: 0.02 });
        summary.cpu_per_step_s = 1.234e-4;
        (summary.energy.energies.drift_j, summary.energy.energies.turnover_j) = (Some(-0.5), 10.0);
        let row = |soil: &str, value: &str| CompareRow {
            strategy: "cooperative-compliant".into(),
            soil: soil.into(),
            varied: vec![
                ("soil.parameters".into(), value.into()),
                ("robot.stiffness".into(), "600.0".into()),
            ],
            summary: Some(summary.clone()),
            ..CompareRow::default()
        };
        vec![row("soil-cellular-automaton", "lunar_nominal_Apollo"), row("soil-bekker", "LETE_sand")]
    }

    #[test]
    fn the_lines_fit_and_say_what_differs() {
        let mut rows = rows();
        rows[1].error = Some("refused".into());
        let text = terminal(&rows);
        let (table, failed) = text.split_once("* best").expect("a legend");
        assert!(table.lines().all(|line| line.chars().count() <= WIDTH.into()), "{table}");
        assert!(table.contains("all runs: cooperative-compliant · stiffness 600.0"), "{table}");
        for words in ["LETE_sand", "lunar_nominal_Apollo", "! −5.00\u{a0}%", "12.3\u{a0}mm", "123\u{a0}µs"]
        {
            assert!(table.contains(words), "{words} in {table}");
        }
        assert!(failed.contains("LETE_sand · stiffness 600.0: refused"), "{failed}");
    }
}
