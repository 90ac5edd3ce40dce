//! A comparison of runs of the synthetic testbed by which recordings are tested, too: its figures are known beforehand.

#[path = "../../recording/tests/unit/fixture.rs"]
#[allow(dead_code)]
mod fixture;

use fixture::*;
use std::path::Path;
use terraglue_compare::{COMPARE_JSON, COMPARE_PAGE, COMPARE_TABLE, CompareRow, terminal_table, write};
use terraglue_recording::{FailureRecord, Recorder, RecorderOptions, RecorderState, Status, Summary};

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("temporary folder")
}

#[test]
fn what_is_unknown_or_does_not_apply_is_said_and_never_a_number() {
    let f = folder();
    let s = Fixture::unknown().recorded(f.path(), RecorderOptions::default(), 100);
    let row = CompareRow { summary: Some(s), ..Default::default() };
    let table = terminal_table(&[row], true);
    let gap = table.lines().find(|l| l.contains("largest gap")).expect("line");
    assert!(gap.contains("not applicable"), "{gap}");
    assert!(
        table.contains("unknown") && table.contains("soil keeps no energy ledger") && !table.contains("NaN"),
        "{table}"
    );
}

fn compared(f: &Path) -> Vec<CompareRow> {
    let mut rows = Vec::new();
    for strategy in ["cooperative", "iterative"] {
        let folder = f.join(strategy);
        let summary = Fixture::new(strategy).recorded(&folder, RecorderOptions::default(), 2000);
        rows.push(CompareRow {
            strategy: strategy.into(),
            soil: "soil-bekker".into(),
            summary: Some(summary),
            folder: Some(folder),
            error: None,
            cold_start_mean: (strategy == "iterative").then_some(7.5),
            ..Default::default()
        });
    }
    let mut failed = rows[1].clone();
    failed.strategy = "relaxed".into();
    failed.folder = None;
    if let Some(s) = &mut failed.summary {
        let message = "gluing by `relaxed` did not converge: residual 3".to_owned();
        (s.status, s.gluing.max_gap_m) = (Status::Failed, Some(0.0));
        s.error = Some(FailureRecord { module: None, function: None, time_s: Some(1.25), message });
    }
    rows.push(failed);
    rows
}

#[test]
fn a_comparison_marks_the_best_and_says_what_diverged_and_when() {
    let f = folder();
    let rows = compared(f.path());
    write(f.path(), &rows).expect("written");
    let read = |name: &str| std::fs::read_to_string(f.path().join(name)).expect("written");
    let json: serde_json::Value = serde_json::from_str(&read(COMPARE_JSON)).expect("JSON");
    assert_eq!(json["rows"][1]["cold_start_mean"], 7.5);
    assert_eq!(json["rows"][0]["error"], serde_json::Value::Null);
    assert_eq!(json["rows"][0]["folder"], "cooperative");
    let csv = read(COMPARE_TABLE);
    assert!(csv.lines().count() == 4 && csv.contains("failed at t = 1.2500 s"));
    let terminal = terminal_table(&rows, true);
    let gap = terminal.lines().find(|l| l.contains("largest gap")).expect("line");
    // 3e-11·2.2 m; the diverged run with gap 0 does not compete.
    assert!(gap.contains("* 66.0") && !gap.contains("* 0"), "{gap}");
    assert!(terminal.contains("relaxed · soil-bekker: failed at t = 1.2500 s"), "{terminal}");
    let html = read(COMPARE_PAGE);
    assert!(html.contains("class=\"best\">66.0") && html.contains("href=\"iterative/report.html\""));
    assert!(!html.replace("http://www.w3.org/2000/svg", "").contains("http"));
    if let Ok(keep) = std::env::var("TERRAGLUE_KEEP_COMPARISON") {
        std::fs::write(keep, html + "<!--" + &terminal + "-->").expect("kept");
    }
}
