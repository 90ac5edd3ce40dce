//! Prints of feet: where cohesion holds their walls, the material that the foot has pressed out stays where it came to rest; in
//! dry sand all slides down to the angle of repose.

use crate::feet;
use crate::support;

use feet::{Feet, instance, shape, steepest};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use std::sync::Arc;
use support::{DRY_SAND, LETE, LUNAR, Shaped, flat};
use terraglue_ground::Placed;
use terraglue_soil_cellular_automaton::SoilCellularAutomaton;
use terraglue_subsystem::{Host, Pose, Standalone};

fn ground(spacing: f64) -> Arc<dyn Host> {
    let terrain = Shaped { size: [(0.4 / spacing) as u32 + 1; 2], spacing, height: flat };
    Arc::new(Standalone {
        gravity: [0.0, 0.0, -9.81],
        terrain: Some(Box::new(terrain)),
        folder: String::new(),
    })
}

/// A body pressed down by `depth` (m), turned about the vertical by `yaw` (rad), that stands until nothing moves any more.
fn stands(config: &str, kind: u32, spacing: f64, depth: f64, yaw: f64) -> Feet {
    let mut fixture = Feet::new(instance::<SoilCellularAutomaton>(config, ground(spacing)));
    let (s, c) = (libm::sin(0.5 * yaw), libm::cos(0.5 * yaw));
    let at = |z: f64| Pose { position: [0.0013, -0.0007, z], orientation: [c, 0.0, 0.0, s] };
    let low = -Placed::new(&shape(kind), &at(0.0)).aabb().min[2];
    fixture.add(&shape(kind), at(low));
    let steps = (depth / 2e-4).round() as u32;
    (1..=steps).for_each(|k| fixture.step(|_| at(low - 2e-4 * f64::from(k))));
    let rests = (0..20_000).any(|_| {
        fixture.step(|_| at(low - depth));
        fixture.soil.material().active_nodes() == 0
    });
    assert!(rests, "{} nodes are active", fixture.soil.material().active_nodes());
    fixture
}

/// Heights of all nodes, units.
fn heights(fixture: &Feet) -> Vec<i32> {
    let heights = &fixture.soil.ground().heights;
    let [nx, ny] = heights.lattice().size.map(|n| n as i32);
    (0..ny).flat_map(|j| (0..nx).map(move |i| heights.units(i, j))).collect()
}

proptest! {
    #![proptest_config(ProptestConfig {
        rng_seed: RngSeed::Fixed(20),
        failure_persistence: None,
        ..ProptestConfig::with_cases(24)
    })]

    /// H_c' of this soil is 4.9 cm: no unit of the heaps around a foot slides into its print.
    #[test]
    fn what_came_to_rest_around_a_foot_stays_when_it_is_lifted(
        kind in 0..4u32, grid in 0..3usize, depth in 0.005..0.025f64, yaw in 0.0..1.5f64,
    ) {
        let mut fixture = stands(LUNAR, kind, [0.02, 0.01, 0.005][grid], depth, yaw);
        let before = heights(&fixture);
        fixture.lift_and_rest(20_000);
        let moved = before.iter().zip(heights(&fixture)).map(|(a, b)| (a - b).abs());
        prop_assert_eq!(moved.max(), Some(0));
    }

    #[test]
    fn a_print_in_dry_sand_slides_to_the_angle_of_repose(
        kind in 0..4u32, grid in 0..2usize, depth in 0.005..0.025f64, yaw in 0.0..1.5f64, lete in any::<bool>(),
    ) {
        let (config, phi) = if lete { (LETE, 31.1) } else { (DRY_SAND, 28.0) };
        let mut fixture = stands(config, kind, [0.02, 0.01][grid], depth, yaw);
        fixture.lift_and_rest(60_000);
        let steep = steepest(&fixture.soil).atan().to_degrees();
        prop_assert!(steep <= phi + 0.5, "{steep}° instead of {phi}°");
    }
}

/// The walls of a print in lunar soil stand; they were 55° steep where half of the heap slid back.
#[test]
fn walls_of_lunar_prints_are_steep() {
    for spacing in [0.01, 0.005] {
        let mut fixture = stands(LUNAR, 3, spacing, 0.03, 0.0);
        fixture.lift_and_rest(20_000);
        let steep = steepest(&fixture.soil).atan().to_degrees();
        assert!(steep > 60.0, "{steep}° on a grid of {spacing} m");
    }
}

/// Soil that a foot presses out has no cohesion as long as it moves: it slides away from the foot and does not stand
/// around it as a wall as thin as a cell.
#[test]
fn the_heap_around_a_foot_is_no_wall() {
    for spacing in [0.01, 0.005] {
        let fixture = stands(LUNAR, 1, spacing, 0.02, 0.0);
        let highest = heights(&fixture).into_iter().max().unwrap();
        let highest = f64::from(highest) * terraglue_ground::UNIT_M;
        assert!((0.002..0.0167).contains(&highest), "{highest} m on a grid of {spacing} m");
    }
}
