//! The energy ledger of random bodies at random angles that are pressed, dragged, turned about any axis and lifted: heat
//! and stored energy are the work at the ports, and heat never falls.

use crate::feet;
use crate::support;

use feet::{Dice, Feet, H, instance, shape};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use std::sync::Arc;
use support::{DRY_SAND, LETE, LUNAR, Shaped, flat};
use terraglue_ground::{Placed, compose};
use terraglue_numerics::extremes::larger;
use terraglue_soil_cellular_automaton::SoilCellularAutomaton;
use terraglue_subsystem::{Energy, Geometry, Host, Pose, Standalone, Subsystem};

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

/// Distance of the lowest point of a body below its middle, m.
fn low(kind: u32, orientation: [f64; 4]) -> f64 {
    let body = Placed::new(&shape(kind), &Pose { position: [0.0; 3], orientation });
    -body.patch_origin([0.0, 0.0, 1.0])[2].min(0.0)
}

/// Presses, drags, turns and lifts a body. Returns by how much the ledger errs at worst beyond `share` of the work to and fro and
/// `held` of the energy in the soil at the moment, J.
fn go(seed: u64, kind: u32, row: usize, grid: usize, [share, held]: [f64; 2]) -> Result<f64, TestCaseError> {
    let spacing = [0.02, 0.01, 0.005][grid];
    let config = [LUNAR, LETE, DRY_SAND, SNOW][row];
    let mut fixture = Feet::new(instance::<SoilCellularAutomaton>(config, ground(spacing)));
    let mut dice = Dice(seed);
    (0..8).for_each(|_| {
        dice.roll(0.0, 1.0);
    });
    let orientation = dice.turn();
    let position = [dice.roll(-0.05, 0.05), dice.roll(-0.05, 0.05), low(kind, orientation)];
    let mut pose = Pose { position, orientation };
    fixture.add(&shape(kind), pose);
    let mut before = fixture.soil.energy();
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
            fixture.step(|_| pose);
            let now = fixture.soil.energy();
            let Energy { potential, dissipated, port_work, .. } = now;
            path += (port_work - before.port_work).abs();
            prop_assert!(dissipated >= before.dissipated, "heat falls to {dissipated} J");
            worst =
                larger(worst, (dissipated + potential - port_work).abs() - share * path - held * potential);
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
        let error = go(seed, kind, row, grid, [0.01, 0.0])?;
        // in addition the energy of a node that an edge turns onto, until the next steps have paid for it
        prop_assert!(error <= 1e-3, "{error:e} J beyond 1 % of the work");
    }

    /// A sharp corner of a wedge, or a blade as thin as a cell, that is turned in the soil at a speed of its own loads whole nodes at once: the ledger owes no
    /// more than they hold, and when they are let go it is even.
    #[test]
    fn a_corner_owes_no_more_than_its_nodes_hold(
        seed in 1..u64::MAX, kind in 4..7u32, row in 0..4usize, grid in 0..3usize,
    ) {
        let error = go(seed, kind, row, grid, [0.01, 1.0])?;
        prop_assert!(error <= 1e-4, "{error:e} J beyond 1 % of the work and what the soil holds");
    }
}

/// A box with a side that looks just past a node on both sides of it: the sides of a contact act where the contact is.
#[test]
fn a_contact_that_hardly_covers_its_neighbours_is_not_thrown_sideways() {
    let error = go(629_968_910_466_154_312, 1, 2, 1, [0.01, 0.0]).unwrap();
    assert!(error <= 1e-9, "{error:e} J");
}

/// A body at 10 mm below the surface that is dragged by 8 cm, in steps of so many mm: its mean force along the path and up, N.
fn dragged(kind: u32, step_mm: f64) -> [f64; 2] {
    let mut fixture = Feet::new(instance::<SoilCellularAutomaton>(LETE, ground(0.01)));
    let upright = [1.0, 0.0, 0.0, 0.0];
    let mut pose = Pose { position: [-0.03, 0.0013, low(kind, upright)], orientation: upright };
    fixture.add(&shape(kind), pose);
    let mut sums = [0.0; 2];
    let parts = (1.0 / step_mm).round() as u32;
    for _ in 0..10 * parts {
        pose.position[2] -= 1e-3 * step_mm;
        fixture.step(|_| pose);
    }
    for _ in 0..80 * parts {
        pose.position[0] += 1e-3 * step_mm;
        fixture.step(|_| pose);
        let force = fixture.force(0);
        sums[0] -= force[0] / f64::from(80 * parts);
        sums[1] += force[2] / f64::from(80 * parts);
    }
    sums
}

/// Side force over vertical force on a box that leans by 15° about its way and is dragged by 8 cm at the depth of 7 mm; it lies `aside`
/// (m) on the lattice.
fn side_force(spacing: f64, degrees: f64, aside: f64) -> f64 {
    let mut fixture = Feet::new(instance::<SoilCellularAutomaton>(LETE, ground(spacing)));
    let half = 0.5 * degrees.to_radians();
    let orientation = [libm::cos(half), libm::sin(half), 0.0, 0.0];
    let solid = Geometry::Box { half_extents: [0.04, 0.025, 0.02] };
    let lowest =
        -Placed::new(&solid, &Pose { position: [0.0; 3], orientation }).patch_origin([0.0, 0.0, 1.0])[2];
    let mut pose = Pose { position: [-0.05, aside, lowest], orientation };
    fixture.add(&solid, pose);
    for _ in 0..70 {
        pose.position[2] -= 1e-4;
        fixture.step(|_| pose);
    }
    let mut sums = [0.0; 2];
    for k in 0..800 {
        pose.position[0] += 1e-4;
        fixture.step(|_| pose);
        let force = fixture.force(0);
        if k >= 400 {
            sums = [sums[0] + force[1], sums[1] + force[2]];
        }
    }
    sums[0] / sums[1]
}

/// Its underside gives the side force, tan 15° of the load, in the mean over places on the lattice. (Its side, which is in the soil in a part of
/// a cell, carried up to one and a half times the load the other way: it took the bed for loose soil that slides along, and so knew
/// of no shear.)
#[test]
fn the_side_force_on_a_leaning_body_is_that_of_its_underside() {
    let wanted = libm::tan(15.0_f64.to_radians());
    let error = |spacing: f64| {
        let places = [0.0, 0.25, 0.5, 0.75].map(|part| part * spacing + 1e-4);
        let off = |aside: f64| {
            let [left, right] = [15.0, -15.0].map(|degrees| side_force(spacing, degrees, aside));
            0.5 * ((left + wanted).abs() + (right - wanted).abs())
        };
        0.25 * places.map(off).iter().sum::<f64>()
    };
    let [coarse, fine] = [0.01, 0.005].map(error);
    assert!(coarse <= 0.12 && fine <= 0.06, "{coarse}, {fine} of the load");
}

/// Soil that is pressed out comes to its neighbours a few units of height at a time if steps are short: it is as loose
/// as soil that comes at once.
#[test]
fn forces_converge_in_shorter_steps() {
    for kind in [0, 2, 3] {
        let [coarse, fine] = [0.1, 0.0125].map(|step_mm| dragged(kind, step_mm));
        for (coarse, fine) in coarse.iter().zip(fine) {
            assert!((coarse - fine).abs() <= 0.05 * fine.abs(), "shape {kind}: {coarse} N, {fine} N");
        }
    }
}

/// A body that comes through the rim of its own rut down to the bed and aside: the force on it is a continuous function of its
/// motion in a step. (The reaction of the bed to a foot that is pushed sideways came at once where the foot met it:
/// `iterative` had steps without a solution.)
#[test]
fn the_force_does_not_jump() {
    for (kind, config) in [(0, LUNAR), (0, LETE), (1, LETE), (2, LUNAR), (3, DRY_SAND)] {
        let mut fixture = Feet::new(instance::<SoilCellularAutomaton>(config, ground(0.01)));
        let upright = [1.0, 0.0, 0.0, 0.0];
        let mut pose = Pose { position: [-0.05, 0.0013, low(kind, upright)], orientation: upright };
        fixture.add(&shape(kind), pose);
        // a rut with rims, up, and back over the rim
        for [dx, dz, steps] in
            [[0.0, -1.5e-4, 100.0], [6e-4, 0.0, 100.0], [0.0, 3e-4, 60.0], [1e-3, 0.0, 40.0]]
        {
            for _ in 0..steps as u32 {
                pose.position[0] += dx;
                pose.position[2] += dz;
                fixture.step(|_| pose);
            }
        }
        for _ in 0..120 {
            pose.position[0] -= 2e-4;
            pose.position[2] -= 1.5e-4;
            fixture.step(|_| pose);
            let jump = largest_jump(&mut fixture, pose, [-1e-3, 0.0, -3e-3]);
            assert!(jump <= 1e-3, "shape {kind}: {jump} N at {:?}", pose.position);
        }
    }
}

/// By how much the force on a body jumps if it went by a part of `way` in the next step, N: the largest difference between
/// neighbours among 64 places, halved until no more than rounding lies between them.
fn largest_jump(fixture: &mut Feet, from: Pose, way: [f64; 3]) -> f64 {
    let mut force = |part: f64| {
        let position = std::array::from_fn(|c| from.position[c] + part * way[c]);
        fixture.ask(|_| Pose { position, ..from });
        fixture.force(0)
    };
    let apart = |a: [f64; 3], b: [f64; 3]| (0..3).map(|c| (a[c] - b[c]).abs()).fold(0.0, larger);
    let places: Vec<_> = (0..=64).map(|k| f64::from(k) / 64.0).map(|part| (part, force(part))).collect();
    let widest = |pairs: [[(f64, [f64; 3]); 2]; 2]| {
        let [first, second] = pairs;
        if apart(first[0].1, first[1].1) >= apart(second[0].1, second[1].1) { first } else { second }
    };
    let pairs = places.windows(2).map(|w| [w[0], w[1]]);
    let Some(mut pair) = pairs.reduce(|a, b| widest([a, b])) else { return 0.0 };
    for _ in 0..30 {
        let middle = 0.5 * (pair[0].0 + pair[1].0);
        let middle = (middle, force(middle));
        pair = widest([[pair[0], middle], [middle, pair[1]]]);
    }
    apart(pair[0].1, pair[1].1)
}

/// It carries load by its further sinkage, up to the load of a body that was pressed to its depth (a curved one less by the
/// shear of its flanks), and the ledger starts there: nothing is thrown out. (39 % of its energy came from nowhere.)
#[test]
fn a_body_that_starts_inside_the_ground_stands_in_its_print() {
    for (kind, config) in [(0, LUNAR), (1, LETE), (2, LETE), (3, LUNAR)] {
        let upright = [1.0, 0.0, 0.0, 0.0];
        let start = |depth: f64| {
            let mut fixture = Feet::new(instance::<SoilCellularAutomaton>(config, ground(0.005)));
            let pose = Pose { position: [0.0, 0.0, low(kind, upright) - depth], orientation: upright };
            fixture.add(&shape(kind), pose);
            (fixture, pose)
        };
        let press = |fixture: &mut Feet, pose: &mut Pose, way: f64| {
            for _ in 0..(way / 1e-4).round() as u32 {
                pose.position[2] -= 1e-4;
                fixture.step(|_| *pose);
            }
        };
        let (mut inside, mut pose) = start(0.02);
        inside.step(|_| pose);
        let force = inside.force(0)[2];
        assert!((0.0..0.05).contains(&force), "shape {kind}: {force} N");
        let mut last = [0.0; 2];
        for way in [0.002, 0.003, 0.015] {
            press(&mut inside, &mut pose, way);
            let (mut pressed, mut other) = start(0.0);
            press(&mut pressed, &mut other, low(kind, upright) - pose.position[2]);
            last = [&inside, &pressed].map(|fixture| fixture.force(0)[2]);
            assert!(last[0] <= last[1] * (1.0 + 1e-9), "shape {kind}: {last:?} N");
        }
        let flanks = if kind % 2 == 1 { 1e-9 } else { 0.05 };
        assert!(last[0] >= last[1] * (1.0 - flanks), "shape {kind}: {last:?} N");
        let Energy { potential, dissipated, port_work, .. } = inside.soil.energy();
        let error = (dissipated + potential - port_work).abs();
        assert!(error <= 0.01 * port_work, "shape {kind}: {error} J of {port_work} J");
    }
}

/// A box that is dragged over a coarse lattice comes over a row of nodes at a time and presses out the soil there: no step lifts
/// more than it has heat to pay for. (The balance missed by up to 2 % of the work for some steps.)
#[test]
fn what_is_pressed_out_at_once_is_lifted_as_the_work_allows() {
    let mut fixture = Feet::new(instance::<SoilCellularAutomaton>(SNOW, ground(0.02)));
    let upright = [1.0, 0.0, 0.0, 0.0];
    let mut pose = Pose { position: [-0.05, 0.0017, low(1, upright)], orientation: upright };
    fixture.add(&shape(1), pose);
    let (mut path, mut before) = (0.0, 0.0);
    for k in 0..360 {
        match k {
            0..60 => pose.position[2] -= 5e-4,
            _ => pose.position[0] += 3e-4,
        }
        fixture.step(|_| pose);
        let Energy { potential, dissipated, port_work, .. } = fixture.soil.energy();
        path += f64::abs(port_work - before);
        before = port_work;
        let error = (dissipated + potential - port_work).abs();
        assert!(error <= 1e-3 * path, "step {k}: {error:e} J of {path:e} J");
    }
}
