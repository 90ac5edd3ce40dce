//! Reece's law: p = (c·k_c' + γ·b·k_φ')·(z/b)ⁿ (Reece 1965, Proc. Inst. Mech. Eng. 180, eq. 6).

use crate::first_loading::FirstLoading;
use crate::pressure_sinkage::PressureSinkage;

/// Reece's law: for n < 1 the pressure at a depth rises with the size of the contact, for n > 1 it falls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reece {
    /// c·k_c', Pa.
    pub cohesive: f64,
    /// γ·k_φ', Pa/m.
    pub frictional: f64,
    /// Exponent n.
    pub n: f64,
}

impl PressureSinkage for Reece {
    fn under(&self, b: f64) -> FirstLoading {
        let modulus = (self.cohesive + self.frictional * b) * libm::pow(b, -self.n);
        FirstLoading::Power { modulus, exponent: self.n }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PressureLaw;

    #[test]
    fn it_is_its_formula() {
        let (b, z, n) = (0.04, 0.013, 1.3);
        let law = PressureLaw::Reece(Reece { cohesive: 900.0, frictional: 4e5, n });
        let p = law.curve(b, 4e8).and_then(|curve| curve.virgin(z)).expect("a pressure");
        assert!((p / ((900.0 + 4e5 * b) * (z / b).powf(n)) - 1.0).abs() < 1e-12, "{p}");
    }
}
