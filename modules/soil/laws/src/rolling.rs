//! Parameters of wheels alone: the effect of their slip and of the place of their largest stress on the laws.

use crate::slip_sinkage::SlipSinkage;
use terraglue_subsystem::{Config, Error, Parameter, ParameterType, Result};

/// Names of the laws of slip sinkage as a scenario writes them.
pub const SLIP_SINKAGES: [&str; 3] = ["none", "ding", "lyasko"];

/// Options of wheels.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Rolling {
    /// Slip sinkage.
    pub sinkage: SlipSinkage,
    /// a_0 and a_1 of the angle of the largest stress, θ_m = (a_0 + a_1·s)·θ_f (Wong and Reece 1967, J. Terramechanics
    /// 4, eq. 3). `None`: the stress follows the depth and is largest at the bottom.
    pub peak: Option<[f64; 2]>,
    /// Shear deformation modulus across the direction of travel, m. `None`: as along it.
    pub across: Option<f64>,
}

impl Rolling {
    /// Parameters in the scenario table of a module.
    pub fn schema() -> Vec<Parameter> {
        let number = |name, unit: &str, help| Parameter {
            unit: unit.into(),
            ..Parameter::of(name, ParameterType::Number, help).optional()
        };
        vec![
            Parameter::of(
                "slip_sinkage",
                ParameterType::Text,
                "wheels: how slip s digs; ding: exponent n + slip_sinkage_n1 s; lyasko: (1+s)/(1-s/2) times the depth",
            )
            .or(SLIP_SINKAGES[0])
            .choices(&SLIP_SINKAGES),
            number("slip_sinkage_n1", "", "ding: n_1").within(-1.0, 2.0),
            number("wheel_peak_a0", "", "wheels: angle of the largest stress (a_0 + a_1 s) theta_f; at the bottom where absent")
                .within(0.0, 0.95),
            number("wheel_peak_a1", "", "wheels: a_1").within(-0.95, 0.95),
            number("K_across_m", "m", "wheels: shear deformation modulus across the travel; K_m where absent").positive().usually("m", 0.002, 0.12),
        ]
    }

    /// Reads the options. Refused: an option without the number that it needs.
    ///
    /// # Errors
    /// [`Error::Refused`]: an option without the number that it needs, or a number without its option.
    pub fn from_config(config: &Config) -> Result<Self> {
        let name = config.get("slip_sinkage").and_then(|v| v.as_str()).unwrap_or(SLIP_SINKAGES[0]);
        let n1 = config.optional_number("slip_sinkage_n1")?;
        let sinkage = match (name, n1) {
            ("ding", Some(n1)) => SlipSinkage::Ding { n1 },
            ("ding", None) => {
                return Err(Error::Refused("`slip_sinkage` = \"ding\" needs `slip_sinkage_n1`".into()));
            }
            (_, Some(_)) => {
                return Err(Error::Refused(
                    "`slip_sinkage_n1` acts with `slip_sinkage` = \"ding\" only".into(),
                ));
            }
            ("lyasko", None) => SlipSinkage::Lyasko,
            _ => SlipSinkage::None,
        };
        let [a0, a1] = ["wheel_peak_a0", "wheel_peak_a1"].map(|key| config.optional_number(key));
        let peak = match (a0?, a1?) {
            (None, Some(_)) => return Err(Error::Refused("`wheel_peak_a1` needs `wheel_peak_a0`".into())),
            (a0, a1) => a0.map(|a0| [a0, a1.unwrap_or(0.0)]),
        };
        Ok(Self { sinkage, peak, across: config.optional_number("K_across_m")? })
    }

    /// θ_m/θ_f at the slip `slip`; 0 without a shifted peak.
    pub fn peak_share(&self, slip: f64) -> f64 {
        self.peak.map_or(0.0, |[a0, a1]| (a0 + a1 * slip.clamp(0.0, 1.0)).clamp(0.0, 0.95))
    }
}

terraglue_subsystem::persist!(Rolling { sinkage, peak, across });
