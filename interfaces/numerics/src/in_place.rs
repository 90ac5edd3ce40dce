//! Dense systems of a few unknowns in buffers of the caller; column-major.

/// Four columns of n entries.
#[inline(always)]
pub(crate) fn four(columns: &[f64], n: usize) -> [&[f64]; 4] {
    let (a, rest) = columns.split_at(n);
    let (b, rest) = rest.split_at(n);
    let (c, d) = rest.split_at(n);
    [a, b, c, &d[..n]]
}

/// y += a·x for the entries of four columns a from `first` on, one after the other at each entry, as four single columns would
/// be added.
#[inline(always)]
pub(crate) fn add_four(y: &mut [f64], [a, b, c, d]: [&[f64]; 4], first: usize, [p, q, r, s]: [f64; 4]) {
    let n = y.len();
    let (a, b, c, d) = (&a[first..][..n], &b[first..][..n], &c[first..][..n], &d[first..][..n]);
    for k in 0..n {
        y[k] = y[k] + p * a[k] + q * b[k] + r * c[k] + s * d[k];
    }
}

/// Takes the columns `factors` (below the diagonal, which is 1), eliminated before, out of the next one; at the front of it stands its
/// part of U. The same solves L·x = b.
fn reduce(column: &mut [f64], factors: &[f64]) {
    let n = column.len().max(1);
    let fours = factors.chunks_exact(4 * n);
    let (mut i, rest) = (0, fours.remainder());
    for columns in fours {
        let [a, b, c, d] = four(columns, n);
        let (head, below) = column[i..].split_at_mut(4);
        let p = -head[0];
        head[1] += p * a[i + 1];
        let q = -head[1];
        head[2] = head[2] + p * a[i + 2] + q * b[i + 2];
        let r = -head[2];
        head[3] = head[3] + p * a[i + 3] + q * b[i + 3] + r * c[i + 3];
        let s = -head[3];
        i += 4;
        add_four(below, [a, b, c, d], i, [p, q, r, s]);
    }
    for factors in rest.chunks_exact(n) {
        let (head, below) = column.split_at_mut(i + 1);
        let lead = -head[i];
        below.iter_mut().zip(&factors[i + 1..]).for_each(|(y, f)| *y += lead * f);
        i += 1;
    }
}

/// Overwrites the lower triangle of the positive definite `a` (n × n) with L of A = L·Lᵀ. False: not definite.
#[inline]
pub fn cholesky(n: usize, a: &mut [f64]) -> bool {
    cholesky_above(n, a, 0.0)
}

/// The same where each pivot has to be larger than a share of its entry on the diagonal: the other unknowns must leave
/// so much of it.
#[inline]
pub fn cholesky_above(n: usize, a: &mut [f64], share: f64) -> bool {
    for j in 0..n {
        let least = share * a[j * n + j];
        let (left, right) = a.split_at_mut(j * n);
        let column = &mut right[j..n];
        let fours = left.chunks_exact(4 * n);
        let rest = fours.remainder();
        for columns in fours {
            let [a, b, c, d] = four(columns, n);
            add_four(column, [a, b, c, d], j, [-a[j], -b[j], -c[j], -d[j]]);
        }
        for other in rest.chunks_exact(n) {
            let (factor, other) = (other[j], &other[j..]);
            column.iter_mut().zip(other).for_each(|(v, o)| *v -= factor * o);
        }
        let pivot = a[j * n + j];
        if pivot <= least.max(0.0) || pivot.is_nan() {
            return false;
        }
        let inverse = 1.0 / pivot.sqrt();
        a[j * n + j..(j + 1) * n].iter_mut().for_each(|v| *v *= inverse);
    }
    true
}

/// x = A⁻¹·x with the factor of [`cholesky`].
#[inline]
pub fn cholesky_solve(n: usize, l: &[f64], x: &mut [f64]) {
    let fours = l[..n * n].chunks_exact(4 * n.max(1));
    let rest = fours.remainder();
    let mut j = 0;
    for columns in fours {
        let [a, b, c, d] = four(columns, n);
        let (head, below) = x[j..n].split_at_mut(4);
        head[0] /= a[j];
        let p = -head[0];
        head[1] = (head[1] + p * a[j + 1]) / b[j + 1];
        let q = -head[1];
        head[2] = (head[2] + p * a[j + 2] + q * b[j + 2]) / c[j + 2];
        let r = -head[2];
        head[3] = (head[3] + p * a[j + 3] + q * b[j + 3] + r * c[j + 3]) / d[j + 3];
        let s = -head[3];
        j += 4;
        add_four(below, [a, b, c, d], j, [p, q, r, s]);
    }
    for column in rest.chunks_exact(n.max(1)) {
        let (head, below) = x.split_at_mut(j + 1);
        head[j] /= column[j];
        below.iter_mut().zip(&column[j + 1..]).for_each(|(v, l)| *v -= l * head[j]);
        j += 1;
    }
    for (j, column) in l.chunks_exact(n.max(1)).take(n).enumerate().rev() {
        let below: f64 = column[j + 1..].iter().zip(&x[j + 1..n]).map(|(l, x)| l * x).sum();
        x[j] = (x[j] - below) / column[j];
    }
}

/// The next `column` of an LU: its rows change places as those of the columns `left` have (`order`: which takes whose place), these
/// are taken out of it, and the row of its largest entry that is left comes to its diagonal, in all of them.
#[inline]
pub fn next_column(left: &mut [f64], column: &mut [f64], order: &mut Vec<usize>) {
    let (n, j) = (column.len(), order.len());
    order.iter().enumerate().for_each(|(i, p)| column.swap(i, *p));
    reduce(column, left);
    let p = (j + 1..n).fold(j, |best, i| if column[i].abs() > column[best].abs() { i } else { best });
    order.push(p);
    if p != j {
        column.swap(j, p);
        left.chunks_exact_mut(n).for_each(|column| column.swap(j, p));
    }
}

/// Overwrites `a` (n × n) with its factors L (below the diagonal, which is 1) and U; `order`: which row takes whose place,
/// largest pivots first. False: singular.
#[inline]
pub fn lu(n: usize, a: &mut [f64], order: &mut Vec<usize>) -> bool {
    order.clear();
    for j in 0..n {
        let (left, right) = a.split_at_mut(j * n);
        let column = &mut right[..n];
        next_column(left, column, order);
        let pivot = column[j];
        if pivot == 0.0 || !pivot.is_finite() {
            return false;
        }
        column[j + 1..].iter_mut().for_each(|f| *f /= pivot);
    }
    true
}

/// x = A⁻¹·x with the factors of [`lu`].
#[inline]
pub fn lu_solve(n: usize, a: &[f64], order: &[usize], x: &mut [f64]) {
    order.iter().enumerate().for_each(|(j, p)| x.swap(j, *p));
    reduce(x, a);
    for (j, column) in a.chunks_exact(n.max(1)).enumerate().rev() {
        x[j] /= column[j];
        let (above, rest) = x.split_at_mut(j);
        above.iter_mut().zip(column).for_each(|(v, u)| *v -= u * rest[0]);
    }
}

/// Rank of the positive semi-definite `a` (overwritten) by Cholesky with diagonal pivoting; pivots below
/// `tolerance` × the largest diagonal entry count as zero.
pub fn rank(n: usize, a: &mut [f64], tolerance: f64) -> usize {
    let largest = (0..n).fold(0.0_f64, |m, i| m.max(a[i * n + i]));
    for step in 0..n {
        let p = (0..n).fold(0, |best, i| if a[i * n + i] > a[best * n + best] { i } else { best });
        let pivot = a[p * n + p];
        if pivot <= tolerance * largest {
            return step;
        }
        for j in (0..n).filter(|j| *j != p) {
            let factor = a[j * n + p] / pivot;
            (0..n).filter(|i| *i != p).for_each(|i| a[j * n + i] -= factor * a[p * n + i]);
        }
        (0..n).for_each(|i| (a[p * n + i], a[i * n + p]) = (0.0, 0.0));
        // Done: never chosen again.
        a[p * n + p] = -1.0;
    }
    n
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_definite_system_is_solved() {
        let mut a = [4.0, 2.0, 0.0, 2.0, 5.0, 1.0, 0.0, 1.0, 3.0];
        let mut x = [6.0, 8.0, 4.0];
        assert!(cholesky(3, &mut a));
        cholesky_solve(3, &a, &mut x);
        x.iter().for_each(|x| assert!((x - 1.0).abs() < 1e-15));
        assert!(!cholesky(2, &mut [1.0, 2.0, 2.0, 1.0]));
        let nearly_singular = [1.0, 1.0, 1.0, 1.0 + 1e-6];
        assert!(cholesky(2, &mut nearly_singular.clone()));
        assert!(!cholesky_above(2, &mut nearly_singular.clone(), 1e-5));
        assert!(cholesky_above(2, &mut nearly_singular.clone(), 1e-7));
    }

    #[test]
    fn a_system_that_is_not_symmetric_is_solved() {
        // columns (0, 3, 1), (2, 1, 0), (1, 0, 4); the first pivot is not on the diagonal
        let mut a = [0.0, 3.0, 1.0, 2.0, 1.0, 0.0, 1.0, 0.0, 4.0];
        let (mut order, mut x) = (Vec::new(), [7.0, 5.0, 13.0]);
        assert!(lu(3, &mut a, &mut order));
        lu_solve(3, &a, &order, &mut x);
        x.iter().zip([1.0, 2.0, 3.0]).for_each(|(x, right)| assert!((x - right).abs() < 1e-14));
        assert!(!lu(2, &mut [1.0, 2.0, 0.5, 1.0], &mut order));
    }

    #[test]
    fn the_rank_of_six_feet_on_one_plane_is_three() {
        let feet = [(0.35, 0.5), (0.0, 0.5), (-0.35, 0.5), (0.35, -0.5), (0.0, -0.5), (-0.35, -0.5)];
        let mut a = [0.0; 36];
        for (i, (xi, yi)) in feet.iter().enumerate() {
            for (j, (xj, yj)) in feet.iter().enumerate() {
                a[j * 6 + i] = 1.0 + 3.0 * xi * xj + 2.0 * yi * yj;
            }
        }
        assert_eq!(rank(6, &mut a, 1e-10), 3);
    }
}
