//! The pressure laws that can be fitted to plate tests, their numbers, and the readings that they are fitted to.
//!
//! All of them have the form p = (A·u(b) + B·w(b))·x(z, b)ⁿ with A, B ≥ 0.

/// One reading of a plate test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Number of the curve, one press of one plate, that it belongs to.
    pub curve: usize,
    /// Size of the contact in the law, m: radius of a disc, short side of a rectangle.
    pub b: f64,
    /// Sinkage, m, > 0.
    pub depth: f64,
    /// Pressure, Pa, > 0.
    pub pressure: f64,
}

/// The laws that can be fitted; the factors A and B are found, see [`terraglue_soil_law::PressureLaw`] for their meaning.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum FitLaw {
    /// p = (A/b + B)·zⁿ: A = k_c, B = k_φ.
    Bekker,
    /// p = (A + B·b)·(z/b)ⁿ: A = c·k_c', B = γ·k_φ'.
    Reece,
    /// p = (A + B·b)·(z/z_r)ⁿ: A = c·N_c, B = γ·N_γ.
    Bearing {
        /// z_r, m.
        reference: f64,
    },
}

impl FitLaw {
    /// u, w and ln x of a reading.
    pub(crate) fn terms(&self, b: f64, depth: f64) -> [f64; 3] {
        match *self {
            Self::Bekker => [1.0 / b, 1.0, libm::log(depth)],
            Self::Reece => [1.0, b, libm::log(depth / b)],
            Self::Bearing { reference } => [1.0, b, libm::log(depth / reference)],
        }
    }
}

/// The numbers of a law.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct PlateNumbers {
    /// A, the cohesive factor.
    pub cohesive: f64,
    /// B, the frictional factor.
    pub frictional: f64,
    /// n.
    pub n: f64,
}

impl PlateNumbers {
    /// ln p of the law at a size and a depth.
    pub fn ln_pressure(&self, law: &FitLaw, b: f64, depth: f64) -> f64 {
        let [u, w, x] = law.terms(b, depth);
        libm::log(self.cohesive * u + self.frictional * w) + self.n * x
    }

    /// Root of the mean square of ln(p/p_measured).
    pub fn rms(&self, law: &FitLaw, readings: &[Reading]) -> f64 {
        let square = |r: &Reading| {
            let e = self.ln_pressure(law, r.b, r.depth) - libm::log(r.pressure);
            e * e
        };
        (readings.iter().map(square).sum::<f64>() / readings.len() as f64).sqrt()
    }
}

/// Why nothing can be fitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FitError {
    /// Fewer than four readings with positive size, depth and pressure.
    TooFew,
    /// All readings have one depth: the exponent is free.
    OneDepth,
    /// The pressure falls with the depth: the exponent is not positive.
    Falls,
}

impl std::fmt::Display for FitError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::TooFew => "fewer than four readings can be used",
            Self::Falls => "the pressure falls as the sinkage grows, which no law of a soil does",
            Self::OneDepth => "all readings have the same sinkage: the exponent n cannot be found",
        })
    }
}

impl std::error::Error for FitError {}
