//! Bearing capacity mobilised with the depth: p = (c·N_c + γ·b·N_γ)·(z/z_r)ⁿ, the cohesion and the width term of Terzaghi
//! (1943, Theoretical Soil Mechanics, ch. VIII).

use crate::first_loading::FirstLoading;
use crate::pressure_sinkage::PressureSinkage;

/// Bearing capacity that is reached at the depth z_r, whatever the size. At a given depth the pressure rises with the size
/// at any n, as plates on dry sand show; Bekker's law with k_c ≥ 0 cannot do that.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BearingCapacity {
    /// c·N_c, pressure at the depth z_r under a contact without width, Pa.
    pub cohesive: f64,
    /// γ·N_γ, Pa/m.
    pub frictional: f64,
    /// Reference depth z_r, m.
    pub reference: f64,
    /// Exponent n.
    pub n: f64,
}

impl PressureSinkage for BearingCapacity {
    fn under(&self, b: f64) -> FirstLoading {
        let modulus = (self.cohesive + self.frictional * b) * libm::pow(self.reference, -self.n);
        FirstLoading::Power { modulus, exponent: self.n }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PressureLaw;

    #[test]
    fn it_is_its_formula_and_rises_with_the_size() {
        let (b, z, n) = (0.04, 0.013, 1.3);
        let law = PressureLaw::BearingCapacity(BearingCapacity {
            cohesive: 2e4,
            frictional: 1e6,
            reference: 0.1,
            n,
        });
        let p = |b| law.curve(b, 4e8).and_then(|curve| curve.virgin(z)).expect("a pressure");
        assert!((p(b) / ((2e4 + 1e6 * b) * (z / 0.1).powf(n)) - 1.0).abs() < 1e-12, "{}", p(b));
        assert!(p(0.05) > p(b));
    }
}
