//! The fitted curve over the data, as a drawing in SVG.

use super::PlateTests;
use std::fmt::Write as _;
use terraglue_soil_identification::Reading;

const WIDTH: f64 = 720.0;
const HEIGHT: f64 = 460.0;
const LEFT: f64 = 64.0;
const RIGHT: f64 = 190.0;
const TOP: f64 = 28.0;
const BOTTOM: f64 = 48.0;
const COLOURS: [&str; 6] = ["#1f77b4", "#d95f02", "#2a9d4a", "#9b3fb5", "#8c564b", "#444444"];

/// A law to be drawn.
pub struct Curve<'a> {
    /// Its name.
    pub law: &'a str,
    /// Root of the mean square of ln(p/p_measured).
    pub rms: f64,
    /// Pressure (Pa) under a contact of that size (m) at that depth (m).
    pub pressure: Box<dyn Fn(f64, f64) -> f64 + 'a>,
}

/// Pressure over sinkage: the readings as dots, the law as a line for every size. `seen` are those that the law was
/// fitted to, `unseen` those that it predicts.
pub fn svg(fit: &Curve, seen: &PlateTests, unseen: Option<&PlateTests>) -> String {
    let all: Vec<(&Reading, bool)> = seen
        .readings
        .iter()
        .map(|r| (r, true))
        .chain(unseen.into_iter().flat_map(|t| &t.readings).map(|r| (r, false)))
        .collect();
    let axes = Axes::around(&all);
    let mut text = axes.frame();
    for (k, size) in sizes(&all).into_iter().enumerate() {
        let of_size = || all.iter().filter(move |(r, _)| same(r.b, size));
        let colour = COLOURS[k % COLOURS.len()];
        for (r, fitted) in of_size() {
            let (x, y) = axes.place(r.depth, r.pressure);
            let fill = if *fitted { colour } else { "none" };
            let _ = writeln!(
                text,
                r#"<circle cx="{x:.1}" cy="{y:.1}" r="2" fill="{fill}" stroke="{colour}" stroke-width="0.7" opacity="0.6"/>"#
            );
        }
        let deepest = of_size().fold(0.0_f64, |m, (r, _)| m.max(r.depth));
        let points: String = (1..=100)
            .map(|k| {
                let z = deepest * f64::from(k) / 100.0;
                let (x, y) = axes.place(z, (fit.pressure)(size, z));
                format!("{x:.1},{y:.1} ")
            })
            .collect();
        let _ =
            writeln!(text, r#"<polyline points="{points}" fill="none" stroke="{colour}" stroke-width="2"/>"#);
        let unseen = if of_size().any(|(_, fitted)| *fitted) { "" } else { ", not fitted" };
        let y = TOP + 18.0 * (k as f64 + 1.0);
        let _ = writeln!(
            text,
            r#"<text x="{:.0}" y="{y:.0}" fill="{colour}">b = {:.1} mm{unseen}</text>"#,
            WIDTH - RIGHT + 12.0,
            1e3 * size
        );
    }
    let _ =
        writeln!(text, r#"<text x="{LEFT}" y="18">{}, rms {:.1} %</text></svg>"#, fit.law, 100.0 * fit.rms);
    text
}

fn same(a: f64, b: f64) -> bool {
    (a / b - 1.0).abs() < 1e-6
}

fn sizes(all: &[(&Reading, bool)]) -> Vec<f64> {
    let mut sizes: Vec<f64> = all.iter().map(|(r, _)| r.b).collect();
    sizes.sort_by(f64::total_cmp);
    sizes.dedup_by(|a, b| same(*a, *b));
    sizes
}

/// Linear axes from 0: sinkage in mm, pressure in kPa.
struct Axes {
    depth: f64,
    pressure: f64,
}

impl Axes {
    fn around(all: &[(&Reading, bool)]) -> Self {
        let largest = |pick: fn(&Reading) -> f64| all.iter().fold(1e-9_f64, |m, (r, _)| m.max(pick(r)));
        Self { depth: 1.05 * largest(|r| r.depth), pressure: 1.05 * largest(|r| r.pressure) }
    }

    fn place(&self, depth: f64, pressure: f64) -> (f64, f64) {
        let (w, h) = (WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM);
        (LEFT + w * depth / self.depth, TOP + h * (1.0 - (pressure / self.pressure).min(1.0)))
    }

    fn frame(&self) -> String {
        let mut text = open_svg([WIDTH, HEIGHT]);
        let (right, bottom) = (WIDTH - RIGHT, HEIGHT - BOTTOM);
        for value in grid_lines([0.0, 1e3 * self.depth]) {
            let (x, _) = self.place(1e-3 * value, 0.0);
            let _ = writeln!(text, r##"<path d="M{x:.1} {TOP}V{bottom}" stroke="#dddddd"/>"##);
            let _ = writeln!(
                text,
                r#"<text x="{x:.1}" y="{:.0}" text-anchor="middle">{value}</text>"#,
                bottom + 16.0
            );
        }
        for value in grid_lines([0.0, 1e-3 * self.pressure]) {
            let (_, y) = self.place(0.0, 1e3 * value);
            let _ = writeln!(text, r##"<path d="M{LEFT} {y:.1}H{right}" stroke="#dddddd"/>"##);
            let _ = writeln!(
                text,
                r#"<text x="{:.0}" y="{:.1}" text-anchor="end">{value}</text>"#,
                LEFT - 6.0,
                y + 4.0
            );
        }
        let (middle, low) = (0.5 * (LEFT + right), HEIGHT - 12.0);
        let _ =
            writeln!(text, r#"<text x="{middle:.0}" y="{low:.0}" text-anchor="middle">sinkage, mm</text>"#);
        let _ = writeln!(
            text,
            r#"<text x="16" y="{0:.0}" text-anchor="middle" transform="rotate(-90 16 {0:.0})">pressure, kPa</text>"#,
            0.5 * (TOP + bottom)
        );
        text
    }
}

/// The head of a drawing of that size, on white.
pub(super) fn open_svg([width, height]: [f64; 2]) -> String {
    format!(
        r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" font-size="12"><rect width="100%" height="100%" fill="#ffffff"/>
"##
    )
}

/// Round values between the ends, about six.
pub(super) fn grid_lines([from, to]: [f64; 2]) -> Vec<f64> {
    let rough = (to - from) / 6.0;
    let power = 10f64.powf(rough.log10().floor());
    let step =
        [1.0, 2.0, 5.0, 10.0].map(|f| f * power).into_iter().find(|s| *s >= rough).unwrap_or(10.0 * power);
    let round = |x: f64| format!("{x:.6e}").parse().unwrap_or(x);
    ((from / step).ceil() as i32..=(to / step).floor() as i32).map(|k| round(f64::from(k) * step)).collect()
}
