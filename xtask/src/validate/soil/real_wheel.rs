//! A real wheel: the smooth wheel of Carnegie Mellon's bench in Direct-90 sand. The integral of the stresses is
//! calibrated on some slips, the soil with these numbers drives at all of them.

use super::plates::Maker;
use super::wheel_rig::{Bench, Reading};
use super::wong_reece::Wheel;
use super::{STILL, in_parallel};
use crate::process::{Outcome, read, root};
use crate::validate::{Context, Figure, Limit};
use terraglue_soil_law::DEFAULT_ELASTIC_STIFFNESS;

const RADIUS: f64 = 0.058;
const WIDTH: f64 = 0.05;
/// Points of the integrals and rounds of the calibration.
const POINTS: usize = 200;
const ROUNDS: u32 = 40;
/// How far the measured means are trusted: sinkage 5 %, drawbar pull 0.7 N.
const SCATTER: [f64; 2] = [0.05, 0.7];

/// What is calibrated: ln k_φ, n_0, n_1 of Ding's slip sinkage, shear strength between rim and sand without pressure
/// (Pa), tan of their angle of friction, ln K.
type Numbers = [f64; 6];
/// Where the search begins: the plates' numbers for the sand (`CMU_Direct90_s0`) and a smooth rim.
const START: Numbers = [15.894_952, 1.46, 0.3, 200.0, 0.4, -4.605_170];
/// How far the answer is held to the start.
const PRIOR: Numbers = [3.0, 0.5, 0.6, 800.0, 0.3, 1.0];
const LOW: Numbers = [8.0, 0.5, 0.0, 0.0, 0.05, -6.9];
const HIGH: Numbers = [20.0, 2.0, 1.5, 1000.0, 0.554, -2.3];

/// A slip of the bench: slip, load (N), sinkage (m), drawbar pull (N).
#[derive(Clone, Copy, Debug)]
struct Point {
    slip: f64,
    load: f64,
    sinkage: f64,
    pull: f64,
}

/// The five points from slip 0 on.
fn points() -> Outcome<Vec<Point>> {
    let text = read(&root().join("tests/reference/terramechanics/cmu_smooth_beta0_mean.csv"))?;
    let number = |line: &str, k: usize| line.split(',').nth(k).and_then(|c| c.parse::<f64>().ok());
    let point = |line: &str| {
        let [slip, pull, load, sinkage] =
            [number(line, 4)?, number(line, 6)?, number(line, 8)?, number(line, 10)?];
        Some(Point { slip, load, sinkage: 1e-3 * sinkage, pull })
    };
    let all: Option<Vec<Point>> = text.lines().skip(1).map(point).collect();
    Ok(all.ok_or("the wheel's table cannot be read")?.into_iter().filter(|p| p.slip > -0.01).collect())
}

fn wheel(x: &Numbers, slip: f64) -> Wheel {
    Wheel {
        radius: RADIUS,
        width: WIDTH,
        modulus: x[0].exp(),
        n: x[1] + x[2] * slip.max(0.0),
        cohesion: x[3],
        friction: x[4],
        shear: x[5].exp(),
        peak: [0.0; 2],
        unloading: DEFAULT_ELASTIC_STIFFNESS,
        points: POINTS,
    }
}

/// Errors of the integral over their scatter, and how far the numbers are from the start.
fn residuals(x: &Numbers, seen: &[Point]) -> Vec<f64> {
    let mut all = Vec::new();
    for p in seen {
        let state = wheel(x, p.slip).under(p.load, p.slip);
        all.push((state.sinkage / p.sinkage).ln() / SCATTER[0]);
        all.push((state.pull - p.pull) / SCATTER[1]);
    }
    all.extend((0..6).map(|k| (x[k] - START[k]) / PRIOR[k]));
    all
}

/// Least squares by damped Gauss–Newton steps inside the bounds.
fn calibrate(seen: &[Point]) -> Numbers {
    let squares = |r: &[f64]| r.iter().map(|v| v * v).sum::<f64>();
    let (mut x, mut damping) = (START, 1e-2);
    let mut r = residuals(&x, seen);
    for _ in 0..ROUNDS {
        let columns: [Vec<f64>; 6] = std::array::from_fn(|k| {
            let mut y = x;
            let d = 1e-4
                * x[k].abs().max(1.0)
                * if x[k] + 1e-4 * x[k].abs().max(1.0) < HIGH[k] { 1.0 } else { -1.0 };
            y[k] += d;
            residuals(&y, seen).iter().zip(&r).map(|(a, b)| (a - b) / d).collect()
        });
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let before = squares(&r);
        let mut better = false;
        for _ in 0..8 {
            let mut m: [[f64; 7]; 6] = std::array::from_fn(|a| {
                std::array::from_fn(
                    |b| if b < 6 { dot(&columns[a], &columns[b]) } else { dot(&columns[a], &r) },
                )
            });
            (0..6).for_each(|k| m[k][k] *= 1.0 + damping);
            let d = solve(m);
            let y: Numbers = std::array::from_fn(|k| (x[k] - d[k]).clamp(LOW[k], HIGH[k]));
            let new = residuals(&y, seen);
            if squares(&new) < before {
                (x, r, damping, better) = (y, new, 0.3 * damping, true);
                break;
            }
            damping *= 4.0;
        }
        if !better || before - squares(&r) < 1e-7 * before {
            break;
        }
    }
    x
}

/// Gaussian elimination of a positive definite system with its right side in the last column.
fn solve(mut m: [[f64; 7]; 6]) -> Numbers {
    for c in 0..6 {
        for a in c + 1..6 {
            let f = m[a][c] / m[c][c];
            for b in c..7 {
                m[a][b] -= f * m[c][b];
            }
        }
    }
    let mut x = [0.0; 6];
    for c in (0..6).rev() {
        x[c] = (m[c][6] - (c + 1..6).map(|b| m[c][b] * x[b]).sum::<f64>()) / m[c][c];
    }
    x
}

/// The numbers as a module's configuration: the sand of the plates, its rim smoother than the sand is rough. The integral
/// that was calibrated knows no material that moves.
fn config(x: &Numbers) -> String {
    format!(
        r#"{{"n":{},"k_c":0.0,"k_phi":{},"c_pa":1000.0,"phi_rad":0.506145483078,"K_m":{},"density_kg_m3":1330.0,
            "interface_c_pa":{},"interface_phi_rad":{},"slip_sinkage":"ding","slip_sinkage_n1":{},{STILL}}}"#,
        x[1],
        x[0].exp(),
        x[5].exp(),
        x[3],
        x[4].atan(),
        x[2]
    )
}

/// Sinkage and drawbar pull of the soil at a slip.
fn driven(make: Maker, x: &Numbers, p: &Point, spacing: f64) -> Reading {
    let soil = make(&config(x), (0.5 / spacing) as u32 + 1, spacing);
    Bench::new(soil, [RADIUS, WIDTH], p.load, -0.1).drive(p.slip, 0.2, 0.05)
}

/// The figures of a soil: calibrated on every other slip and on the rest.
pub fn figures(context: &Context, name: &str, make: Maker) -> Outcome<Vec<Figure>> {
    let points = points()?;
    let spacing = if context.quick { 0.005 } else { 0.0025 };
    let mut all = Vec::new();
    for (part, seen, of) in [
        ("three", [0, 2, 4].as_slice(), "calibrated on slip 0, 0.5, 0.9"),
        ("two", [1, 3].as_slice(), "calibrated on slip 0.23, 0.75"),
    ] {
        let numbers = calibrate(&seen.iter().map(|k| points[*k]).collect::<Vec<_>>());
        let found = in_parallel(&points, |p| driven(make, &numbers, p, spacing));
        for (group, unseen) in [("seen", false), ("unseen", true)] {
            let of_group =
                || points.iter().zip(&found).enumerate().filter(|(k, _)| seen.contains(k) != unseen);
            let sinkage = of_group().map(|(_, (p, f))| 100.0 * (f.sinkage / p.sinkage - 1.0).abs());
            let pull = of_group().map(|(_, (p, f))| (f.pull - p.pull).abs());
            let figure = |quantity: &str, worst: f64, limit, unit| {
                let what =
                    format!("largest error of the {quantity} of the real wheel, {unit}, {group} slips; {of}");
                Figure::new(
                    format!("soil.{name}.real_wheel.{part}.{group}.{quantity}"),
                    worst,
                    Limit::AtMost(limit),
                    what,
                )
            };
            all.push(figure("sinkage", largest(sinkage), 15.0, "%"));
            all.push(figure("pull", largest(pull), 2.0, "N"));
        }
        let falls = found.windows(2).filter(|w| w[1].sinkage <= w[0].sinkage).count();
        let what = format!("slips between 0 and 0.9 at which the sinkage does not rise; {of}");
        all.push(Figure::new(
            format!("soil.{name}.real_wheel.{part}.falls"),
            falls as f64,
            Limit::Equal(0.0),
            what,
        ));
    }
    Ok(all)
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |m: f64, v| if v.is_nan() || m.is_nan() { f64::NAN } else { m.max(v) })
}
