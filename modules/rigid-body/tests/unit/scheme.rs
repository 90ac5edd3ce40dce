//! The order of generalized-α.

use super::*;

/// An oscillator x¨ = −x; the error of the position at t = 1.
fn oscillator(rho: f64, h: f64) -> f64 {
    let w = Weights::new(rho);
    let (mut x, mut v) = (1.0, [0.0; 6]);
    let mut a = Acceleration { algorithmic: [-1.0, 0.0, 0.0, 0.0, 0.0, 0.0], ..Acceleration::default() };
    a.real = a.algorithmic;
    for _ in 0..(1.0 / h).round() as usize {
        let mut u = Weights::predict(&v, &a, h);
        let (_, end) = w.end(&u, &v, &a, h);
        // θh(−x⁺ − v̇⁺) = 0 with dv̇⁺/du = 1/(θh).
        let residual = w.theta() * h * (-(x + h * u[0]) - end.real[0]);
        u[0] += residual / (1.0 + w.theta() * h * h);
        let (rate, end) = w.end(&u, &v, &a, h);
        (x, v, a) = (x + h * u[0], rate, end);
    }
    (x - libm::cos(1.0)).abs()
}

#[test]
fn an_oscillator_converges_with_second_order() {
    for rho in [0.0, 0.8, 1.0] {
        let order = libm::log2(oscillator(rho, 1e-2) / oscillator(rho, 5e-3));
        assert!((1.9..2.1).contains(&order), "{rho}: {order}");
    }
}
