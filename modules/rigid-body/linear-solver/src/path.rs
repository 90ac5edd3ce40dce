//! The inverse between single bodies, by their paths to the root.

use crate::spatial::Wrench;
use crate::tree::Tree;

/// Answers of a factored [`Tree`] to unit wrenches as vectors y(w) with w_i·K⁻¹·w_k = y_i·y_k.
///
/// A vector has one entry for each freedom between the root and the body, from the root on, so two bodies share
/// the first [`Path::shared`] entries and W = H·K⁻¹·Hᵀ of contacts is a matter of short dot products. For rates
/// under rigid rows at rest (b = 0).
pub struct Path;

impl Path {
    /// Number of entries for a body.
    pub fn len(tree: &Tree, body: usize) -> usize {
        tree.path_len(body)
    }

    /// How many entries the vectors of two bodies have in common; 0: they are in different trees.
    pub fn shared(tree: &Tree, mut a: usize, mut b: usize) -> usize {
        // Parents come first, so the later body is never the ancestor.
        while a != b {
            let later = if a > b { &mut a } else { &mut b };
            match tree.above(*later) {
                Some(above) => *later = above,
                None => return 0,
            }
        }
        tree.path_len(a)
    }

    /// Writes y of a wrench on a body (about its centre of mass, world axes) into `y[..Path::len(body)]`.
    pub fn respond(tree: &Tree, body: usize, wrench: &Wrench, y: &mut [f64]) {
        let mut end = tree.path_len(body);
        let mut p = *wrench;
        let mut next = Some(body);
        while let Some(b) = next {
            let first = tree.above(b).map_or(0, |above| tree.path_len(above));
            let mut k = first;
            next = tree.pass_up(b, &mut p, |share| {
                y[k] = share;
                k += 1;
            });
            debug_assert_eq!(k, end);
            end = first;
        }
    }

    /// y_a·y_b over the shared entries.
    pub fn dot(shared: usize, a: &[f64], b: &[f64]) -> f64 {
        a[..shared].iter().zip(&b[..shared]).map(|(a, b)| a * b).sum()
    }
}
