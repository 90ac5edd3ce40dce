//! Bekker's law: p = (k_c/b + k_φ)·zⁿ (Bekker 1956, Theory of Land Locomotion).

use crate::first_loading::FirstLoading;
use crate::pressure_sinkage::PressureSinkage;

/// Bekker's law. The modulus of the power law rises as the contact becomes narrower.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bekker {
    /// Cohesive modulus k_c, N/m^(n+1).
    pub k_c: f64,
    /// Frictional modulus k_φ, N/m^(n+2).
    pub k_phi: f64,
    /// Exponent n.
    pub n: f64,
}

impl PressureSinkage for Bekker {
    fn under(&self, b: f64) -> FirstLoading {
        FirstLoading::Power { modulus: self.k_c / b + self.k_phi, exponent: self.n }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PressureLaw;

    #[test]
    fn one_centimetre_under_ten_centimetres() {
        let law = PressureLaw::Bekker(Bekker { k_c: 1400.0, k_phi: 820_000.0, n: 1.0 });
        let p = law.curve(0.05, 4e8).and_then(|curve| curve.virgin(0.01)).expect("a pressure");
        assert!((p - 8480.0).abs() < 1e-9, "{p}");
    }
}
