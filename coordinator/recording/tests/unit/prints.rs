//! Separation of footprints.

use super::*;

#[test]
fn one_deep_print_moves_neither_the_median_nor_the_spread() {
    let mut depths: Vec<f64> = (0..51).map(|k| 0.010 + 1e-4 * f64::from(k)).collect();
    let even = spread(depths.clone()).expect("some");
    assert!((even.median_m - 0.0125).abs() < 1e-12 && even.count == 51, "{even:?}");
    assert!((even.p10_m - 0.0105).abs() < 1e-12 && (even.p90_m - 0.0145).abs() < 1e-12, "{even:?}");
    depths[50] = 0.2;
    assert_eq!(spread(depths), Some(even));
    assert_eq!(spread(Vec::new()), None);
    let two = spread(vec![2.0, 1.0]).expect("some");
    assert!((two.median_m, two.p10_m, two.p90_m) == (1.5, 1.1, 1.9), "{two:?}");
}

fn walked(way: impl Fn(f64) -> Option<f64>) -> Vec<Print> {
    let mut prints = Vec::new();
    for k in 0..1000 {
        let t_s = 1e-3 * f64::from(k);
        if let Some(x) = way(t_s) {
            press(&mut prints, &Touch { at: [x, 0.0], t_s, normal_n: 1.0, depth_m: t_s });
        }
    }
    prints
}

#[test]
fn a_wheel_leaves_joined_prints_and_a_foot_leaves_single_ones() {
    let wheel = walked(|t| Some(0.3 * t));
    assert!(wheel.len() == 10 && wheel.iter().skip(1).all(|p| p.joined) && !wheel[0].joined, "{wheel:?}");
    let foot = walked(|t| (t % 0.5 < 0.4).then_some(0.2 * (t / 0.5).floor()));
    assert!(foot.len() == 2 && foot.iter().all(|p| !p.joined), "{foot:?}");
    assert!((foot[0].depth_m - 0.399).abs() < 1e-9, "the deepest moment counts: {foot:?}");
    assert!((foot[0].deepest_s - 0.399).abs() < 1e-9 && foot[0].at == [0.0; 2], "{foot:?}");
    let shaken = walked(|t| (t % 0.1 < 0.06).then_some(0.0));
    assert_eq!(shaken.len(), 1, "short breaks do not end a print");
    let bounces = walked(|t| (t % 0.3 < 0.1).then_some(1e-3 * t));
    assert!(bounces.len() == 1 && bounces[0].to_s > 0.9, "one place, one print: {bounces:?}");
}
