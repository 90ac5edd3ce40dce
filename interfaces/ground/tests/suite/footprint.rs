//! Nodes of a contact patch: covered areas, depths, and the plane below it.

use proptest::prelude::*;
use terraglue_ground::{
    HeightField, Lattice, Placed, PlaneFit, Surface, UNIT_M, disc_in_rectangle, fit_plane, nodes_below,
};
use terraglue_subsystem::{Geometry, Node, Pose};

fn flat() -> HeightField {
    let lattice = Lattice { origin: [-1.0, -1.0], spacing: 0.01, size: [201, 201] };
    HeightField::flat(lattice, 0.0).expect("in range")
}

fn nodes(geometry: &Geometry, pose: &Pose, margin: f64) -> Vec<Node> {
    let mut out = Vec::new();
    nodes_below(&Placed::new(geometry, pose), &flat(), margin, &mut out);
    out
}

fn at(x: f64, y: f64, z: f64) -> Pose {
    Pose { position: [x, y, z], ..Pose::IDENTITY }
}

fn area(nodes: &[Node]) -> f64 {
    nodes.iter().map(|n| n.area).sum()
}

#[test]
fn areas_of_standing_shapes_are_exact_wherever_they_stand() {
    let disc = Geometry::Cylinder { half_length: 0.05, radius: 0.083 };
    let plate = Geometry::Box { half_extents: [0.051, 0.033, 0.01] };
    for k in 0..20 {
        let (x, y, turn) = (0.0013 * f64::from(k), -0.0027 * f64::from(k), 0.05 * f64::from(k));
        let covered = area(&nodes(&disc, &at(x, y, 0.04), 0.0));
        assert!((covered / (std::f64::consts::PI * 0.083 * 0.083) - 1.0).abs() < 1e-9, "{covered}");
        let turned = Pose { orientation: [turn.cos(), 0.0, 0.0, turn.sin()], ..at(x, y, 0.005) };
        let covered = area(&nodes(&plate, &turned, 0.0));
        assert!((covered / (4.0 * 0.051 * 0.033) - 1.0).abs() < 1e-9, "{covered}");
    }
}

/// Nodes as (i, j) from the middle of the lattice after so many turns by 90° back, sorted, with area and underside.
fn turned_back(found: &[Node], turns: i32) -> Vec<([i32; 2], [f64; 2])> {
    let back = |mut p: [i32; 2]| {
        (0..turns).for_each(|_| p = [p[1], -p[0]]);
        p
    };
    let mut all: Vec<_> = found.iter().map(|n| (back([n.i - 100, n.j - 100]), [n.area, n.lower])).collect();
    all.sort_by_key(|(at, _)| *at);
    all
}

fn product(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
    [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ]
}

/// A hexagonal prism, lying on a side.
fn prism() -> Geometry {
    let corner = |k: usize| {
        let angle = std::f64::consts::FRAC_PI_3 * (k % 6) as f64;
        [0.06 * angle.cos(), 0.06 * angle.sin(), if k < 6 { -0.05 } else { 0.05 }]
    };
    let mut triangles = Vec::new();
    for k in 1..5 {
        triangles.extend([[0, k + 1, k], [6, k + 6, k + 7]]);
    }
    for k in 0..6 {
        let next = (k + 1) % 6;
        triangles.extend([[k, next, k + 6], [next, next + 6, k + 6]]);
    }
    let triangles = triangles.into_iter().map(|t| t.map(|c: usize| c as u32)).collect();
    Geometry::ConvexMesh { points: (0..12).map(corner).collect(), triangles }
}

/// A ball of 572 triangles, as meshes of feet come from robot files.
fn faceted_ball() -> Geometry {
    const ROUND: usize = 26;
    const RINGS: usize = 11;
    let ring = |k: usize| std::f64::consts::PI * (k + 1) as f64 / (RINGS + 1) as f64;
    let mut points = vec![[0.0, 0.0, BALL], [0.0, 0.0, -BALL]];
    for (k, j) in (0..RINGS).flat_map(|k| (0..ROUND).map(move |j| (k, j))) {
        let (s, c) = (std::f64::consts::TAU * j as f64 / ROUND as f64).sin_cos();
        points.push([BALL * ring(k).sin() * c, BALL * ring(k).sin() * s, BALL * ring(k).cos()]);
    }
    let at = |k: usize, j: usize| 2 + k * ROUND + j % ROUND;
    let mut triangles = Vec::new();
    for j in 0..ROUND {
        triangles.extend([[0, at(0, j), at(0, j + 1)], [1, at(RINGS - 1, j + 1), at(RINGS - 1, j)]]);
        for k in 0..RINGS - 1 {
            triangles.extend([
                [at(k, j), at(k + 1, j), at(k + 1, j + 1)],
                [at(k, j), at(k + 1, j + 1), at(k, j + 1)],
            ]);
        }
    }
    let triangles = triangles.into_iter().map(|t| t.map(|c| c as u32)).collect();
    Geometry::ConvexMesh { points, triangles }
}

/// Its radius, m.
const BALL: f64 = 0.04;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn a_mesh_of_many_faces_covers_what_a_ball_does_and_changes_smoothly(
        x in -0.02..0.02f64, y in -0.02..0.02f64, tilt in -3.0..3.0f64, turn in 0.0..3.0f64, way in 0.0..6.3f64,
    ) {
        let ((s, c), (sl, cl)) = ((0.5 * turn).sin_cos(), (0.5 * tilt).sin_cos());
        let orientation = product([c, 0.0, 0.0, s], [cl, sl, 0.0, 0.0]);
        let ball = faceted_ball();
        prop_assert!(Placed::new(&ball, &Pose::IDENTITY).is_convex());
        let below = |shift: f64| {
            let position = [x + shift * way.cos(), y + shift * way.sin(), 0.02];
            nodes(&ball, &Pose { position, orientation }, 0.0)
        };
        let here = below(0.0);
        // the circle in which the ball lies below the ground, at nodes that it reaches
        let covered: f64 = here.iter().map(|n| n.area).sum();
        let whole = std::f64::consts::PI * BALL * BALL;
        prop_assert!(covered < 1.001 * whole && covered > 0.6 * whole, "{} of {}", covered, whole);
        let shift = 1e-7;
        for (a, b) in here.iter().filter_map(|a| Some((a, *below(shift).iter().find(|b| (b.i, b.j) == (a.i, a.j))?))) {
            // an edge through a cell sweeps no more than its diagonal
            prop_assert!((a.area - b.area).abs() < 1.5 * shift * 0.01, "{:?} {:?}", a, b);
        }
    }

    #[test]
    fn the_slope_of_a_mesh_is_that_of_its_heights(u in -0.9..0.9f64, v in -0.9..0.9f64, tilt in -3.0..3.0f64) {
        let (sl, cl) = (0.5 * tilt).sin_cos();
        let pose = Pose { position: [0.3, -0.2, 0.1], orientation: [cl, sl, 0.0, 0.0] };
        let ball = Placed::new(&faceted_ball(), &pose);
        let (x, y) = (0.3 + 0.6 * BALL * u, -0.2 + 0.6 * BALL * v);
        let lower = |x, y| ball.lower(x, y).expect("below the ball");
        let step = 1e-7;
        let slope = ball.underside_slope([x, y, lower(x, y)]);
        let found = [lower(x + step, y) - lower(x - step, y), lower(x, y + step) - lower(x, y - step)];
        // within a face; across an edge the two lie between those of its faces
        let within = (lower(x + step, y) + lower(x - step, y) - 2.0 * lower(x, y)).abs()
            + (lower(x, y + step) + lower(x, y - step) - 2.0 * lower(x, y)).abs() < 1e-14;
        prop_assume!(within);
        for k in 0..2 {
            prop_assert!((slope[k] - found[k] / (2.0 * step)).abs() < 1e-6, "{:?} {:?}", slope, found);
        }
        // the facets stay inside the ball by a hundredth of its radius
        let round = 0.1 - (BALL * BALL - (x - 0.3) * (x - 0.3) - (y + 0.2) * (y + 0.2)).sqrt();
        prop_assert!(lower(x, y) >= round - 1e-12 && lower(x, y) < round + 0.05 * BALL);
    }

    #[test]
    fn a_shape_that_is_turned_with_the_lattice_covers_the_same_cells(
        x in -0.02..0.02f64, y in -0.02..0.02f64, tilt in -0.3..0.3f64, turn in 0.0..3.0f64, shape in 0..5usize,
    ) {
        let shapes = [
            Geometry::Cylinder { half_length: 0.0535, radius: 0.092 },
            Geometry::Capsule { half_length: 0.05, radius: 0.05 },
            Geometry::Box { half_extents: [0.06, 0.05, 0.07] },
            Geometry::Sphere { radius: 0.08 },
            prism(),
        ];
        // about the vertical, on its rim with a lean
        let (s, c) = (0.5 * turn).sin_cos();
        let (sl, cl) = (0.5 * (std::f64::consts::FRAC_PI_2 + tilt)).sin_cos();
        let lies = product([c, 0.0, 0.0, s], [cl, sl, 0.0, 0.0]);
        let pose = Pose { position: [x, y, 0.04], orientation: lies };
        let first = turned_back(&nodes(&shapes[shape], &pose, 0.0), 0);
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let (mut p, mut q) = ([x, y], lies);
        for turns in 1..4 {
            (p, q) = ([-p[1], p[0]], product([half, 0.0, 0.0, half], q));
            let pose = Pose { position: [p[0], p[1], 0.04], orientation: q };
            let same = turned_back(&nodes(&shapes[shape], &pose, 0.0), turns);
            prop_assert_eq!(first.len(), same.len());
            for (a, b) in first.iter().zip(&same) {
                prop_assert_eq!(a.0, b.0);
                for k in 0..2 {
                    prop_assert!((a.1[k] - b.1[k]).abs() < 1e-9, "{:?} {:?}", a, b);
                }
            }
        }
    }

    #[test]
    fn lying_cylinders_and_capsules_cover_their_area(
        x in -0.02..0.02f64, y in -0.02..0.02f64, tilt in -0.4..0.4f64, turn in 0.0..3.0f64, flat: bool,
    ) {
        let (half_length, radius) = (0.0535, 0.092);
        let shape = if flat { Geometry::Cylinder { half_length, radius } } else { Geometry::Capsule { half_length, radius } };
        let (s, c) = (0.5 * turn).sin_cos();
        let (sl, cl) = (0.5 * (std::f64::consts::FRAC_PI_2 + tilt)).sin_cos();
        let pose = Pose { position: [x, y, 0.0], orientation: product([c, 0.0, 0.0, s], [cl, sl, 0.0, 0.0]) };
        let covered = area(&nodes(&shape, &pose, 1.0));
        let ends = std::f64::consts::PI * radius * radius * if flat { tilt.sin().abs() } else { 1.0 };
        let exact = ends + 4.0 * half_length * tilt.cos() * radius;
        // a cell below the true outline counts as whole where the polygon cuts it
        prop_assert!((covered / exact - 1.0).abs() < 4e-3, "{} {}", covered, exact);
    }
}

#[test]
fn area_of_a_slightly_tilted_cylinder_is_within_one_percent() {
    let disc = Geometry::Cylinder { half_length: 0.05, radius: 0.083 };
    let tilted = Pose { orientation: [1.0, 1e-4, 0.0, 0.0], ..at(0.003, 0.001, 0.04) };
    let covered = area(&nodes(&disc, &tilted, 0.0));
    assert!((covered / (std::f64::consts::PI * 0.083 * 0.083) - 1.0).abs() < 0.01, "{covered}");
}

#[test]
fn disc_area_splits_over_cells_without_remainder() {
    let (centre, radius) = ([0.013, -0.002], 0.0314);
    let total: f64 = (-10..10)
        .flat_map(|j| (-10..10).map(move |i| [f64::from(i) * 0.01, f64::from(j) * 0.01]))
        .map(|low| disc_in_rectangle(centre, radius, low, [low[0] + 0.01, low[1] + 0.01]))
        .sum();
    assert!((total - std::f64::consts::PI * radius * radius).abs() < 1e-15);
    let quarter = disc_in_rectangle([0.0; 2], 1.0, [0.0; 2], [2.0; 2]);
    assert!((quarter - std::f64::consts::FRAC_PI_4).abs() < 1e-15);
}

#[test]
fn a_sphere_lists_the_nodes_of_its_contact_circle_and_those_next_to_them() {
    let sphere = Geometry::Sphere { radius: 0.03 };
    let found = nodes(&sphere, &at(0.002, 0.001, 0.027), 0.0);
    // Contact circle of 3 mm depth: √(0.03² − 0.027²) = 13 mm.
    let touching = |n: &Node| n.lower < 0.0;
    for n in &found {
        let p = flat().lattice().position(n.i, n.j);
        let d2 = (p[0] - 0.002).powi(2) + (p[1] - 0.001).powi(2);
        assert!((n.lower - (0.027 - (0.0009 - d2).sqrt())).abs() < 1e-12);
        assert_eq!(touching(n), d2 < 0.0009 - 0.027 * 0.027);
        assert!(!touching(n) || (n.area - 1e-4).abs() < 1e-15, "inner cells are covered");
        let next = |other: &Node| touching(other) && (other.i - n.i).abs() <= 1 && (other.j - n.j).abs() <= 1;
        assert!(found.iter().any(next));
    }
    // The centre, its four neighbours and the node at (10, 10) mm, 12.04 mm away.
    assert_eq!(found.iter().filter(|n| touching(n)).count(), 6);
    assert!(nodes(&sphere, &at(0.0, 0.0, 0.031), 0.0).is_empty());
    assert!(!nodes(&sphere, &at(0.0, 0.0, 0.031), 0.002).is_empty());
}

#[test]
fn a_cell_that_is_covered_beside_its_node_gets_the_nearest_underside() {
    // A plate whose edge ends 3 mm beyond a cell's border and 2 mm short of its node.
    let plate = Geometry::Box { half_extents: [0.023, 0.02, 0.01] };
    let found = nodes(&plate, &at(0.005, 0.0, 0.0), 0.0);
    let edge = found.iter().find(|n| n.i == 103 && n.j == 100).expect("covered in part");
    assert!((edge.area - 0.003 * 0.01).abs() < 1e-12, "{}", edge.area);
    assert!((edge.lower + 0.01).abs() < 1e-9);
}

#[test]
fn plane_fit_is_exact_on_a_slope_and_level_outside() {
    struct Slope(Lattice);
    impl Surface for Slope {
        fn lattice(&self) -> &Lattice {
            &self.0
        }
        fn height(&self, i: i32, j: i32) -> f64 {
            let (i, j) = self.0.clamp(i, j);
            let [x, y] = self.0.position(i as i32, j as i32);
            100.0 + 0.3 * x - 0.1 * y
        }
    }
    let slope = Slope(*flat().lattice());
    for (x, y, radius) in [(0.0, 0.0, 0.0), (0.2137, -0.4, 0.03), (-0.99, 0.995, 0.05), (0.1, 0.3, 0.4)] {
        let plane = fit_plane(&slope, x, y, radius);
        let length = (1.0f64 + 0.09 + 0.01).sqrt();
        assert!((plane.height - (100.0 + 0.3 * x - 0.1 * y)).abs() < 1e-9);
        assert!((plane.normal[0] + 0.3 / length).abs() < 1e-9);
        assert!((plane.normal[1] - 0.1 / length).abs() < 1e-9);
    }
    assert_eq!(fit_plane(&slope, 5.0, 5.0, 0.1).normal, [0.0, 0.0, 1.0]);
}

#[test]
fn a_rim_beside_its_nodes_moves_with_the_shape_and_not_by_rounding() {
    for geometry in [Geometry::Sphere { radius: 0.03 }, Geometry::Capsule { half_length: 0.02, radius: 0.03 }]
    {
        let here = nodes(&geometry, &at(0.0, 0.0, 0.003), 0.1);
        for k in 1..200 {
            // far less than a force that matters, far more than rounding
            let shifted = nodes(&geometry, &at(1e-17 * f64::from(k), 0.0, 0.003), 0.1);
            assert_eq!(here.len(), shifted.len());
            let outside = |n: &&Node| {
                let [x, y] = flat().lattice().position(n.i, n.j);
                x.hypot(y) > 0.0301
            };
            for (a, b) in here.iter().zip(&shifted).filter(|(a, _)| outside(a)) {
                assert!((a.lower - b.lower).abs() < 1e-15, "{a:?} {b:?}");
            }
        }
    }
}

#[test]
fn fits_that_share_what_was_read_are_those_that_read_anew() {
    let mut ground = flat();
    let waves = |i: i32, j: i32| 0.003 * (f64::from(i) * 0.7).sin() + 0.002 * (f64::from(j) * 0.4).cos();
    for (i, j) in (40..160).flat_map(|i| (40..160).map(move |j| (i, j))) {
        ground.set_units(i, j, (waves(i, j) / UNIT_M) as i32);
    }
    for radius in [0.0, 0.03, 0.2] {
        let mut fit = PlaneFit::new(&ground, radius);
        for k in 0..300 {
            let (x, y) = (-0.3 + 1.7e-3 * f64::from(k), 0.2 - 0.9e-3 * f64::from(k));
            assert_eq!(fit.at(x, y), fit_plane(&ground, x, y, radius));
        }
    }
}
