//! The matrix [[M, Jᵀ], [J, −C]] of the whole robot: numbering of its unknowns, assembly, and its factor.

use super::scheme::Six;
use crate::joint::Joint;
use crate::math::{M3, Q};
use crate::model::{Body, Model};
use terraglue_linear_solver::{Cut, Error, Link, Rows, Tree};

/// Positions of the unknowns of bodies (six rates) and joints (six impulses) in the system, and the solver.
pub(crate) struct Kkt {
    pub solver: Tree,
    pub body_at: Vec<usize>,
    pub joint_at: Vec<usize>,
    masses: Vec<f64>,
    /// Inertia of the bodies in world axes, kg m².
    pub(super) inertia: Vec<M3>,
    /// Rows of the joints.
    pub(super) rows: Vec<Rows>,
    /// Per joint and row its compliance; none: no row.
    pub(super) compliance: Vec<[Option<f64>; 6]>,
    /// Whether the factor stands for the step and its branches.
    pub(super) factored: bool,
    /// Counts factorisations; shows whether a compliance matrix is still valid.
    pub factor_count: u64,
    below: Vec<[f64; 6]>,
}

impl Kkt {
    /// Numbers the unknowns.
    pub fn new(model: &Model) -> Result<Self, Error> {
        let link = |above: &Option<usize>| Link {
            parent: above.and_then(|j| model.joints[j].parent),
            joint: *above,
        };
        let links: Vec<Link> = model.joint_above.iter().map(link).collect();
        let solver = Tree::new(&links, model.joints.len(), model.closures.iter().map(|c| c.len()).sum())?;
        let (bodies, joints) = (model.bodies.len(), model.joints.len());
        Ok(Self {
            body_at: (0..bodies).map(|b| solver.body_at(b)).collect(),
            joint_at: (0..joints).map(|j| solver.joint_at(j)).collect(),
            masses: model.bodies.iter().map(|b| b.mass).collect(),
            inertia: vec![M3::zeros(); bodies],
            rows: vec![Rows::default(); joints],
            compliance: vec![[None; 6]; joints],
            factored: false,
            factor_count: 0,
            below: Vec::with_capacity(bodies),
            solver,
        })
    }

    /// Number of unknowns.
    pub fn len(&self) -> usize {
        self.solver.len()
    }

    /// Turns the inertia of body b into world axes.
    pub fn turn_inertia(&mut self, b: usize, body: &Body, q: &Q) {
        let r = q.to_rotation_matrix();
        self.inertia[b] = r * body.inertia * r.transpose();
    }

    /// Factorises with `cuts`, the rows that close loops.
    pub fn factor(&mut self, cuts: &[Cut]) -> Result<(), Error> {
        self.solver.factor(&self.masses, &self.inertia, &self.rows, &self.compliance, cuts)
    }

    /// Writes the impulses of rigid rows into a solution that has the rates only.
    pub fn complete(&mut self, rhs: &[f64], solution: &mut [f64]) {
        self.solver.impulses(&self.masses, &self.inertia, rhs, solution, &mut self.below);
    }

    /// J·v of all rows of joint j.
    pub fn rates(&self, j: usize, joint: &Joint, v: &[f64]) -> Six {
        let of = |b: usize| &v[self.body_at[b]..][..6];
        self.rows[j].rates(of(joint.child), joint.parent.map(of))
    }

    /// J·v of one row of joint j.
    pub fn rate(&self, j: usize, joint: &Joint, row: usize, v: &[f64]) -> f64 {
        let of = |b: usize| &v[self.body_at[b]..][..6];
        self.rows[j].rate(row, of(joint.child), joint.parent.map(of))
    }

    /// Adds an impulse along a row of a joint, given by `rows`, to the rates' part of `x`.
    pub fn push(&self, x: &mut [f64], joint: &Joint, rows: &Rows, row: usize, impulse: f64) {
        self.push_body(x, joint.child, impulse, &rows.on_child(row));
        if let Some(parent) = joint.parent {
            self.push_body(x, parent, impulse, &rows.on_parent(row));
        }
    }

    /// Adds an impulse along one direction of a body.
    pub fn push_body(&self, x: &mut [f64], body: usize, impulse: f64, direction: &Six) {
        let at = self.body_at[body];
        x[at..at + 6].iter_mut().zip(direction).for_each(|(x, d)| *x += impulse * d);
    }
}
