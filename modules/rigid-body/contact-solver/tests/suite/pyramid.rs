//! Friction pyramids: with Lemke and Dantzig, against the cone.

use crate::common;
use common::files;
use terraglue_contact_solver::lcp::{Dantzig, Facets, Lemke, Method, Outcome, Pyramid};
use terraglue_contact_solver::{Options, Problem, Solver};
use terraglue_numerics::extremes::larger;

const W: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

#[test]
fn along_an_edge_the_pyramid_is_the_cone() {
    for q in [[-1.0, 3.0, 0.0], [-1.0, 0.2, -0.1], [1.0, 2.0, 0.0]] {
        let problem = Problem::new(&W, &q, &[0.5]).unwrap();
        let mut cone = vec![0.0; 3];
        assert!(Solver::default().solve(&problem, &Options::default(), &mut cone).converged);
        for facets in [Facets::Four, Facets::Eight] {
            let mut r = vec![f64::NAN; 3];
            let outcome = Pyramid::default().solve(&problem, facets, Method::Lemke, &mut r);
            assert!(matches!(outcome, Outcome::Solved(_)), "{outcome:?}");
            for (r, cone) in r.iter().zip(&cone) {
                assert!((r - cone).abs() < 1e-12, "{q:?} {facets:?} {r} {cone}");
            }
        }
    }
}

#[test]
fn between_the_edges_four_facets_brake_less_and_eight_come_nearer() {
    // Sliding at 22.5°, half way between two of eight edges.
    let (sin, cos) = (0.382_683_432_365_089_8, 0.923_879_532_511_286_7);
    let q = [-1.0, 3.0 * cos, 3.0 * sin];
    let problem = Problem::new(&W, &q, &[0.5]).unwrap();
    let size = |facets| {
        let mut r = vec![0.0; 3];
        Pyramid::default().solve(&problem, facets, Method::Lemke, &mut r);
        -(r[1] * cos + r[2] * sin)
    };
    assert!((size(Facets::Four) - 0.5 * cos).abs() < 1e-12);
    assert!((size(Facets::Eight) - 0.5 * cos).abs() < 1e-12);
    let diagonal = [-1.0, 3.0, 3.0];
    let problem = Problem::new(&W, &diagonal, &[0.5]).unwrap();
    let mut r = vec![0.0; 3];
    Pyramid::default().solve(&problem, Facets::Eight, Method::Lemke, &mut r);
    assert!((r[1] + 0.5 * std::f64::consts::FRAC_1_SQRT_2).abs() < 1e-12 && (r[1] - r[2]).abs() < 1e-12);
}

#[test]
fn lemke_solves_the_pyramids_of_the_rover_and_dantzig_says_where_it_cannot() {
    let (mut solved, mut rays) = (0, 0);
    for file in files().iter().filter(|f| f.name.starts_with("Rover")) {
        let problem = Problem::new(&file.w, &file.q, &file.mu).unwrap();
        let mut r = vec![0.0; file.q.len()];
        let mut pyramid = Pyramid::default();
        let outcome = pyramid.solve(&problem, Facets::Eight, Method::Lemke, &mut r);
        assert!(matches!(outcome, Outcome::Solved(_)), "{} {outcome:?}", file.name);
        // Signorini's condition holds exactly, friction within the pyramid.
        let mut u = vec![0.0; r.len()];
        problem.velocity(&r, &mut u);
        let scale = file.q.iter().fold(0.0_f64, |s, q| larger(s, q.abs()));
        for (k, (r, u)) in r.chunks_exact(3).zip(u.chunks_exact(3)).enumerate() {
            assert!(
                r[0] >= 0.0 && u[0] > -1e-8 * scale && (r[0] * u[0]).abs() < 1e-7 * scale,
                "{}",
                file.name
            );
            assert!(r[1].hypot(r[2]) <= file.mu[k] * r[0] * (1.0 + 1e-9) + 1e-12);
        }
        match pyramid.solve(&problem, Facets::Four, Method::Dantzig, &mut r) {
            Outcome::Solved(_) => solved += 1,
            Outcome::Ray(_) | Outcome::PivotLimit(_) => rays += 1,
        }
        println!("{} lemke {outcome:?}", file.name);
    }
    println!("Dantzig: {solved} solved, {rays} given up");
    assert_eq!(solved + rays, 14);
    assert!(solved > 0);
}

#[test]
fn dantzig_and_lemke_agree_on_definite_problems_and_on_rays() {
    let m = [2.0, -1.0, 0.5, -1.0, 3.0, 0.2, 0.5, 0.2, 1.0];
    for q in [[-1.0, -2.0, 1.0], [-1.0, 1.0, -1.0], [1.0, 1.0, -3.0], [-5.0, -1.0, -1.0]] {
        let (mut a, mut b) = ([0.0; 3], [0.0; 3]);
        assert!(matches!(Dantzig::default().solve(&m, &q, &mut a), Outcome::Solved(_)));
        assert!(matches!(Lemke::default().solve(&m, &q, &mut b), Outcome::Solved(_)));
        for (a, b) in a.iter().zip(&b) {
            assert!((a - b).abs() < 1e-12, "{q:?} {a} {b}");
        }
    }
    let mut z = [0.0; 2];
    let outcome = Dantzig::default().solve(&[1.0, -1.0, -1.0, 1.0], &[-1.0, -1.0], &mut z);
    assert!(matches!(outcome, Outcome::Ray(_)) && z == [0.0; 2], "{outcome:?}");
}
