//! A diagram of points on two logarithmic axes, as inline SVG: errors over steps, errors over work.

use std::fmt::Write;
use terraglue_recording::report::html::escape;

/// One line of points.
pub(crate) struct Series {
    pub name: String,
    /// Number in the palette.
    pub colour: usize,
    pub points: Vec<(f64, f64)>,
}

const PALETTE: [&str; 8] =
    ["#4477aa", "#ee6677", "#228833", "#ccbb44", "#66ccee", "#aa3377", "#999999", "#bb5500"];
const WIDTH: f64 = 640.0;
const HEIGHT: f64 = 360.0;
const LEFT: f64 = 64.0;
const RIGHT: f64 = 24.0;
const BOTTOM: f64 = 45.0;
const TOP: f64 = 12.0;

/// A logarithmic axis over whole decades.
struct Axis {
    low: f64,
    high: f64,
}

impl Axis {
    fn over(values: impl Iterator<Item = f64>) -> Option<Self> {
        let (low, high) =
            values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v.log10()), b.max(v.log10())));
        (low <= high).then(|| Self { low: low.floor(), high: high.ceil().max(low.floor() + 1.0) })
    }

    fn share(&self, value: f64) -> f64 {
        (value.log10() - self.low) / (self.high - self.low)
    }

    fn decades(&self) -> impl Iterator<Item = (f64, String)> {
        (self.low as i32..=self.high as i32).map(|k| (10f64.powi(k), power_of_ten(k)))
    }
}

/// `10⁻³`.
fn power_of_ten(k: i32) -> String {
    let raised = |c: char| match c.to_digit(10) {
        Some(d) => ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][d as usize],
        None => '⁻',
    };
    format!("10{}", k.to_string().chars().map(raised).collect::<String>())
}

/// Line, fill of the points and sign in the legend: beyond the palette lines are dashed and points hollow.
fn style(colour: usize) -> (&'static str, &'static str, &'static str, char) {
    let own = PALETTE[colour % PALETTE.len()];
    if (colour / PALETTE.len()).is_multiple_of(2) {
        (own, own, "none", '●')
    } else {
        (own, "none", "5 3", '○')
    }
}

/// The diagram; none where no series has a point with positive coordinates.
pub(crate) fn diagram(x_name: &str, y_name: &str, series: &[Series]) -> Option<String> {
    let good = |(x, y): &&(f64, f64)| *x > 0.0 && *y > 0.0 && x.is_finite() && y.is_finite();
    let points = || series.iter().flat_map(|s| &s.points).filter(good);
    let (x, y) = (Axis::over(points().map(|p| p.0))?, Axis::over(points().map(|p| p.1))?);
    let place = |p: &(f64, f64)| {
        let right = LEFT + (WIDTH - LEFT - RIGHT) * x.share(p.0);
        (right, TOP + (HEIGHT - BOTTOM - TOP) * (1.0 - y.share(p.1)))
    };
    let corner = (10f64.powf(x.low), 10f64.powf(y.low));
    let mut out = format!(
        "<svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" style=\"max-width:{WIDTH}px;width:100%\" font-size=\"12\" fill=\"currentColor\" role=\"img\">"
    );
    for (v, name) in x.decades() {
        let (px, py) = place(&(v, corner.1));
        let _ = write!(
            out,
            "<path d=\"M{px:.1} {TOP}V{py:.1}\" stroke=\"currentColor\" opacity=\"0.2\"/><text x=\"{px:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{name}</text>",
            py + 16.0
        );
    }
    for (v, name) in y.decades() {
        let (px, py) = place(&(corner.0, v));
        let _ = write!(
            out,
            "<path d=\"M{px:.1} {py:.1}H{}\" stroke=\"currentColor\" opacity=\"0.2\"/><text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{name}</text>",
            WIDTH - RIGHT,
            px - 6.0,
            py + 4.0
        );
    }
    for s in series {
        let places: Vec<(f64, f64)> = s.points.iter().filter(good).map(place).collect();
        draw(&mut out, s, &places);
    }
    let _ = write!(
        out,
        "<text x=\"{:.0}\" y=\"{:.0}\" text-anchor=\"middle\">{}</text><text x=\"14\" y=\"{:.0}\" text-anchor=\"middle\" transform=\"rotate(-90 14 {:.0})\">{}</text></svg>",
        0.5 * (LEFT + WIDTH),
        HEIGHT - 8.0,
        escape(x_name),
        0.5 * (HEIGHT - BOTTOM),
        0.5 * (HEIGHT - BOTTOM),
        escape(y_name)
    );
    out.push_str("<p class=\"hint\">");
    for s in series.iter().filter(|s| s.points.iter().any(|p| good(&p))) {
        let (colour, _, _, sign) = style(s.colour);
        let _ = write!(out, "<span style=\"color:{colour}\">{sign}</span> {} &nbsp; ", escape(&s.name));
    }
    out.push_str("</p>");
    Some(out)
}

/// Line and points of a series at these places.
fn draw(out: &mut String, s: &Series, places: &[(f64, f64)]) {
    let (colour, fill, dash, _) = style(s.colour);
    let line: Vec<String> = places.iter().map(|(a, b)| format!("{a:.1},{b:.1}")).collect();
    let _ = write!(
        out,
        "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.5\" stroke-dasharray=\"{dash}\"/>",
        line.join(" ")
    );
    for (a, b) in places {
        let _ = write!(
            out,
            "<circle cx=\"{a:.1}\" cy=\"{b:.1}\" r=\"4\" fill=\"{fill}\" stroke=\"{colour}\"><title>{}</title></circle>",
            escape(&s.name)
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_without_a_logarithm_make_no_diagram() {
        let series =
            |points: &[(f64, f64)]| [Series { name: "a<b".into(), colour: 0, points: points.to_vec() }];
        assert!(diagram("h", "error", &series(&[(0.0, 1.0), (1.0, f64::NAN)])).is_none());
        let some = diagram("h", "error", &series(&[(1e-3, 1e-6), (1e-2, 1e-4)])).expect("two points");
        assert!(some.contains("a&lt;b") && some.matches("<circle").count() == 2);
    }
}
