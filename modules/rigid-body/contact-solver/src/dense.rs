//! LU with partial pivoting of the Newton matrix, row by row in a buffer of the caller.

/// Solves A·x = b in place: `a` (n × n, row-major) is destroyed, `b` becomes x. Pivots that vanish against the
/// largest entry of A leave their unknown at zero, so that consistent singular systems are solved too.
pub(crate) fn solve(n: usize, a: &mut [f64], b: &mut [f64], singular: f64) {
    let largest = a[..n * n].iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    for k in 0..n {
        let mut pivot = k;
        for i in k + 1..n {
            if a[i * n + k].abs() > a[pivot * n + k].abs() {
                pivot = i;
            }
        }
        if pivot != k {
            let (upper, lower) = a.split_at_mut(pivot * n);
            upper[k * n + k..(k + 1) * n].swap_with_slice(&mut lower[k..n]);
            b.swap(k, pivot);
        }
        let (head, tail) = a.split_at_mut((k + 1) * n);
        let row = &head[k * n..];
        if row[k].abs() <= singular * largest {
            continue;
        }
        let inverse = 1.0 / row[k];
        for (i, other) in tail.chunks_exact_mut(n).enumerate().take(n - k - 1) {
            let factor = other[k] * inverse;
            if factor != 0.0 {
                for (o, r) in other[k + 1..].iter_mut().zip(&row[k + 1..]) {
                    *o -= factor * r;
                }
                b[k + 1 + i] -= factor * b[k];
            }
        }
    }
    for k in (0..n).rev() {
        let row = &a[k * n..(k + 1) * n];
        let pivot = row[k];
        let rest: f64 = row[k + 1..].iter().zip(&b[k + 1..n]).map(|(a, x)| a * x).sum();
        b[k] = if pivot.abs() <= singular * largest { 0.0 } else { (b[k] - rest) / pivot };
    }
}

#[cfg(test)]
mod tests {
    use super::solve;

    #[test]
    fn a_system_that_needs_pivoting_is_solved() {
        let mut a = [0.0, 2.0, 1.0, 1.0, 1.0, 0.0, 4.0, -1.0, 3.0];
        let mut b = [7.0, 3.0, 11.0];
        solve(3, &mut a, &mut b, 1e-14);
        for (x, exact) in b.iter().zip([1.0, 2.0, 3.0]) {
            assert!((x - exact).abs() < 1e-14, "{b:?}");
        }
    }

    #[test]
    fn a_consistent_singular_system_has_an_answer() {
        let mut a = [1.0, 1.0, 1.0, 1.0];
        let mut b = [2.0, 2.0];
        solve(2, &mut a, &mut b, 1e-14);
        assert!((b[0] + b[1] - 2.0).abs() < 1e-14);
    }
}
