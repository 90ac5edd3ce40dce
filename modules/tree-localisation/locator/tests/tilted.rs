//! A machine that leans finds the place that it finds when it stands level: scans of cylinders on a plane, in closed form.
#![allow(clippy::unwrap_used, missing_docs)]

mod standing;

use standing::Standing;
use std::sync::Arc;
use terraglue_laser_scanner::{Pattern, Told, message};
use terraglue_numerics::random::uniform;
use terraglue_subsystem::*;
use terraglue_tree_locator::TreeLocator;

/// Where the machine stands: x, y, m, and yaw, rad.
const TRUTH: [f64; 3] = [3.0, -2.0, 0.7];
/// Height of the scanner, which is the mount, m.
const HEIGHT: f64 = 2.3;
const RADIUS: f64 = 0.15;
/// A pole on the machine, 4 m ahead of the mount along its axes.
const POLE: [f64; 2] = [4.0, 0.5];

/// Places of trees: 200 in a square of 80 m, no two within 2 m and none within 3 m of the machine.
fn trees() -> Vec<[f64; 2]> {
    let mut all: Vec<[f64; 2]> = Vec::new();
    for k in 0.. {
        let at = [2 * k, 2 * k + 1].map(|n| 80.0 * uniform(3, n) - 40.0);
        let far = |other: &[f64; 2], least: f64| (at[0] - other[0]).hypot(at[1] - other[1]) > least;
        if all.iter().all(|t| far(t, 2.0)) && far(&[TRUTH[0], TRUTH[1]], 3.0) {
            all.push(at);
        }
        if all.len() == 200 {
            return all;
        }
    }
    unreachable!()
}

/// Distance along a ray in the frame of an upright cylinder, whose axis is at a place; the plane of the ray's origin is z = 0.
fn cylinder(direction: [f64; 3], [x, y]: [f64; 2], radius: f64) -> Option<f64> {
    let [dx, dy, _] = direction;
    let (a, b, c) = (dx * dx + dy * dy, dx * x + dy * y, x * x + y * y - radius * radius);
    let root = b * b - a * c;
    (root > 0.0 && b > 0.0).then(|| (b - root.sqrt()) / a)
}

/// The turn of a scanner that leans by roll and pitch; times and bodies do not matter.
fn scan([roll, pitch]: [f64; 2]) -> Vec<u8> {
    let pattern = Pattern::os1_64();
    let (sr, cr) = roll.sin_cos();
    let (sp, cp) = pitch.sin_cos();
    // level_from_mount: roll about x, then pitch about y
    let level = |[x, y, z]: [f64; 3]| {
        let (y, z) = (cr * y - sr * z, sr * y + cr * z);
        [cp * x + sp * z, y, cp * z - sp * x]
    };
    let (sine, cosine) = TRUTH[2].sin_cos();
    let around: Vec<[f64; 2]> = trees()
        .iter()
        .map(|t| [t[0] - TRUTH[0], t[1] - TRUTH[1]])
        .map(|[x, y]| [cosine * x + sine * y, cosine * y - sine * x])
        .collect();
    let mut points = Vec::new();
    for (column, ring) in (0..pattern.columns).flat_map(|c| (0..64).map(move |r| (c, r))) {
        let own = pattern.direction(column, ring);
        let seen = level(own);
        let mut range = if seen[2] < 0.0 { -HEIGHT / seen[2] } else { f64::INFINITY };
        for tree in &around {
            if let Some(t) =
                cylinder(seen, *tree, RADIUS).filter(|t| (0.0..18.0).contains(&(HEIGHT + t * seen[2])))
            {
                range = range.min(t);
            }
        }
        if let Some(t) = cylinder(own, POLE, 0.1).filter(|t| (t * own[2]).abs() < 2.0) {
            range = range.min(t);
        }
        if range < 35.0 {
            let position = own.map(|d| range * d);
            points.push(Told { position, time: 0.0, intensity: 0.5, ring, subsystem: 0, body: 0, shape: 0 });
        }
    }
    message(&points, 0.0, "machine/front", &Pose::IDENTITY)
}

/// A machine with a pole.
fn world() -> Standing {
    let body = |name: &str| SceneBody { name: name.into(), mass: 1.0 };
    let pole = SceneShape {
        id: 0,
        body: 0,
        name: "pole".into(),
        geometry: Geometry::Cylinder { half_length: 2.0, radius: 0.1 },
        body_from_shape: Pose { position: [POLE[0], POLE[1], 0.0], ..Pose::IDENTITY },
        collides: true,
        material: Material::default(),
    };
    let scene = Scene { bodies: vec![body("front")], shapes: vec![pole], ..Scene::default() };
    Standing::with(scene)
}

/// Distance from the true place, m, turn from the true yaw, rad, stems, and of these those that stand where the machine is.
fn located(tilt: [f64; 2], shown: [f64; 2]) -> Option<[f64; 4]> {
    let json = r#"{"mount": "machine.front", "mask": "volume", "map_noise_m": 0.03}"#;
    let config = Config::parse(json).unwrap().with_defaults(&TreeLocator::schema());
    let mut locator = TreeLocator::new(&config, Arc::new(Standalone::default())).unwrap();
    let id = |l: &TreeLocator, name: &str| l.variables().iter().find(|v| v.name == name).unwrap().id;
    let rows: String = trees().iter().map(|[x, y]| format!("{x},{y}\n")).collect();
    for (name, bytes) in [("map", format!("x,y\n{rows}").into_bytes()), ("points_1", scan(tilt))] {
        locator.set(&[id(&locator, name)], Values::Binary(&[bytes])).unwrap();
    }
    let tilts = [id(&locator, "roll"), id(&locator, "pitch")];
    locator.set(&tilts, Values::F64(&shown)).unwrap();
    locator.observe(&Step::free(0.0, 1.0, 0), &world()).unwrap();
    let mut counts = [0; 2];
    locator.get(&["stems", "own_stems"].map(|n| id(&locator, n)), ValuesMut::U64(&mut counts)).unwrap();
    let mut known = [false];
    locator.get(&[id(&locator, "is_known")], ValuesMut::Bool(&mut known)).unwrap();
    let mut pose = [f64::NAN; 3];
    locator.get(&["x", "y", "yaw"].map(|n| id(&locator, n)), ValuesMut::F64(&mut pose)).unwrap();
    let gap = (pose[0] - TRUTH[0]).hypot(pose[1] - TRUTH[1]);
    known[0].then(|| [gap, (pose[2] - TRUTH[2]).abs(), counts[0] as f64, counts[1] as f64])
}

#[test]
fn a_machine_that_leans_finds_the_same_place() {
    let [gap, turn, stems, own] = located([0.0; 2], [0.0; 2]).unwrap();
    assert!(gap < 0.02 && turn < 1e-3 && stems > 30.0 && own == 0.0, "{gap} {turn} {stems} {own}");
    for tilt in [[0.15, 0.0], [-0.1, 0.12], [0.05, -0.17], [-0.2, -0.1]] {
        let [gap, turn, leaning, own] = located(tilt, tilt).unwrap();
        assert!(gap < 0.03 && turn < 2e-3, "{tilt:?}: {gap} m, {turn} rad");
        assert!(leaning > 0.8 * stems && own == 0.0, "{tilt:?}: {leaning} stems of {stems}, {own}");
    }
}

#[test]
fn without_an_inclinometer_the_lean_shifts_the_place() {
    let found = located([0.15, 0.05], [0.0; 2]);
    assert!(found.is_none_or(|[gap, ..]| gap > 0.1), "{found:?}");
}
