//! Overlays of a soil on the ground: pressure under a foot and the friction cone, of the committed state alone.

use crate::support;

use support::{Fixture, LUNAR, flat, soil};
use terraglue_soil_bekker::SoilBekker;
use terraglue_subsystem::{Figure, Geometry, Overlay, Subsystem};

const PHI: f64 = 0.610865238198;
const SPACING: f64 = 0.01;
const SLOPE: f64 = 0.2;

/// Points of the lines of a layer, pairs; empty where it is not shown.
fn lines(soil: &dyn Subsystem, layer: &str) -> Vec<[[f64; 3]; 2]> {
    let mut all: Vec<Overlay> = Vec::new();
    soil.overlays(&mut all);
    assert!(all.iter().all(|o| o.frame == Overlay::WORLD));
    let own = all.into_iter().filter(|o| o.layer == layer);
    let points = own.flat_map(|o| match o.figure {
        Figure::Lines { points, .. } => points,
        other => panic!("{other:?}"),
    });
    points.collect::<Vec<_>>().as_chunks::<2>().0.to_vec()
}

fn foot(height: fn(f64, f64) -> f64) -> Fixture {
    let half_extents = [0.05, 0.05, 0.02];
    Fixture::new(soil::<SoilBekker>(LUNAR, 101, SPACING, height), Geometry::Box { half_extents }, 5.0, 0.02)
}

/// Presses the foot by 5 mm along its normal; the normal force, N.
fn press(foot: &mut Fixture) -> f64 {
    (0..10).map(|_| foot.prescribed_step(&[-5e-4, 0.0, 0.0, 0.0, 0.0, 0.0])[0]).last().unwrap()
}

#[test]
fn untouched_ground_shows_nothing() {
    let mut all = Vec::new();
    soil::<SoilBekker>(LUNAR, 21, SPACING, flat).overlays(&mut all);
    assert!(all.is_empty());
}

#[test]
fn lines_are_as_long_as_the_pressure_and_the_cone_as_high_as_the_force() {
    let mut foot = foot(flat);
    let force = press(&mut foot);
    let pressure = lines(&*foot.soil, "pressure");
    assert_eq!(pressure.len(), 11 * 11);
    // 5 mm deep under a plate of 0.1 m: k_c/b + k_phi times the depth
    let expected = (1400.0 / 0.1 + 820_000.0) * 5e-3;
    for [low, high] in &pressure {
        // from the surface that the soil would spring back to
        assert!((-5e-3..-3e-3).contains(&low[2]) && low[..2] == high[..2], "{low:?}");
        let told = (high[2] - low[2]) / 1e-6;
        assert!((told / expected - 1.0).abs() < 0.02, "{told} {expected}");
    }
    let cone = lines(&*foot.soil, "friction cone");
    assert_eq!(cone.len(), 16);
    let apex = cone[0][0];
    assert!(apex[0].abs() < 1e-12 && apex[1].abs() < 1e-12);
    for rim in cone.iter().filter(|[from, _]| *from == apex).map(|[_, to]| to) {
        let height = rim[2] - apex[2];
        assert!((height / 1e-3 / force - 1.0).abs() < 0.02, "{height} {force}");
        assert!((rim[0].hypot(rim[1]) / height - PHI.tan()).abs() < 1e-9);
    }
}

#[test]
fn on_a_slope_the_cone_stands_along_the_normal_of_the_ground() {
    let mut foot = foot(|x, _| -SLOPE.tan() * x);
    foot.tilt(SLOPE);
    press(&mut foot);
    let cone = lines(&*foot.soil, "friction cone");
    let apex = cone[0][0];
    let rims: Vec<[f64; 3]> = cone.iter().filter(|[from, _]| *from == apex).map(|[_, to]| *to).collect();
    let axis = [0, 1, 2].map(|k| rims.iter().map(|r| r[k] - apex[k]).sum::<f64>());
    let length = axis.iter().map(|c| c * c).sum::<f64>().sqrt();
    let n = [SLOPE.sin(), 0.0, SLOPE.cos()];
    assert!((0..3).all(|k| (axis[k] / length - n[k]).abs() < 1e-3), "{axis:?}");
}

#[test]
fn a_state_that_comes_back_shows_what_it_showed() {
    let mut foot = foot(flat);
    press(&mut foot);
    foot.soil.save_state(0).unwrap();
    let bytes = foot.soil.serialize().unwrap();
    let shown = |soil: &dyn Subsystem| [lines(soil, "pressure"), lines(soil, "friction cone")];
    let before = shown(&*foot.soil);
    press(&mut foot);
    assert_ne!(shown(&*foot.soil), before);
    foot.soil.restore_state(0).unwrap();
    assert_eq!(shown(&*foot.soil), before);
    let mut other = soil::<SoilBekker>(LUNAR, 101, SPACING, flat);
    other.deserialize(&bytes).unwrap();
    assert_eq!(shown(&*other), before);
}
