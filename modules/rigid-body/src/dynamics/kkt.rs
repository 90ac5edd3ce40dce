//! The matrix [[M, Jᵀ], [J, −C]] of the whole robot, numbered from the leaves to the root.

use crate::dynamics::joint_rows::JointRows;
use crate::math::M3;
use crate::model::Model;
use terraglue_linear_solver::{Error, Solver};

/// Where the unknowns of bodies (six rates) and joints (six impulses) stand, and the solver.
pub(crate) struct Kkt {
    pub solver: Solver,
    pub body_at: Vec<usize>,
    pub joint_at: Vec<usize>,
    /// Per body: joints to its children in ascending order of `joint_at`.
    below: Vec<Vec<usize>>,
}

impl Kkt {
    /// Numbers the unknowns and analyses the pattern: later bodies first, each before the joint above it.
    pub fn new(model: &Model) -> Result<Self, Error> {
        let (nb, nj) = (model.bodies.len(), model.joints.len());
        let (mut body_at, mut joint_at, mut n) = (vec![0; nb], vec![0; nj], 0);
        for b in (0..nb).rev() {
            body_at[b] = n;
            n += 6;
            if let Some(j) = model.joint_above[b] {
                joint_at[j] = n;
                n += 6;
            }
        }
        let mut below = vec![Vec::new(); nb];
        for b in (0..nb).rev() {
            if let Some(j) = model.joint_above[b]
                && let Some(parent) = model.joints[j].parent
            {
                below[parent].push(j);
            }
        }
        let (ptr, rows) = pattern(model, &body_at, &joint_at, &below);
        Ok(Self { solver: Solver::new(n, ptr, rows)?, body_at, joint_at, below })
    }

    /// Number of unknowns.
    pub fn len(&self) -> usize {
        self.solver.len()
    }

    /// Fills in the values and factorises. `compliance[j][r]`: None removes row r of joint j (J = 0, C = 1).
    pub fn factor(
        &mut self,
        model: &Model,
        inertia: &[M3],
        rows: &[JointRows],
        compliance: &[[Option<f64>; 6]],
    ) -> Result<(), Error> {
        let mut values = self.solver.values_mut().iter_mut();
        let mut put = |v: f64| {
            if let Some(slot) = values.next() {
                *slot = v;
            }
        };
        let alive = |j: usize, r: usize| compliance[j][r].is_some();
        for b in (0..model.bodies.len()).rev() {
            for c in 0..6 {
                for j in &self.below[b] {
                    (0..6).for_each(|r| put(if alive(*j, r) { rows[*j].parent[r][c] } else { 0.0 }));
                }
                for r in 0..=c {
                    put(match (r, c) {
                        (3.., 3..) => inertia[b][(r - 3, c - 3)],
                        _ if r == c => model.bodies[b].mass,
                        _ => 0.0,
                    });
                }
            }
            if let Some(j) = model.joint_above[b] {
                for (r, row) in compliance[j].iter().enumerate() {
                    (0..6).for_each(|c| put(if alive(j, r) { rows[j].child[r][c] } else { 0.0 }));
                    put(-row.unwrap_or(1.0));
                }
            }
        }
        self.solver.factor()
    }
}

fn pattern(
    model: &Model,
    body_at: &[usize],
    joint_at: &[usize],
    below: &[Vec<usize>],
) -> (Vec<usize>, Vec<usize>) {
    let (mut ptr, mut rows) = (vec![0], Vec::new());
    for b in (0..model.bodies.len()).rev() {
        let o = body_at[b];
        for c in 0..6 {
            for j in &below[b] {
                rows.extend(joint_at[*j]..joint_at[*j] + 6);
            }
            // Zeros between translation and rotation included: the path of a body then holds all its unknowns.
            rows.extend(o..o + c + 1);
            ptr.push(rows.len());
        }
        if let Some(j) = model.joint_above[b] {
            for r in 0..6 {
                rows.extend(o..o + 6);
                rows.push(joint_at[j] + r);
                ptr.push(rows.len());
            }
        }
    }
    (ptr, rows)
}
