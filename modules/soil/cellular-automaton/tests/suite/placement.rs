//! A level foot carries the same load wherever it stands on the lattice and however it is turned about the vertical.

use crate::feet;
use crate::support;

use feet::{Feet, instance};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use std::sync::Arc;
use support::{LETE, LUNAR, Shaped, flat};
use terraglue_soil_cellular_automaton::SoilCellularAutomaton;
use terraglue_subsystem::{Geometry, Pose, Standalone};

/// Force (N) on a box that is pressed to a depth of 10 mm at a place and angle.
fn force(config: &str, half_extents: [f64; 3], place: [f64; 2], yaw: f64, spacing: f64) -> f64 {
    let terrain = Shaped { size: [(0.4 / spacing) as u32 + 1; 2], spacing, height: flat };
    let host = Arc::new(Standalone {
        gravity: [0.0, 0.0, -9.81],
        terrain: Some(Box::new(terrain)),
        folder: String::new(),
    });
    let mut fixture = Feet::new(instance::<SoilCellularAutomaton>(config, host));
    let orientation = [libm::cos(0.5 * yaw), 0.0, 0.0, libm::sin(0.5 * yaw)];
    let mut pose = Pose { position: [place[0], place[1], half_extents[2]], orientation };
    fixture.add(&Geometry::Box { half_extents }, pose);
    for _ in 0..20 {
        pose.position[2] -= 5e-4;
        fixture.step(|_| pose);
    }
    fixture.force(0)[2]
}

proptest! {
    #![proptest_config(ProptestConfig {
        rng_seed: RngSeed::Fixed(7), failure_persistence: None, ..ProptestConfig::with_cases(96)
    })]

    /// Down to a blade as broad as a cell. (The size b of a blade was taken from how many rows of nodes it happened to cover:
    /// half a cell aside it sank a third deeper.)
    #[test]
    fn a_level_foot_bears_the_same_wherever_it_stands(
        breadth in 1.0..4.0f64, length in 4.0..12.0f64, x in 0.0..1.0f64, y in 0.0..1.0f64, yaw in 0.0..1.6f64, lunar in any::<bool>(),
    ) {
        // walls that stand: heaps that slide are no matter of the contact
        let standing = LETE.replacen(r#""wall_cohesion_pa":0"#, r#""wall_cohesion_pa":1300"#, 1);
        let (config, spacing) = (if lunar { LUNAR } else { &standing }, 0.01);
        let half = [0.5 * breadth * spacing, 0.5 * length * spacing, 0.03];
        let level = force(config, half, [0.0; 2], 0.0, spacing);
        let aside = force(config, half, [x * spacing, y * spacing], 0.0, spacing);
        let turned = force(config, half, [x * spacing, y * spacing], yaw, spacing);
        prop_assert!((aside / level - 1.0).abs() <= 0.02, "{breadth} x {length}: {level} N, {aside} N aside");
        prop_assert!((turned / level - 1.0).abs() <= 0.02, "{breadth} x {length}: {level} N, {turned} N turned");
    }
}
