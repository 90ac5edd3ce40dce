//! The figures of a run at one glance.

use crate::recording::reader::Recording;
use crate::recording::report::html::{escape, number, with_prefix};
use crate::recording::summary::Summary;
use std::fmt::Write;

/// One figure.
struct Card {
    label: &'static str,
    value: String,
    unit: String,
    /// Smaller line below.
    more: String,
}

impl Card {
    fn new(label: &'static str, value: (String, String), more: impl Into<String>) -> Self {
        Self { label, value: value.0, unit: value.1, more: more.into() }
    }
}

/// The cards as HTML.
pub(crate) fn render(recording: &Recording, summary: Option<&Summary>) -> String {
    let cards = match summary {
        Some(summary) => from_summary(summary),
        None => from_recording(recording),
    };
    let mut out = String::from(r#"<dl class="cards">"#);
    for c in cards {
        let _ = write!(
            out,
            r#"<div class="card"><dt>{}</dt><dd><b>{}</b>&#8239;<span class="unit">{}</span></dd><p>{}</p></div>"#,
            c.label,
            c.value,
            escape(&c.unit),
            c.more
        );
    }
    out.push_str("</dl>");
    out
}

fn pure(value: f64, digits: usize) -> (String, String) {
    (number(value, digits), String::new())
}

fn degrees(rad: f64) -> (String, String) {
    (number(rad.to_degrees(), 3), "°".into())
}

fn not_applicable() -> (String, String) {
    ("not applicable".into(), String::new())
}

fn unknown() -> (String, String) {
    ("unknown".into(), String::new())
}

fn text(value: (String, String)) -> String {
    format!("{}\u{2009}{}", value.0, value.1)
}

fn from_summary(s: &Summary) -> Vec<Card> {
    let mut cards = Vec::new();
    if let Some(d) = s.distance_m {
        let more = match s.commanded_distance_m {
            Some(c) if c > 0.0 => {
                format!("{} % of the commanded {} m", number(100.0 * d / c, 3), number(c, 3))
            }
            _ => "along the initial heading".into(),
        };
        cards.push(Card::new("Distance", (number(d, 4), "m".into()), more));
    }
    if let (Some(roll), Some(pitch)) = (s.max_roll_rad, s.max_pitch_rad) {
        let tilt = roll.max(pitch);
        let more = format!("roll {}, pitch {}", text(degrees(roll)), text(degrees(pitch)));
        cards.push(Card::new("Largest tilt", degrees(tilt), more));
    }
    if let Some(z) = s.max_sinkage_m {
        cards.push(Card::new("Deepest print", with_prefix(z, "m", 3), "below the initial surface"));
    }
    if s.energy_j > 0.0 {
        let more = match s.cost_of_transport {
            Some(c) => format!("cost of transport {}", number(c, 3)),
            None => "at the motors".into(),
        };
        cards.push(Card::new("Motor energy", with_prefix(s.energy_j, "J", 4), more));
    }
    if let Some(electrical_j) = s.electrical_energy_j.filter(|e| *e > 0.0) {
        let more = s.electrical_energy_j_per_m.map_or_else(
            || "drawn by the motors".into(),
            |e| format!("{} per metre", text(with_prefix(e, "J", 4))),
        );
        cards.push(Card::new("Electrical energy", with_prefix(electrical_j, "J", 4), more));
    }
    let more = format!("bodies, at most {}; soil {}", s.evaluations_max, number(s.evaluations_soil_mean, 3));
    cards.push(Card::new("Evaluations a step", pure(s.evaluations_mean, 3), more));
    let not = match s.steps_not_converged {
        None => "convergence: not applicable, a single pass".into(),
        Some(0) => "every step converged".into(),
        Some(n) => format!("<em>{n} steps not converged</em>"),
    };
    let gap = s.max_gap_m.map_or_else(not_applicable, |gap| with_prefix(gap, "m", 3));
    cards.push(Card::new("Largest gap", gap, not));
    let more = format!("|T* − T1| up to {}", text(with_prefix(s.max_estimate_gap_n, "N", 3)));
    let gap = s.max_action_reaction_gap_n.map_or_else(not_applicable, |gap| with_prefix(gap, "N", 3));
    cards.push(Card::new("Action–reaction gap", gap, more));
    let error = s.interface_work_error_j.map_or_else(unknown, |e| with_prefix(e, "J", 3));
    cards.push(Card::new("Interface work error", error, "by the wrenches of both sides"));
    if let Some(e) = s.soil_mass_error_relative {
        cards.push(Card::new("Soil mass error", pure(e, 2), "relative to the soil moved"));
    }
    let more = format!("{} s wall, {} s CPU, {} steps", number(s.wall_s, 3), number(s.cpu_s, 3), s.steps);
    cards.push(Card::new("Real-time factor", pure(s.real_time_factor, 3), more));
    cards
}

/// Fewer figures, for a run that has no summary.
fn from_recording(r: &Recording) -> Vec<Card> {
    let mut cards = vec![Card::new("Simulated", (number(r.end_s(), 4), "s".into()), "up to the last record")];
    if let Some((_, poses)) = r.reported_body()
        && let (Some(a), Some(b)) = (poses.position.first(), poses.position.last())
    {
        let d = (b[0] - a[0]).hypot(b[1] - a[1]);
        cards.push(Card::new("Displacement", (number(d, 4), "m".into()), "of the reported body, horizontal"));
    }
    let largest = |f: fn(&crate::recording::WindowRecord) -> f64| {
        r.gluing.iter().map(|g| f(&g.since_last)).fold(0.0, f64::max)
    };
    let evaluations = largest(|w| f64::from(w.evaluations_bodies_max));
    cards.push(Card::new("Evaluations a step", pure(evaluations, 3), "bodies, at most"));
    if r.gluing.iter().any(|g| g.since_last.max_gap_m.is_some()) {
        let gap = with_prefix(largest(|w| w.max_gap_m.unwrap_or(0.0)), "m", 3);
        cards.push(Card::new("Largest gap", gap, "over closed ports"));
        let force = with_prefix(largest(|w| w.max_action_reaction_gap_n), "N", 3);
        cards.push(Card::new("Action–reaction gap", force, "largest"));
    }
    cards
}
