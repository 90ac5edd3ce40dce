//! Random worlds against a loop over all shapes whose intersections are found by other means: the same hit, at the same distance.

use proptest::prelude::*;
use random_scenes::{drawn, is_right, naive, rays, scenes};
use terraglue_subsystem::{Ray, RayHit, RayMask, World};
use terraglue_world::WorldModel;

fn cast(world: &WorldModel, rays: &[Ray]) -> Vec<RayHit> {
    let mut hits = vec![RayHit::MISS; rays.len()];
    world.cast_rays(rays, &RayMask::ALL, &mut hits);
    hits
}

/// (wrong, grazing) of some rays through a world of so many bodies.
fn wrong(seed: u64, bodies: usize, count: usize) -> (Vec<String>, usize) {
    let (pieces, heights) = scenes(seed, bodies);
    let order: Vec<usize> = (0..pieces.len()).collect();
    let world = drawn(&pieces, &heights, &order, None).expect("a world");
    let rays = rays(seed, bodies, count);
    let (mut wrong, mut grazing) = (Vec::new(), 0);
    for (ray, hit) in rays.iter().zip(cast(&world, &rays)) {
        let mut candidates = naive(&pieces, &[(0, &heights)], ray);
        match is_right(&hit, &candidates) {
            Some(true) => {}
            Some(false) => {
                candidates.sort_by(|a, b| a.distance.total_cmp(&b.distance));
                candidates.truncate(2);
                wrong.push(format!("{ray:?}\n{hit:?}\n{candidates:?}"));
            }
            None => grazing += 1,
        }
    }
    (wrong, grazing)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(60))]
    #[test]
    fn a_hit_is_that_of_a_loop_over_all_shapes(seed in any::<u64>(), scale in 0.0..2.5_f64) {
        let bodies = 10_f64.powf(scale) as usize;
        let (wrong, grazing) = wrong(seed, bodies, 200);
        prop_assert!(wrong.is_empty(), "{} of 200 with {bodies} bodies: {}", wrong.len(), wrong[0]);
        prop_assert!(grazing <= 2, "{grazing} of 200 rays graze something");
    }
}

#[test]
fn ten_thousand_bodies_hide_nothing() {
    let (wrong, _) = wrong(11, 10_000, 300);
    assert!(wrong.is_empty(), "{} of 300: {}", wrong.len(), wrong[0]);
}
