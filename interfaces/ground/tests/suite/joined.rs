//! Meshes that are not convex and shapes that are one piece: undersides and nodes against those of the boxes they are made of.

use proptest::prelude::*;
use terraglue_ground::{Aabb, HeightField, Lattice, Part, Placed, compose, nodes_below, nodes_below_parts};
use terraglue_subsystem::{Geometry, Node, Pose};

/// Half length, half of the gap between the legs, height of the gap and of the whole, half width, m.
const OUTER: f64 = 0.09;
const INNER: f64 = 0.052;
const GAP: f64 = 0.04;
const TOP: f64 = 0.07;
const WIDTH: f64 = 0.033;

fn flat() -> HeightField {
    let lattice = Lattice { origin: [-0.5, -0.5], spacing: 0.01, size: [101, 101] };
    HeightField::flat(lattice, 0.0).expect("in range")
}

/// Two legs and a bridge, legs down, standing on z = 0: a closed mesh.
fn bridge() -> Geometry {
    let outline = [
        [-OUTER, 0.0],
        [-INNER, 0.0],
        [-INNER, GAP],
        [INNER, GAP],
        [INNER, 0.0],
        [OUTER, 0.0],
        [OUTER, TOP],
        [-OUTER, TOP],
    ];
    let points = [-WIDTH, WIDTH].iter().flat_map(|y| outline.map(|[x, z]| [x, *y, z])).collect();
    let lid = [[0, 1, 2], [0, 2, 7], [2, 3, 7], [3, 6, 7], [3, 4, 5], [3, 5, 6_u32]];
    let mut triangles: Vec<[u32; 3]> = lid.to_vec();
    triangles.extend(lid.map(|[a, b, c]| [a + 8, c + 8, b + 8]));
    triangles.extend((0..8).flat_map(|k| {
        let n = (k + 1) % 8;
        [[k, n + 8, n], [k, k + 8, n + 8]]
    }));
    Geometry::ConvexMesh { points, triangles }
}

/// The same of three boxes, each at its place.
fn boxes() -> [(Geometry, Pose); 3] {
    let part = |x: [f64; 2], z: [f64; 2]| {
        let half_extents = [0.5 * (x[1] - x[0]), WIDTH, 0.5 * (z[1] - z[0])];
        let position = [0.5 * (x[0] + x[1]), 0.0, 0.5 * (z[0] + z[1])];
        (Geometry::Box { half_extents }, Pose { position, ..Pose::IDENTITY })
    };
    [part([-OUTER, -INNER], [0.0, TOP]), part([INNER, OUTER], [0.0, TOP]), part([-OUTER, OUTER], [GAP, TOP])]
}

fn placed(pose: &Pose) -> (Placed, Vec<(Placed, Aabb)>) {
    let of = |(geometry, local): &(Geometry, Pose)| {
        let placed = Placed::new(geometry, &compose(pose, local));
        let bounds = placed.aabb();
        (placed, bounds)
    };
    (Placed::new(&bridge(), pose), boxes().iter().map(of).collect())
}

fn parts(all: &[(Placed, Aabb)]) -> impl Iterator<Item = Part<'_>> + Clone {
    all.iter().map(|(placed, bounds)| Part { placed, bounds })
}

fn both(pose: &Pose, margin: f64) -> [Vec<Node>; 2] {
    let (mesh, all) = placed(pose);
    let (mut of_mesh, mut of_parts) = (Vec::new(), Vec::new());
    nodes_below(&mesh, &flat(), margin, &mut of_mesh);
    nodes_below_parts(parts(&all), &flat(), margin, |_, node| of_parts.push(node));
    [of_mesh, of_parts]
}

fn pose_from(q: [f64; 4], position: [f64; 3]) -> Pose {
    let norm = q.iter().map(|c| c * c).sum::<f64>().sqrt();
    Pose { position, orientation: q.map(|c| c / norm) }
}

fn standing(turn: f64, x: f64, z: f64) -> Pose {
    Pose { position: [x, 0.0013, z], orientation: [libm::cos(turn), 0.0, 0.0, libm::sin(turn)] }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]
    #[test]
    fn the_underside_of_a_mesh_is_that_of_its_boxes(
        q in prop::array::uniform4(-1.0..1.0f64).prop_filter("length", |q| q.iter().map(|c| c * c).sum::<f64>() > 0.01),
        at in prop::array::uniform2(-0.1..0.1f64),
    ) {
        let (mesh, all) = placed(&pose_from(q, [0.03, -0.02, 0.05]));
        prop_assert!(!mesh.is_convex());
        let hits = all.iter().filter_map(|(p, _)| p.lower(0.03 + at[0], -0.02 + at[1]));
        let expected = hits.min_by(f64::total_cmp);
        match (mesh.lower(0.03 + at[0], -0.02 + at[1]), expected) {
            (Some(a), Some(b)) => prop_assert!((a - b).abs() < 1e-9, "{a} {b}"),
            (a, b) => prop_assert_eq!(a, b),
        }
    }

    #[test]
    fn the_nodes_of_a_mesh_are_those_of_its_boxes(
        turn in 0.0..3.0f64, tilt in -0.5..0.5f64, x in -0.01..0.01f64, z in -0.06..0.0f64,
    ) {
        let pose = pose_from([libm::cos(turn), tilt * 0.3, tilt, libm::sin(turn)], [x, 0.0, z]);
        // All of it counts, however high it is.
        let [mesh, boxes] = both(&pose, 1.0);
        let known = |all: &[Node], n: &Node| all.iter().find(|m| (m.i, m.j) == (n.i, n.j)).copied();
        for (some, others) in [(&mesh, &boxes), (&boxes, &mesh)] {
            for n in some {
                // The closed form sees strips at the side of a cell that are narrower than half a sample.
                let Some(m) = known(others, n) else {
                    prop_assert!(n.area < 6.3e-6, "{n:?}");
                    continue;
                };
                prop_assert!((m.area - n.area).abs() < 0.12e-4, "{m:?} {n:?}");
                if n.area > 0.999e-4 && m.area > 0.999e-4 {
                    prop_assert!((m.lower - n.lower).abs() < 1e-9, "{m:?} {n:?}");
                }
            }
        }
        let sum = |all: &[Node]| all.iter().map(|n| n.area).sum::<f64>();
        prop_assert!((sum(&mesh) - sum(&boxes)).abs() < 0.02 * sum(&boxes) + 1e-5);
    }
}

#[test]
fn the_ground_between_the_legs_is_left_alone() {
    for turn in [0.0, 0.3, 0.8] {
        for nodes in both(&standing(turn, 0.0021, -0.02), 1e-3) {
            let (s, c) = (libm::sin(2.0 * turn), libm::cos(2.0 * turn));
            for n in &nodes {
                let [x, y] = flat().lattice().position(n.i, n.j);
                let along = ((x - 0.0021) * c + (y - 0.0013) * s).abs();
                assert!(along > INNER - 0.0072, "{n:?}");
                assert!((n.lower + 0.02).abs() < 1e-9 && n.slope == [0.0; 2], "{n:?}");
            }
            let area: f64 = nodes.iter().map(|n| n.area).sum();
            let exact = 2.0 * (OUTER - INNER) * 2.0 * WIDTH;
            assert!((area / exact - 1.0).abs() < 0.02, "{area} {exact}");
        }
    }
}

#[test]
fn a_bridge_that_is_pressed_in_up_to_its_arch_lies_on_all_of_it() {
    let [mesh, boxes] = both(&standing(0.0, 0.0021, -0.05), 1e-3);
    for nodes in [mesh, boxes] {
        let area: f64 = nodes.iter().map(|n| n.area).sum();
        assert!((area / (4.0 * OUTER * WIDTH) - 1.0).abs() < 0.02, "{area}");
        let levels = |z: f64| nodes.iter().filter(|n| (n.lower - z).abs() < 1e-9).count();
        assert!(levels(-0.05) > 40 && levels(GAP - 0.05) > 60);
        assert_eq!(levels(-0.05) + levels(GAP - 0.05), nodes.len());
    }
}

#[test]
fn an_open_mesh_has_the_underside_of_its_sheets() {
    // A gutter: two sheets that meet in a ridge along y.
    let points = [-1.0, 0.0, 1.0].iter().flat_map(|x| [-1.0, 1.0].map(|y| [*x, y, -f64::abs(*x)])).collect();
    let triangles = vec![[0, 2, 3], [0, 3, 1], [2, 4, 5], [2, 5, 3]];
    let gutter = Placed::new(&Geometry::ConvexMesh { points, triangles }, &Pose::IDENTITY);
    for (x, z) in [(-0.25, -0.25), (0.0, 0.0), (0.7, -0.7)] {
        let found = gutter.lower(x, 0.1).expect("below the sheet");
        assert!((found - z).abs() < 1e-12, "{x} {found}");
    }
    assert_eq!(gutter.underside_slope([0.5, 0.1, -0.5]), [-1.0, 0.0]);
    assert_eq!(gutter.lower(1.5, 0.0), None);
}
