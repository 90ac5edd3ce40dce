//! The underside of rotated shapes against dense sampling of their definition.

use proptest::prelude::*;
use terraglue_ground::{Placed, Rotation};
use terraglue_subsystem::{Geometry, Pose};

/// Whether a point of the shape's frame lies inside, by the definition of the shape.
fn inside(geometry: &Geometry, p: [f64; 3]) -> bool {
    let across = (p[0] * p[0] + p[1] * p[1]).sqrt();
    match geometry {
        Geometry::Sphere { radius } => (across * across + p[2] * p[2]).sqrt() <= *radius,
        Geometry::Box { half_extents: h } => (0..3).all(|k| p[k].abs() <= h[k]),
        Geometry::Capsule { half_length, radius } => {
            let over = (p[2].abs() - half_length).max(0.0);
            (across * across + over * over).sqrt() <= *radius
        }
        Geometry::Cylinder { half_length, radius } => across <= *radius && p[2].abs() <= *half_length,
        Geometry::ConeFrustum { half_length, radius_bottom, radius_top } => {
            let share = 0.5 * (p[2] / half_length + 1.0);
            (0.0..=1.0).contains(&share) && across <= radius_bottom + share * (radius_top - radius_bottom)
        }
        Geometry::Ellipsoid { semi_axes } => {
            (0..3).map(|k| p[k] / semi_axes[k]).map(|x| x * x).sum::<f64>() <= 1.0
        }
        // A regular octahedron of size 0.1 is the only mesh here.
        Geometry::ConvexMesh { .. } | Geometry::Mesh { .. } => p.iter().map(|c| c.abs()).sum::<f64>() <= 0.1,
    }
}

fn octahedron() -> Geometry {
    let points = (0..6).map(|k| {
        let mut p = [0.0; 3];
        p[k / 2] = if k % 2 == 0 { 0.1 } else { -0.1 };
        p
    });
    let mut triangles = Vec::new();
    for octant in 0..8u32 {
        let corner = |axis: u32| 2 * axis + (octant >> axis & 1);
        let flipped = (octant & 1) + (octant >> 1 & 1) + (octant >> 2 & 1);
        let [a, b] = if flipped % 2 == 0 { [1, 2] } else { [2, 1] };
        triangles.push([corner(0), corner(a), corner(b)]);
    }
    Geometry::ConvexMesh { points: points.collect(), triangles }
}

fn shapes() -> [Geometry; 8] {
    [
        Geometry::Sphere { radius: 0.08 },
        Geometry::Box { half_extents: [0.1, 0.05, 0.02] },
        Geometry::Capsule { half_length: 0.07, radius: 0.03 },
        Geometry::Cylinder { half_length: 0.03, radius: 0.09 },
        octahedron(),
        Geometry::ConeFrustum { half_length: 0.08, radius_bottom: 0.05, radius_top: 0.02 },
        Geometry::ConeFrustum { half_length: 0.05, radius_bottom: 0.0, radius_top: 0.09 },
        Geometry::Ellipsoid { semi_axes: [0.1, 0.06, 0.04] },
    ]
}

/// Lowest point inside along the vertical line: a coarse scan finds the interval, bisection its lower end.
fn scanned(geometry: &Geometry, pose: &Pose, x: f64, y: f64) -> Option<f64> {
    let rotation = Rotation::from_quaternion(pose.orientation);
    let hit = |z: f64| {
        let c = pose.position;
        inside(geometry, rotation.to_shape([x - c[0], y - c[1], z - c[2]]))
    };
    let z = |k: i32| pose.position[2] - 0.2 + f64::from(k) * 1e-4;
    let first = (0..4000).find(|k| hit(z(*k)))?;
    let (mut out, mut inner) = (z(first - 1), z(first));
    for _ in 0..40 {
        let middle = 0.5 * (out + inner);
        if hit(middle) { inner = middle } else { out = middle }
    }
    Some(inner)
}

fn pose_from(q: [f64; 4], position: [f64; 3]) -> Pose {
    let norm = q.iter().map(|c| c * c).sum::<f64>().sqrt();
    Pose { position, orientation: q.map(|c| c / norm) }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn underside_is_where_sampling_finds_it(
        q in prop::array::uniform4(-1.0..1.0f64).prop_filter("length", |q| q.iter().map(|c| c * c).sum::<f64>() > 0.01),
        at in prop::array::uniform2(-0.1..0.1f64),
    ) {
        let pose = pose_from(q, [0.3, -0.2, 0.5]);
        for geometry in &shapes() {
            let placed = Placed::new(geometry, &pose);
            let (x, y) = (0.3 + at[0], -0.2 + at[1]);
            match (placed.lower(x, y), scanned(geometry, &pose, x, y)) {
                (Some(exact), Some(sampled)) => prop_assert!((exact - sampled).abs() < 1e-9, "{geometry:?}"),
                (None, Some(z)) => prop_assert!(false, "{geometry:?} missed at {z}"),
                // A chord shorter than the scan's step may be overlooked by the scan.
                (Some(_), None) | (None, None) => {}
            }
        }
    }

    #[test]
    fn underside_lies_inside_and_above_the_box(
        q in prop::array::uniform4(-1.0..1.0f64).prop_filter("length", |q| q.iter().map(|c| c * c).sum::<f64>() > 0.01),
    ) {
        let pose = pose_from(q, [0.0, 0.0, 0.0]);
        let rotation = Rotation::from_quaternion(pose.orientation);
        for geometry in &shapes() {
            let placed = Placed::new(geometry, &pose);
            let bounds = placed.aabb();
            let mut lowest = f64::INFINITY;
            for b in -40..=40 {
                for a in -40..=40 {
                    let (x, y) = (f64::from(a) * 0.004, f64::from(b) * 0.004);
                    if let Some(z) = placed.lower(x, y) {
                        let p = rotation.to_shape([x, y, z]).map(|c| c * (1.0 - 1e-9));
                        prop_assert!(inside(geometry, p), "{geometry:?}: ({x}, {y}, {z}) is not on it");
                        for (k, c) in [x, y, z].into_iter().enumerate() {
                            prop_assert!(c >= bounds.min[k] - 1e-12 && c <= bounds.max[k] + 1e-12);
                        }
                        lowest = lowest.min(z);
                    }
                }
            }
            let bottom = placed.support([0.0, 0.0, -1.0]);
            prop_assert!((bottom[2] - bounds.min[2]).abs() < 1e-9, "{geometry:?}: {} {}", bottom[2], bounds.min[2]);
            prop_assert!(lowest >= bottom[2] - 1e-9 && lowest < bottom[2] + 0.006);
        }
    }
}

#[test]
fn a_standing_box_and_a_lying_cylinder_are_read_off() {
    let block = Placed::new(&Geometry::Box { half_extents: [0.1, 0.2, 0.3] }, &Pose::IDENTITY);
    assert_eq!(block.lower(0.05, -0.19), Some(-0.3));
    assert_eq!(block.lower(0.11, 0.0), None);
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let lying = Pose { position: [0.0, 0.0, 1.0], orientation: [half, half, 0.0, 0.0] };
    let wheel = Placed::new(&Geometry::Cylinder { half_length: 0.1, radius: 0.25 }, &lying);
    let z = wheel.lower(0.15, 0.05).expect("below the wheel");
    assert!((z - 0.8).abs() < 1e-12);
    let origin = wheel.patch_origin([0.0, 0.0, 1.0]);
    assert!((origin[2] - 0.75).abs() < 1e-12 && origin[0].abs() < 1e-12 && origin[1].abs() < 1e-9);
    assert!((wheel.half_width([0.0, 1.0, 0.0]) - 0.1).abs() < 1e-12);
}

#[test]
fn reference_point_of_a_plate_moves_smoothly_to_its_edge() {
    let geometry = Geometry::Box { half_extents: [0.15, 0.15, 0.01] };
    let mut before = 0.0;
    for k in 0..=200 {
        let tilt = f64::from(k) * 2e-4;
        let (s, c) = ((0.5 * tilt).sin(), (0.5 * tilt).cos());
        let pose = Pose { position: [0.0; 3], orientation: [c, 0.0, s, 0.0] };
        let plate = Placed::new(&geometry, &pose);
        let origin = plate.patch_origin([0.0, 0.0, 1.0]);
        assert!((origin[2] - plate.aabb().min[2]).abs() < 1e-12);
        assert!((origin[0] - before).abs() < 0.003, "jump at tilt {tilt}");
        before = origin[0];
    }
    assert!(before > 0.145);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn the_slope_is_the_derivative_of_the_underside(
        q in prop::array::uniform4(-1.0..1.0f64).prop_filter("length", |q| q.iter().map(|c| c * c).sum::<f64>() > 0.01),
        at in prop::array::uniform2(-0.08..0.08f64),
    ) {
        let pose = pose_from(q, [0.3, -0.2, 0.5]);
        let d = 1e-7;
        for geometry in &shapes() {
            let placed = Placed::new(geometry, &pose);
            let (x, y) = (0.3 + at[0], -0.2 + at[1]);
            let around = [placed.lower(x, y), placed.lower(x + d, y), placed.lower(x - d, y),
                          placed.lower(x, y + d), placed.lower(x, y - d)];
            let [Some(z), Some(e), Some(w), Some(n), Some(s)] = around else { continue };
            // an edge within reach has no derivative, a wall more than is reported
            let bend = (e - 2.0 * z + w).abs().max((n - 2.0 * z + s).abs());
            let numeric = [(e - w) / (2.0 * d), (n - s) / (2.0 * d)];
            if bend > 1e-10 || numeric[0].hypot(numeric[1]) > 2.9 { continue }
            let slope = placed.underside_slope([x, y, z]);
            for k in 0..2 {
                prop_assert!((slope[k] - numeric[k]).abs() < 1e-4, "{geometry:?} {slope:?} {numeric:?}");
            }
        }
    }
}

/// A vertical line that just grazes the widest circle of a rolling wheel: the rounded ends of an interval without length
/// must not lie below the wheel.
#[test]
fn lines_that_graze_a_wheel_do_not_enter_it_below_its_lowest_point() {
    let (radius, half_length) = (0.092, 0.0535);
    let wheel = Geometry::Cylinder { half_length, radius };
    let mut grazed = 0;
    for k in 0..20_000 {
        let turn = 0.5 * (1e-3 * f64::from(k) + std::f64::consts::FRAC_PI_2);
        let (s, c) =
            (libm::sin(0.5 * std::f64::consts::FRAC_PI_2), libm::cos(0.5 * std::f64::consts::FRAC_PI_2));
        // lying along y, then turned about y
        let orientation =
            [c * libm::cos(turn), s * libm::cos(turn), c * libm::sin(turn), -s * libm::sin(turn)];
        let position = [-0.5 + 1e-5 * f64::from(k), 0.0013, 0.0717];
        let placed = Placed::new(&wheel, &Pose { position, orientation });
        for x in [position[0] + radius, position[0] - radius] {
            for y in [-0.05, 0.0, 0.02, 0.05] {
                if let Some(z) = placed.lower(x, y) {
                    grazed += 1;
                    assert!(z >= placed.aabb().min[2] - 1e-9, "{k} {x} {y}: {z}");
                }
            }
        }
    }
    assert!(grazed > 1000, "{grazed}");
}

#[test]
fn slopes_of_cones_and_ellipsoids_are_those_of_their_undersides() {
    let tilt = pose_from([0.9, 0.2, -0.3, 0.1], [0.0, 0.0, 0.5]);
    for geometry in &shapes()[5..] {
        let placed = Placed::new(geometry, &tilt);
        let mut compared = 0;
        for (a, b) in
            (-10..=10).flat_map(|a| (-10..=10).map(move |b| (f64::from(a) * 5e-3, f64::from(b) * 5e-3)))
        {
            let at = |dx: f64, dy: f64| placed.lower(a + dx, b + dy);
            let d = 1e-6;
            let (Some(z), Some(e), Some(w)) = (at(0.0, 0.0), at(d, 0.0), at(-d, 0.0)) else { continue };
            let (Some(n), Some(s)) = (at(0.0, d), at(0.0, -d)) else { continue };
            // an edge between: the two sides differ
            let bent = |p: f64, m: f64| (p + m - 2.0 * z).abs() > 1e-8;
            let slope = [(e - w) / (2.0 * d), (n - s) / (2.0 * d)];
            if bent(e, w) || bent(n, s) || slope[0].hypot(slope[1]) > 2.5 {
                continue;
            }
            let told = placed.underside_slope([a, b, z]);
            assert!(
                (0..2).all(|k| (told[k] - slope[k]).abs() < 1e-4),
                "{geometry:?} {a} {b}: {told:?} {slope:?}"
            );
            compared += 1;
        }
        assert!(compared > 40, "{geometry:?}: {compared}");
    }
}
