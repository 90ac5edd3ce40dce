//! Heaps of loose material: angle of repose, curvature, mass, and silence at rest.

use crate::support;

use support::{Shown, read, soil};
use terraglue_ground::{Surface, UNIT_M};
use terraglue_numerics::extremes::{larger, smaller};
use terraglue_soil_cellular_automaton::SoilCellularAutomaton;
use terraglue_subsystem::{Motion, Step, Subsystem};

/// Without cohesion in the walls; as many sweeps as bring a heap to rest within seconds.
const LUNAR_SLIDING: &str = r#"{"n":1.0,"k_c":1400,"k_phi":820000,"c_pa":170,"phi_rad":0.610865238198,"K_m":0.018,
    "critical_height_m":0.0,"sweeps_per_step":2}"#;
const PHI: f64 = 0.610865238198;

fn column(x: f64, y: f64) -> f64 {
    // volume of a cone of radius 16 cells and slope tan φ on 9 × 9 cells of 1 cm
    let volume = std::f64::consts::FRAC_PI_3 * 0.16f64.powi(3) * PHI.tan();
    if x.abs() < 0.045 && y.abs() < 0.045 { volume / 81e-4 } else { 0.0 }
}

fn ramp(x: f64, _: f64) -> f64 {
    if x < 0.0 { 0.0 } else { 0.2 }
}

fn steps(soil: &mut dyn Subsystem, most: u64) -> u64 {
    for k in 0..most {
        let none = Motion { x: &[], v: &[] };
        soil.commit(&Step::free(k as f64 * 1e-3, 1e-3, k), &[], &none).expect("a plain step");
        if read(soil, "active_nodes") == 0.0 {
            return k;
        }
    }
    panic!("not at rest after {most} steps");
}

/// Slope along a ray from the middle: straight-line fit between 0.2 and 0.85 of the foot's radius.
fn slope(surface: &Shown, angle: f64) -> f64 {
    slope_around(surface, 0.5 * f64::from(surface.lattice.size[0] - 1), angle)
}

/// The same from another column of the middle row.
fn slope_around(surface: &Shown, column: f64, angle: f64) -> f64 {
    let d = surface.lattice.spacing;
    let middle = 0.5 * f64::from(surface.lattice.size[1] - 1);
    let at = |r: f64| {
        let (x, y) = (column + r * angle.cos(), middle + r * angle.sin());
        let (i, j, fx, fy) = (x.floor() as i32, y.floor() as i32, x.fract(), y.fract());
        let h = |a, b| surface.height(i + a, j + b);
        (h(0, 0) * (1.0 - fx) + h(1, 0) * fx) * (1.0 - fy) + (h(0, 1) * (1.0 - fx) + h(1, 1) * fx) * fy
    };
    let peak = at(0.0);
    let foot = (0..400).map(|k| 0.25 * f64::from(k)).find(|r| at(*r) < 0.02 * peak).expect("a foot");
    let points: Vec<(f64, f64)> = (0..400)
        .map(|k| 0.25 * f64::from(k))
        .filter(|r| *r > 0.2 * foot && *r < 0.85 * foot)
        .map(|r| (r * d, at(r)))
        .collect();
    let n = points.len() as f64;
    let (mx, my) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
    let sxy: f64 = points.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum();
    let sxx: f64 = points.iter().map(|p| (p.0 - mx).powi(2)).sum();
    -sxy / sxx
}

fn total(soil: &dyn Subsystem) -> i64 {
    let s = Shown::new(soil);
    let n = s.lattice.size[0] as i32;
    (0..n).flat_map(|j| (0..n).map(move |i| (i, j))).map(|(i, j)| (s.height(i, j) / UNIT_M) as i64).sum()
}

#[test]
fn a_column_collapses_to_a_cone_at_the_angle_of_repose() {
    let mut soil = soil::<SoilCellularAutomaton>(LUNAR_SLIDING, 65, 0.01, column);
    let before = total(&*soil);
    let rest = steps(&mut *soil, 4000);
    assert_eq!(total(&*soil), before, "material was lost");
    assert_eq!(read(&*soil, "mass_error_units"), 0.0);
    let shown = Shown::new(&*soil);
    let slopes: Vec<f64> =
        (0..360).map(|k| slope(&shown, f64::from(k).to_radians()).atan().to_degrees()).collect();
    let mean = slopes.iter().sum::<f64>() / 360.0;
    let (low, high) = slopes.iter().fold((90.0, 0.0), |(a, b), s| (smaller(a, *s), larger(b, *s)));
    println!("at rest after {rest} steps, slope {mean:.2}°, {low:.2} … {high:.2}");
    assert!((mean - 35.0).abs() < 1.0, "{mean}");
    assert_eq!(read(&*soil, "active_nodes"), 0.0);
}

#[test]
fn a_column_that_settles_at_the_start_is_the_same_cone_at_rest() {
    let own = LUNAR_SLIDING.trim_end_matches('}');
    let soil = soil::<SoilCellularAutomaton>(&format!("{own},\"settle_at_start\":true}}"), 65, 0.01, column);
    let shown = Shown::new(&*soil);
    let before: i64 = {
        let place = |k: i32| f64::from(k - 32) * 0.01;
        let nodes = (0..65).flat_map(|j| (0..65).map(move |i| (i, j)));
        nodes.map(|(i, j)| (column(place(i), place(j)) / UNIT_M).round() as i64).sum()
    };
    assert_eq!(total(&*soil), before, "material was lost");
    let slopes = (0..360).map(|k| slope(&shown, f64::from(k).to_radians()).atan().to_degrees());
    let mean = slopes.sum::<f64>() / 360.0;
    assert!((mean - 35.0).abs() < 1.0, "{mean}");
    for (name, value) in [("moved_volume", 0.0), ("max_sinkage", 0.0), ("mass_error_units", 0.0)] {
        assert_eq!(read(&*soil, name), value, "{name}");
    }
}

/// Two columns on the soils of a mask: each becomes a cone at the angle of its own soil.
#[test]
fn every_soil_of_a_mask_has_its_own_angle_of_repose() {
    const OTHER: f64 = 0.436332;
    fn columns(x: f64, y: f64) -> f64 {
        column(x + 0.32, y) + column(x - 0.32, y)
    }
    let own = LUNAR_SLIDING.trim_end_matches('}');
    let runs = vec!["64,0,65,1"; 129].join(",");
    let config = format!(r#"{own},"mask":{{"soils":[{{"phi_rad":{OTHER}}}],"runs":[{runs}]}}}}"#);
    let mut soil = soil::<SoilCellularAutomaton>(&config, 129, 0.01, columns);
    steps(&mut *soil, 8000);
    assert_eq!(read(&*soil, "mass_error_units"), 0.0);
    let shown = Shown::new(&*soil);
    for (middle, angle) in [(32.0, PHI), (96.0, OTHER)] {
        let slopes = (0..360).map(|k| slope_around(&shown, middle, f64::from(k).to_radians()).atan());
        let mean = slopes.sum::<f64>() / 360.0;
        assert!((mean - angle).to_degrees().abs() < 1.0, "{} for {}", mean.to_degrees(), angle.to_degrees());
    }
}

#[test]
fn no_triple_is_more_curved_than_allowed() {
    let mut soil = soil::<SoilCellularAutomaton>(LUNAR_SLIDING, 65, 0.01, ramp);
    steps(&mut *soil, 20_000);
    let s = Shown::new(&*soil);
    let mut worst: f64 = 0.0;
    for j in 1..64 {
        for i in 1..64 {
            for ([a, b], d2) in [([1, 0], 1e-4), ([0, 1], 1e-4), ([1, 1], 2e-4), ([1, -1], 2e-4)] {
                let c = s.height(i - a, j - b) - 2.0 * s.height(i, j) + s.height(i + a, j + b);
                worst = larger(worst, (c.abs() - 96.0 * UNIT_M) / d2);
            }
        }
    }
    assert!(worst <= 40.0, "{worst} per m");
}

#[test]
fn flat_ground_sleeps_from_the_start() {
    let mut soil = soil::<SoilCellularAutomaton>(LUNAR_SLIDING, 65, 0.01, support::flat);
    assert_eq!(steps(&mut *soil, 1), 0);
}
