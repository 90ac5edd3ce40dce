//! The paper's step 3 in the soil: given what the bodies would do, which wrenches does the soil give so that both agree?
//!
//! The estimate says where the feet would be without the soil, x_free, and how they yield, G = dX/dT. The soil seeks the wrench
//! T of its own law at x_free + G·T: Newton on r = T − F(x_free + G·T) with the matrix I + K·G, K = −dF/dX, halved at the
//! kinks of unloading and slip until |r| falls. So T is what the law gives at the motion that the bodies then make: nothing is
//! left to iterate between both, and action equals reaction as far as the bodies are linear within the step.

use crate::patch::Patches;
use nalgebra::{DMatrixViewMut, linalg::gauss_step, linalg::gauss_step_swap};
use terraglue_subsystem::Estimate;

/// Newton steps at most.
const STEPS: usize = 60;
/// Halvings of one of them.
const HALVINGS: u32 = 12;
/// |r| over the largest wrench, and over what rounding leaves of the motion, at which the wrench is found.
const TOLERANCE: f64 = 1e-11;

/// The unknowns with their buffers.
#[derive(Clone, Debug, Default)]
pub struct Compatibility {
    /// The wrench T on the bodies, packed.
    pub t: Vec<f64>,
    /// The motion x_free + G·T, packed.
    pub x: Vec<f64>,
    residual: Vec<f64>,
    d: Vec<f64>,
    base: Vec<f64>,
    stiffness: Vec<f64>,
    /// [I + K·G | −r], column-major n × (n + 1).
    matrix: Vec<f64>,
}

impl Compatibility {
    /// Solves for the wrench. `Some(|r|)`, N: it was not found.
    pub fn solve(&mut self, patches: &mut Patches, n: usize, estimate: &Estimate) -> Option<f64> {
        for buffer in [&mut self.t, &mut self.x, &mut self.residual, &mut self.d, &mut self.base] {
            buffer.clear();
            buffer.resize(n, 0.0);
        }
        for patch in &patches.ports {
            patch.pack(&patch.force, &mut self.t);
        }
        let mut left = self.evaluate(patches, estimate);
        for _ in 0..STEPS {
            if left <= self.tolerated() {
                return None;
            }
            if !self.newton(patches, n, &estimate.g) {
                return Some(left);
            }
            let before = left;
            left = self.step(patches, estimate, before);
            if left >= before && left <= 1e3 * self.tolerated() {
                // what rounding leaves
                return None;
            }
        }
        (left > 1e3 * self.tolerated()).then_some(left)
    }

    fn tolerated(&self) -> f64 {
        TOLERANCE * self.t.iter().fold(1e-3_f64, |m, t| m.max(t.abs()))
    }

    /// X and r at the present T; |r|.
    fn evaluate(&mut self, patches: &Patches, estimate: &Estimate) -> f64 {
        self.x.copy_from_slice(estimate.x_free);
        for (column, t) in estimate.g.chunks_exact(self.t.len().max(1)).zip(&self.t) {
            self.x.iter_mut().zip(column).for_each(|(x, g)| *x += g * t);
        }
        for (p, patch) in patches.ports.iter().enumerate() {
            let wrench = patches.wrench(p, &patch.unpack(&self.x));
            patch.pack(&wrench, &mut self.residual);
        }
        self.residual.iter_mut().zip(&self.t).for_each(|(r, t)| *r = t - *r);
        self.residual.iter().fold(0.0, |m: f64, r| if r.is_nan() { f64::INFINITY } else { m.max(r.abs()) })
    }

    /// d = −(I + K·G)⁻¹·r; whether there is one.
    fn newton(&mut self, patches: &mut Patches, n: usize, g: &[f64]) -> bool {
        self.stiffness.clear();
        self.stiffness.resize(n * n, 0.0);
        for p in 0..patches.ports.len() {
            let block = patches.stiffness(p, &patches.ports[p].unpack(&self.x));
            crate::trial::scatter(&patches.ports[p], &block, n, &mut self.stiffness);
        }
        self.matrix.clear();
        self.matrix.resize(n * (n + 1), 0.0);
        for (c, (out, g)) in self.matrix.chunks_exact_mut(n).zip(g.chunks_exact(n)).enumerate() {
            out[c] = 1.0;
            for (k, g) in self.stiffness.chunks_exact(n).zip(g).filter(|(_, g)| **g != 0.0) {
                out.iter_mut().zip(k).for_each(|(out, k)| *out += k * g);
            }
        }
        self.matrix[n * n..].iter_mut().zip(&self.residual).for_each(|(m, r)| *m = -r);
        let mut matrix = DMatrixViewMut::from_slice(&mut self.matrix, n, n + 1);
        for i in 0..n {
            let pivot = matrix.view_range(i.., i).icamax() + i;
            let diagonal = matrix[(pivot, i)];
            if diagonal == 0.0 || !diagonal.is_finite() {
                return false;
            }
            if pivot == i {
                gauss_step(&mut matrix, diagonal, i);
            } else {
                matrix.columns_range_mut(..i).swap_rows(i, pivot);
                gauss_step_swap(&mut matrix, diagonal, i, pivot);
            }
        }
        let (upper, mut right) = matrix.columns_range_pair_mut(..n, n..);
        if !upper.solve_upper_triangular_mut(&mut right) {
            return false;
        }
        self.d.iter_mut().zip(right.iter()).for_each(|(d, r)| *d = *r);
        true
    }

    /// Takes the step, halved until the residual falls; the new |r|.
    fn step(&mut self, patches: &Patches, estimate: &Estimate, before: f64) -> f64 {
        self.base.copy_from_slice(&self.t);
        let mut share = 1.0;
        for halving in 0..=HALVINGS {
            for ((t, base), d) in self.t.iter_mut().zip(&self.base).zip(&self.d) {
                *t = base + share * d;
            }
            let left = self.evaluate(patches, estimate);
            if left < before || halving == HALVINGS {
                return left;
            }
            share *= 0.5;
        }
        before
    }
}
