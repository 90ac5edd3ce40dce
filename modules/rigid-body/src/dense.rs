//! Dense symmetric systems of contact size in buffers of the caller; column-major.

/// Overwrites the lower triangle of the positive definite `a` (n × n) with L of A = L·Lᵀ. False: not definite.
pub(crate) fn cholesky(n: usize, a: &mut [f64]) -> bool {
    for j in 0..n {
        for k in 0..j {
            let factor = a[k * n + j];
            for i in j..n {
                a[j * n + i] -= factor * a[k * n + i];
            }
        }
        let pivot = a[j * n + j];
        if pivot <= 0.0 || pivot.is_nan() {
            return false;
        }
        let inverse = 1.0 / pivot.sqrt();
        a[j * n + j..(j + 1) * n].iter_mut().for_each(|v| *v *= inverse);
    }
    true
}

/// x = A⁻¹·x with the factor of [`cholesky`].
pub(crate) fn cholesky_solve(n: usize, l: &[f64], x: &mut [f64]) {
    for j in 0..n {
        x[j] /= l[j * n + j];
        for i in j + 1..n {
            x[i] -= l[j * n + i] * x[j];
        }
    }
    for j in (0..n).rev() {
        let below: f64 = (j + 1..n).map(|i| l[j * n + i] * x[i]).sum();
        x[j] = (x[j] - below) / l[j * n + j];
    }
}

/// Rank of the positive semi-definite `a` (overwritten) by Cholesky with diagonal pivoting; pivots below
/// `tolerance` × the largest diagonal entry count as zero.
pub(crate) fn rank(n: usize, a: &mut [f64], tolerance: f64) -> usize {
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
