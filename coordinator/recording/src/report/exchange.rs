//! How values went round, and what each subsystem cost.

use super::html::{escape, number};
use crate::exchange::read_exchange;
use crate::layout::TIMING;
use std::fmt::Write;
use std::path::Path;

/// Connections that are listed; a robot has hundreds that are all alike.
const LISTED: usize = 60;

/// The section of a run's folder; none where it holds no explanation.
pub(crate) fn render(folder: &Path) -> Option<String> {
    let explanation = read_exchange(folder)?;
    let mut out = format!(
        "<details><summary>order of a step, {} connections, cost of each subsystem</summary><ol>",
        explanation.connections.len()
    );
    for line in &explanation.order {
        let _ = write!(out, "<li>{}</li>", escape(line));
    }
    out.push_str("</ol>");
    if !explanation.connections.is_empty() {
        table(&mut out, &["from", "to", "value", "delay (steps)", "why"]);
        for c in explanation.connections.iter().take(LISTED) {
            row(&mut out, &[&c.from, &c.to, &c.value, &c.delay, &c.why]);
        }
        out.push_str(TABLE_END);
        let more = explanation.connections.len().saturating_sub(LISTED);
        if more > 0 {
            let _ = write!(out, "<p class=\"note\">and {more} more, in exchange.json</p>");
        }
    }
    for line in &explanation.loops {
        let _ = write!(out, "<p class=\"note\">Loop: {}</p>", escape(line));
    }
    let costs = costs(folder);
    if !costs.is_empty() {
        table(&mut out, &["subsystem", "wall time (s)", "per step (µs)"]);
        for (name, wall_s, per_step_us) in &costs {
            row(&mut out, &[name, &number(*wall_s, 4), &number(*per_step_us, 4)]);
        }
        out.push_str(TABLE_END);
    }
    out.push_str("</details>");
    Some(out)
}

const TABLE_END: &str = "</tbody></table></div>";

fn table(out: &mut String, heads: &[&str]) {
    out.push_str("<div class=\"scroll\"><table class=\"events\"><thead><tr>");
    for head in heads {
        let _ = write!(out, "<th>{head}</th>");
    }
    out.push_str("</tr></thead><tbody>");
}

fn row(out: &mut String, cells: &[&str]) {
    out.push_str("<tr>");
    for cell in cells {
        let _ = write!(out, "<td>{}</td>", escape(cell));
    }
    out.push_str("</tr>");
}

/// Name, s and µs per step of every subsystem in `timing.csv`.
fn costs(folder: &Path) -> Vec<(String, f64, f64)> {
    let Ok(mut table) = csv::Reader::from_path(folder.join(TIMING)) else { return Vec::new() };
    let one = |record: csv::Result<csv::StringRecord>| {
        let record = record.ok()?;
        let name = record.get(0)?.strip_prefix("subsystem ")?.to_owned();
        Some((name, record.get(1)?.parse().ok()?, record.get(4)?.parse().ok()?))
    };
    table.records().filter_map(one).collect()
}
