//! `sweep.html`: how often runs reached their end, how figures answer to each key, all cases at once, and those that failed.

use crate::collect::{Collected, Row};
use crate::folder::{PAGE, Sweep};
use crate::parallel;
use crate::statistics::{Counted, Sampled};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::PathBuf;
use terraglue_diagnostics::error::Result;
use terraglue_recording::report::figure::{Curve, Figure, Panel};
use terraglue_recording::report::html::{escape, number};
use terraglue_recording::report::page::Page;
use terraglue_recording::{at, replace};

/// Most values of a key that each have a mean of their own; more are gathered in groups of neighbours.
const MOST_VALUES: usize = 25;
/// Groups of neighbours, and the fewest cases of one.
const GROUPS: usize = 10;
const FEWEST: usize = 5;
/// Most curves for the values of another key.
const MOST_CURVES: usize = 6;
/// Most failed cases that are listed.
const MOST_FAILED: usize = 500;

/// Writes the page; its path.
///
/// # Errors
/// The file cannot be written.
pub fn write(sweep: &Sweep, all: &Collected) -> Result<PathBuf> {
    let path = sweep.folder().join(PAGE);
    replace(&path, render(all).as_bytes()).map_err(at(&path))?;
    Ok(path)
}

fn render(all: &Collected) -> String {
    let mut page = Page::wide(&format!("{}: sweep", all.scenario));
    let ended = Counted::of(all.count("done"), all.rows.len() - all.missing());
    let of_them = match all.missing() {
        0 => String::new(),
        n => format!(", {n} still to be run"),
    };
    page.header(&format!(
        "<p class=\"lead\"><span>{} runs of <b>{}</b>{of_them}; {} % of those that were run reached their end ({} to {} %, 95 % interval)</span></p>",
        all.rows.len(),
        escape(&all.scenario),
        number(100.0 * ended.share, 3),
        number(100.0 * ended.low, 3),
        number(100.0 * ended.high, 3),
    ));
    for (k, key) in all.keys.iter().enumerate() {
        let id = format!("values-{k}");
        page.section(&format!("By {key}"), &id, &by_value(all, k));
    }
    if let Some(figure) = responses(all) {
        page.figure(figure);
    }
    if let Some(svg) = parallel::diagram(all) {
        page.section("All cases", "parallel", &svg);
    }
    if let Some(html) = failed(all) {
        page.section("Cases that did not reach their end", "failed", &html);
    }
    page.finish()
}

/// Whether all values of a key are numbers.
fn is_number(all: &Collected, k: usize) -> bool {
    all.rows.iter().all(|row| row.values[k].parse::<f64>().is_ok_and(f64::is_finite))
}

/// Cases by the value of a key: groups of neighbours where there are many values.
fn groups<'a>(all: &'a Collected, k: usize, rows: &[&'a Row]) -> Vec<(String, f64, Vec<&'a Row>)> {
    let place = |row: &Row| row.values[k].parse::<f64>().unwrap_or(f64::NAN);
    let mut by_value: BTreeMap<&str, Vec<&Row>> = BTreeMap::new();
    rows.iter().for_each(|row| by_value.entry(row.values[k].as_str()).or_default().push(row));
    let mut groups: Vec<(String, f64, Vec<&Row>)> = by_value
        .into_iter()
        .map(|(value, rows)| (value.to_owned(), value.parse().unwrap_or(f64::NAN), rows))
        .collect();
    if !is_number(all, k) {
        return groups;
    }
    if groups.len() > MOST_VALUES {
        let mut sorted: Vec<&Row> = rows.to_vec();
        sorted.sort_by(|a, b| place(a).total_cmp(&place(b)));
        let count = (sorted.len() / FEWEST).clamp(1, GROUPS);
        let bound = |k: usize| k * sorted.len() / count;
        groups = (0..count)
            .map(|k| &sorted[bound(k)..bound(k + 1)])
            .map(|rows| {
                let (low, high) = (place(rows[0]), place(rows[rows.len() - 1]));
                let mean = rows.iter().map(|row| place(row)).sum::<f64>() / rows.len() as f64;
                (format!("{} … {}", number(low, 3), number(high, 3)), mean, rows.to_vec())
            })
            .collect();
    }
    groups.sort_by(|a, b| a.1.total_cmp(&b.1));
    groups
}

/// A table: for each value of a key how many runs reached their end, and the means of the figures with their intervals.
fn by_value(all: &Collected, k: usize) -> String {
    let rows: Vec<&Row> = all.rows.iter().filter(|row| row.outcome.is_some()).collect();
    let mut out = format!(
        "<div class=\"wide\"><table class=\"rows\"><thead><tr><th class=\"name\">{}</th><th>runs</th><th>reached their end</th>",
        escape(&all.keys[k])
    );
    all.shown.iter().for_each(|name| {
        let _ = write!(out, "<th>{}</th>", escape(name));
    });
    out.push_str("</tr></thead><tbody>");
    for (value, _, rows) in groups(all, k, &rows) {
        let done: Vec<&&Row> = rows.iter().filter(|row| row.is_done()).collect();
        let ended = Counted::of(done.len(), rows.len());
        let _ = write!(
            out,
            "<tr><td class=\"name\">{}</td><td>{}</td><td>{} % <span class=\"hint\">{} … {}</span></td>",
            escape(&value),
            rows.len(),
            number(100.0 * ended.share, 3),
            number(100.0 * ended.low, 3),
            number(100.0 * ended.high, 3)
        );
        for name in &all.shown {
            let values: Vec<f64> = done.iter().filter_map(|row| row.figure(name)).collect();
            let _ = match Sampled::of(&values) {
                Some(s) if s.high.is_finite() => write!(
                    out,
                    "<td>{} <span class=\"hint\">± {}</span></td>",
                    number(s.mean, 4),
                    number(s.high - s.mean, 2)
                ),
                Some(s) => write!(out, "<td>{}</td>", number(s.mean, 4)),
                None => write!(out, "<td>–</td>"),
            };
        }
        out.push_str("</tr>");
    }
    out.push_str("</tbody></table></div><p class=\"hint\">Means over the runs that reached their end, with the 95 % interval of the mean (Student's t); shares with that of Wilson.</p>");
    out
}

/// How the figures answer to each key of numbers.
fn responses(all: &Collected) -> Option<Figure> {
    let keys: Vec<usize> = (0..all.keys.len())
        .filter(|k| is_number(all, *k) && all.keys[*k] != "world.seed")
        .filter(|k| all.rows.iter().any(|row| row.values[*k] != all.rows[0].values[*k]))
        .collect();
    // the other key whose values are curves of their own: one of few words
    let split = (0..all.keys.len())
        .filter(|k| !is_number(all, *k))
        .map(|k| (k, words(all, k)))
        .find(|(_, words)| words.len() <= MOST_CURVES);
    let panel = |choice: usize, name: &String| {
        let k = keys[choice];
        let curves = match &split {
            Some((other, words)) => {
                let of_word = |(colour, word): (usize, &String)| {
                    response(all, k, name, (word, colour), &|row| row.values[*other] == *word)
                };
                words.iter().enumerate().flat_map(of_word).collect()
            }
            None => response(all, k, name, ("mean", 0), &|_| true),
        };
        let across = Some((all.keys[k].clone(), String::new()));
        Panel { choice: Some(choice), across, ..Panel::new(name, "", curves) }
    };
    let panels = (0..keys.len()).flat_map(|choice| all.shown.iter().map(move |name| (choice, name)));
    let panels: Vec<Panel> = panels.map(|(choice, name)| panel(choice, name)).collect();
    let panels: Vec<Panel> = panels.into_iter().filter(|p| !p.curves.is_empty()).collect();
    let note = "Mean of the runs that reached their end; dashed: its 95 % interval.".to_owned();
    let choices = keys.iter().map(|k| format!("over {}", all.keys[*k])).collect();
    let title = "How the figures answer".to_owned();
    (!panels.is_empty()).then_some(Figure { id: "response", title, note, choices, chosen: 0, panels })
}

/// All values of a key, sorted.
fn words(all: &Collected, k: usize) -> Vec<String> {
    let mut words: Vec<String> = all.rows.iter().map(|row| row.values[k].clone()).collect();
    words.sort();
    words.dedup();
    words
}

/// The mean of a figure over a key, and both ends of its interval.
fn response(
    all: &Collected,
    k: usize,
    name: &str,
    (title, colour): (&str, usize),
    of: &dyn Fn(&Row) -> bool,
) -> Vec<Curve> {
    let rows: Vec<&Row> = all.rows.iter().filter(|row| row.is_done() && of(row)).collect();
    let points: Vec<(f64, Sampled)> = groups(all, k, &rows)
        .into_iter()
        .filter_map(|(_, x, rows)| {
            let values: Vec<f64> = rows.iter().filter_map(|row| row.figure(name)).collect();
            Some((x, Sampled::of(&values)?))
        })
        .collect();
    if points.len() < 2 {
        return Vec::new();
    }
    let x: Vec<f64> = points.iter().map(|(x, _)| *x).collect();
    let curve = |title: String, dashed: bool, y: fn(&Sampled) -> f64| {
        let y =
            points.iter().map(|(_, s)| Some(y(s)).filter(|y| y.is_finite()).unwrap_or(f64::NAN)).collect();
        Curve { dashed, ..Curve::new(title, colour, &x, y) }
    };
    let mut curves = vec![curve(title.to_owned(), false, |s| s.mean)];
    if points.iter().any(|(_, s)| s.high.is_finite()) {
        curves.push(curve(format!("{title}, lower end"), true, |s| s.low));
        curves.push(curve(format!("{title}, upper end"), true, |s| s.high));
    }
    curves
}

/// The cases that did not reach their end, with the reason.
fn failed(all: &Collected) -> Option<String> {
    let failed: Vec<&Row> = all.rows.iter().filter(|row| row.outcome.is_some() && !row.is_done()).collect();
    if failed.is_empty() {
        return None;
    }
    let mut out = String::from(
        "<div class=\"wide\"><table class=\"rows\"><thead><tr><th class=\"name\">case</th><th class=\"name\">status</th>",
    );
    all.keys.iter().for_each(|key| {
        let _ = write!(out, "<th class=\"name\">{}</th>", escape(key));
    });
    out.push_str("<th class=\"name\">reason</th></tr></thead><tbody>");
    for row in failed.iter().take(MOST_FAILED) {
        let _ = write!(
            out,
            "<tr><td class=\"name\"><a href=\"{}\">{}</a></td><td class=\"name\">{}</td>",
            escape(&row.folder.display().to_string()),
            row.number,
            row.status()
        );
        row.values.iter().for_each(|value| {
            let _ = write!(out, "<td class=\"name\">{}</td>", escape(value));
        });
        let reason = row.outcome.as_ref().and_then(|o| o.reason.as_deref()).unwrap_or_default();
        let _ = write!(out, "<td class=\"name\">{}</td></tr>", escape(reason));
    }
    out.push_str("</tbody></table></div>");
    if failed.len() > MOST_FAILED {
        let _ = write!(out, "<p class=\"hint\">{} more stand in the table.</p>", failed.len() - MOST_FAILED);
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::outcome::{CaseStatus, Outcome};

    fn collected(n: usize) -> Collected {
        let row = |k: usize| {
            let x = k as f64 / n as f64;
            let figures = BTreeMap::from([("distance_m".to_owned(), 2.0 * x)]);
            let status = if k == 3 { CaseStatus::Failed } else { CaseStatus::Done };
            let reason = (k == 3).then(|| "the leg is <broken>".to_owned());
            let soil = if k.is_multiple_of(2) { "bekker" } else { "automaton" };
            Row {
                number: k + 1,
                values: vec![format!("{x:?}"), soil.into()],
                outcome: Some(Outcome { status, reason, figures }),
                folder: format!("cases/{k}").into(),
            }
        };
        Collected {
            scenario: "walk".into(),
            keys: vec!["terrain.angle_rad".into(), "soil.module".into()],
            shown: vec!["distance_m".into()],
            figures: vec!["distance_m".into()],
            rows: (0..n).map(row).collect(),
        }
    }

    #[test]
    fn many_values_are_gathered_and_means_follow_the_key() {
        let all = collected(200);
        let rows: Vec<&Row> = all.rows.iter().collect();
        let groups = groups(&all, 0, &rows);
        assert_eq!(groups.len(), GROUPS);
        assert_eq!(groups.iter().map(|g| g.2.len()).sum::<usize>(), 200);
        let figure = responses(&all).expect("a figure");
        // a mean and both ends of its interval for each soil
        assert_eq!((figure.panels.len(), figure.panels[0].curves.len()), (1, 6));
        let mean = &figure.panels[0].curves[0];
        assert!(mean.t_s.iter().zip(&mean.y).all(|(x, y)| (y - 2.0 * x).abs() < 1e-9));
    }

    #[test]
    fn the_page_tells_what_failed_and_why() {
        let page = render(&collected(30));
        assert!(page.contains("the leg is &lt;broken&gt;") && page.contains("parallel coordinates"));
        assert!(page.contains("By soil.module"));
    }
}
