//! Rows that close loops: every equation holds, paths know the loops, dependent rows are found.
#![allow(missing_docs)]

use nalgebra::{Matrix3, Vector3};
use terraglue_linear_solver::{Cut, Link, Path, Rows, Tree, Wrench};
use terraglue_numerics::extremes::larger;

const BODIES: usize = 7;

/// Two branches of rods on skew hinges from the first body, which is free or hangs on the world.
fn tree(free: bool, cuts: &[Cut]) -> Tree {
    let links: Vec<Link> = (0..BODIES)
        .map(|b| Link {
            parent: b.checked_sub(2).or((b == 1).then_some(0)),
            joint: (b > 0 || !free).then_some(b),
        })
        .collect();
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    let rows: Vec<Rows> = (0..BODIES)
        .map(|b| Rows {
            directions: std::array::from_fn(|r| axes[(r + b) % 3]),
            anchor: Vector3::new(-0.5, 0.1 * b as f64, 0.0),
            lever: Vector3::new(0.4, -0.05, 0.02 * b as f64),
        })
        .collect();
    let mut compliance = vec![[Some(0.0); 6]; BODIES];
    compliance.iter_mut().enumerate().for_each(|(b, c)| c[3 + b % 3] = (b % 3 == 0).then_some(0.3));
    let masses: Vec<f64> = (0..BODIES).map(|b| 1.0 + b as f64).collect();
    let inertia = vec![Matrix3::from_diagonal(&Vector3::new(0.1, 0.2, 0.25)); BODIES];
    let mut tree = Tree::new(&links, BODIES, cuts.len()).expect("parents first");
    tree.factor(&masses, &inertia, &rows, &compliance, cuts).expect("factors");
    tree
}

fn wrench(seed: usize) -> Wrench {
    std::array::from_fn(|k| (((seed + 3) * (k + 2) * 37) % 11) as f64 - 5.0)
}

fn cut(seed: usize, a: usize, b: Option<usize>, compliance: Option<f64>) -> Cut {
    let other = b.map(|b| (b, wrench(seed + 7)));
    Cut { parts: [Some((a, wrench(seed))), other, None, None], compliance }
}

fn rate(cut: &Cut, x: &[f64]) -> f64 {
    let one = |(b, w): &(usize, Wrench)| w.iter().zip(&x[6 * b..]).map(|(w, v)| w * v).sum::<f64>();
    cut.parts.iter().flatten().map(one).sum()
}

/// Solves for a right-hand side; the solution.
fn solve(tree: &Tree, cuts: &[Cut], b: &[f64]) -> Vec<f64> {
    let mut x: Vec<f64> = (0..tree.len()).map(|i| ((i * 7919 + 13) % 101) as f64 / 50.0 - 1.0).collect();
    (0..cuts.len()).for_each(|c| x[tree.cut_at(c)] = b[c]);
    tree.substitute(&mut x);
    x
}

#[test]
fn rigid_and_compliant_rows_hold() {
    let cuts = [cut(1, 6, Some(5), Some(0.0)), cut(2, 4, None, Some(0.7)), cut(3, 6, Some(3), Some(0.0))];
    for free in [true, false] {
        let tree = tree(free, &cuts);
        assert_eq!(tree.redundant(), 0);
        let b = [0.3, -0.2, 0.5];
        let x = solve(&tree, &cuts, &b);
        for (c, cut) in cuts.iter().enumerate() {
            let left = rate(cut, &x) - cut.compliance.expect("a row") * x[tree.cut_at(c)] - b[c];
            assert!(left.abs() < 1e-11, "{free} {c}: {left:e}");
        }
    }
}

#[test]
fn a_row_with_a_multiplier_is_an_impulse_on_its_bodies() {
    let cuts = [cut(1, 6, Some(5), Some(0.0)), cut(2, 4, None, Some(0.7))];
    let (with, without) = (tree(true, &cuts), tree(true, &[]));
    let x = solve(&with, &cuts, &[0.3, -0.2]);
    let mut y: Vec<f64> = (0..without.len()).map(|i| ((i * 7919 + 13) % 101) as f64 / 50.0 - 1.0).collect();
    for (c, cut) in cuts.iter().enumerate() {
        for (b, w) in cut.parts.iter().flatten() {
            (0..6).for_each(|k| y[6 * b + k] -= x[with.cut_at(c)] * w[k]);
        }
    }
    without.substitute(&mut y);
    let worst = x.iter().zip(&y).fold(0.0_f64, |m, (x, y)| larger(m, (x - y).abs()));
    assert!(worst < 1e-11, "{worst:e}");
}

#[test]
fn dependent_rows_are_counted_and_harmless() {
    let first = cut(1, 6, Some(5), Some(0.0));
    let second = cut(2, 4, Some(2), Some(0.0));
    // Half the first row, and one that has been switched off.
    let half = |(b, w): (usize, Wrench)| (b, w.map(|v| 0.5 * v));
    let third = Cut { parts: first.parts.map(|p| p.map(half)), compliance: Some(0.0) };
    let off = cut(9, 1, None, None);
    let cuts = [first, second, third, off];
    let tree = tree(false, &cuts);
    assert_eq!(tree.redundant(), 1);
    let x = solve(&tree, &cuts, &[0.4, -0.1, 0.2, 0.0]);
    for (c, b) in [(0, 0.4), (1, -0.1), (2, 0.2)] {
        assert!((rate(&cuts[c], &x) - b).abs() < 1e-10, "{c}: {}", rate(&cuts[c], &x));
    }
    assert_eq!(x[tree.cut_at(3)], 0.0);
    assert!(x.iter().all(|x| x.is_finite()));
}

#[test]
fn rows_that_move_nothing_are_harmless() {
    // Both bodies are held against the world in these directions, but for rounding.
    let held = |b: usize, tiny: f64| Cut {
        parts: [Some((b, [tiny, 0.0, 0.0, 0.0, tiny, 0.0])), None, None, None],
        compliance: Some(0.0),
    };
    let links: Vec<Link> = (0..2).map(|b| Link { parent: None, joint: Some(b) }).collect();
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    let directions = std::array::from_fn(|r| axes[r % 3]);
    let rows = vec![Rows { directions, anchor: Vector3::zeros(), lever: Vector3::zeros() }; 2];
    // Only a turn about z is free.
    let compliance = vec![[Some(0.0), Some(0.0), Some(0.0), Some(0.0), Some(0.0), None]; 2];
    let nearly =
        Cut { parts: [Some((1, [1.0, 0.0, 0.0, 0.0, 0.0, 1e-16])), None, None, None], compliance: Some(0.0) };
    let cuts = [held(0, 1.0), nearly, held(1, 1e-3)];
    let mut tree = Tree::new(&links, 2, cuts.len()).expect("parents first");
    let inertia = vec![Matrix3::identity(); 2];
    tree.factor(&[1.0, 2.0], &inertia, &rows, &compliance, &cuts).expect("factors");
    assert_eq!(tree.redundant(), 3);
    let mut x = vec![1.0; tree.len()];
    (0..3).for_each(|c| x[tree.cut_at(c)] = 0.0);
    tree.substitute(&mut x);
    assert_eq!((x[5], x[11], x[tree.cut_at(1)]), (1.0, 1.0, 0.0));
}

#[test]
fn paths_know_the_loops() {
    let cuts = [cut(1, 6, Some(5), Some(0.0)), cut(2, 4, None, Some(0.7)), cut(1, 6, Some(5), Some(0.0))];
    for free in [true, false] {
        let tree = tree(free, &cuts);
        let answer = |b: usize| {
            let mut y = vec![0.0; 6 * BODIES + cuts.len()];
            Path::respond(&tree, b, &wrench(b + 20), &mut y[..Path::len(&tree, b)]);
            y
        };
        for (a, b) in [(6, 5), (3, 3), (0, 6), (2, 1)] {
            let mut x = vec![0.0; tree.len()];
            x[6 * a..6 * a + 6].copy_from_slice(&wrench(a + 20));
            tree.substitute(&mut x);
            let moved: f64 = wrench(b + 20).iter().zip(&x[6 * b..]).map(|(w, v)| w * v).sum();
            let found = Path::dot(&tree, Path::shared(&tree, a, b), &answer(a), &answer(b));
            assert!((moved - found).abs() < 1e-9 * moved.abs().max(1.0), "{a} {b}: {moved} {found}");
        }
    }
}
