//! Bekker's pressure and the shear of Janosi and Hanamoto as a law of its own, for comparison with the built-in one.
use terraglue_subsystem::{
    Kind, LawModule, Parameter, PressureAnswer, PressureNodes, Result, Schema, ShearAnswer, ShearNodes,
};

/// The law.
pub struct BekkerLaw;
terraglue_plugin::export_law!(BekkerLaw);

impl LawModule for BekkerLaw {
    fn schema() -> Schema {
        let number = |name, unit, default, help| Parameter::number(name, unit, default, help);
        Schema {
            name: "law-bekker".into(),
            kind: Kind::Law,
            help: "Bekker's pressure and the shear of Janosi and Hanamoto".into(),
            parameters: vec![
                number("n", "", 1.0, "exponent"),
                number("k_c", "", 1400.0, "cohesive modulus, N/m^(n+1)"),
                number("k_phi", "", 820e3, "frictional modulus, N/m^(n+2)"),
                number("c_pa", "Pa", 170.0, "cohesion"),
                number("phi_rad", "rad", 0.61, "angle of friction"),
                number("K_m", "m", 0.018, "shear modulus").positive(),
            ],
        }
    }

    fn pressure(p: &[f64], at: &PressureNodes, out: &mut PressureAnswer) -> Result {
        let modulus = p[1] / at.b + p[2];
        for ((z, pressure), slope) in at.depth.iter().zip(&mut *out.pressure).zip(&mut *out.slope) {
            *pressure = modulus * libm::pow(*z, p[0]);
            *slope = p[0] * *pressure / z;
        }
        Ok(())
    }

    fn shear(p: &[f64], at: &ShearNodes, out: &mut ShearAnswer) -> Result {
        let mu = libm::tan(p[4]);
        for (i, (sigma, slip)) in at.pressure.iter().zip(at.slip).enumerate() {
            let (strength, mobilised) = (p[3] + mu * sigma, -libm::expm1(-slip / p[5]));
            out.stress[i] = strength * mobilised;
            out.by_pressure[i] = mu * mobilised;
            out.by_slip[i] = strength * (1.0 - mobilised) / p[5];
        }
        Ok(())
    }
}
