//! Lemke's algorithm on random, degenerate, cycling, indeterminate and unsolvable problems.

use proptest::prelude::*;
use terraglue_contact_solver::lcp::{Lemke, Outcome};
use terraglue_numerics::extremes::{larger, smaller};

fn solve(m: &[f64], q: &[f64]) -> (Outcome, Vec<f64>) {
    let mut z = vec![f64::NAN; q.len()];
    let outcome = Lemke::default().solve(m, q, &mut z);
    (outcome, z)
}

/// Largest violation of z ≥ 0, w ≥ 0, z·w = 0, relative to q and M·z; `m` column-major.
fn violation(m: &[f64], q: &[f64], z: &[f64]) -> f64 {
    let n = q.len();
    let w = |i: usize| q[i] + (0..n).map(|j| m[j * n + i] * z[j]).sum::<f64>();
    let scale = q.iter().fold(0.0_f64, |s, q| larger(s, q.abs()));
    (0..n).fold(0.0_f64, |v, i| {
        [-z[i], -w(i) / scale, smaller(z[i], w(i).abs() / scale)].into_iter().fold(v, larger)
    })
}

fn assert_solved(m: &[f64], q: &[f64]) -> Vec<f64> {
    let (outcome, z) = solve(m, q);
    assert!(matches!(outcome, Outcome::Solved(_)), "{outcome:?}");
    assert!(violation(m, q, &z) < 1e-8, "{z:?} {}", violation(m, q, &z));
    z
}

/// A·Aᵀ of an n × k matrix: positive semi-definite of rank ≤ k.
fn gram(a: &[f64], n: usize, k: usize) -> Vec<f64> {
    let entry = |i: usize, j: usize| (0..k).map(|l| a[i * k + l] * a[j * k + l]).sum();
    (0..n * n).map(|e| entry(e % n, e / n)).collect()
}

#[test]
fn one_contact_is_a_division_at_any_scale() {
    assert!((assert_solved(&[2e-9], &[-6e-6])[0] - 3e3).abs() < 1e-9);
    assert_eq!(solve(&[2e-9], &[6e-6]), (Outcome::Solved(0), vec![0.0]));
}

#[test]
fn murtys_exponential_problem_is_solved() {
    // Murty (1978): M lower triangular, 1 on the diagonal, 2 below; q = −1.
    for n in [4, 8, 12] {
        let z = assert_solved(&lower(n), &vec![-1.0; n]);
        assert!((z[0] - 1.0).abs() < 1e-12);
    }
}

fn lower(n: usize) -> Vec<f64> {
    (0..n * n)
        .map(|e| {
            if e % n == e / n {
                1.0
            } else if e % n > e / n {
                2.0
            } else {
                0.0
            }
        })
        .collect()
}

#[test]
fn the_cyclic_matrix_of_murty_does_not_cycle() {
    // Murty (1988), example 2.11: a P-matrix on which simple pivoting rules run in a circle.
    let m = [1.0, 0.0, 2.0, 2.0, 1.0, 0.0, 0.0, 2.0, 1.0];
    let z = assert_solved(&m, &[-1.0, -1.0, -1.0]);
    z.iter().for_each(|z| assert!((z - 1.0 / 3.0).abs() < 1e-12));
}

#[test]
fn ties_everywhere_do_not_cycle() {
    for n in [3, 6, 12] {
        let m: Vec<f64> = (0..n * n).map(|_| 1.0).collect();
        let z = assert_solved(&m, &vec![-1.0; n]);
        assert!((z.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    }
    // Zero entries of q are degenerate from the start.
    assert_solved(&[2.0, -1.0, 0.0, -1.0, 2.0, -1.0, 0.0, -1.0, 2.0], &[0.0, -1.0, 0.0]);
}

#[test]
fn a_problem_without_solution_ends_on_a_ray() {
    // w = −z − 1 cannot be met; neither can w = 0·z − 1, nor a semi-definite M that does not reach q.
    assert!(matches!(solve(&[-1.0], &[-1.0]).0, Outcome::Ray(_)));
    assert!(matches!(solve(&[0.0], &[-1.0]).0, Outcome::Ray(_)));
    let (outcome, z) = solve(&[1.0, -1.0, -1.0, 1.0], &[-1.0, -1.0]);
    assert!(matches!(outcome, Outcome::Ray(_)), "{outcome:?}");
    assert_eq!(z, [0.0, 0.0]);
}

#[test]
fn six_feet_of_rank_three_carry_the_weight() {
    let feet = [(0.35, 0.5), (0.0, 0.5), (-0.35, 0.5), (0.35, -0.5), (0.0, -0.5), (-0.35, -0.5)];
    let rows: Vec<f64> = feet.iter().flat_map(|(x, y)| [1.0 / 5.0, y / 0.5, x / 0.4]).collect();
    let m = gram(&rows, 6, 3);
    // Free fall of 25 kg on all feet: any split of the weight over them is a solution, the sum is not free.
    let z = assert_solved(&m, &[-9.81; 6]);
    let sum: f64 = z.iter().sum();
    assert!((sum - 25.0 * 9.81).abs() < 1e-9, "{sum}");
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_semi_definite_problems_are_solved_where_they_can_be(
        (n, k, a, q) in (1_usize..9, 1_usize..9).prop_flat_map(|(n, k)| (
            Just(n), Just(k),
            prop::collection::vec(-1.0..1.0_f64, n * k),
            prop::collection::vec(-1.0..1.0_f64, k),
        ))
    ) {
        // q in the range of A: the problem is feasible, and Lemke must solve it.
        let m = gram(&a, n, k);
        let q: Vec<f64> = (0..n).map(|i| (0..k).map(|l| a[i * k + l] * q[l]).sum()).collect();
        let (outcome, z) = solve(&m, &q);
        prop_assert!(matches!(outcome, Outcome::Solved(_)), "{outcome:?}");
        let size = z.iter().fold(1.0_f64, |s, z| larger(s, z.abs()));
        prop_assert!(violation(&m, &q, &z) < 1e-7 * size, "{z:?}");
    }

    #[test]
    fn random_definite_problems_do_not_depend_on_the_order(
        (n, a, q) in (2_usize..9).prop_flat_map(|n| (
            Just(n),
            prop::collection::vec(-1.0..1.0_f64, n * n),
            prop::collection::vec(-1.0..1.0_f64, n),
        ))
    ) {
        let mut m = gram(&a, n, n);
        (0..n).for_each(|i| m[i * n + i] += 0.1);
        let z = solve(&m, &q).1;
        let reversed: Vec<f64> = m.iter().rev().copied().collect();
        let back: Vec<f64> = q.iter().rev().copied().collect();
        let other = solve(&reversed, &back).1;
        let size = z.iter().fold(1.0_f64, |s, z| larger(s, z.abs()));
        for (a, b) in z.iter().zip(other.iter().rev()) {
            prop_assert!((a - b).abs() < 1e-8 * size, "{z:?} {other:?}");
        }
    }
}
