//! Curves over time as the page's script wants them: thinned, packed, times shared.

use base64::Engine;
use serde_json::{Value, json};

/// Most points of a curve in a page.
pub(crate) const MOST_POINTS: usize = 4000;

/// A group of panels under one heading.
#[derive(Clone, Debug, Default)]
pub struct Figure {
    /// Name of its section in the page.
    pub id: &'static str,
    /// Heading.
    pub title: String,
    /// One line below the heading.
    pub note: String,
    /// Names to choose from; a panel with `choice = Some(k)` is shown for name k only.
    pub choices: Vec<String>,
    /// Chosen at first.
    pub chosen: usize,
    /// Axes from top to bottom.
    pub panels: Vec<Panel>,
}

/// One pair of axes.
#[derive(Clone, Debug, Default)]
pub struct Panel {
    /// Name of the quantity, e.g. `normal force`.
    pub quantity: String,
    /// SI unit; empty for a pure number.
    pub unit: String,
    /// Logarithmic axis offered, and whether it is on at first.
    pub log: Option<bool>,
    /// The choice for which it is shown; none: always.
    pub choice: Option<usize>,
    /// Quantity and unit of the horizontal axis in place of the time. The times of the curves are its values then.
    pub across: Option<(String, String)>,
    /// Its curves.
    pub curves: Vec<Curve>,
}

/// One curve.
#[derive(Clone, Debug, Default)]
pub struct Curve {
    /// Name in the legend.
    pub name: String,
    /// Simulated times, s.
    pub t_s: Vec<f64>,
    /// Values at these times, in the unit of its axes.
    pub y: Vec<f64>,
    /// Number in the page's palette.
    pub colour: usize,
    /// Whether its line is dashed.
    pub dashed: bool,
    /// Holds its value until the next point.
    pub steps: bool,
}

impl Curve {
    /// A solid curve.
    pub fn new(name: impl Into<String>, colour: usize, t_s: &[f64], y: Vec<f64>) -> Self {
        Self { name: name.into(), t_s: t_s.to_vec(), y, colour, dashed: false, steps: false }
    }
}

impl Panel {
    /// Axes for a quantity in a unit.
    pub fn new(quantity: &str, unit: &str, curves: Vec<Curve>) -> Self {
        Self { quantity: quantity.into(), unit: unit.into(), curves, ..Self::default() }
    }

    /// The same with a logarithmic axis on offer.
    pub fn log(mut self, on: bool) -> Self {
        self.log = Some(on);
        self
    }
}

/// Smallest and largest value of each of `points`/2 equal pieces, in order of time: no peak is lost.
pub(crate) fn thinned(t: &[f64], y: &[f64], points: usize) -> (Vec<f64>, Vec<f64>) {
    let n = t.len().min(y.len());
    if n <= points {
        return (t[..n].to_vec(), y[..n].to_vec());
    }
    let pieces = (points / 2).max(1);
    let (mut ts, mut ys) = (Vec::with_capacity(points), Vec::with_capacity(points));
    for piece in 0..pieces {
        let (from, to) = (piece * n / pieces, (piece + 1) * n / pieces);
        let by_value = |a: &usize, b: &usize| y[*a].total_cmp(&y[*b]);
        let numbers = || (from..to).filter(|k| y[*k].is_finite());
        let (Some(low), Some(high)) = (numbers().min_by(by_value), numbers().max_by(by_value)) else {
            continue;
        };
        for k in [low.min(high), low.max(high)] {
            ts.push(t[k]);
            ys.push(y[k]);
        }
    }
    (ts, ys)
}

/// Numbers as base64 of little-endian f32.
pub(crate) fn packed(values: &[f64]) -> String {
    let bytes: Vec<u8> = values.iter().flat_map(|v| (*v as f32).to_le_bytes()).collect();
    base64::engine::general_purpose::STANDARD.encode(bytes)
}

/// Time axes of a page; equal ones are stored once.
#[derive(Default)]
pub(crate) struct Times {
    seen: Vec<Vec<f64>>,
}

impl Times {
    fn index(&mut self, t: Vec<f64>) -> usize {
        match self.seen.iter().position(|s| *s == t) {
            Some(k) => k,
            None => {
                self.seen.push(t);
                self.seen.len() - 1
            }
        }
    }

    /// All of them, packed.
    pub fn json(&self) -> Value {
        self.seen.iter().map(|t| packed(t)).collect()
    }
}

impl Figure {
    /// As data of the page.
    pub(crate) fn json(&self, times: &mut Times) -> Value {
        // Curves that are shown on demand only may be coarser.
        let points = if self.choices.len() > 1 { MOST_POINTS / 2 } else { MOST_POINTS };
        let mut curve = |c: &Curve, over_time: bool| {
            let mut out = json!({ "name": c.name, "colour": c.colour, "dashed": c.dashed, "steps": c.steps });
            if over_time {
                let (t, y) = thinned(&c.t_s, &c.y, points);
                (out["t"], out["y"]) = (json!(times.index(t)), json!(packed(&y)));
            } else {
                (out["x"], out["y"]) = (json!(packed(&c.t_s)), json!(packed(&c.y)));
            }
            out
        };
        let mut panels = Vec::new();
        for p in &self.panels {
            let curves: Vec<Value> = p.curves.iter().map(|c| curve(c, p.across.is_none())).collect();
            let across =
                p.across.as_ref().map(|(quantity, unit)| json!({ "quantity": quantity, "unit": unit }));
            panels.push(json!({
                "quantity": p.quantity, "unit": p.unit, "log": p.log, "choice": p.choice, "x": across, "curves": curves,
            }));
        }
        json!({ "id": self.id, "choices": self.choices, "chosen": self.chosen, "panels": panels })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_every_peak_and_the_order() {
        let t: Vec<f64> = (0..100_000).map(|k| k as f64 * 1e-3).collect();
        let mut y: Vec<f64> = t.iter().map(|t| t.sin()).collect();
        (y[12_345], y[77_777], y[5]) = (9.0, -9.0, f64::NAN);
        let (tt, yy) = thinned(&t, &y, MOST_POINTS);
        assert!(tt.len() <= MOST_POINTS && tt.is_sorted());
        assert!(yy.contains(&9.0) && yy.contains(&-9.0) && yy.iter().all(|v| v.is_finite()));
    }

    #[test]
    fn equal_times_are_stored_once() {
        let c = |name: &str| Curve::new(name, 0, &[0.0, 1.0], vec![1.0, 2.0]);
        let panels = vec![Panel::new("a", "m", vec![c("x"), c("y")])];
        let mut times = Times::default();
        let value = Figure { panels, ..Figure::default() }.json(&mut times);
        assert_eq!(times.json().as_array().map(Vec::len), Some(1));
        assert_eq!(value["panels"][0]["curves"][1]["y"], "AACAPwAAAEA=");
    }
}
