//! The cost of a step of the shipped scenarios split by part, as tables for `docs/performance.md`.
//!
//! `cargo bench -p terraglue-acceptance --bench step_parts [-- SCENARIO …]`: all of them, or those named. Every step counts
//! with the least of its times over three runs.

use terraglue_acceptance::step_times::{COMBINATIONS, Case, RECORDING, Row, SCENARIOS, WHOLE, measure};

const RUNS: usize = 3;

fn main() {
    let named: Vec<String> = std::env::args().skip(1).filter(|a| !a.starts_with('-')).collect();
    for (scenario, seconds) in SCENARIOS {
        if named.is_empty() || named.iter().any(|n| n == scenario) {
            show(scenario, seconds);
        }
    }
}

/// Parts without recording, and the cost of the whole with and without.
fn show(scenario: &'static str, seconds: f64) {
    let measured = |recorded: bool| -> Vec<Vec<Row>> {
        let of = |(soil, strategy)| {
            let case = Case { scenario, soil, strategy };
            measure(case, seconds, RUNS, recorded).unwrap_or_else(|e| panic!("{e}"))
        };
        COMBINATIONS.map(of).into()
    };
    let (plain, recorded) = (measured(false), measured(true));
    let heads: Vec<_> = COMBINATIONS.iter().map(|(soil, strategy)| format!("{soil}, {strategy}")).collect();
    println!("\n{scenario}, {seconds} s\n\n| part (mean µs per step) | {} |", heads.join(" | "));
    println!("|---|{}", "---:|".repeat(heads.len()));
    let parts = plain[0].iter().map(|row| row.name).filter(|name| ![RECORDING, WHOLE].contains(name));
    for name in parts {
        line(name, &plain, name, Row::mean, 1);
    }
    line("whole", &plain, WHOLE, Row::mean, 1);
    line(RECORDING, &recorded, RECORDING, Row::mean, 1);
    for (what, share) in [("median", 0.5), ("99 %", 0.99), ("largest", 1.0)] {
        line(&format!("whole with recording, {what}"), &recorded, WHOLE, |r| r.quantile(share), 1);
    }
    let step_us = 1e6 * terraglue_acceptance::shipped(scenario, &[]).time.step_s;
    line("times real time", &plain, WHOLE, |r| step_us / r.mean(), 1);
    line("times real time with recording", &recorded, WHOLE, |r| step_us / r.mean(), 1);
}

/// One line of the table.
fn line(title: &str, columns: &[Vec<Row>], name: &str, figure: impl Fn(&Row) -> f64, digits: usize) {
    let of = |rows: &Vec<Row>| rows.iter().find(|r| r.name == name).map_or(f64::NAN, &figure);
    let cells: Vec<_> = columns.iter().map(|rows| format!("{:.digits$}", of(rows))).collect();
    println!("| {title} | {} |", cells.join(" | "));
}
