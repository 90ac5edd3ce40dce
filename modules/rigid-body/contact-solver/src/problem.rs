//! A frictional contact problem and the residual by which every solution is judged.
//!
//! Find r with u = W·r + q, r ∈ K_μ, û = u + (μ·|u_t|, 0, 0) ∈ K_μ* and rᵀû = 0: Signorini's condition and Coulomb's
//! law at the end of a time step, in De Saxcé's form (De Saxcé and Feng 1998; Acary and Cadoux 2013, eq. 7).

use crate::cone::{norm2, project};

/// Why numbers are not a contact problem.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Lengths do not fit: n contacts need W of 9n², q of 3n and μ of n numbers.
    #[error("{contacts} friction coefficients need {} numbers in W and {} in q; there are {w} and {q}", 9 * contacts * contacts, 3 * contacts)]
    Size {
        /// Number of friction coefficients.
        contacts: usize,
        /// Length of W.
        w: usize,
        /// Length of q.
        q: usize,
    },
    /// A number is not finite or a friction coefficient is negative.
    #[error("{what} number {index} is {value}; finite numbers are needed, friction coefficients not below 0")]
    Value {
        /// `W`, `q` or `mu`.
        what: &'static str,
        /// Index in it.
        index: usize,
        /// The value.
        value: f64,
    },
    /// A contact whose own W_nn is not positive: nothing there can be moved.
    #[error("contact {contact} cannot be moved along its normal: W_nn = {value}")]
    Immobile {
        /// Index of the contact.
        contact: usize,
        /// W_nn, 1/kg.
        value: f64,
    },
}

/// Three components for each contact: normal, tangent 1, tangent 2.
#[derive(Clone, Copy, Debug)]
pub struct Problem<'a> {
    /// d(velocity)/d(impulse) at the contacts, 3n × 3n, row by row, 1/kg. Symmetric but for rounding.
    pub w: &'a [f64],
    /// Relative velocity at the end of the step without contact impulses, m/s; the normal component opens.
    pub q: &'a [f64],
    /// Friction coefficients.
    pub mu: &'a [f64],
}

impl<'a> Problem<'a> {
    /// Checks sizes and numbers.
    ///
    /// # Errors
    /// [`Error::Size`], [`Error::Value`] or [`Error::Immobile`]: sizes that do not fit, a number that is not finite or negative
    /// where it may not be, a contact that no impulse moves.
    pub fn new(w: &'a [f64], q: &'a [f64], mu: &'a [f64]) -> Result<Self, Error> {
        let n = mu.len();
        if q.len() != 3 * n || w.len() != 9 * n * n {
            return Err(Error::Size { contacts: n, w: w.len(), q: q.len() });
        }
        let bad = |what, v: &[f64], below: f64| {
            let found = v.iter().enumerate().find(|(_, x)| !x.is_finite() || **x < below);
            found.map_or(Ok(()), |(index, value)| Err(Error::Value { what, index, value: *value }))
        };
        bad("W", w, f64::NEG_INFINITY)?;
        bad("q", q, f64::NEG_INFINITY)?;
        bad("mu", mu, 0.0)?;
        let me = Self { w, q, mu };
        match (0..n).find(|k| me.at(3 * k, 3 * k) <= 0.0) {
            Some(contact) => Err(Error::Immobile { contact, value: me.at(3 * contact, 3 * contact) }),
            None => Ok(me),
        }
    }

    /// Number of contacts.
    pub fn contacts(&self) -> usize {
        self.mu.len()
    }

    /// W of row i and column j.
    pub fn at(&self, i: usize, j: usize) -> f64 {
        self.w[i * self.q.len() + j]
    }

    /// u = W·r + q.
    pub fn velocity(&self, r: &[f64], u: &mut [f64]) {
        for ((u, q), row) in u.iter_mut().zip(self.q).zip(self.w.chunks_exact(self.q.len().max(1))) {
            *u = q + row.iter().zip(r).map(|(w, r)| w * r).sum::<f64>();
        }
    }

    /// ‖r − P_K(r − û)‖ / ‖q‖ for u = W·r + q; 0 where q is 0.
    pub fn residual(&self, r: &[f64], u: &[f64]) -> f64 {
        let scale: f64 = self.q.iter().map(|q| q * q).sum();
        if scale == 0.0 {
            return 0.0;
        }
        let contacts = r.chunks_exact(3).zip(u.chunks_exact(3)).zip(self.mu);
        let squares = contacts.map(|((r, u), mu)| {
            let normal = r[0] - u[0] - mu * norm2([u[1], u[2]]);
            let p = project(*mu, [normal, r[1] - u[1], r[2] - u[2]]);
            (0..3).map(|c| (r[c] - p[c]) * (r[c] - p[c])).sum::<f64>()
        });
        (squares.sum::<f64>() / scale).sqrt()
    }
}
