//! Points that are kept of a contact.

use super::*;

fn at(x: f64, y: f64, gap: f64, normal: V3) -> Found {
    let on_ground = V3::new(x, y, 0.0);
    Found { on_ground, on_shape: on_ground + gap * normal, normal, gap }
}

#[test]
fn a_flat_grid_is_carried_by_its_corners() {
    let grid = |k: i32| f64::from(k) * 0.01;
    let mut found: Vec<Found> =
        (0..400).map(|k| at(grid(k % 20), grid(k / 20), 1e-9 * f64::from(k % 3), V3::z())).collect();
    found.extend(found.clone());
    reduce(&mut found);
    assert!(found.len() <= MOST, "{}", found.len());
    for (x, y) in [(0.0, 0.0), (0.19, 0.0), (0.0, 0.19), (0.19, 0.19)] {
        assert!(found.iter().any(|f| (f.on_ground - V3::new(x, y, 0.0)).norm() < 1e-12));
    }
}

#[test]
fn what_is_round_keeps_its_deepest_point_and_walls_keep_theirs() {
    let dish = |x: f64, y: f64| at(x, y, 2.0 * (x * x + y * y), V3::z());
    let mut found: Vec<Found> = (-10..=10)
        .flat_map(|i| (-10..=10).map(move |k| (f64::from(i) * 0.01, f64::from(k) * 0.01)))
        .map(|(x, y)| dish(x, y))
        .collect();
    found.insert(7, at(0.3, 0.0, -1e-3, V3::x()));
    reduce(&mut found);
    assert!(found.iter().any(|f| f.gap == 0.0 && f.normal == V3::z()));
    assert!(found.iter().filter(|f| f.normal == V3::z()).all(|f| f.on_ground.norm() < 0.03));
    assert!(found.iter().any(|f| f.normal == V3::x()));
}
