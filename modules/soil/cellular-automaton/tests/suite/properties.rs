//! Random bodies pressed, dragged and lifted in random order: mass, numbers, slopes and pull.

use crate::feet;
use crate::support;

use feet::{Dice, Feet, H, Wanderer, instance, shape, steepest};
use proptest::prelude::*;
use std::sync::Arc;
use support::{DRY_SAND, LETE, LUNAR, Shaped, flat};
use terraglue_soil_cellular_automaton::SoilCellularAutomaton;
use terraglue_subsystem::{Geometry, Host, Pose, Standalone, Subsystem};

const SMOOTH: &str = r#"{"n":1.0,"k_c":1400,"k_phi":820000,"c_pa":0,"phi_rad":0.01,"K_m":0.018,
    "angle_of_repose_rad":0.610865238198}"#;

fn bumpy(x: f64, y: f64) -> f64 {
    0.02 * libm::sin(9.0 * x) * libm::cos(7.0 * y) + 0.1 * x
}

fn ground(size: u32, height: fn(f64, f64) -> f64) -> Arc<dyn Host> {
    let terrain = Shaped { size: [size; 2], spacing: 0.01, height };
    Arc::new(Standalone {
        gravity: [0.0, 0.0, -9.81],
        terrain: Some(Box::new(terrain)),
        folder: String::new(),
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    /// A rough foot may be held back by friction on its flanks when it is drawn out of a hole; stress normal to the
    /// foot never pulls, so a smooth one (φ = 0.6°, c = 0 against the foot, repose as ever) is never held.
    #[test]
    fn bodies_pressed_and_dragged_keep_mass_slopes_and_sense(
        seed in 1..u64::MAX, kinds in prop::collection::vec(0..5u32, 1..4), row in 0..4usize, level in any::<bool>(),
    ) {
        let config = [LUNAR, LETE, DRY_SAND, SMOOTH][row].replacen('{', r#"{"critical_height_m":0.0,"#, 1);
        let phi = [35.0, 31.1, 28.0, 35.0][row];
        let mut fixture = Feet::new(instance::<SoilCellularAutomaton>(&config, ground(61, if level { flat } else { bumpy })));
        let mut wanderers = Vec::new();
        for (k, kind) in kinds.iter().enumerate() {
            let wanderer = Wanderer::new(seed ^ k as u64, 0.27, 0.02);
            fixture.add(&shape(*kind), wanderer.pose);
            wanderers.push(wanderer);
        }
        let before = fixture.mass();
        let mut dice = Dice(seed | 1);
        for _ in 0..400 {
            let mut goals = Vec::new();
            for (k, wanderer) in wanderers.iter_mut().enumerate() {
                if dice.roll(0.0, 1.0) < 0.005 && fixture.force(k) == [0.0; 3] {
                    wanderer.turn_in_the_air();
                    fixture.bodies[k].move_to(&wanderer.pose);
                }
                goals.push(wanderer.next());
            }
            fixture.step(|k| goals[k]);
            for k in 0..kinds.len() {
                let [_, _, up] = fixture.force(k);
                prop_assert!(up >= 0.0 || row < 3, "a soil without adhesion pulls with {up} N");
            }
            prop_assert!(fixture.nodes.iter().all(|n| fixture.soil.ground().nodes.get(n.i, n.j).pressure >= 0.0));
            prop_assert_eq!(fixture.mass(), before);
        }
        fixture.lift_and_rest(60_000);
        prop_assert_eq!(fixture.mass(), before);
        prop_assert_eq!(fixture.soil.material().counts().gained, 0);
        let steep = steepest(&fixture.soil).atan().to_degrees();
        prop_assert!(steep <= phi + 0.5, "{steep}° instead of {phi}° at rest");
    }
}

/// Ground with walls around: material that a body at the edge presses out has to go inwards.
fn pressed(places: &[[f64; 2]], compacted: f64) -> (Feet, i64, i64) {
    let config = format!("{}, \"compacted_fraction\": {compacted}}}", LUNAR.trim_end_matches('}'));
    let mut fixture = Feet::new(instance::<SoilCellularAutomaton>(&config, ground(41, flat)));
    let at = |[x, y]: [f64; 2], z: f64| Pose { position: [x, y, z], ..Pose::IDENTITY };
    for place in places {
        fixture.add(&Geometry::Cylinder { half_length: 0.05, radius: 0.035 }, at(*place, 0.051));
    }
    let before = fixture.mass();
    for step in 1..=400 {
        let depth = 1e-4 * f64::from(step);
        fixture.step(|k| at(places[k], 0.051 - depth));
        assert_eq!(fixture.mass(), before, "after {depth} m");
    }
    fixture.lift_and_rest(60_000);
    let heights = &fixture.soil.ground().heights;
    let (mut crater, mut rim) = (0, 0);
    for (i, j) in (0..41).flat_map(|j| (0..41).map(move |i| (i, j))) {
        let sunk = i64::from(heights.sinkage_units(i, j));
        crater += sunk.max(0);
        rim -= sunk.min(0);
    }
    (fixture, crater, rim)
}

#[test]
fn crater_is_rim_and_compaction_wherever_the_foot_stands() {
    for compacted in [0.0, 0.25, 0.9] {
        for places in [
            &[[0.0, 0.0]][..],
            // half beyond the edge, and in a corner
            &[[0.2, 0.01]],
            &[[0.19, -0.2]],
            // side by side, and a third foot boxed in by two others and the edge
            &[[-0.035, 0.0], [0.035, 0.0]],
            &[[0.13, 0.13], [0.13, 0.2], [0.2, 0.13], [0.2, 0.2]],
        ] {
            let (fixture, crater, rim) = pressed(places, compacted);
            let dense = fixture.soil.material().compaction().total();
            assert_eq!(crater, rim + dense, "{places:?}, {compacted}");
            assert!(
                crater > 0 && (compacted == 0.0) == (dense == 0),
                "{places:?}, {compacted}: {crater} {dense}"
            );
        }
    }
}

/// 300 steps of three bodies over crumbling heaps.
fn run(fixture: &mut Feet, wanderers: &mut [Wanderer], steps: u32) -> u64 {
    for _ in 0..steps {
        let goals: Vec<Pose> = wanderers.iter_mut().map(Wanderer::next).collect();
        fixture.step(|k| goals[k]);
    }
    fixture.hash()
}

#[test]
fn what_was_saved_comes_back_bit_by_bit() {
    let mut fixture = Feet::new(instance::<SoilCellularAutomaton>(LUNAR, ground(61, bumpy)));
    let mut wanderers: Vec<Wanderer> = (0..3).map(|k| Wanderer::new(77 + k, 0.27, 0.02)).collect();
    wanderers.iter().zip(0..).for_each(|(w, kind)| fixture.add(&shape(kind), w.pose));
    run(&mut fixture, &mut wanderers, 150);
    fixture.soil.save_state(1).expect("a slot");
    let (poses, index) = (wanderers.clone(), fixture.index);
    let expected = run(&mut fixture, &mut wanderers, 150);
    for more in [0, 1, 40] {
        run(&mut fixture, &mut wanderers, more);
        fixture.soil.restore_state(1).expect("saved before");
        (wanderers, fixture.index) = (poses.clone(), index);
        fixture.bodies.iter_mut().zip(&wanderers).for_each(|(body, w)| body.move_to(&w.pose));
        assert_eq!(
            run(&mut fixture, &mut wanderers, 150),
            expected,
            "{more} steps later, at {} s",
            H * index as f64
        );
    }
}
