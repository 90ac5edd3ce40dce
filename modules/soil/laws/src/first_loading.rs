//! First loading under a contact of one size: the answer of a law of pressure and sinkage, for all nodes below it.

use crate::expression::Program;
use crate::plugin::PluginLaw;
use terraglue_subsystem::Result;

/// First loading under a contact of one size: pressure over depth.
#[derive(Clone, Debug, PartialEq)]
#[allow(clippy::large_enum_variant)] // one per contact and step; a box would allocate
pub enum FirstLoading {
    /// modulus·z^exponent.
    Power {
        /// Pa/m^exponent.
        modulus: f64,
        /// Exponent.
        exponent: f64,
    },
    /// Written in the scenario.
    Program(Program),
    /// A module of its own, under a contact of this size (m).
    Module(PluginLaw, f64),
}

impl FirstLoading {
    /// Pressure (Pa) and slope (Pa/m) of the law itself at one depth z > 0 (m).
    ///
    /// # Errors
    /// The law has no answer there.
    #[inline]
    pub fn at(&self, z: f64) -> Result<(f64, f64)> {
        match self {
            Self::Power { modulus, exponent } if *exponent == 1.0 => Ok((modulus * z, *modulus)),
            Self::Power { modulus, exponent } => {
                let p = modulus * libm::pow(z, *exponent);
                Ok((p, exponent * p / z))
            }
            Self::Program(program) => Ok(program.depth(z)),
            Self::Module(law, b) => law.at(*b, z),
        }
    }

    /// Pressures (Pa) and slopes (Pa/m) of the law itself at depths (m); all slices have one length.
    ///
    /// # Errors
    /// The law has no answer at one of them.
    #[inline]
    pub fn at_all(&self, z: &[f64], p: &mut [f64], slope: &mut [f64]) -> Result {
        match self {
            Self::Power { .. } => {
                for ((z, p), slope) in z.iter().zip(p).zip(slope) {
                    (*p, *slope) = self.at(*z)?;
                }
            }
            Self::Program(program) => program.eval_all([z], p, [slope]),
            Self::Module(law, b) => law.first_loading(*b, z, p, slope)?,
        }
        Ok(())
    }

    /// The same only to look at the law: NaN where it has no answer.
    pub(crate) fn look(&self, z: &[f64], p: &mut [f64], slope: &mut [f64]) {
        match self {
            Self::Module(law, b) => law.look(*b, z, p, slope),
            _ if self.at_all(z, p, slope).is_ok() => {}
            _ => p.fill(f64::NAN),
        }
    }
}
