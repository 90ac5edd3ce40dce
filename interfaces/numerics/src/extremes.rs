//! Larger and smaller of two numbers, for maxima over residuals.
//!
//! [`f64::max`] and [`f64::min`] drop a NaN, so a maximum of residuals by them is fine where one of them is no number.

/// The larger of two numbers, or NaN where one of them is.
///
/// ```
/// use terraglue_numerics::extremes::larger;
/// assert_eq!([0.1, 0.3, 0.2].into_iter().fold(0.0, larger), 0.3);
/// assert!([0.1, f64::NAN, 0.2].into_iter().fold(0.0, larger).is_nan());
/// ```
pub fn larger<T: PartialOrd>(a: T, b: T) -> T {
    if a >= b || is_nan(&a) { a } else { b }
}

/// The smaller of two numbers, or NaN where one of them is.
pub fn smaller<T: PartialOrd>(a: T, b: T) -> T {
    if a <= b || is_nan(&a) { a } else { b }
}

/// The largest of some numbers; NaN where one of them is, or where there are none.
pub fn largest(numbers: impl IntoIterator<Item = f64>) -> f64 {
    numbers.into_iter().reduce(larger).unwrap_or(f64::NAN)
}

/// Whether a value is unequal to itself.
fn is_nan<T: PartialOrd>(a: &T) -> bool {
    a.partial_cmp(a).is_none()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nan_is_kept_wherever_it_stands() {
        for numbers in [[f64::NAN, 1.0, 2.0], [1.0, f64::NAN, 2.0], [1.0, 2.0, f64::NAN]] {
            assert!(numbers.into_iter().fold(0.0, larger).is_nan());
            assert!(numbers.into_iter().fold(f64::INFINITY, smaller).is_nan());
            assert!(largest(numbers).is_nan());
        }
        assert!(largest([]).is_nan());
    }

    #[test]
    fn numbers_are_ordered() {
        assert_eq!((larger(1.0, 2.0), larger(2.0, 1.0)), (2.0, 2.0));
        assert_eq!((smaller(1.0, 2.0), smaller(2.0, 1.0)), (1.0, 1.0));
        assert_eq!((larger(1_u32, 2), smaller(-f64::INFINITY, 0.0)), (2, -f64::INFINITY));
        assert_eq!(largest([-3.0, -1.0, -2.0]), -1.0);
    }
}
