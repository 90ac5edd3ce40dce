//! The 22 frictional contact problems of `tests/reference/multibody/ncp`, and random ones.

use crate::common;
use common::files;
use proptest::prelude::*;
use terraglue_contact_solver::{Error, Options, Problem, Solver, Stage};

#[test]
fn every_reference_problem_is_solved() {
    let mut solver = Solver::default();
    let files = files();
    assert_eq!(files.len(), 22);
    for file in files {
        let problem = Problem::new(&file.w, &file.q, &file.mu).unwrap();
        let mut r = vec![0.0; file.q.len()];
        let report = solver.solve(&problem, &Options::default(), &mut r);
        println!("{:32} {report:?}", file.name);
        let limit = if file.name.starts_with("Rover") { 1e-10 } else { 1e-8 };
        let mut u = vec![0.0; r.len()];
        problem.velocity(&r, &mut u);
        assert!(problem.residual(&r, &u) <= limit, "{} {report:?}", file.name);
        assert_eq!(report.residual, problem.residual(&r, &u));
        // Its own solution is a start that needs no step.
        assert_eq!(solver.solve(&problem, &Options::default(), &mut r).stage, Stage::Start);
    }
}

#[test]
fn the_fall_backs_solve_what_newton_may_not() {
    let options = Options { newton_steps: 0, ..Options::default() };
    for file in files().iter().filter(|f| f.name.starts_with("Rover") && f.mu.len() < 5) {
        let problem = Problem::new(&file.w, &file.q, &file.mu).unwrap();
        let mut r = vec![0.0; file.q.len()];
        let report = Solver::default().solve(&problem, &Options { tolerance: 1e-8, ..options }, &mut r);
        assert!(report.converged && report.newton_steps == 0, "{} {report:?}", file.name);
    }
}

#[test]
fn nonsense_is_refused() {
    let size = Problem::new(&[1.0], &[1.0], &[0.5]).unwrap_err();
    assert!(size.to_string().contains("9 numbers in W and 3 in q"), "{size}");
    let w = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    assert!(matches!(Problem::new(&w, &[f64::NAN, 0.0, 0.0], &[0.5]), Err(Error::Value { what: "q", .. })));
    assert!(matches!(Problem::new(&w, &[0.0; 3], &[-0.5]), Err(Error::Value { what: "mu", .. })));
    assert!(matches!(Problem::new(&[0.0; 9], &[0.0; 3], &[0.5]), Err(Error::Immobile { contact: 0, .. })));
}

#[test]
fn redundant_contacts_share_the_load_as_evenly_as_the_start() {
    // A table of 4 kg, inertia 1, on four legs at (±1, ±1, −0.5): rank 6 of 12.
    let mut rows = Vec::new();
    for (x, y) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
        let z = -0.5;
        rows.extend([[0.0, 0.0, 0.5, y, -x, 0.0], [0.5, 0.0, 0.0, 0.0, z, -y], [0.0, 0.5, 0.0, -z, 0.0, x]]);
    }
    let entry =
        |i: usize, j: usize| rows[i].iter().zip(&rows[j]).map(|(a, b): (&f64, &f64)| a * b).sum::<f64>();
    let w: Vec<f64> = (0..144).map(|e| entry(e / 12, e % 12)).collect();
    let q: Vec<f64> = (0..12).map(|i| if i % 3 == 0 { -0.00981 } else { 0.0 }).collect();
    let problem = Problem::new(&w, &q, &[0.8; 4]).unwrap();
    let mut r = vec![0.0; 12];
    let options = Options { softening: 1e-6, ..Options::default() };
    let report = Solver::default().solve(&problem, &options, &mut r);
    assert!(report.converged && report.stage == Stage::Newton, "{report:?}");
    for r in r.chunks_exact(3) {
        assert!((r[0] - 0.00981).abs() < 1e-11 && r[1].abs() < 1e-11 && r[2].abs() < 1e-11, "{r:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_problems_are_solved_or_their_residual_is_told(
        (n, k, a, v, mu) in (1_usize..6, 3_usize..20).prop_flat_map(|(n, k)| (
            Just(n), Just(k),
            prop::collection::vec(-1.0..1.0_f64, 3 * n * k),
            prop::collection::vec(-1.0..1.0_f64, k),
            prop::collection::vec(0.0..1.5_f64, n),
        ))
    ) {
        // W = A·Aᵀ, q = A·v: bodies of unit mass that move with v.
        let row = |i: usize| &a[i * k..(i + 1) * k];
        let dot = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
        let w: Vec<f64> = (0..9 * n * n).map(|e| dot(row(e / (3 * n)), row(e % (3 * n)))).collect();
        let q: Vec<f64> = (0..3 * n).map(|i| dot(row(i), &v)).collect();
        let problem = Problem::new(&w, &q, &mu).unwrap();
        let mut r = vec![0.0; 3 * n];
        let report = Solver::default().solve(&problem, &Options::default(), &mut r);
        prop_assert!(report.residual <= 1e-9, "{report:?} {n} {k}");
        // Impulses of contacts can only brake: the work r·(u + q)/2 of a passive contact is not positive.
        let mut u = vec![0.0; 3 * n];
        problem.velocity(&r, &mut u);
        prop_assert!(dot(&r, &u) + dot(&r, &q) <= 1e-9, "{}", dot(&r, &u) + dot(&r, &q));
    }
}
