//! The book of energies of random bodies at random angles that are pressed, dragged, turned about any axis and lifted: heat
//! and stored energy are the work at the ports, and heat never falls.
#![allow(clippy::unwrap_used)]

mod feet;
#[path = "../../../interfaces/soil-contact/tests/support/mod.rs"]
mod support;

use feet::{Dice, Feet, H, instance, shape};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use std::sync::Arc;
use support::{DRY_SAND, LETE, LUNAR, Shaped, flat};
use terraglue_ground::{Placed, compose};
use terraglue_soil_cellular_automaton::SoilCellularAutomaton;
use terraglue_subsystem::{Energy, Host, Pose, Standalone, Subsystem};

const SNOW: &str = r#"{"n":1.6,"k_c":2490,"k_phi":245900,"c_pa":620,"phi_rad":0.404916386463,"K_m":0.03,
    "density_kg_m3":300,"elastic_stiffness_pa_m":2.2e6}"#;

fn ground(spacing: f64) -> Arc<dyn Host> {
    let terrain = Shaped { size: [(0.6 / spacing) as u32 + 1; 2], spacing, height: flat };
    Arc::new(Standalone {
        gravity: [0.0, 0.0, -9.81],
        terrain: Some(Box::new(terrain)),
        folder: String::new(),
    })
}

/// q after a small turn by the rotation vector `w` (rad).
fn turned(w: [f64; 3], q: [f64; 4]) -> [f64; 4] {
    let angle = w.iter().map(|c| c * c).sum::<f64>().sqrt();
    let share = if angle > 0.0 { libm::sin(0.5 * angle) / angle } else { 0.0 };
    let [x, y, z] = w.map(|c| c * share);
    let of = |orientation| Pose { position: [0.0; 3], orientation };
    compose(&of([libm::cos(0.5 * angle), x, y, z]), &of(q)).orientation
}

/// How far the lowest point of a body lies below its middle, m.
fn low(kind: u32, orientation: [f64; 4]) -> f64 {
    let body = Placed::new(&shape(kind), &Pose { position: [0.0; 3], orientation });
    -body.patch_origin([0.0, 0.0, 1.0])[2].min(0.0)
}

/// Presses, drags, turns and lifts a body. Returns by how much the book errs at worst beyond `share` of the work to and fro, J.
fn go(seed: u64, kind: u32, row: usize, grid: usize, share: f64) -> Result<f64, TestCaseError> {
    let spacing = [0.02, 0.01, 0.005][grid];
    let config = [LUNAR, LETE, DRY_SAND, SNOW][row];
    let mut rig = Feet::new(instance::<SoilCellularAutomaton>(config, ground(spacing)));
    let mut dice = Dice(seed);
    (0..8).for_each(|_| {
        dice.roll(0.0, 1.0);
    });
    let orientation = dice.turn();
    let position = [dice.roll(-0.05, 0.05), dice.roll(-0.05, 0.05), low(kind, orientation)];
    let mut pose = Pose { position, orientation };
    rig.add(&shape(kind), pose);
    let mut before = rig.soil.energy();
    let (mut path, mut worst) = (0.0, 0.0_f64);
    for phase in 0..6 {
        let speed: [f64; 3] = match phase {
            0 => [0.0, 0.0, -dice.roll(0.05, 0.2)],
            5 => [0.0, 0.0, 0.4],
            _ => [dice.roll(-0.3, 0.3), dice.roll(-0.3, 0.3), dice.roll(-0.02, 0.02)],
        };
        let rate: [f64; 3] =
            if phase % 5 == 0 { [0.0; 3] } else { std::array::from_fn(|_| dice.roll(-4.0, 4.0)) };
        for _ in 0..80 {
            for (p, v) in pose.position.iter_mut().zip(speed) {
                *p += H * v;
            }
            pose.orientation = turned(rate.map(|w| H * w), pose.orientation);
            rig.step(|_| pose);
            let now = rig.soil.energy();
            let Energy { potential, dissipated, port_work, .. } = now;
            path += (port_work - before.port_work).abs();
            prop_assert!(dissipated >= before.dissipated, "heat falls to {dissipated} J");
            worst = worst.max((dissipated + potential - port_work).abs() - share * path);
            before = now;
        }
    }
    Ok(worst)
}

/// The same bodies in every run.
fn cases(cases: u32) -> ProptestConfig {
    ProptestConfig {
        rng_seed: RngSeed::Fixed(20),
        failure_persistence: None,
        ..ProptestConfig::with_cases(cases)
    }
}

proptest! {
    #![proptest_config(cases(96))]

    #[test]
    fn heat_and_stored_energy_are_the_work_at_the_ports(
        seed in 1..u64::MAX, kind in 0..4u32, row in 0..4usize, grid in 0..3usize,
    ) {
        let error = go(seed, kind, row, grid, 0.01)?;
        // beside it what a node holds that an edge turns onto, until the next steps have paid for it
        prop_assert!(error <= 1e-3, "{error:e} J beyond 1 % of the work");
    }

    /// A sharp corner of a wedge that is turned in the soil at a speed of its own loads whole nodes at once, more than the
    /// work of the next steps pays for.
    #[test]
    fn a_corner_owes_no_more_than_its_nodes_hold(
        seed in 1..u64::MAX, row in 0..4usize, grid in 0..3usize,
    ) {
        let error = go(seed, 4, row, grid, 0.03)?;
        prop_assert!(error <= 3e-2, "{error:e} J beyond 3 % of the work");
    }
}

/// A box with a side that looks just past a node on both sides of it: the sides of a contact act where the contact is.
#[test]
fn a_contact_that_hardly_covers_its_neighbours_is_not_thrown_sideways() {
    let error = go(629_968_910_466_154_312, 1, 2, 1, 0.01).unwrap();
    assert!(error <= 1e-9, "{error:e} J");
}
