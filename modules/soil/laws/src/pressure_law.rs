//! The choice among the laws of pressure and sinkage, and the curve of the chosen one under a contact.

use crate::bearing_capacity::BearingCapacity;
use crate::bekker::Bekker;
use crate::expression::PressureExpression;
use crate::first_loading::FirstLoading;
use crate::plugin::PluginLaw;
use crate::pressure_curve::PressureCurve;
use crate::pressure_sinkage::PressureSinkage;
use crate::reece::Reece;
use crate::slip_sinkage::SlipSinkage;
use terraglue_subsystem::Result;

/// The law of a soil; [`PressureLaw::curve`] fixes it for the size of a contact.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum PressureLaw {
    /// p = (k_c/b + k_φ)·zⁿ.
    Bekker(Bekker),
    /// p = (c·k_c' + γ·b·k_φ')·(z/b)ⁿ.
    Reece(Reece),
    /// p = (c·N_c + γ·b·N_γ)·(z/z_r)ⁿ.
    BearingCapacity(BearingCapacity),
    /// Written in the scenario, see [`crate::expression`].
    Expression(PressureExpression),
    /// A module of its own.
    Plugin(PluginLaw),
}

/// Names of the built-in laws as a scenario writes them.
pub const PRESSURE_LAWS: [&str; 3] = ["bekker", "reece", "bearing"];

/// Depths and sizes at which [`PressureLaw::unloading`] looks at a law, m: those of the measurement, and those of a light foot or
/// wheel, where first loading is stiffer (n < 1, k_c/b) and would stay elastic otherwise.
const LOOKS: [[f64; 2]; 2] = [[0.02, 0.05], [0.002, 0.02]];
/// Stiffness of unloading over the secant of first loading there: LETE sand, whose k_u = A_u·z_u with A_u = 503 MPa/m² (Wong
/// 1984; Wong 2010, table 4.1) is 10.1 MPa/m at 2 cm, where k_c = 1.16 kN/m^1.611, k_φ = 475 kN/m^2.611 and n = 0.611 of the same
/// tests give a secant of 2.28 MPa/m.
const UNLOADING: f64 = 4.4;
/// Stiffness of unloading under a law that answers for unloading itself, Pa/m; its shear springs back with it.
const KEEPERS: f64 = 1e7;

impl PressureLaw {
    /// Whether it answers for unloading itself, from a state that it keeps at each node.
    pub fn keeps(&self) -> bool {
        matches!(self, Self::Plugin(law) if law.state_doubles() > 0)
    }

    /// The law behind the choice.
    pub fn law(&self) -> &dyn PressureSinkage {
        match self {
            Self::Bekker(law) => law,
            Self::Reece(law) => law,
            Self::BearingCapacity(law) => law,
            Self::Expression(law) => law,
            Self::Plugin(law) => law,
        }
    }

    /// The curve under a contact of smaller dimension `b` (m; radius of a disc, short side of a rectangle) with
    /// the unloading stiffness `k_u` (Pa/m).
    ///
    /// # Errors
    /// The law, which is a module, has no answer.
    pub fn curve(&self, b: f64, k_u: f64) -> Result<PressureCurve> {
        self.curve_in_slip(b, k_u, &SlipSinkage::None, 0.0)
    }

    /// The same under a contact that slips by `slip` (0: rolls or stands, 1: spins on the spot), which sinks deeper by
    /// `sinkage`.
    ///
    /// # Errors
    /// The law, which is a module, has no answer.
    pub fn curve_in_slip(&self, b: f64, k_u: f64, sinkage: &SlipSinkage, slip: f64) -> Result<PressureCurve> {
        let law = self.law();
        match law.under(b) {
            FirstLoading::Power { modulus, exponent } => {
                let (modulus, exponent) = sinkage.apply(modulus, exponent, slip);
                Ok(PressureCurve::new(modulus, exponent, k_u))
            }
            other => PressureCurve::of(other, k_u, law.is_gentle_at(k_u)),
        }
    }

    /// Default stiffness of unloading and reloading, Pa/m: 4.4 times that of first loading down to 2 cm under a contact
    /// of 5 cm, as Wong (1984) measured in sand.
    ///
    /// # Errors
    /// The law, which is a module, has no answer.
    pub fn unloading(&self) -> Result<f64> {
        let law = self.law();
        if law.state_doubles() > 0 {
            return Ok(KEEPERS);
        }
        let mut stiffest: f64 = 0.0;
        for [depth, size] in LOOKS {
            let pressure = match law.under(size) {
                FirstLoading::Power { modulus, exponent } => modulus * libm::pow(depth, exponent),
                other => other.at(depth)?.0,
            };
            stiffest = f64::max(stiffest, pressure / depth);
        }
        Ok(UNLOADING * stiffest)
    }
}
