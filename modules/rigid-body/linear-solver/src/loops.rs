//! Rows that close loops: the dense system that is left of them when the trees are eliminated.
//!
//! With K the matrix of the trees, H the rows and C their compliance, W = H·K⁻¹·Hᵀ + C is symmetric and positive
//! semi-definite. It is scaled to a unit diagonal and factored by Cholesky with diagonal pivoting (faer), which stops
//! at the numerical rank: a row whose pivot falls below 1e-11 is redundant, gets no impulse, and is counted. Closed
//! chains with dependent rows need this (Bricard's mechanism has 30 rows for 30 coordinates, and moves).

use crate::dense::Dense;
use crate::forest::{Error, Forest};
use crate::spatial::{Wrench, dot};
/// A row whose mobility is less than this share of that with free bodies moves by rounding only.
const IMMOBILE: f64 = 1e-20;
/// Bodies that one row can act on.
pub const MOST_PARTS: usize = 4;

/// A row on up to four bodies: its Jacobian on each, and its compliance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cut {
    /// Bodies and the row's Jacobian there (force and moment about the centre of mass of a unit impulse).
    pub parts: [Option<(usize, Wrench)>; MOST_PARTS],
    /// `Some(0)`: rigid; `Some(c)`: compliant; `None`: no row.
    pub compliance: Option<f64>,
}

/// All rows and their factor.
#[derive(Clone, Debug, Default)]
pub(crate) struct Loops {
    cuts: Vec<Cut>,
    /// Answers of the trees to each part, `stride` numbers each.
    answers: Vec<f64>,
    stride: usize,
    /// K⁻¹·Hᵀ by columns.
    columns: Vec<f64>,
    /// W, scaled to a unit diagonal.
    w: Dense,
    scale: Vec<f64>,
    live: usize,
}

impl Loops {
    /// Room for so many rows.
    pub fn new(rows: usize) -> Self {
        Self {
            cuts: vec![Cut::default(); rows],
            w: Dense::new(rows),
            scale: vec![0.0; rows],
            ..Self::default()
        }
    }

    pub fn len(&self) -> usize {
        self.cuts.len()
    }

    pub fn is_empty(&self) -> bool {
        self.cuts.is_empty()
    }

    /// Number of redundant rows.
    pub fn redundant(&self) -> usize {
        self.live - self.w.rank()
    }

    /// Factorises against the trees, which have been factored.
    pub fn factor(&mut self, forest: &Forest, cuts: &[Cut]) -> Result<(), Error> {
        self.cuts.copy_from_slice(cuts);
        self.answer(forest);
        self.fill(forest);
        if !self.w.factor() {
            return Err(Error::Loops);
        }
        self.live = self.cuts.iter().filter(|c| c.compliance.is_some()).count();
        let n = forest.len();
        self.columns.clear();
        self.columns.resize(n * self.cuts.len(), 0.0);
        for (cut, column) in self.cuts.iter().zip(self.columns.chunks_exact_mut(n)) {
            if cut.compliance.is_some() {
                for (body, wrench) in cut.parts.iter().flatten() {
                    column[6 * body..6 * body + 6].iter_mut().zip(wrench).for_each(|(c, w)| *c += w);
                }
                forest.substitute(column);
            }
        }
        Ok(())
    }

    fn answer(&mut self, forest: &Forest) {
        let touched = self.cuts.iter().flat_map(|c| c.parts).flatten();
        self.stride = touched.map(|(b, _)| forest.path_len(b)).max().unwrap_or(0);
        self.answers.clear();
        self.answers.resize(self.cuts.len() * MOST_PARTS * self.stride, 0.0);
        for (i, cut) in self.cuts.iter().enumerate().filter(|(_, c)| c.compliance.is_some()) {
            for (p, (body, wrench)) in
                cut.parts.iter().enumerate().filter_map(|(p, x)| Some((p, x.as_ref()?)))
            {
                let at = (i * MOST_PARTS + p) * self.stride;
                forest.climb(*body, wrench, &mut self.answers[at..at + self.stride]);
            }
        }
    }

    /// Parts of row i with their answers.
    fn parts(&self, i: usize) -> impl Iterator<Item = (usize, &[f64])> {
        let of = move |(p, part): (usize, &Option<(usize, Wrench)>)| {
            let at = (i * MOST_PARTS + p) * self.stride;
            part.as_ref().map(|(body, _)| (*body, &self.answers[at..at + self.stride]))
        };
        self.cuts[i].parts.iter().enumerate().filter_map(of)
    }

    /// W, scaled to a unit diagonal.
    fn fill(&mut self, forest: &Forest) {
        let n = self.cuts.len();
        for i in 0..n {
            let own = self.entry(forest, i, i) + self.cuts[i].compliance.unwrap_or(0.0);
            let moves = own > IMMOBILE * self.free_mobility(i, forest) || own.is_nan();
            self.scale[i] = if moves { 1.0 / own.sqrt() } else { 0.0 };
            self.w.set(i, i, if moves { self.scale[i] * self.scale[i] * own } else { 0.0 });
            for k in 0..i {
                let value = self.scale[i] * self.scale[k] * self.entry(forest, i, k);
                self.w.set(i, k, value);
            }
        }
    }

    /// Approximate motion along row i under a unit impulse if its bodies were free.
    fn free_mobility(&self, i: usize, forest: &Forest) -> f64 {
        let part = |(body, w): &(usize, Wrench)| {
            let (force, moment) = w.split_at(3);
            let size = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>();
            let (mass, inertia) = forest.own_inertia(*body);
            size(force) / mass + size(moment) / inertia
        };
        self.cuts[i].parts.iter().flatten().map(part).sum()
    }

    /// Entry of H·K⁻¹·Hᵀ.
    fn entry(&self, forest: &Forest, i: usize, k: usize) -> f64 {
        if self.cuts[i].compliance.is_none() || self.cuts[k].compliance.is_none() {
            return 0.0;
        }
        let pairs = self.parts(i).flat_map(|a| self.parts(k).map(move |b| (a, b)));
        pairs.map(|((a, x), (b, y))| sum(forest.shared(a, b), x, y)).sum()
    }

    /// Adds the effect of the rows to a solution of the trees; `x[n..]` holds their right-hand sides and then impulses.
    pub fn substitute(&self, x: &mut [f64], n: usize) {
        let (v, rows) = x.split_at_mut(n);
        for (cut, (b, scale)) in self.cuts.iter().zip(rows.iter_mut().zip(&self.scale)) {
            let open: f64 = cut.parts.iter().flatten().map(|(body, w)| rate(w, &v[6 * body..])).sum();
            *b = if cut.compliance.is_some() { scale * (open - *b) } else { 0.0 };
        }
        self.w.lower(rows);
        self.w.upper(rows);
        for (mu, (scale, column)) in rows.iter_mut().zip(self.scale.iter().zip(self.columns.chunks_exact(n)))
        {
            *mu *= scale;
            if *mu != 0.0 {
                v.iter_mut().zip(column).for_each(|(v, c)| *v -= *mu * c);
            }
        }
    }

    /// Effect of a body's answer on the rows, as vector z with z_a·z_b to be taken from y_a·y_b.
    pub fn feel(&self, forest: &Forest, body: usize, y: &[f64], z: &mut [f64]) {
        for i in 0..self.cuts.len() {
            let felt = |(b, x): (usize, &[f64])| sum(forest.shared(body, b), x, y);
            z[i] = if self.cuts[i].compliance.is_some() {
                self.scale[i] * self.parts(i).map(felt).sum::<f64>()
            } else {
                0.0
            };
        }
        self.w.lower(z);
    }
}

fn rate(wrench: &Wrench, v: &[f64]) -> f64 {
    dot(wrench, &[v[0], v[1], v[2], v[3], v[4], v[5]])
}

fn sum(shared: usize, a: &[f64], b: &[f64]) -> f64 {
    a[..shared].iter().zip(&b[..shared]).map(|(a, b)| a * b).sum()
}
