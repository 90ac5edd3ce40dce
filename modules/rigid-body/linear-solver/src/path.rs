//! The inverse between single bodies, by their paths to the root.

use crate::spatial::Wrench;
use crate::tree::Tree;

/// Answers of a factored [`Tree`] to unit wrenches as vectors y(w) with w_i·K⁻¹·w_k = ⟨y_i, y_k⟩ ([`Path::dot`]).
///
/// A vector has one entry for each row that closes a loop, then one for each freedom between the root and the body,
/// from the root on, so two bodies share the first [`Path::shared`] entries and W = H·K⁻¹·Hᵀ of contacts is a matter
/// of short dot products. For rates under rigid rows at rest (b = 0).
pub struct Path;

impl Path {
    /// Number of entries for a body.
    pub fn len(tree: &Tree, body: usize) -> usize {
        tree.loops().len() + tree.forest().path_len(body)
    }

    /// Number of entries that the vectors of two bodies have in common; 0: nothing connects them.
    pub fn shared(tree: &Tree, a: usize, b: usize) -> usize {
        tree.loops().len() + tree.forest().shared(a, b)
    }

    /// Writes y of a wrench on a body (about its centre of mass, world axes) into `y[..Path::len(body)]`.
    pub fn respond(tree: &Tree, body: usize, wrench: &Wrench, y: &mut [f64]) {
        let (loops, path) = y.split_at_mut(tree.loops().len());
        tree.forest().climb(body, wrench, path);
        tree.loops().feel(tree.forest(), body, path, loops);
    }

    /// All [`Path::dot`] of six vectors of a with six of b, each six side by side, entry after entry: row by vector of a.
    pub fn dots(tree: &Tree, shared: usize, a: &[f64], b: &[f64]) -> [[f64; 6]; 6] {
        let loops = tree.loops().len();
        let (a, b) = (a.as_chunks().0, b.as_chunks().0);
        let mut sums = products(&a[loops..shared], &b[loops..shared]);
        let held = products(&a[..loops], &b[..loops]);
        for (sum, held) in sums.as_flattened_mut().iter_mut().zip(held.as_flattened()) {
            *sum -= held;
        }
        sums
    }

    /// ⟨y_a, y_b⟩ over the shared entries: the part that loops hold back is subtracted.
    pub fn dot(tree: &Tree, shared: usize, a: &[f64], b: &[f64]) -> f64 {
        let loops = tree.loops().len();
        let held: f64 = a[..loops].iter().zip(&b[..loops]).map(|(a, b)| a * b).sum();
        a[loops..shared].iter().zip(&b[loops..shared]).map(|(a, b)| a * b).sum::<f64>() - held
    }
}

/// Sums of the products of six with six numbers of each entry.
fn products(a: &[[f64; 6]], b: &[[f64; 6]]) -> [[f64; 6]; 6] {
    let mut sums = [[-0.0; 6]; 6];
    for (a, b) in a.iter().zip(b) {
        for (row, a) in sums.iter_mut().zip(a) {
            for (sum, b) in row.iter_mut().zip(b) {
                *sum += a * b;
            }
        }
    }
    sums
}
