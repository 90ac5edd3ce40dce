//! Substitutions with the simplicial factor: column j holds D_j first, then the rows of L below the diagonal.

/// Marks an unknown that nothing depends on.
const NONE: usize = usize::MAX;

/// Elimination tree: the first row below the diagonal of each column.
pub(crate) fn parents(ptr: &[usize], rows: &[usize]) -> Vec<usize> {
    ptr.windows(2).map(|w| if w[0] + 1 < w[1] { rows[w[0] + 1] } else { NONE }).collect()
}

/// From `first` to its root.
pub(crate) fn path(parents: &[usize], first: usize) -> impl Iterator<Item = usize> + '_ {
    std::iter::successors(Some(first), |j| Some(parents[*j]).filter(|p| *p != NONE))
}

#[inline]
fn eliminate(ptr: &[usize], rows: &[usize], l: &[f64], j: usize, x: &mut [f64]) {
    let xj = x[j];
    let range = ptr[j] + 1..ptr[j + 1];
    for (i, l) in rows[range.clone()].iter().zip(&l[range]) {
        x[*i] -= l * xj;
    }
}

/// x = L⁻¹·x.
pub(crate) fn forward(ptr: &[usize], rows: &[usize], l: &[f64], x: &mut [f64]) {
    for j in 0..x.len() {
        if x[j] != 0.0 {
            eliminate(ptr, rows, l, j, x);
        }
    }
}

/// x = L⁻¹·x where only the path of `first` is touched.
pub(crate) fn forward_on_path(
    ptr: &[usize],
    rows: &[usize],
    l: &[f64],
    parents: &[usize],
    first: usize,
    x: &mut [f64],
) {
    let mut j = first;
    while j != NONE {
        eliminate(ptr, rows, l, j, x);
        j = parents[j];
    }
}

/// x = L⁻ᵀ·D⁻¹·x.
pub(crate) fn scale_and_backward(ptr: &[usize], rows: &[usize], l: &[f64], x: &mut [f64]) {
    for j in (0..x.len()).rev() {
        let range = ptr[j] + 1..ptr[j + 1];
        let below: f64 = rows[range.clone()].iter().zip(&l[range]).map(|(i, l)| l * x[*i]).sum();
        x[j] = x[j] / l[ptr[j]] - below;
    }
}
