//! The energies of a run at the top of pages: where they came from and went, and what nobody accounts for, red beyond 1 %.

use crate::energies::Energies;
use crate::report::html::{escape, number, with_prefix};
use std::fmt::Write;

/// Head of a line and its figure, J.
pub type Line = (&'static str, fn(&Energies) -> Option<f64>);

/// The lines in the order in which they add up.
pub const LINES: [Line; 6] = [
    ("work of motors and loads", |e| e.work_j),
    ("change of kinetic energy", |e| e.kinetic_change_j),
    ("change of potential energy", |e| e.potential_change_j),
    ("heat of the soil", |e| e.soil_heat_j),
    ("heat elsewhere", |e| e.other_heat_j),
    ("drift", |e| e.drift_j),
];

/// A line of the card as text: the figure, or that it is unknown.
pub fn text(value: Option<f64>) -> String {
    value.map_or_else(
        || "unknown".into(),
        |v| {
            let (value, unit) = with_prefix(v, "J", 4);
            format!("{value}\u{2009}{unit}")
        },
    )
}

/// The drift relative to its reference, as `0.12 % of the motors' work`; why it is unknown where it is.
pub fn judgement(e: &Energies) -> String {
    match (e.drift_share(), e.drift_j) {
        (Some(share), _) => format!("{}\u{2009}% {}", number(100.0 * share, 3), e.measure()),
        (None, Some(_)) => "nothing was turned over".into(),
        (None, None) => e.why_unknown(),
    }
}

/// The card of one run.
pub fn render(e: &Energies) -> String {
    let mut out = String::from(r#"<dl class="cards">"#);
    for (label, value) in LINES {
        let drift = label == "drift";
        // a scenario without soil has no such heat, and that is not unknown
        if label == "heat of the soil" && value(e).is_none() && e.drift_j.is_some() {
            continue;
        }
        let off = if drift && e.is_off() { " off" } else { "" };
        let more = match label {
            "drift" => judgement(e),
            "work of motors and loads" if e.driving_j > 0.0 || e.braking_j > 0.0 => {
                format!(
                    "net; motors: {} driving, {} braking",
                    text(Some(e.driving_j)),
                    text(Some(e.braking_j))
                )
            }
            "work of motors and loads" if !e.by_ports => {
                format!("net; {} to and fro", text(Some(e.turnover_j)))
            }
            "heat elsewhere" => "joints, contacts, glue".into(),
            _ => String::new(),
        };
        let _ = write!(
            out,
            r#"<div class="card{off}"><dt>{label}</dt><dd><b>{}</b></dd><dd class="more">{}</dd></div>"#,
            escape(&text(value(e))),
            escape(&more)
        );
    }
    out.push_str("</dl>");
    out
}

/// The cards of several runs as one table; each run with its name.
pub fn table<'a>(runs: impl Iterator<Item = (String, &'a Energies)>) -> String {
    let mut out =
        String::from(r#"<div class="wide"><table class="rows"><thead><tr><th class="name">run</th>"#);
    for (label, _) in LINES {
        let _ = write!(out, "<th>{label}</th>");
    }
    out.push_str("<th>drift against</th></tr></thead><tbody>");
    for (name, e) in runs {
        let off = if e.is_off() { " class=\"off\"" } else { "" };
        let _ = write!(out, "<tr><td class=\"name\">{}</td>", escape(&name));
        for (label, value) in LINES {
            let class = if label == "drift" { off } else { "" };
            let _ = write!(out, "<td{class}>{}</td>", escape(&text(value(e))));
        }
        let _ = write!(out, "<td{off}>{}</td></tr>", escape(&judgement(e)));
    }
    out.push_str("</tbody></table></div>");
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn known() -> Energies {
        Energies {
            work_j: Some(10.0),
            kinetic_change_j: Some(1.0),
            potential_change_j: Some(2.0),
            soil_heat_j: Some(4.0),
            other_heat_j: Some(3.05),
            drift_j: Some(0.05),
            turnover_j: 20.0,
            ..Energies::default()
        }
    }

    #[test]
    fn the_card_is_red_beyond_a_hundredth_of_the_motors_work() {
        let mut e = known();
        let html = render(&e);
        assert!(!html.contains("card off") && html.contains("0.250\u{2009}% of the motors' work"), "{html}");
        e.drift_j = Some(0.25);
        assert!(render(&e).contains("card off"));
        assert!(table([("a".to_owned(), &e)].into_iter()).contains("class=\"off\""));
    }

    #[test]
    fn what_is_unknown_is_said_and_why() {
        let e = Energies {
            soil_heat_j: None,
            other_heat_j: None,
            drift_j: None,
            without_book: vec!["soil".into()],
            ..known()
        };
        let html = render(&e);
        assert!(
            html.contains("unknown") && html.contains("soil keeps no energy ledger") && !html.contains("NaN"),
            "{html}"
        );
        assert!(!html.contains("card off"));
    }
}
