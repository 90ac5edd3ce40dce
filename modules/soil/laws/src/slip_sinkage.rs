//! Slip sinkage: a contact that slips digs itself in, so the pressure law softens with the slip.

/// Dependence of the law of first loading on the slip s of a contact, 0 ≤ s ≤ 1.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
#[non_exhaustive]
pub enum SlipSinkage {
    /// Not at all.
    #[default]
    None,
    /// Exponent n = n_0 + n_1·s (Ding, Gao, Deng, Nagatani and Yoshida 2011, J. Terramechanics 48). As z < 1 m, a
    /// larger exponent is a softer soil.
    Ding {
        /// n_1.
        n1: f64,
    },
    /// The depth under a load is (1 + s)/(1 − s/2) times that of the contact without slip (Lyasko 2010,
    /// J. Terramechanics 47): p(z) = p_0(z·(1 − s/2)/(1 + s)).
    Lyasko,
}

impl SlipSinkage {
    /// Modulus and exponent of a power law under the slip `slip`; a slip outside 0 … 1 counts as the nearer end.
    pub fn apply(&self, modulus: f64, n: f64, slip: f64) -> (f64, f64) {
        let s = slip.clamp(0.0, 1.0);
        match *self {
            Self::None => (modulus, n),
            Self::Ding { n1 } => (modulus, n + n1 * s),
            Self::Lyasko => (modulus * libm::pow((1.0 - 0.5 * s) / (1.0 + s), n), n),
        }
    }
}

impl terraglue_subsystem::bytes::Persist for SlipSinkage {
    fn write(&self, out: &mut Vec<u8>) {
        let (name, n1) = match self {
            Self::None => (0_u8, 0.0),
            Self::Ding { n1 } => (1, *n1),
            Self::Lyasko => (2, 0.0),
        };
        (name, n1).write(out);
    }
    fn read(from: &mut &[u8]) -> terraglue_subsystem::Result<Self> {
        match <(u8, f64)>::read(from)? {
            (0, _) => Ok(Self::None),
            (1, n1) => Ok(Self::Ding { n1 }),
            (2, _) => Ok(Self::Lyasko),
            _ => Err(terraglue_subsystem::bytes::wrong("there is no such law of slip sinkage")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Bekker, PressureLaw};

    /// Under 8 kPa.
    fn depth(law: &PressureLaw, sinkage: &SlipSinkage, slip: f64) -> f64 {
        let curve = law.curve_in_slip(0.1, 4e8, sinkage, slip);
        curve.and_then(|curve| curve.virgin_depth(8000.0)).expect("a power law always answers")
    }

    #[test]
    fn a_slipping_contact_sinks_deeper() {
        let law = PressureLaw::Bekker(Bekker { k_c: 1400.0, k_phi: 820e3, n: 1.0 });
        for sinkage in [SlipSinkage::Ding { n1: 0.3 }, SlipSinkage::Lyasko] {
            let depth = |s| depth(&law, &sinkage, s);
            assert!((depth(0.0) - self::depth(&law, &SlipSinkage::None, 0.0)).abs() < 1e-15);
            assert!(depth(0.0) < depth(0.3) && depth(0.3) < depth(0.9));
        }
        let depth = |s| depth(&law, &SlipSinkage::Lyasko, s);
        assert!((depth(0.4) / depth(0.0) - 1.4 / 0.8).abs() < 1e-6);
    }
}
