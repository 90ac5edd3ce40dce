//! The simulation in words: headline, modules, numbers of the run, the scenario's text.

use crate::reader::Recording;
use crate::report::html::{escape, number};
use crate::summary::{Status, Summary};
use std::fmt::Write;

/// The lines below the title.
pub(crate) fn headline(recording: &Recording, summary: Option<&Summary>) -> String {
    let mut out = String::new();
    let missing = summary.filter(|s| recording.end_s() < s.simulated_s - 1e-6 * s.simulated_s.max(1.0));
    let (class, word) = match summary.map(|s| s.status) {
        Some(Status::Done) if missing.is_some() => ("fair", "recording cut off"),
        Some(Status::Done) => ("good", "done"),
        Some(Status::Failed) => ("bad", "failed"),
        Some(Status::Stopped) => ("fair", "stopped"),
        None => ("fair", "cut off"),
    };
    let _ = write!(out, r#"<p class="lead"><span class="pill {class}">{word}</span>"#);
    let mut parts = vec![format!("{} s simulated", number(recording.end_s(), 4))];
    parts.push(format!("gluing <b>{}</b>", escape(recording.header.get("strategy"))));
    if let Some(soil) = summary.and_then(|s| s.soil_module.as_deref()) {
        parts.push(format!("soil <b>{}</b>", escape(soil)));
    }
    let _ = write!(out, "<span>{}</span></p>", parts.join(" · "));
    if let Some(error) = summary.and_then(|s| s.error.as_ref()) {
        let _ = write!(out, r#"<p class="notice bad">{}</p>"#, escape(&error.message));
    }
    if let Some(summary) = missing {
        let (end, all) = (number(recording.end_s(), 4), number(summary.simulated_s, 4));
        let _ = write!(
            out,
            r#"<p class="notice">The recording ends at t = {end} s, the run at {all} s: curves and pictures show what is left, figures of
the whole run are those of summary.json.</p>"#
        );
    }
    if summary.is_none() {
        out.push_str(
            r#"<p class="notice">The run did not end properly: there is no summary.json. Figures below are
taken from what had been recorded.</p>"#,
        );
    }
    out
}

/// Modules and numbers beside the scenario's text.
pub(crate) fn render(recording: &Recording) -> String {
    let h = &recording.header;
    let mut out = String::from(r#"<div class="setup"><table class="facts"><tbody>"#);
    let mut row = |name: &str, value: String| {
        if !value.is_empty() {
            let _ = write!(out, "<tr><th>{name}</th><td>{value}</td></tr>");
        }
    };
    let modules: Vec<String> = h
        .subsystems()
        .map(|(name, module)| {
            format!("{} <span class=\"quiet\">is</span> <code>{}</code>", escape(name), escape(module))
        })
        .collect();
    row("Subsystems", modules.join("<br>"));
    let form = match h.get("form") {
        "" | "auto" => String::new(),
        form => format!(", form {}", escape(form)),
    };
    row("Gluing", format!("{}{form}", escape(h.get("strategy"))));
    row("Step h", with_unit(h.get("step_s"), "s"));
    row("Gravity", with_unit(&vector(h.get("gravity_m_s2")), "m/s²"));
    row("Seed", escape(h.get("seed")));
    if let Some((name, _)) = recording.reported_body() {
        row("Reported body", escape(&name.replace('/', ".")));
    }
    if let Some(g) = &recording.final_ground {
        let [nx, ny] = g.size;
        row("Ground", format!("{nx} × {ny} nodes, {}\u{2009}m apart", g.spacing));
    }
    out.push_str("</tbody></table>");
    if !h.get("scenario_text").is_empty() {
        let _ = write!(
            out,
            r#"<details open><summary>Scenario <code>{}.toml</code></summary><pre tabindex="0">{}</pre></details>"#,
            escape(h.get("scenario")),
            escape(h.get("scenario_text").trim_end())
        );
    }
    out.push_str("</div>");
    out
}

fn with_unit(value: &str, unit: &str) -> String {
    if value.is_empty() { String::new() } else { format!("{}\u{2009}{unit}", escape(value)) }
}

/// `[0.0, 0.0, -1.62]` as (0, 0, −1.62).
fn vector(list: &str) -> String {
    let numbers =
        list.trim_matches(['[', ']']).split(", ").map(|n| n.trim_end_matches(".0").replace('-', "−"));
    format!("({})", numbers.collect::<Vec<_>>().join(", "))
}
