//! The picture of the page: path and heading of the four walks.

use super::legs::Legs;
use super::walk::Walk;
use crate::process::Outcome;
use plotters::prelude::*;
use std::path::Path;

const COLOURS: [RGBColor; 4] =
    [RGBColor(90, 90, 90), RGBColor(31, 119, 180), RGBColor(214, 39, 40), RGBColor(44, 160, 44)];

/// The quantities of one panel: names of the axes, and the curve of a walk.
struct FaultPanel {
    x: &'static str,
    y: &'static str,
    curve: fn(&Walk) -> Vec<(f64, f64)>,
}

const PANELS: [FaultPanel; 2] = [
    FaultPanel { x: "x of the body (m)", y: "y of the body (mm)", curve: path },
    FaultPanel { x: "time (s)", y: "heading (degrees)", curve: heading },
];

fn path(walk: &Walk) -> Vec<(f64, f64)> {
    walk.x.iter().zip(&walk.y).map(|(x, y)| (*x, 1e3 * y)).collect()
}

fn heading(walk: &Walk) -> Vec<(f64, f64)> {
    walk.t.iter().zip(&walk.yaw).map(|(t, yaw)| (*t, yaw.to_degrees())).collect()
}

/// Draws the picture into an SVG file.
pub fn draw(legs: &Legs, file: &Path) -> Outcome {
    let area = SVGBackend::new(file, (900, 700)).into_drawing_area();
    let failed = |e: &dyn std::fmt::Display| format!("{}: {e}", file.display());
    area.fill(&WHITE).map_err(|e| failed(&e))?;
    for (part, panel) in area.split_evenly((2, 1)).iter().zip(&PANELS) {
        let curves: Vec<_> = legs.walks.iter().map(|(name, walk)| (*name, (panel.curve)(walk))).collect();
        draw_panel(part, panel, &curves).map_err(|e| failed(&e))?;
    }
    area.present().map_err(|e| failed(&e))
}

fn draw_panel<B: DrawingBackend>(
    part: &DrawingArea<B, plotters::coord::Shift>,
    panel: &FaultPanel,
    curves: &[(&str, Vec<(f64, f64)>)],
) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
    let range = |of: fn(&(f64, f64)) -> f64| {
        let all = || curves.iter().flat_map(|(_, c)| c.iter().map(of));
        let (low, high) = (all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max));
        let margin = 0.04 * (high - low).max(1e-9);
        low - margin..high + margin
    };
    let mut chart = ChartBuilder::on(part)
        .margin(12)
        .x_label_area_size(40)
        .y_label_area_size(60)
        .build_cartesian_2d(range(|p| p.0), range(|p| p.1))?;
    chart.configure_mesh().x_desc(panel.x).y_desc(panel.y).light_line_style(WHITE).draw()?;
    for ((name, curve), colour) in curves.iter().zip(COLOURS) {
        chart
            .draw_series(LineSeries::new(curve.iter().copied(), colour.stroke_width(2)))?
            .label(*name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 20, y)], colour.stroke_width(2)));
    }
    chart.configure_series_labels().position(SeriesLabelPosition::UpperLeft).border_style(BLACK).draw()
}
