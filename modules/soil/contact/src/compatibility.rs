//! The paper's step 3 in the soil: given the free motion of the bodies, the wrenches of the soil with which both agree.
//!
//! The estimate gives the place of the feet without the soil, x_free, and how they yield, G = dX/dT. The soil seeks the wrench
//! T of its own law at x_free + G·T: Newton on r = T − F(x_free + G·T) with the matrix I + K·G, K = −dF/dX, halved at the
//! kinks of unloading and slip until |r| falls. So T is the answer of the law to the motion that the bodies then make: nothing
//! is left to iterate between both, and action equals reaction as far as the bodies are linear within the step.

use crate::assemble::Noted;
use crate::patch::Patches;
use crate::vectors::Stiffness;
use terraglue_numerics::dense::multiply_add;
use terraglue_numerics::in_place::{lu_solve, next_column};
use terraglue_subsystem::{Estimate, Result};

/// Newton steps at most.
const STEPS: usize = 60;
/// Halvings of one of them.
const HALVINGS: u32 = 12;
/// |r| over the largest wrench, and over the rounding of the motion, at which the wrench is found.
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
    /// Answers of the laws at `x`.
    noted: Noted,
    /// [I + K·G | −r], column-major n × (n + 1).
    matrix: Vec<f64>,
    /// Which of its rows takes whose place.
    order: Vec<usize>,
}

impl Compatibility {
    /// Room for `nodes` nodes of all contacts.
    pub fn reserve(&mut self, nodes: usize) {
        self.noted.reserve(nodes);
    }

    /// Solves for the wrench. `Some(|r|)`, N: it was not found.
    ///
    /// # Errors
    /// The law, which is a module, has no answer.
    pub fn solve(&mut self, patches: &Patches, n: usize, estimate: &Estimate) -> Result<Option<f64>> {
        for buffer in [&mut self.t, &mut self.x, &mut self.residual, &mut self.d, &mut self.base] {
            buffer.clear();
            buffer.resize(n, 0.0);
        }
        for patch in &patches.ports {
            patch.pack(&patch.force, &mut self.t);
        }
        let mut left = self.evaluate(patches, estimate)?;
        for _ in 0..STEPS {
            if left <= self.tolerated() {
                return Ok(None);
            }
            if !self.newton(patches, n, estimate.g) {
                return Ok(Some(left));
            }
            let before = left;
            left = self.step(patches, estimate, before)?;
            if left >= before && left <= 1e3 * self.tolerated() {
                // rounding only
                return Ok(None);
            }
        }
        Ok((left > 1e3 * self.tolerated()).then_some(left))
    }

    fn tolerated(&self) -> f64 {
        TOLERANCE * self.t.iter().fold(1e-3_f64, |m, t| m.max(t.abs()))
    }

    /// X and r at the present T; |r|.
    fn evaluate(&mut self, patches: &Patches, estimate: &Estimate) -> Result<f64> {
        self.x.copy_from_slice(estimate.x_free);
        multiply_add(estimate.g, &self.t, &mut self.x);
        self.noted.clear();
        for (p, patch) in patches.ports.iter().enumerate() {
            let wrench = patches.noted_wrench(p, &patch.unpack(&self.x), &mut self.noted)?;
            patch.pack(&wrench, &mut self.residual);
        }
        self.residual.iter_mut().zip(&self.t).for_each(|(r, t)| *r = t - *r);
        let larger = |m: f64, r: &f64| if r.is_nan() { f64::INFINITY } else { m.max(r.abs()) };
        Ok(self.residual.iter().fold(0.0, larger))
    }

    /// d = −(I + K·G)⁻¹·r at the motion of the last evaluation; whether there is one.
    fn newton(&mut self, patches: &Patches, n: usize, g: &[f64]) -> bool {
        self.matrix.clear();
        self.matrix.resize(n * n, 0.0);
        (0..n).for_each(|c| self.matrix[c * n + c] = 1.0);
        for (p, patch) in patches.ports.iter().enumerate() {
            let block = patches.noted_stiffness(p, &patch.unpack(&self.x), &self.noted);
            // a foot in the air has none
            if block.as_flattened().iter().any(|k| *k != 0.0) {
                add_product(&patch.place, &block, g, &mut self.matrix, n);
            }
        }
        if !eliminate(&mut self.matrix, n, &mut self.order) {
            return false;
        }
        self.d.iter_mut().zip(&self.residual).for_each(|(d, r)| *d = -r);
        lu_solve(n, &self.matrix, &self.order, &mut self.d);
        true
    }

    /// Takes the step, halved until the residual falls; the new |r|.
    fn step(&mut self, patches: &Patches, estimate: &Estimate, before: f64) -> Result<f64> {
        self.base.copy_from_slice(&self.t);
        let mut share = 1.0;
        for halving in 0..=HALVINGS {
            for ((t, base), d) in self.t.iter_mut().zip(&self.base).zip(&self.d) {
                *t = base + share * d;
            }
            let left = self.evaluate(patches, estimate)?;
            if left < before || halving == HALVINGS {
                return Ok(left);
            }
            share *= 0.5;
        }
        Ok(before)
    }
}

/// Adds the rows of K·G that belong to one port: `block` of K at the components `place`.
fn add_product(place: &[Option<usize>; 6], block: &Stiffness, g: &[f64], matrix: &mut [f64], n: usize) {
    if let [Some(first), .., Some(last)] = *place
        && last == first + 5
    {
        return add_whole(first, block, g, matrix, n);
    }
    for (out, g) in matrix.chunks_exact_mut(n).zip(g.chunks_exact(n)) {
        for (row, r) in block.iter().zip(place) {
            let Some(r) = r else { continue };
            for (k, c) in row.iter().zip(place) {
                if let Some(c) = c {
                    out[*r] += k * g[*c];
                }
            }
        }
    }
}

/// The same for a port that carries all six components, from `first` on: its rows side by side.
fn add_whole(first: usize, block: &Stiffness, g: &[f64], matrix: &mut [f64], n: usize) {
    let mut columns = [[0.0; 6]; 6];
    for (c, column) in columns.iter_mut().enumerate() {
        for (k, row) in column.iter_mut().zip(block) {
            *k = row[c];
        }
    }
    for (out, g) in matrix.chunks_exact_mut(n).zip(g.chunks_exact(n)) {
        let (Some(out), Some(g)) = (six_mut(out, first), six(g, first)) else { return };
        let mut sum = *out;
        for (column, g) in columns.iter().zip(g) {
            for (s, k) in sum.iter_mut().zip(column) {
                *s += k * g;
            }
        }
        *out = sum;
    }
}

#[inline]
fn six(all: &[f64], first: usize) -> Option<&[f64; 6]> {
    all.get(first..)?.first_chunk()
}

#[inline]
fn six_mut(all: &mut [f64], first: usize) -> Option<&mut [f64; 6]> {
    all.get_mut(first..)?.first_chunk_mut()
}

/// LU of the n × n `matrix` (column-major) with the largest pivot of each column; whether there is one. `order`: which row takes
/// whose place.
fn eliminate(matrix: &mut [f64], n: usize, order: &mut Vec<usize>) -> bool {
    order.clear();
    for c in 0..n {
        let (factors, column) = matrix.split_at_mut(c * n);
        let column = &mut column[..n];
        next_column(factors, column, order);
        let diagonal = column[c];
        if diagonal == 0.0 || !diagonal.is_finite() {
            return false;
        }
        let inverse = 1.0 / diagonal;
        column[c + 1..].iter_mut().for_each(|f| *f *= inverse);
    }
    true
}
