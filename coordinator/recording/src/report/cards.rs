//! The figures of a run at one glance.

use crate::reader::Recording;
use crate::report::html::{escape, number, with_prefix, without_rounding};
use crate::summary::Summary;
use std::fmt::Write;

/// A smaller drift, relative to the energies, is not given in digits.
const SMALLEST_SHARE: f64 = 1e-5;

/// One figure.
struct Card {
    label: &'static str,
    value: String,
    unit: String,
    /// Smaller line below.
    more: String,
    /// Whether it is red.
    off: bool,
}

impl Card {
    fn new(label: &'static str, value: (String, String), more: impl Into<String>) -> Self {
        Self { label, value: value.0, unit: value.1, more: more.into(), off: false }
    }
}

/// The cards as HTML: first what a run is judged by, then the rest.
pub(crate) fn render(recording: &Recording, summary: Option<&Summary>) -> String {
    match summary {
        Some(s) => list("cards first", first(s)) + &list("cards", rest(s)),
        None => list("cards", from_recording(recording)),
    }
}

fn list(class: &str, cards: impl IntoIterator<Item = Card>) -> String {
    let mut out = format!(r#"<dl class="{class}">"#);
    for c in cards {
        let _ = write!(
            out,
            r#"<div class="card{}"><dt>{}</dt><dd><b{}>{}</b>&#8239;<span class="unit">{}</span></dd><dd class="more">{}</dd></div>"#,
            if c.off { " off" } else { "" },
            c.label,
            // words are longer than numbers
            if c.value.contains(|ch: char| ch.is_ascii_digit()) { "" } else { " class=\"word\"" },
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
    (number(without_rounding(rad).to_degrees(), 3), "°".into())
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

/// The main figures of a run, in order of importance.
fn first(s: &Summary) -> impl Iterator<Item = Card> {
    let real_time = format!(
        "{} s wall, {} s CPU, {} steps",
        number(s.times.wall_s, 3),
        number(s.times.cpu_s, 3),
        s.steps
    );
    [
        distance(s),
        energy_per_metre(s),
        Some(balance(s)),
        print_depth(s),
        s.motion.peak_force_over_weight.map(|f| {
            Card::new(
                "Peak force",
                (number(f, 3), "× weight".into()),
                "of the ground on all feet or wheels together",
            )
        }),
        Some(Card::new("Real-time factor", pure(s.times.real_time_factor, 3), real_time)),
    ]
    .into_iter()
    .flatten()
}

fn distance(s: &Summary) -> Option<Card> {
    let d = without_rounding(s.motion.distance_m?);
    let more = match s.motion.commanded_distance_m {
        Some(c) if c > 0.0 => format!("{} % of the {} m asked for", number(100.0 * d / c, 3), number(c, 4)),
        _ => "along the initial heading".into(),
    };
    Some(Card::new("Distance", (number(d, 4), "m".into()), more))
}

/// Electrical where a drive with losses reports it, else the work of the motors.
fn energy_per_metre(s: &Summary) -> Option<Card> {
    let cost =
        |c: Option<f64>| c.map_or_else(String::new, |c| format!("; cost of transport {}", number(c, 3)));
    let mechanical = s.energy.energy_j_per_m.filter(|e| *e > 0.0)?;
    let (label, electrical) = ("Energy per metre", s.energy.electrical_energy_j_per_m.filter(|e| *e > 0.0));
    let Some(electrical) = electrical else {
        let more = format!("work of the motors, driving and braking{}", cost(s.energy.cost_of_transport));
        return Some(Card::new(label, per_metre(mechanical), more));
    };
    let work = match s.energy.cost_of_transport {
        Some(c) => format!(" ({} by the work of the motors alone)", number(c, 3)),
        None => String::new(),
    };
    let more = format!("electrical{}{work}", cost(s.energy.electrical_cost_of_transport));
    Some(Card::new(label, per_metre(electrical), more))
}

fn per_metre(energy_j_per_m: f64) -> (String, String) {
    let (value, unit) = with_prefix(energy_j_per_m, "J", 3);
    (value, format!("{unit}/m"))
}

fn balance(s: &Summary) -> Card {
    let e = &s.energy.energies;
    let drift = |drift_j: f64| text(with_prefix(drift_j, "J", 2));
    let (value, more) = match (e.drift_share(), e.drift_j) {
        (Some(share), _) if share.abs() < SMALLEST_SHARE => {
            (("< 0.001".into(), "%".into()), e.measure().into())
        }
        (Some(share), Some(drift_j)) => {
            let more = format!("{}: a drift of {}", e.measure(), drift(drift_j));
            ((number(100.0 * share, 2), "%".into()), more)
        }
        (_, Some(drift_j)) => (with_prefix(drift_j, "J", 2), "drift; nothing was turned over".into()),
        (_, None) => (unknown(), escape(&e.why_unknown())),
    };
    Card { off: e.is_off(), ..Card::new("Energy balance", value, more) }
}

fn print_depth(s: &Summary) -> Option<Card> {
    let p = s.print_depth?;
    let [low, high] = [p.p10_m, p.p90_m].map(|z| text(with_prefix(z, "m", 2)));
    let more = format!("median of {}, below the initial surface; 10 % to 90 %: {low} to {high}", p.count);
    Some(Card::new("Depth of the prints", with_prefix(p.median_m, "m", 2), more))
}

fn rest(s: &Summary) -> Vec<Card> {
    let mut cards = Vec::new();
    if let (Some(roll), Some(pitch)) = (s.motion.max_roll_rad, s.motion.max_pitch_rad) {
        let tilt = roll.max(pitch);
        let more = format!("roll {}, pitch {}", text(degrees(roll)), text(degrees(pitch)));
        cards.push(Card::new("Largest tilt", degrees(tilt), more));
    }
    if let Some(h) = s.motion.height_gained_m {
        cards.push(Card::new(
            "Height gained",
            with_prefix(without_rounding(h), "m", 3),
            "of the reported body, against gravity",
        ));
    }
    if s.energy.energy_j > 0.0 {
        let braking = text(with_prefix(s.energy.energies.braking_j, "J", 3));
        let more = format!("mechanical, driving; braking takes {braking} out");
        cards.push(Card::new("Work of the motors", with_prefix(s.energy.energies.driving_j, "J", 3), more));
    }
    if let Some(electrical_j) = s.energy.electrical_energy_j.filter(|e| *e > 0.0) {
        let more = "drawn by the motors, with the losses of their drives";
        cards.push(Card::new("Electrical energy", with_prefix(electrical_j, "J", 3), more));
    }
    let more = format!(
        "bodies, at most {}; soil {}",
        s.gluing.evaluations_max,
        number(s.gluing.evaluations_soil_mean, 3)
    );
    cards.push(Card::new("Evaluations a step", pure(s.gluing.evaluations_mean, 3), more));
    let not = match s.gluing.steps_not_converged {
        None => "convergence: not applicable, a single pass".into(),
        Some(0) => "every step converged".into(),
        Some(n) => format!("<em>{n} steps not converged</em>"),
    };
    let gap = s.gluing.max_gap_m.map_or_else(not_applicable, |gap| with_prefix(gap, "m", 3));
    cards.push(Card::new("Largest gap", gap, not));
    let more = format!("|T* − T1| up to {}", text(with_prefix(s.gluing.max_estimate_gap_n, "N", 3)));
    let gap = s.gluing.max_action_reaction_gap_n.map_or_else(not_applicable, |gap| with_prefix(gap, "N", 3));
    cards.push(Card::new("Action–reaction gap", gap, more));
    let error = s.gluing.interface_work_error_j.map_or_else(unknown, |e| with_prefix(e, "J", 3));
    cards.push(Card::new("Interface work error", error, "by the wrenches of both sides"));
    if let Some(e) = s.soil_mass_error_relative {
        cards.push(Card::new("Soil mass error", pure(e, 2), "relative to the soil moved"));
    }
    cards
}

/// Fewer figures, for a run that has no summary.
fn from_recording(r: &Recording) -> Vec<Card> {
    let mut cards = vec![Card::new("Simulated", (number(r.end_s(), 4), "s".into()), "up to the last record")];
    if let Some((_, poses)) = r.reported_body()
        && let (Some(a), Some(b)) = (poses.position.first(), poses.position.last())
    {
        let d = without_rounding((b[0] - a[0]).hypot(b[1] - a[1]));
        cards.push(Card::new("Displacement", (number(d, 4), "m".into()), "of the reported body, horizontal"));
    }
    let largest =
        |f: fn(&crate::WindowRecord) -> f64| r.gluing.iter().map(|g| f(&g.since_last)).fold(0.0, f64::max);
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
