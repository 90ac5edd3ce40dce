//! The numbers of one soil and the laws made from them.

use crate::pressure::PressureLaw;
use crate::shear::ShearLaw;
use terraglue_subsystem::{Config, Error, Parameter, ParameterType, Result};

/// Elastic stiffness of unloading where a scenario is silent, Pa/m.
pub const DEFAULT_ELASTIC_STIFFNESS: f64 = 4e8;

/// Parameters of a soil; the names are the keys of a scenario and the columns of `models/soils.csv`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(non_snake_case)]
pub struct SoilParameters {
    /// Exponent of the pressure–sinkage law.
    pub n: f64,
    /// Cohesive modulus, N/m^(n+1).
    pub k_c: f64,
    /// Frictional modulus, N/m^(n+2).
    pub k_phi: f64,
    /// Cohesion, Pa.
    pub c_pa: f64,
    /// Angle of internal friction, rad.
    pub phi_rad: f64,
    /// Shear deformation modulus, m.
    pub K_m: f64,
    /// Bulk density where known, kg/m³.
    pub density_kg_m3: Option<f64>,
    /// Stiffness of unloading and reloading, Pa/m.
    pub elastic_stiffness_pa_m: f64,
}

impl SoilParameters {
    /// What a module that uses these laws takes from its scenario table.
    pub fn schema() -> Vec<Parameter> {
        let number = |name, unit: &str, help| Parameter {
            unit: unit.into(),
            ..Parameter::of(name, ParameterType::Number, help)
        };
        vec![
            number("n", "", "exponent of p = (k_c/b + k_phi) z^n").within(0.05, 3.0),
            number("k_c", "", "cohesive modulus, N/m^(n+1)").within(0.0, 1e9),
            number("k_phi", "", "frictional modulus, N/m^(n+2)").positive(),
            number("c_pa", "Pa", "cohesion").within(0.0, 1e7),
            number("phi_rad", "rad", "angle of internal friction").within(0.01, 1.2),
            number("K_m", "m", "shear deformation modulus of Janosi and Hanamoto").positive(),
            number("density_kg_m3", "kg/m^3", "bulk density").positive().optional(),
            Parameter::number(
                "elastic_stiffness_pa_m",
                "Pa/m",
                DEFAULT_ELASTIC_STIFFNESS,
                "stiffness of unloading and reloading",
            )
            .positive(),
        ]
    }

    /// Reads the parameters of an instance. Refused: a missing or non-positive number where one is needed.
    pub fn from_config(config: &Config) -> Result<Self> {
        let parameters = Self {
            n: config.number("n")?,
            k_c: config.number("k_c")?,
            k_phi: config.number("k_phi")?,
            c_pa: config.number("c_pa")?,
            phi_rad: config.number("phi_rad")?,
            K_m: config.number("K_m")?,
            density_kg_m3: config.optional_number("density_kg_m3")?,
            elastic_stiffness_pa_m: config
                .optional_number("elastic_stiffness_pa_m")?
                .unwrap_or(DEFAULT_ELASTIC_STIFFNESS),
        };
        parameters.check().map(|()| parameters)
    }

    /// Refuses numbers with which the laws make no sense.
    pub fn check(&self) -> Result {
        for (name, value) in [
            ("n", self.n),
            ("k_phi", self.k_phi),
            ("phi_rad", self.phi_rad),
            ("K_m", self.K_m),
            ("elastic_stiffness_pa_m", self.elastic_stiffness_pa_m),
        ] {
            if !(value.is_finite() && value > 0.0) {
                return Err(Error::Refused(format!("`{name}` = {value} must be larger than zero")));
            }
        }
        for (name, value) in [("k_c", self.k_c), ("c_pa", self.c_pa)] {
            if !(value.is_finite() && value >= 0.0) {
                return Err(Error::Refused(format!("`{name}` = {value} must not be negative")));
            }
        }
        Ok(())
    }

    /// The pressure law.
    pub fn pressure(&self) -> PressureLaw {
        PressureLaw::Bekker { k_c: self.k_c, k_phi: self.k_phi, n: self.n }
    }

    /// The shear law.
    pub fn shear(&self) -> ShearLaw {
        ShearLaw::new(self.c_pa, self.phi_rad, self.K_m, self.elastic_stiffness_pa_m)
    }
}
