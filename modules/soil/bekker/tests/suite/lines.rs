//! Contacts that are no broader than a few cells sink as deep wherever they lie, however they are turned, on every grid.

use crate::line_cases as lines;

use lines::{Body, ball, capsule, corner, edge, forces, pressed, told};
use terraglue_numerics::extremes::larger;
use terraglue_soil_bekker::SoilBekker as Soil;

/// Places on the lattice, in cells, with a heading each.
const PLACES: [(f64, [f64; 2]); 6] = [
    (0.0, [0.0; 2]),
    (0.0, [0.25, 0.0]),
    (0.0, [0.5, 0.5]),
    (0.3, [0.0, 0.4]),
    (0.785, [0.0; 2]),
    (0.785, [0.3, 0.1]),
];
const LOAD: f64 = 40.0;
const STEP: f64 = 5e-5;

/// Largest difference of the depths on a grid from the depth on one of 1.25 mm, over it.
fn off(body: &Body, spacing: f64) -> f64 {
    let place = |grid: f64, (yaw, at): (f64, [f64; 2])| {
        pressed::<Soil>(body, grid, LOAD, STEP, (yaw, at.map(|c| c * grid)))
    };
    let fine = place(0.00125, PLACES[0]);
    PLACES.iter().map(|at| (place(spacing, *at) / fine - 1.0).abs()).fold(0.0, larger)
}

/// (Each node saw the underside at one point: the edge sank 1.4 to 5.3 mm by grid, place and heading.)
#[test]
fn narrow_contacts_sink_alike_on_all_grids() {
    // an edge that touches 5 mm, half a cell or a whole one; a capsule that touches 10 mm; a corner 45 mm broad; a ball of 25 mm
    let cases: [(&str, Body, [f64; 2]); 4] = [
        ("edge", edge(), [0.15, 0.08]),
        ("capsule", capsule(), [0.05, 0.04]),
        ("corner", corner(), [0.09, 0.02]),
        ("ball", ball(), [0.03, 0.015]),
    ];
    for (name, body, limits) in cases {
        for (spacing, limit) in [0.01, 0.005].into_iter().zip(limits) {
            let found = off(&body, spacing);
            println!("{name} on {} mm: {:.1} %", 1e3 * spacing, 1e2 * found);
            assert!(found <= limit, "{name} on {spacing} m: {found}");
        }
    }
}

/// A wedge that is pressed straight down is not pushed aside, wherever its edge lies between the nodes.
#[test]
fn an_edge_is_not_thrown_sideways() {
    for at in [0.0, 0.2, 0.5, 0.7] {
        let [up, aside] = forces::<Soil>(&edge(), 0.01, 0.003, [at * 0.01, 0.0]);
        assert!(aside.abs() <= 0.2 * up, "{aside} N aside of {up} N at {at}");
    }
}

/// The deepest point of a round body lies between the nodes. (The deepest node gave up to 9 % less of a ball that was 1 cm deep.)
#[test]
fn the_depth_that_is_told_is_that_of_the_deepest_point() {
    for (body, limit) in [(ball(), 0.01), (capsule(), 0.01)] {
        for place in PLACES {
            let found = told::<Soil>(&body, 0.01, 0.01, (place.0, place.1.map(|c| 0.01 * c)));
            assert!((found / 0.01 - 1.0).abs() <= limit, "{found} m at {place:?}");
        }
    }
}
