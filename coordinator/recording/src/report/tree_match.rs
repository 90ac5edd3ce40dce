//! Where a machine was among trees: its local map on the global one from above, and the error of its pose beside the bound that it claimed.

use crate::reader::{Recording, TreeMatch};
use crate::report::figure::{Curve, Figure, Panel};
use crate::report::html::{escape, number};
use std::collections::BTreeMap;
use std::fmt::Write;

/// Matches whose local trees, lines and ellipses are drawn, at even distances of time.
const DRAWN: usize = 12;
/// By how much the ellipses of one deviation are drawn larger.
const ENLARGED: f64 = 20.0;
/// Points of a path at most.
const MOST_POINTS: usize = 1500;

/// Name of the stream's subsystem and its messages, the first one that there is.
fn told(recording: &Recording) -> Option<(&str, &[TreeMatch])> {
    let (stream, all) = recording.tree_matches.iter().find(|(_, all)| !all.is_empty())?;
    Some((stream.rsplit_once('.').map_or(stream.as_str(), |(name, _)| name), all))
}

/// The section with the map; none: no match was recorded.
pub(crate) fn section(recording: &Recording) -> Option<String> {
    let (name, all) = told(recording)?;
    let step = all.len().div_ceil(DRAWN).max(1);
    let drawn: Vec<&TreeMatch> = all.iter().rev().step_by(step).collect();
    let mut map = Map::default();
    map.global(all);
    for told in &drawn {
        map.local(told);
    }
    let truth = recording.reported_body();
    let true_path: Vec<[f64; 2]> =
        truth.map_or_else(Vec::new, |(_, poses)| poses.position.iter().map(|p| [p[0], p[1]]).collect());
    let estimated = estimated(recording, name);
    map.path(&true_path, "var(--c0, #2a6fdb)", "");
    map.path(&estimated, "var(--c1, #d9480f)", " stroke-dasharray=\"1.2 0.6\"");
    let note = format!(
        "<p class=\"note\">Global trees ○ of the map, local trees + of <code>{}</code> at {} times with lines to those that they were matched \
         with; solid: the true way of <code>{}</code>; dashed: the way that was believed. Ellipses: one deviation, {} times as large. Grid: 10 m.</p>",
        escape(name),
        drawn.len(),
        escape(&truth.map_or_else(String::new, |(body, _)| body.replace('/', "."))),
        number(ENLARGED, 2),
    );
    Some(note + &map.svg())
}

/// The path that was believed, where there was one.
fn estimated(recording: &Recording, name: &str) -> Vec<[f64; 2]> {
    let series = |part: &str| recording.series(&format!("{name}.{part}")).map(|(_, y)| y);
    let (Some(x), Some(y), Some(known)) = (series("x"), series("y"), series("is_known")) else {
        return Vec::new();
    };
    let all = x.iter().zip(y).zip(known);
    all.filter(|(_, known)| **known > 0.5).map(|((x, y), _)| [*x, *y]).collect()
}

/// A drawing in metres, y up.
#[derive(Default)]
struct Map {
    parts: String,
    low: Option<[f64; 2]>,
    high: [f64; 2],
}

impl Map {
    fn reach(&mut self, [x, y]: [f64; 2]) {
        let low = self.low.get_or_insert([x, y]);
        *low = [low[0].min(x), low[1].min(y)];
        if self.parts.is_empty() {
            self.high = [x, y];
        }
        self.high = [self.high[0].max(x), self.high[1].max(y)];
    }

    /// All trees of the map that any message showed, once each.
    fn global(&mut self, all: &[TreeMatch]) {
        let key = |p: &[f64; 2]| p.map(|v| (100.0 * v).round() as i64);
        let places: BTreeMap<[i64; 2], [f64; 2]> =
            all.iter().flat_map(|m| &m.global).map(|p| (key(p), *p)).collect();
        for [x, y] in places.values() {
            self.reach([*x, *y]);
            let _ = write!(self.parts, "<circle cx=\"{x:.2}\" cy=\"{:.2}\" r=\"0.45\"/>", -y);
        }
        self.parts = format!("<g fill=\"none\" stroke=\"#2f9e44\" stroke-width=\"0.15\">{}</g>", self.parts);
    }

    fn local(&mut self, told: &TreeMatch) {
        let mut lines = String::new();
        for ([ax, ay], [bx, by]) in told.match_from.iter().zip(&told.match_to) {
            let _ = write!(lines, "M{ax:.2} {:.2}L{bx:.2} {:.2}", -ay, -by);
        }
        let _ = write!(self.parts, "<path d=\"{lines}\" stroke=\"#e03131\" stroke-width=\"0.2\"/>");
        let mut crosses = String::new();
        for [x, y] in &told.local {
            self.reach([*x, *y]);
            let _ = write!(crosses, "M{:.2} {:.2}h0.7m-0.35 -0.35v0.7", x - 0.35, -y);
        }
        let _ = write!(self.parts, "<path d=\"{crosses}\" stroke=\"#f08c00\" stroke-width=\"0.15\"/>");
        if let Some([x, y, _]) = told.pose {
            let [long, short, angle] = told.ellipse;
            let _ = write!(
                self.parts,
                "<ellipse cx=\"{x:.2}\" cy=\"{:.2}\" rx=\"{:.3}\" ry=\"{:.3}\" transform=\"rotate({:.2} {x:.2} {:.2})\" \
                 fill=\"#4263eb33\" stroke=\"#4263eb\" stroke-width=\"0.12\"/>",
                -y,
                (ENLARGED * long).max(0.05),
                (ENLARGED * short).max(0.05),
                -angle.to_degrees(),
                -y,
            );
        }
    }

    fn path(&mut self, points: &[[f64; 2]], colour: &str, dashes: &str) {
        let step = points.len().div_ceil(MOST_POINTS).max(1);
        let mut line = String::new();
        for [x, y] in points.iter().step_by(step).filter(|p| p.iter().all(|v| v.is_finite())) {
            self.reach([*x, *y]);
            let _ = write!(line, "{}{x:.2} {:.2}", if line.is_empty() { 'M' } else { 'L' }, -y);
        }
        if !line.is_empty() {
            let _ = write!(
                self.parts,
                "<path d=\"{line}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"0.4\"{dashes}/>"
            );
        }
    }

    fn svg(&self) -> String {
        let low = self.low.unwrap_or_default().map(|v| v - 2.0);
        let size = [0, 1].map(|k| self.high[k] + 2.0 - low[k]);
        let mut grid = String::new();
        let tens = |from: f64, length: f64| {
            ((from / 10.0).ceil() as i64..)
                .map(|k| 10.0 * k as f64)
                .take_while(move |v| *v <= from + length)
                .take(1000)
        };
        for x in tens(low[0], size[0]) {
            let _ = write!(grid, "M{x} {:.2}v{:.2}", -(low[1] + size[1]), size[1]);
        }
        for y in tens(low[1], size[1]) {
            let _ = write!(grid, "M{:.2} {}h{:.2}", low[0], -y, size[0]);
        }
        format!(
            "<svg class=\"trees\" role=\"img\" aria-label=\"map of trees\" viewBox=\"{:.2} {:.2} {:.2} {:.2}\" style=\"width:100%;height:auto;max-height:90vh\">\
             <path d=\"{grid}\" stroke=\"currentColor\" stroke-opacity=\"0.12\" stroke-width=\"0.1\"/>{}</svg>",
            low[0],
            -(low[1] + size[1]),
            size[0],
            size[1],
            self.parts
        )
    }
}

/// Error and bound over time, and the quality of the match; none: no match was recorded.
pub(crate) fn figure(recording: &Recording) -> Option<Figure> {
    let (name, _) = told(recording)?;
    let curve = |part: &str, label: &str, colour: usize, dashed: bool| {
        let (t, y) = recording.series(&format!("{name}.{part}"))?;
        Some(Curve { dashed, ..Curve::new(label, colour, t, y.to_vec()) })
    };
    let panel = |quantity: &str, unit: &str, parts: &[(&str, &str, usize, bool)]| {
        let curves: Vec<Curve> = parts.iter().filter_map(|(p, l, c, d)| curve(p, l, *c, *d)).collect();
        (!curves.is_empty()).then(|| Panel::new(quantity, unit, curves))
    };
    let panels = [
        panel("distance", "m", &[("error", "error", 1, false), ("bound", "bound", 0, true)])
            .map(|p| p.log(false)),
        panel("score", "", &[("score", "best", 0, false), ("runner_up", "next", 1, true)]),
        panel(
            "trees",
            "",
            &[
                ("trees", "local map", 0, false),
                ("matched", "matched", 2, false),
                ("stems", "stems of the last scans", 3, false),
                ("own_stems", "on the machine itself", 1, false),
            ],
        ),
        panel("answer", "", &[("status", "0 located, 1 ambiguous, 2 lost", 0, false)]),
    ];
    let note = format!(
        "{name}: distance of the pose that is believed from the true one, and the bound that it claims with 99.7 %; both are 0 where nothing \
         is believed."
    );
    let panels = panels.into_iter().flatten().collect();
    Some(Figure { id: "trees", title: "Error among trees".into(), note, panels, ..Figure::default() })
}
