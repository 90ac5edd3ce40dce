//! A real wheel from plates alone: the smooth wheel of Carnegie Mellon's bench in Direct-90 sand, driven, braked and with side
//! slip. Factors and exponent of the pressure come from the presses of two discs into the same sand, cohesion, friction and K
//! from the source of the data; every other key is the default, and nothing is fitted to a wheel.

use super::MODULES;
use super::drive::{Drive, Move, on_rim};
use super::plates::Maker;
use crate::parallel::in_parallel;
use crate::process::{Outcome, read, root};
use crate::{Context, Figure, Limit};
use terraglue::soil_fit::{Known, fit_law, read as read_plates};
use terraglue_subsystem::Geometry;

const PLATES: &str = "tests/reference/terramechanics/cmu_plate_pressure_sinkage_d60_d100.csv";
const ALONG: &str = "tests/reference/terramechanics/cmu_smooth_beta0_mean.csv";
const ASIDE: &str = "tests/reference/terramechanics/cmu_smooth_beta15_45_mean.csv";
/// Below this sinkage the plates are not seated, m.
const FROM: f64 = 3e-3;
const SAND: Known =
    Known { c_pa: Some(1000.0), phi_rad: Some(0.506145483078), shear_m: Some(0.021), density: Some(1330.0) };
const RADIUS: f64 = 0.058;
const WIDTH: f64 = 0.05;
/// Longest way of rim or axle in a step, m.
const STRIDE: f64 = 5e-4;

/// A measured state of the wheel.
#[derive(Clone, Copy, Debug, Default)]
struct Point {
    /// Angle between the plane of the wheel and the way, rad.
    angle: f64,
    /// 1 − v/(rω), where the wheel is braked rω/v − 1.
    slip: f64,
    /// Load, pull along the wheel, side force, N.
    load: f64,
    pull: f64,
    side: f64,
    /// m.
    sinkage: f64,
}

/// The points of a file with these columns: angle (°), slip, load, pull, side force (N), sinkage (mm).
fn points(file: &str, columns: [Option<&str>; 6]) -> Outcome<Vec<Point>> {
    let text = read(&root().join(file))?;
    let names: Vec<&str> = text.lines().next().unwrap_or_default().split(',').collect();
    let place =
        |name: &str| names.iter().position(|n| *n == name).ok_or(format!("{file} has no column {name}"));
    let places = columns.map(|c| c.map(place).transpose());
    let mut all = Vec::new();
    for line in text.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        let number = |place: &Outcome<Option<usize>>| match place {
            Ok(None) => Ok(0.0),
            Ok(Some(k)) => cells[*k].parse::<f64>().map_err(|e| format!("{file}: `{line}`: {e}")),
            Err(e) => Err(e.clone()),
        };
        let [angle, slip, load, pull, side, sinkage] = [0, 1, 2, 3, 4, 5].map(|k| number(&places[k]));
        all.push(Point {
            angle: angle?.to_radians(),
            slip: slip?,
            load: load?,
            pull: pull?,
            side: side?,
            sinkage: 1e-3 * sinkage?,
        });
    }
    Ok(all)
}

/// Parameters of a module, from the plates alone.
fn config() -> Outcome<String> {
    let tests = read_plates(&root().join(PLATES), FROM).map_err(|e| e.to_string())?;
    let fit = fit_law("bearing", &tests, SAND).map_err(|e| e.to_string())?;
    let numbers: String = fit.parameters.iter().map(|p| format!(r#""{}":{:?},"#, p.name, p.value)).collect();
    Ok(format!(
        r#"{{"pressure_law":"bearing",{numbers}"reference_depth_m":{:?},"c_pa":1000.0,"phi_rad":0.506145483078,"K_m":0.021,
        "density_kg_m3":1330.0}}"#,
        terraglue::soil_fit::REFERENCE_DEPTH
    ))
}

/// The same state of the simulated wheel: means over the last fifth of the way.
fn driven(make: Maker, config: &str, point: &Point, spacing: f64, way: f64) -> Point {
    let geometry = Geometry::Cylinder { half_length: 0.5 * WIDTH, radius: RADIUS };
    let soil = make(config, ((way + 0.3) / spacing) as u32 + 1, spacing);
    let mut bench = Drive::new(soil, geometry, on_rim(point.angle), [-0.5 * way, 0.0013]);
    let rim_per_way = if point.slip < 0.0 { 1.0 + point.slip } else { 1.0 / (1.0 - point.slip) };
    let ahead = STRIDE / rim_per_way.max(1.0);
    let (sin, cos) = point.angle.sin_cos();
    let turn = ahead * rim_per_way / RADIUS;
    let now = Move::rolling(ahead, turn, point.angle, point.load);
    let steps = (way / ahead).round() as u64;
    let from = steps - steps / 5;
    let mut mean = Point { angle: point.angle, slip: point.slip, ..Point::default() };
    for k in 0..steps {
        let [force, _] = bench.step(&now);
        if k >= from {
            let share = 1.0 / (steps - from) as f64;
            mean.load += share * force[2];
            mean.pull += share * (force[0] * cos + force[1] * sin);
            mean.side += share * (force[1] * cos - force[0] * sin);
            mean.sinkage += share * bench.sinkage();
        }
    }
    mean
}

/// One figure: the largest of an error over the points of a group.
type Group = (&'static str, fn(&Point) -> bool, fn(&Point, &Point) -> f64, f64, &'static str);

fn percent(found: f64, measured: f64) -> f64 {
    100.0 * (found.abs() / measured.abs() - 1.0).abs()
}

const GROUPS: [Group; 6] = [
    (
        "driven.sinkage",
        |p| p.angle == 0.0 && p.slip > -0.01,
        |f, p| percent(f.sinkage, p.sinkage),
        15.0,
        "sinkage, %, slip 0 to 0.9",
    ),
    (
        "driven.pull",
        |p| p.angle == 0.0 && p.slip > -0.01,
        |f, p| (f.pull - p.pull).abs(),
        2.0,
        "drawbar pull, N, slip 0 to 0.9",
    ),
    (
        "braked.sinkage",
        |p| p.angle == 0.0 && p.slip < -0.01,
        |f, p| percent(f.sinkage, p.sinkage),
        20.0,
        "sinkage, %, slip -0.2 to -1",
    ),
    (
        "braked.force",
        |p| p.angle == 0.0 && p.slip < -0.01,
        |f, p| percent(f.pull, p.pull),
        20.0,
        "force along the way, %, slip -0.2 to -1",
    ),
    (
        "aside.sinkage",
        |p| p.angle > 0.0,
        |f, p| percent(f.sinkage, p.sinkage),
        20.0,
        "sinkage, %, slip angle 15° and 45°, slip 0 to 0.9",
    ),
    (
        "aside.force",
        |p| p.angle > 0.0,
        |f, p| percent(f.side, p.side),
        25.0,
        "side force, %, slip angle 15° and 45°, slip 0 to 0.9",
    ),
];

/// All figures.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    let mut measured =
        points(ALONG, [None, Some("slip"), Some("Fz_N"), Some("DP_N"), None, Some("sinkage_mm")])?;
    let aside = ["beta_deg", "slip", "Fz", "Fx", "Fy", "Z"].map(Some);
    measured.extend(points(ASIDE, aside)?.into_iter().filter(|p| p.slip > -0.01));
    if context.quick {
        // slip -1, 0 and 0.5 along the way, 0 and 0.5 aside at 15°
        let shown = |p: &Point| p.angle < 0.5 && [-1.0, 0.0, 0.5].iter().any(|s| (p.slip - s).abs() < 2e-3);
        measured.retain(shown);
    }
    let (spacing, way) = if context.quick { (0.01, 0.3) } else { (0.005, 0.5) };
    let config = config()?;
    let mut all = Vec::new();
    for (name, make) in MODULES {
        let found = in_parallel(&measured, |p| driven(make, &config, p, spacing, way));
        for (group, is_in, error, limit, what) in GROUPS {
            let of_group = measured.iter().zip(&found).filter(|(p, _)| is_in(p));
            let errors = of_group.map(|(p, f)| (error(f, p), p));
            let worst = errors.max_by(|a, b| a.0.total_cmp(&b.0));
            let Some((worst, at)) = worst else { continue };
            let what = format!(
                "largest error of the {what}; real wheel from plates alone, {} mm grid; at slip {:.2}, {:.0}°",
                1e3 * spacing,
                at.slip,
                at.angle.to_degrees()
            );
            all.push(Figure::new(
                format!("soil.{name}.plate_wheel_{:.0}mm.{group}", 1e3 * spacing),
                worst,
                Limit::AtMost(limit),
                what,
            ));
        }
    }
    Ok(all)
}
