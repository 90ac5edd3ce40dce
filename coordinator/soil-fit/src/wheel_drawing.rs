//! A wheel's sinkage and drawbar pull over its slip, measured and fitted, as a drawing in SVG.

use super::drawing::{grid_lines, open_svg};
use super::wheel::WheelFit;
use std::fmt::Write as _;
use terraglue_soil_identification::WheelPoint;

const WIDTH: f64 = 720.0;
const HEIGHT: f64 = 560.0;
const LEFT: f64 = 64.0;
const RIGHT: f64 = 24.0;
const TOP: f64 = 40.0;
const GAP: f64 = 28.0;
const BOTTOM: f64 = 48.0;
/// Places of a curve.
const PLACES: i32 = 60;

/// One quantity over the slip.
struct Panel<'a> {
    top: f64,
    label: &'a str,
    colour: &'a str,
    /// Smallest and largest value shown.
    span: [f64; 2],
}

impl Panel<'_> {
    fn height() -> f64 {
        0.5 * (HEIGHT - TOP - BOTTOM - GAP)
    }

    fn place(&self, slip: f64, value: f64) -> [f64; 2] {
        let [low, high] = self.span;
        let share = ((value - low) / (high - low)).clamp(0.0, 1.0);
        [LEFT + (WIDTH - LEFT - RIGHT) * slip.max(0.0), self.top + Self::height() * (1.0 - share)]
    }

    fn draw(&self, text: &mut String, curve: &[(f64, f64)], seen: &[(f64, f64)], unseen: &[(f64, f64)]) {
        let (right, bottom) = (WIDTH - RIGHT, self.top + Self::height());
        for value in grid_lines(self.span) {
            let [_, y] = self.place(0.0, value);
            let _ = writeln!(
                text,
                r##"<path d="M{LEFT} {y:.1}H{right}" stroke="#dddddd"/><text x="{:.0}" y="{:.1}" text-anchor="end">{value}</text>"##,
                LEFT - 6.0,
                y + 4.0
            );
        }
        let _ = writeln!(
            text,
            r#"<text x="16" y="{0:.0}" text-anchor="middle" transform="rotate(-90 16 {0:.0})">{1}</text>"#,
            0.5 * (self.top + bottom),
            self.label
        );
        let points: String = curve
            .iter()
            .map(|(slip, value)| {
                let [x, y] = self.place(*slip, *value);
                format!("{x:.1},{y:.1} ")
            })
            .collect();
        let colour = self.colour;
        let _ =
            writeln!(text, r#"<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="2"/>"#);
        for (points, fill) in [(seen, colour), (unseen, "none")] {
            for (slip, value) in points {
                let [x, y] = self.place(*slip, *value);
                let _ = writeln!(
                    text,
                    r#"<circle cx="{x:.1}" cy="{y:.1}" r="4" fill="{fill}" stroke="{colour}" stroke-width="1.5"/>"#
                );
            }
        }
    }
}

/// The fit over what was measured: dots that it has seen, circles that it has not. The curves carry the mean load.
pub fn wheel_svg(fit: &WheelFit, seen: &[WheelPoint], unseen: &[WheelPoint]) -> String {
    let load = seen.iter().map(|p| p.load).sum::<f64>() / seen.len().max(1) as f64;
    let curve: Vec<(f64, _)> = (0..=PLACES)
        .map(|k| 0.95 * f64::from(k) / f64::from(PLACES))
        .map(|slip| (slip, fit.fit.state(slip, load)))
        .collect();
    let mut text = open_svg([WIDTH, HEIGHT]);
    let _ = writeln!(
        text,
        r#"<text x="{LEFT}" y="18">wheel of {} mm radius, {} mm width under {load:.1} N; dots: fitted, circles: not seen</text>"#,
        1e3 * fit.fit.wheel.radius,
        1e3 * fit.fit.wheel.width
    );
    for slip in [0.0, 0.2, 0.4, 0.6, 0.8, 1.0] {
        let x = LEFT + (WIDTH - LEFT - RIGHT) * slip;
        let bottom = HEIGHT - BOTTOM;
        let _ = writeln!(
            text,
            r##"<path d="M{x:.1} {TOP}V{bottom}" stroke="#dddddd"/><text x="{x:.1}" y="{:.0}" text-anchor="middle">{slip}</text>"##,
            bottom + 16.0
        );
    }
    let _ = writeln!(
        text,
        r#"<text x="{:.0}" y="{:.0}" text-anchor="middle">slip</text>"#,
        0.5 * (LEFT + WIDTH - RIGHT),
        HEIGHT - 12.0
    );
    let sinkage = |p: &WheelPoint| (p.slip, 1e3 * p.sinkage);
    let pull = |p: &WheelPoint| (p.slip, p.pull);
    let of = |points: &[WheelPoint], pick: &dyn Fn(&WheelPoint) -> (f64, f64)| -> Vec<(f64, f64)> {
        points.iter().map(pick).collect()
    };
    let sinkages: Vec<(f64, f64)> = curve.iter().map(|(slip, s)| (*slip, 1e3 * s.sinkage)).collect();
    let pulls: Vec<(f64, f64)> = curve.iter().map(|(slip, s)| (*slip, s.pull)).collect();
    let (one, two) = ([of(seen, &sinkage), of(unseen, &sinkage)], [of(seen, &pull), of(unseen, &pull)]);
    let [below, above] = span(&two, &pulls);
    let first = Panel {
        top: TOP,
        label: "sinkage, mm",
        colour: "#1f77b4",
        span: [0.0, 1.05 * span(&one, &sinkages)[1]],
    };
    let margin = 0.08 * (above - below).max(0.1);
    let second = Panel {
        top: TOP + Panel::height() + GAP,
        label: "drawbar pull, N",
        colour: "#d95f02",
        span: [below - margin, above + margin],
    };
    first.draw(&mut text, &sinkages, &one[0], &one[1]);
    second.draw(&mut text, &pulls, &two[0], &two[1]);
    text + "</svg>"
}

fn span(points: &[Vec<(f64, f64)>; 2], curve: &[(f64, f64)]) -> [f64; 2] {
    let all = points.iter().flatten().chain(curve).map(|(_, value)| *value);
    all.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], v| [a.min(v), b.max(v)])
}
