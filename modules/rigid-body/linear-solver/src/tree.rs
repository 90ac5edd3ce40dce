//! The whole system: trees of bodies and the rows that close loops between them.

use crate::forest::{Error, Forest, Link};
use crate::loops::{Cut, Loops};
use crate::rows::Rows;
use crate::spatial::Wrench;
use nalgebra::Matrix3;

/// Trees of bodies, with or without rows that close loops.
#[derive(Clone, Debug)]
pub struct Tree {
    forest: Forest,
    loops: Loops,
}

impl Tree {
    /// From the links of all bodies, parents first, the number of joints and that of rows that close loops.
    ///
    /// # Errors
    /// [`Error`]: links that form no tree, or numbers that are out of range.
    pub fn new(links: &[Link], joints: usize, cuts: usize) -> Result<Self, Error> {
        Ok(Self { forest: Forest::new(links, joints)?, loops: Loops::new(cuts) })
    }

    /// Number of unknowns.
    pub fn len(&self) -> usize {
        self.forest.len() + self.loops.len()
    }

    /// Unknown of a row that closes a loop, with the sign of μ as for joints.
    pub fn cut_at(&self, cut: usize) -> usize {
        self.forest.len() + cut
    }

    /// Number of rows of loops that depend on the others, at the last factorisation.
    pub fn redundant(&self) -> usize {
        self.loops.redundant()
    }

    pub(crate) fn forest(&self) -> &Forest {
        &self.forest
    }

    pub(crate) fn loops(&self) -> &Loops {
        &self.loops
    }

    /// Whether there are no unknowns.
    pub fn is_empty(&self) -> bool {
        self.forest.bodies() == 0
    }

    /// First unknown of a body: its six rates.
    pub fn body_at(&self, body: usize) -> usize {
        6 * body
    }

    /// First unknown of a joint: its six impulses with the sign of μ (an impulse on the child is −Jᵀμ).
    pub fn joint_at(&self, joint: usize) -> usize {
        6 * (self.forest.bodies() + joint)
    }

    /// Factorises. Per body its mass (kg) and inertia about the centre of mass (kg m², world axes); per joint its
    /// rows and their compliance: `Some(0)` rigid, `Some(c)` compliant, `None` no row at all; the rows that close
    /// loops.
    ///
    /// # Errors
    /// [`Error::Pivot`]: a body without enough inertia.
    pub fn factor(
        &mut self,
        masses: &[f64],
        inertia: &[Matrix3<f64>],
        rows: &[Rows],
        compliance: &[[Option<f64>; 6]],
        cuts: &[Cut],
    ) -> Result<(), Error> {
        self.forest.factor(masses, inertia, rows, compliance)?;
        if self.loops.is_empty() { Ok(()) } else { self.loops.factor(&self.forest, cuts) }
    }

    /// Overwrites the right-hand side (f, b) by the solution (v, μ). Rows that do not exist get μ = 0; the
    /// right-hand side there is of no effect.
    pub fn substitute(&self, x: &mut [f64]) {
        let n = self.forest.len();
        self.forest.substitute(&mut x[..n]);
        if !self.loops.is_empty() {
            self.loops.substitute(x, n);
        }
    }

    /// The same without the impulses of rigid rows, which become 0; [`Tree::impulses`] computes them. For trees without
    /// loops.
    pub fn substitute_rates(&self, x: &mut [f64]) {
        self.forest.substitute_rates(x);
    }

    /// Writes the impulses of rigid rows into a solution whose rates are known: the joint carries the part of the
    /// right-hand side of a body and all below it that their rates do not need. `masses`, `inertia`: as factored;
    /// `below`: a buffer.
    pub fn impulses(
        &self,
        masses: &[f64],
        inertia: &[Matrix3<f64>],
        rhs: &[f64],
        x: &mut [f64],
        below: &mut Vec<Wrench>,
    ) {
        self.forest.impulses(masses, inertia, rhs, x, below);
    }

    /// [`Tree::substitute`] for a right-hand side that is kept; an error if the solution is not finite.
    ///
    /// # Errors
    /// [`Error::NotFinite`].
    pub fn solve(&self, rhs: &[f64], x: &mut [f64]) -> Result<(), Error> {
        x.copy_from_slice(rhs);
        self.substitute(x);
        finite(x)
    }

    /// [`Tree::substitute_rates`] likewise.
    ///
    /// # Errors
    /// [`Error::NotFinite`].
    pub fn solve_rates(&self, rhs: &[f64], x: &mut [f64]) -> Result<(), Error> {
        x.copy_from_slice(rhs);
        self.substitute_rates(x);
        finite(x)
    }
}

/// Says so when a solution is not finite.
fn finite(x: &[f64]) -> Result<(), Error> {
    // In eight sums, which need not wait for each other; a sum is finite only if all its terms are.
    let mut sums = [0.0_f64; 8];
    x.chunks(8).for_each(|part| sums.iter_mut().zip(part).for_each(|(s, x)| *s += x));
    if sums.iter().all(|s| s.is_finite()) { Ok(()) } else { Err(Error::NotFinite) }
}
