//! Quantiles of Student's distribution, from its density by integration and bisection.

/// Intervals of Simpson's rule.
const STEPS: u32 = 400;

/// t with P(T ≤ t) = `share` for `freedom` degrees of freedom; 0.5 ≤ share < 1.
pub fn quantile(share: f64, freedom: f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    while below(high, freedom) < share && high < 1e6 {
        high *= 2.0;
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if below(middle, freedom) < share { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// P(T ≤ t) for t ≥ 0. With t = √ν·tan a the density becomes cos^(ν−1) a, which is smooth and bounded.
fn below(t: f64, freedom: f64) -> f64 {
    let end = libm::atan(t / freedom.sqrt());
    let factor = libm::exp(libm::lgamma(0.5 * (freedom + 1.0)) - libm::lgamma(0.5 * freedom))
        / std::f64::consts::PI.sqrt();
    let density = |k: u32| libm::pow(libm::cos(end * f64::from(k) / f64::from(STEPS)), freedom - 1.0);
    let inner: f64 = (1..STEPS).map(|k| density(k) * if k % 2 == 1 { 4.0 } else { 2.0 }).sum();
    0.5 + factor * end / (3.0 * f64::from(STEPS)) * (density(0) + inner + density(STEPS))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_of_the_tables() {
        for (freedom, t) in
            [(1.0, 12.7062), (2.0, 4.30265), (5.0, 2.57058), (11.0, 2.20099), (100.0, 1.98397)]
        {
            assert!((quantile(0.975, freedom) - t).abs() < 1e-4, "{freedom} {}", quantile(0.975, freedom));
        }
    }
}
