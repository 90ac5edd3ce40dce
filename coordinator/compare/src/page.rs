//! `compare.html`: the table with the best figure of each column marked, and curves of all runs in one picture.

use crate::scatter::{self, Series};
use crate::table::{varied, varied_keys};
use crate::{CompareRow, columns, grounds, overview, relative};
use std::fmt::Write;
use std::path::Path;
use terraglue_recording::Recording;
use terraglue_recording::report::energy_card;
use terraglue_recording::report::figure::{Curve, Figure, Panel};
use terraglue_recording::report::footprints::{self, Leg};
use terraglue_recording::report::html::escape;
use terraglue_recording::report::page::Page;
use terraglue_recording::{REPORT, WindowRecord};

/// A run with what its recording shows.
pub(crate) struct Run {
    /// Number of its row.
    pub row: usize,
    name: String,
    colour: usize,
    recording: Recording,
    legs: Vec<Leg>,
}

/// The page as text.
pub(crate) fn render(folder: &Path, rows: &[CompareRow], runs: &[Run]) -> String {
    let scenario = rows.iter().find_map(|r| r.summary.as_ref()).map_or("", |s| &s.scenario);
    let mut page = Page::wide(&format!("{scenario}: comparison"));
    let ended = rows.iter().filter(|r| r.failure().is_none()).count();
    page.header(&format!(
        "<p class=\"lead\"><span>{} runs of <b>{}</b>, {ended} reached their end</span></p>",
        rows.len(),
        escape(scenario)
    ));
    page.section("At a glance", "figures", &glance(folder, rows));
    let ledgers = rows.iter().filter_map(|r| Some((r.name(), &r.summary.as_ref()?.energy.energies)));
    page.section("Where the energy went", "energies", &energy_card::table(ledgers));
    let shown: Vec<_> = runs
        .iter()
        .filter_map(|run| Some((run.name.as_str(), relative(folder, &rows[run.row])?, &run.recording)))
        .collect();
    if let Some(html) = grounds::pictures(&shown) {
        page.section("Grounds side by side", "grounds", &html);
    }
    for (title, id, html) in diagrams(rows) {
        page.section(title, id, &html);
    }
    for figure in [gluing(runs), forces(runs), body(runs)].into_iter().flatten() {
        page.figure(figure);
    }
    let all = format!(
        "<details><summary>Every figure of every run</summary>{}</details>",
        html_table(folder, rows)
    );
    page.section("All figures", "all", &all);
    page.finish()
}

/// Error against the reference over the step and over the work, one line per strategy and soil.
fn diagrams(rows: &[CompareRow]) -> Vec<(&'static str, &'static str, String)> {
    let same = |a: &CompareRow, b: &CompareRow| a.strategy == b.strategy && a.is_like(b);
    let mut lines: Vec<&CompareRow> = rows.iter().filter(|r| !r.is_reference).collect();
    lines.dedup_by(|a, b| same(a, b));
    let series = |x: fn(&CompareRow) -> Option<f64>| -> Vec<Series> {
        let one = |(colour, line): (usize, &&CompareRow)| {
            let own = rows.iter().filter(|r| same(r, line) && r.failure().is_none());
            let mut points: Vec<(f64, f64)> =
                own.filter_map(|r| Some((x(r)?, r.reference_error_m?))).collect();
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            let name = CompareRow { name_step: false, ..(*line).clone() }.name();
            Series { name, colour, points }
        };
        lines.iter().enumerate().map(one).collect()
    };
    let work = |r: &CompareRow| {
        let s = r.summary.as_ref()?;
        Some((s.gluing.evaluations_mean + s.gluing.evaluations_soil_mean) * s.steps as f64)
    };
    [
        ("Error against the step", "error-step", "step, s", series(|r| Some(r.step_s))),
        ("Work and precision", "work-precision", "evaluations of both sides, all steps", series(work)),
    ]
    .into_iter()
    .filter_map(|(title, id, x, s)| Some((title, id, scatter::diagram(x, "error, m", &s)?)))
    .collect()
}

/// The recordings of all rows. One that cannot be read leaves its row without curves; the table says what went wrong with
/// the run.
pub(crate) fn open(rows: &[CompareRow]) -> Vec<Run> {
    let one = |(row, of): (usize, &CompareRow)| {
        let recording = Recording::open(of.folder.as_deref()?).ok()?;
        let legs = footprints::legs(&recording);
        Some(Run { row, name: of.name(), colour: row, recording, legs })
    };
    rows.iter().enumerate().filter_map(one).collect()
}

/// The main figures, as in the terminal.
fn glance(folder: &Path, rows: &[CompareRow]) -> String {
    let mut out =
        String::from("<div class=\"wide\"><table class=\"rows\"><thead><tr><th class=\"name\">run</th>");
    for (_, title) in overview::FIGURES {
        let _ = write!(out, "<th>{}</th>", title.replace('\n', " "));
    }
    out.push_str("</tr></thead><tbody>");
    for (k, row) in rows.iter().enumerate() {
        let name = escape(&row.name());
        let _ = match relative(folder, row) {
            Some(place) => {
                write!(out, "<tr><td class=\"name\"><a href=\"{}/{REPORT}\">{name}</a></td>", escape(&place))
            }
            None => write!(out, "<tr><td class=\"name\">{name}</td>"),
        };
        for (key, _) in overview::FIGURES {
            let figure = overview::figure(key, k, rows);
            let class = if figure.off {
                "off"
            } else if figure.best {
                "best"
            } else {
                ""
            };
            let _ = write!(out, "<td class=\"{class}\">{}</td>", escape(&figure.text));
        }
        out.push_str("</tr>");
        if let Some(failure) = row.failure() {
            let _ = write!(
                out,
                "<tr class=\"failed\"><td class=\"why\" colspan=\"5\">{}</td></tr>",
                escape(&failure)
            );
        }
    }
    out.push_str("</tbody></table></div><p class=\"hint\">● best of its column; red: more than 1 % of the energy is missing.</p>");
    out
}

fn html_table(folder: &Path, rows: &[CompareRow]) -> String {
    let shown: Vec<&columns::FigureColumn> = columns::ALL.iter().filter(|c| c.is_shown(rows)).collect();
    let marks: Vec<Vec<bool>> = shown.iter().map(|c| columns::best(c, rows)).collect();
    let mut out = String::from("<div class=\"wide\"><table class=\"rows\"><thead><tr>");
    let keys = varied_keys(rows);
    head(&mut out, &keys, &shown);
    out.push_str("</tr></thead><tbody>");
    for (k, row) in rows.iter().enumerate() {
        let failure = row.failure();
        let _ = write!(out, "<tr{}>", if failure.is_some() { " class=\"failed\"" } else { "" });
        let mut strategy = match relative(folder, row) {
            Some(place) => format!("<a href=\"{}/{REPORT}\">{}</a>", escape(&place), escape(&row.strategy)),
            None => escape(&row.strategy),
        };
        if row.is_reference {
            strategy.push_str(" (reference)");
        }
        let form = row.summary.as_ref().map_or("–", |s| &s.gluing.form);
        let others = keys.iter().map(|key| escape(varied(row, key)));
        for text in [strategy, escape(&row.soil)].into_iter().chain(others).chain([escape(form)]) {
            let _ = write!(out, "<td class=\"name\">{text}</td>");
        }
        for (column, best) in shown.iter().zip(&marks) {
            let class = if best[k] { " class=\"best\"" } else { "" };
            let _ = write!(out, "<td{class}>{}</td>", escape(&column.text(row)));
        }
        out.push_str("</tr>");
        if let Some(failure) = failure {
            let span = shown.len() + keys.len() + 3;
            let _ = write!(
                out,
                "<tr class=\"failed\"><td class=\"why\" colspan=\"{span}\">{}</td></tr>",
                escape(&failure)
            );
        }
    }
    out.push_str("</tbody></table></div><p class=\"hint\">● best of its column among the runs that reached their end.</p>");
    out
}

/// Two lines of heads: groups over their columns, single columns over both lines.
fn head(out: &mut String, keys: &[&str], shown: &[&columns::FigureColumn]) {
    for name in ["strategy", "soil"].iter().chain(keys).chain(&["form"]) {
        let _ = write!(out, "<th class=\"name\" rowspan=\"2\">{}</th>", escape(name));
    }
    for group in shown.chunk_by(|a, b| a.group == b.group && !a.group.is_empty()) {
        let (n, first) = (group.len(), group[0]);
        let _ = match first.group {
            "" => write!(out, "<th rowspan=\"2\">{}</th>", escape(first.title)),
            name => write!(out, "<th class=\"group\" colspan=\"{n}\">{}</th>", escape(name)),
        };
    }
    out.push_str("</tr><tr>");
    for column in shown.iter().filter(|c| !c.group.is_empty()) {
        let _ = write!(out, "<th>{}</th>", escape(column.title));
    }
}

fn panel(runs: &[Run], quantity: &str, unit: &str, steps: bool, f: fn(&WindowRecord) -> f64) -> Panel {
    let curve = |run: &Run| {
        let rows = || run.recording.gluing.iter().filter(|g| g.since_last.steps > 0);
        let t: Vec<f64> = rows().map(|g| g.t).collect();
        let y = rows().map(|g| f(&g.since_last)).collect();
        Curve { steps, ..Curve::new(run.name.clone(), run.colour, &t, y) }
    };
    Panel::new(quantity, unit, runs.iter().map(curve).collect())
}

fn gluing(runs: &[Run]) -> Option<Figure> {
    if runs.iter().all(|r| r.recording.gluing.len() < 2) {
        return None;
    }
    let panels = vec![
        panel(runs, "evaluations of bodies", "", true, |w| f64::from(w.evaluations_bodies_max)),
        panel(runs, "evaluations of soil", "", true, |w| f64::from(w.evaluations_soil_max)),
        panel(runs, "gap", "m", false, |w| w.max_gap_m.unwrap_or(f64::NAN)).log(true),
        panel(runs, "action–reaction gap", "N", false, |w| w.max_action_reaction_gap_n).log(true),
    ];
    let note = "Per step; the largest of all steps since the record before.".into();
    Some(Figure { id: "gluing", title: "Gluing".into(), note, panels, ..Figure::default() })
}

/// One picture per foot, all runs in it.
fn forces(runs: &[Run]) -> Option<Figure> {
    let mut feet: Vec<String> = runs.iter().flat_map(|r| r.legs.iter().map(|l| l.body.clone())).collect();
    feet.sort();
    feet.dedup();
    if feet.is_empty() {
        return None;
    }
    let panel = |(choice, foot): (usize, &String)| {
        let curve = |run: &Run| {
            let leg = run.legs.iter().find(|l| l.body == *foot)?;
            let made = run.recording.first_step();
            let t: Vec<f64> = run.recording.gluing[made..].iter().map(|g| g.t).collect();
            Some(Curve::new(run.name.clone(), run.colour, &t, leg.normal_n[made..].to_vec()))
        };
        let curves = runs.iter().filter_map(curve).collect();
        Panel { choice: Some(choice), ..Panel::new(&format!("normal force on {foot}"), "N", curves) }
    };
    let panels = feet.iter().enumerate().map(panel).collect();
    let note = "Force that the ground exerts along its normal on one foot, in every run.".into();
    Some(Figure { id: "forces", title: "Foot force".into(), note, choices: feet, chosen: 0, panels })
}

fn body(runs: &[Run]) -> Option<Figure> {
    let along = |axis: usize| {
        let curve = |run: &Run| {
            let (_, poses) = run.recording.reported_body()?;
            let y = poses.position.iter().map(|p| p[axis]).collect();
            Some(Curve::new(run.name.clone(), run.colour, &poses.t_s, y))
        };
        runs.iter().filter_map(curve).collect::<Vec<_>>()
    };
    let panels = vec![
        Panel::new("height", "m", along(2)),
        Panel::new("position x", "m", along(0)),
        Panel::new("position y", "m", along(1)),
    ];
    let note = "Origin of the reported body in the world.".into();
    let figure = Figure { id: "body", title: "Body".into(), note, panels, ..Figure::default() };
    (!figure.panels[0].curves.is_empty()).then_some(figure)
}
