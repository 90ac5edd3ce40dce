//! A column of loose material collapses to a cone; a plane stays or flows.

use super::field::{Field, Function, MICROMETRE, PHI, UNLIMITED, largest_curvature};
use crate::process::Outcome;
use crate::{Context, Figure, Limit};
use terraglue_ground::Surface;
use terraglue_numerics::extremes::{larger, largest, smaller};

/// (radius in cells, spacing in m, whether it takes long).
const CASES: [(u32, f64, bool); 8] = [
    (16, 0.01, false),
    (32, 0.01, false),
    (64, 0.01, true),
    (128, 0.01, true),
    (16, 0.005, false),
    (32, 0.005, true),
    (16, 0.02, false),
    (32, 0.02, true),
];

/// Column of the volume of a cone of `radius` cells and slope tan φ, 2⌊R/4⌋ + 1 cells a side.
pub fn column(radius: u32, spacing: f64) -> impl Fn(i64, i64) -> f64 + Send + Sync {
    let half = i64::from(radius / 4);
    let cells = (2 * half + 1) as f64;
    let volume = std::f64::consts::FRAC_PI_3 * (f64::from(radius) * spacing).powi(3) * PHI.tan();
    let height = volume / (cells * spacing).powi(2);
    let middle = i64::from(middle(radius));
    move |i, j| if (i - middle).abs() <= half && (j - middle).abs() <= half { height } else { 0.0 }
}

fn middle(radius: u32) -> u32 {
    2 * radius
}

/// The column on level ground of the same soil.
pub fn released(radius: u32, spacing: f64, curvature: f64) -> Outcome<Field> {
    let size = [2 * middle(radius) + 1; 2];
    Field::new(&Function { size, spacing, height: column(radius, spacing) }, PHI, curvature)
}

/// Slope along a ray from the middle, degrees: bilinear heights every quarter of a cell, straight line between 0.2 and
/// 0.85 of the radius at which the height falls below 2 % of the peak.
fn slope(surface: &dyn Surface, azimuth: f64, middle: f64) -> f64 {
    let at = |r: f64| {
        let (x, y) = (middle + r * azimuth.cos(), middle + r * azimuth.sin());
        let (i, j, fx, fy) = (x.floor() as i32, y.floor() as i32, x.fract(), y.fract());
        let h = |a, b| surface.height(i + a, j + b);
        (h(0, 0) * (1.0 - fx) + h(1, 0) * fx) * (1.0 - fy) + (h(0, 1) * (1.0 - fx) + h(1, 1) * fx) * fy
    };
    let rays = || (0..).map(|k| 0.25 * f64::from(k)).take_while(|r| *r < middle);
    let Some(foot) = rays().find(|r| at(*r) < 0.02 * at(0.0)) else { return f64::NAN };
    let points: Vec<[f64; 2]> = rays()
        .filter(|r| *r > 0.2 * foot && *r < 0.85 * foot)
        .map(|r| [r * surface.lattice().spacing, at(r)])
        .collect();
    let n = points.len() as f64;
    let mean = |c: usize| points.iter().map(|p| p[c]).sum::<f64>() / n;
    let [x, z] = [mean(0), mean(1)];
    let both: f64 = points.iter().map(|p| (p[0] - x) * (p[1] - z)).sum();
    let square: f64 = points.iter().map(|p| (p[0] - x).powi(2)).sum();
    (-both / square).atan().to_degrees()
}

/// Cones on all azimuths.
pub fn cones(context: &Context) -> Outcome<Vec<Figure>> {
    let mut figures = Vec::new();
    for (radius, spacing, long) in CASES {
        let name = format!("soil.automaton.cone.r{radius}_{}mm", spacing * 1e3);
        if long && context.quick {
            continue;
        }
        let cases =
            [(UNLIMITED, false, ""), (UNLIMITED, true, ".settled"), (super::CURVATURE, false, ".curved")];
        for (curvature, settled, rules) in cases {
            let mut field = released(radius, spacing, curvature)?;
            let before = field.total();
            let [coarse, fine] =
                if settled { field.relax(200_000)? } else { [0, field.rest(MICROMETRE, 200_000)?] };
            let slopes: Vec<f64> = (0..360)
                .map(|k| slope(&field.ground.heights, f64::from(k).to_radians(), f64::from(middle(radius))))
                .collect();
            let worst = largest(slopes.iter().map(|s| (s - 35.0).abs()));
            let (low, high) = slopes.iter().fold((90.0, 0.0), |(a, b), s| (smaller(a, *s), larger(b, *s)));
            let lost = if field.total() == before { "" } else { ", MASS LOST" };
            let sweeps = if settled { format!("{coarse} coarse and {fine}") } else { fine.to_string() };
            let what = format!(
                "largest deviation from 35° on 360 azimuths ({low:.2}° … {high:.2}°, {sweeps} sweeps{lost})"
            );
            figures.push(Figure::new(format!("{name}{rules}"), worst, Limit::AtMost(0.2), what));
            if curvature != UNLIMITED {
                field.rest(0, 200_000)?;
                let curved = largest_curvature(&field.ground.heights) / curvature;
                let what = "largest curvature in four directions at rest / κ_max";
                figures.push(Figure::new(format!("{name}.curvature"), curved, Limit::AtMost(1.02), what));
            }
        }
    }
    Ok(figures)
}

/// A plane at 34.9° stays, at 35.1° flows, whatever its azimuth.
pub fn planes(context: &Context) -> Outcome<Vec<Figure>> {
    let mut counts = [0; 2];
    let every = if context.quick { 7 } else { 1 };
    for azimuth in (0..360).step_by(every) {
        let (sin, cos) = f64::from(azimuth).to_radians().sin_cos();
        for (wrong, degrees, flows) in [(0, 34.9f64, false), (1, 35.1, true)] {
            let rise = 0.01 * degrees.to_radians().tan();
            let height = move |i: i64, j: i64| rise * (i as f64 * cos + j as f64 * sin);
            let mut field = Field::new(&Function { size: [40; 2], spacing: 0.01, height }, PHI, UNLIMITED)?;
            field.sweeper.sweep(&mut field.ground, 200);
            counts[wrong] += i32::from((field.sweeper.counts.moved > 0) != flows);
        }
    }
    let what = |degrees, what| {
        format!("azimuths of {} at which a plane of {degrees}° {what}", 360usize.div_ceil(every))
    };
    Ok(vec![
        Figure::new(
            "soil.automaton.plane.34_9_flows",
            f64::from(counts[0]),
            Limit::Equal(0.0),
            what(34.9, "flows"),
        ),
        Figure::new(
            "soil.automaton.plane.35_1_stays",
            f64::from(counts[1]),
            Limit::Equal(0.0),
            what(35.1, "stays"),
        ),
    ])
}
