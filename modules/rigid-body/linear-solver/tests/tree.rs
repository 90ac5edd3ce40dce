//! The elimination against a dense factorisation of the whole matrix, for random forests with rigid, compliant,
//! free and missing rows.
#![allow(missing_docs)]

use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, Vector3};
use proptest::prelude::*;
use terraglue_linear_solver::{Error, Link, Path, Rows, Tree};
use terraglue_numerics::extremes::larger;

/// A forest and its numbers.
#[derive(Debug, Clone)]
struct Forest {
    links: Vec<Link>,
    masses: Vec<f64>,
    inertia: Vec<Matrix3<f64>>,
    rows: Vec<Rows>,
    compliance: Vec<[Option<f64>; 6]>,
}

fn vector() -> impl Strategy<Value = Vector3<f64>> {
    (-1.0..1.0, -1.0..1.0, -1.0..1.0).prop_map(|(x, y, z)| Vector3::new(x, y, z))
}

fn row() -> impl Strategy<Value = Option<f64>> {
    prop_oneof![4 => Just(Some(0.0)), 1 => (1e-3..10.0_f64).prop_map(Some), 2 => Just(None)]
}

type Raw = (usize, f64, Vector3<f64>, [Vector3<f64>; 3], [Option<f64>; 6]);

fn body() -> impl Strategy<Value = Raw> {
    let frame = (vector(), vector(), vector()).prop_map(|(a, b, c)| [a, b, c]);
    (any::<usize>(), -3.0..3.0_f64, vector(), frame, [row(), row(), row(), row(), row(), row()])
}

fn forest(raw: &[Raw]) -> Forest {
    let mut f = Forest { links: vec![], masses: vec![], inertia: vec![], rows: vec![], compliance: vec![] };
    for (b, (above, mass, turn, [anchor, lever, twist], rows)) in raw.iter().enumerate() {
        // One of b + 1 parents; the last one is the world. Every fifth body has no joint.
        let parent = Some(above % (b + 1)).filter(|p| *p < b);
        let joint = (above % 5 > 0).then_some(f.rows.len());
        f.links.push(Link { parent: parent.filter(|_| joint.is_some()), joint });
        f.masses.push(10f64.powf(*mass));
        let r = Rotation3::new(*turn);
        let moments = Vector3::new(0.2, 0.3, 0.4) * 10f64.powf(*mass);
        f.inertia.push(r * Matrix3::from_diagonal(&moments) * r.transpose());
        if joint.is_some() {
            let (d, e) = (Rotation3::new(2.0 * twist), Rotation3::new(*twist));
            let column =
                |k: usize| if k < 3 { d.matrix().column(k).into() } else { e.matrix().column(k - 3).into() };
            f.rows.push(Rows { directions: std::array::from_fn(column), anchor: *anchor, lever: *lever });
            f.compliance.push(*rows);
        }
    }
    f
}

impl Forest {
    fn tree(&self) -> Tree {
        let mut tree = Tree::new(&self.links, self.rows.len(), 0).expect("parents first");
        tree.factor(&self.masses, &self.inertia, &self.rows, &self.compliance, &[]).expect("positive pivots");
        tree
    }

    /// The whole matrix; a row that does not exist is μ = 0.
    fn dense(&self, tree: &Tree) -> DMatrix<f64> {
        let mut k = DMatrix::zeros(tree.len(), tree.len());
        for b in 0..self.links.len() {
            let at = tree.body_at(b);
            for i in 0..3 {
                k[(at + i, at + i)] = self.masses[b];
                (0..3).for_each(|c| k[(at + 3 + i, at + 3 + c)] = self.inertia[b][(i, c)]);
            }
            let Some(j) = self.links[b].joint else { continue };
            for r in 0..6 {
                let row = tree.joint_at(j) + r;
                let Some(c) = self.compliance[j][r] else {
                    k[(row, row)] = 1.0;
                    continue;
                };
                k[(row, row)] = -c;
                let mut put = |body: usize, values: [f64; 6]| {
                    for (i, v) in values.iter().enumerate() {
                        k[(row, tree.body_at(body) + i)] = *v;
                        k[(tree.body_at(body) + i, row)] = *v;
                    }
                };
                put(b, self.rows[j].on_child(r));
                if let Some(p) = self.links[b].parent {
                    put(p, self.rows[j].on_parent(r));
                }
            }
        }
        k
    }

    /// A right-hand side without entries in rows that do not exist.
    fn rhs(&self, tree: &Tree) -> Vec<f64> {
        let mut rhs: Vec<f64> =
            (0..tree.len()).map(|i| ((i * 7919 + 13) % 101) as f64 / 50.0 - 1.0).collect();
        for (j, rows) in self.compliance.iter().enumerate() {
            (0..6).filter(|r| rows[*r].is_none()).for_each(|r| rhs[tree.joint_at(j) + r] = 0.0);
        }
        rhs
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, rng_seed: proptest::test_runner::RngSeed::Fixed(4), ..ProptestConfig::default() })]

    #[test]
    fn the_solution_fulfils_the_whole_system(raw in prop::collection::vec(body(), 1..12)) {
        let f = forest(&raw);
        let tree = f.tree();
        let (k, rhs) = (f.dense(&tree), f.rhs(&tree));
        let mut x = vec![0.0; tree.len()];
        tree.solve(&rhs, &mut x).expect("finite");
        let x = DVector::from_vec(x);
        let residual = &k * &x - DVector::from_vec(rhs);
        // Terms that cancel set the scale of rounding; masses and stiffness span six orders.
        let scale = (k.abs() * x.abs()).amax().max(1.0);
        prop_assert!(residual.amax() <= 1e-12 * scale, "{} {scale}", residual.amax());
    }

    #[test]
    fn rates_first_and_impulses_of_rigid_rows_later_are_the_whole_solution(raw in prop::collection::vec(body(), 1..12)) {
        let f = forest(&raw);
        let tree = f.tree();
        let (k, rhs) = (f.dense(&tree), f.rhs(&tree));
        let mut x = vec![0.0; tree.len()];
        tree.solve_rates(&rhs, &mut x).expect("finite");
        let rates = x.clone();
        tree.impulses(&f.masses, &f.inertia, &rhs, &mut x, &mut Vec::new());
        let bodies = 6 * f.links.len();
        prop_assert_eq!(&rates[..bodies], &x[..bodies]);
        for (j, rows) in f.compliance.iter().enumerate() {
            for r in (0..6).filter(|r| rows[*r].is_some_and(|c| c > 0.0)) {
                prop_assert_eq!(rates[tree.joint_at(j) + r], x[tree.joint_at(j) + r]);
            }
        }
        let x = DVector::from_vec(x);
        let residual = &k * &x - DVector::from_vec(rhs);
        let scale = (k.abs() * x.abs()).amax().max(1.0);
        prop_assert!(residual.amax() <= 1e-12 * scale, "{} {scale}", residual.amax());
    }

    #[test]
    fn paths_give_the_inverse_between_bodies(raw in prop::collection::vec(body(), 2..10)) {
        let f = forest(&raw);
        let tree = f.tree();
        let wrench = |b: usize| std::array::from_fn(|k| (((b + 1) * (k + 2) * 37) % 11) as f64 - 5.0);
        let last = f.links.len() - 1;
        let mut answers = vec![vec![0.0; 6 * f.links.len()]; f.links.len()];
        for (b, y) in answers.iter_mut().enumerate() {
            Path::respond(&tree, b, &wrench(b), y);
        }
        let mut x = vec![0.0; tree.len()];
        x[tree.body_at(last)..][..6].copy_from_slice(&wrench(last));
        tree.substitute(&mut x);
        for b in 0..=last {
            let moved: f64 = wrench(b).iter().zip(&x[tree.body_at(b)..]).map(|(w, v)| w * v).sum();
            let found = Path::dot(&tree, Path::shared(&tree, b, last), &answers[b], &answers[last]);
            let size = wrench(b).iter().zip(&x[tree.body_at(b)..]).map(|(w, v)| (w * v).abs()).sum::<f64>();
            prop_assert!((moved - found).abs() <= 1e-11 * size.max(1e-6), "{b}: {moved} {found}");
        }
    }
}

/// A chain of unit rods on hinges about y, the last one `heavy` kg.
fn chain(heavy: f64) -> Forest {
    let mut f = Forest { links: vec![], masses: vec![], inertia: vec![], rows: vec![], compliance: vec![] };
    for b in 0..8 {
        let mass = if b == 7 { heavy } else { 1.0 };
        f.links.push(Link { parent: (b > 0).then(|| b - 1), joint: Some(b) });
        f.masses.push(mass);
        f.inertia.push(mass * Matrix3::from_diagonal(&Vector3::new(0.01, 0.1, 0.1)));
        let half = Vector3::new(0.5, 0.0, 0.0);
        let lever = if b > 0 { half } else { Vector3::zeros() };
        let axes = [Vector3::y(), Vector3::z(), Vector3::x()];
        f.rows.push(Rows { directions: std::array::from_fn(|r| axes[r % 3]), anchor: -half, lever });
        f.compliance.push([Some(0.0), Some(0.0), Some(0.0), None, Some(0.0), Some(0.0)]);
    }
    f
}

#[test]
fn masses_far_apart_keep_the_joints_together() {
    for heavy in [1.0, 1e3, 1e6, 1e9] {
        let f = chain(heavy);
        let tree = f.tree();
        let mut x = vec![0.0; tree.len()];
        (0..8).for_each(|b| x[tree.body_at(b) + 2] = -f.masses[b]);
        tree.substitute(&mut x);
        for j in 0..8 {
            let parent = f.links[j].parent.map(|p| &x[tree.body_at(p)..][..6]);
            let rates = f.rows[j].rates(&x[tree.body_at(j)..][..6], parent);
            let gap = [0, 1, 2, 4, 5].iter().fold(0.0_f64, |m, r| larger(m, rates[*r].abs()));
            assert!(gap < 1e-14, "{heavy}: {gap:e}");
        }
    }
}

#[test]
fn what_cannot_be_factored_is_an_error() {
    let good = chain(1.0).tree();
    let mut f = chain(1.0);
    f.inertia[7] = Matrix3::zeros();
    f.masses[7] = 0.0;
    let mut tree = Tree::new(&f.links, 8, 0).expect("parents first");
    let refused = tree.factor(&f.masses, &f.inertia, &f.rows, &f.compliance, &[]);
    assert!(matches!(refused, Err(Error::Pivot { body: 7, .. })), "{refused:?}");
    let backwards = [Link { parent: Some(1), joint: Some(0) }, Link { parent: None, joint: None }];
    assert_eq!(Tree::new(&backwards, 1, 0).err(), Some(Error::Order { body: 0 }));
    let mut x = vec![0.0; good.len()];
    let mut rhs = x.clone();
    rhs[3] = f64::NAN;
    assert_eq!(good.solve(&rhs, &mut x), Err(Error::NotFinite));
}
