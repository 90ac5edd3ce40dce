//! The matrix [[M, Jᵀ], [J, −C]] of the whole robot: numbering of its unknowns and its factor.

use crate::math::M3;
use crate::model::Model;
use terraglue_linear_solver::{Cut, Error, Link, Rows, Tree};

/// Where the unknowns of bodies (six rates) and joints (six impulses) stand, and the solver.
pub(crate) struct Kkt {
    pub solver: Tree,
    pub body_at: Vec<usize>,
    pub joint_at: Vec<usize>,
    masses: Vec<f64>,
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
        Ok(Self {
            body_at: (0..model.bodies.len()).map(|b| solver.body_at(b)).collect(),
            joint_at: (0..model.joints.len()).map(|j| solver.joint_at(j)).collect(),
            masses: model.bodies.iter().map(|b| b.mass).collect(),
            below: Vec::with_capacity(model.bodies.len()),
            solver,
        })
    }

    /// Number of unknowns.
    pub fn len(&self) -> usize {
        self.solver.len()
    }

    /// Factorises. `compliance[j][r]`: `None` removes row r of joint j; `cuts`: rows that
    /// close loops.
    pub fn factor(
        &mut self,
        inertia: &[M3],
        rows: &[Rows],
        compliance: &[[Option<f64>; 6]],
        cuts: &[Cut],
    ) -> Result<(), Error> {
        self.solver.factor(&self.masses, inertia, rows, compliance, cuts)
    }

    /// Writes the impulses of rigid rows into a solution that has the rates only.
    pub fn complete(&mut self, inertia: &[M3], rhs: &[f64], solution: &mut [f64]) {
        self.solver.impulses(&self.masses, inertia, rhs, solution, &mut self.below);
    }
}
