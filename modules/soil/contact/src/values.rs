//! The variables that every soil has: how deep it was pressed, and the parameters of its laws.

use crate::bookkeeping::EnergyLedger;
use terraglue_soil_law::SoilParameters;
use terraglue_subsystem::{Causality, Error, Result, Variable};

/// Number of shared variables; a material's own follow.
pub const SHARED: u32 = 12;

/// The shared variables.
pub fn shared() -> Vec<Variable> {
    let out = |id, name: &str, unit, help| Variable::real(id, name, unit, Causality::Output, help);
    let live = |id, name: &str, unit, help| Variable::real(id, name, unit, Causality::Parameter, help);
    vec![
        out(0, "max_sinkage", "m", "largest depth under a foot below the initial surface since the start"),
        out(1, "loaded_nodes", "", "nodes that carry pressure"),
        live(2, "n", "", "exponent of p = (k_c/b + k_phi) z^n").within(0.05, 3.0),
        live(3, "k_c", "", "cohesive modulus, N/m^(n+1)").within(0.0, 1e9),
        live(4, "k_phi", "", "frictional modulus, N/m^(n+2)").within(0.0, 1e12),
        live(5, "c_pa", "Pa", "cohesion").within(0.0, 1e7),
        live(6, "phi_rad", "rad", "angle of internal friction").within(0.01, 1.2),
        live(7, "K_m", "m", "shear deformation modulus of Janosi and Hanamoto").within(1e-6, 10.0),
        live(8, "elastic_stiffness_pa_m", "Pa/m", "stiffness of unloading and reloading").within(1e4, 1e12),
        out(9, "heat", "J", "energy that the soil has turned into heat since the start"),
        out(10, "elastic_energy", "J", "elastic energy of the soil below and beside feet"),
        out(
            11,
            "gravitational_energy",
            "J",
            "gravitational energy that the material has gained since the start",
        ),
    ]
}

/// Value of a shared variable.
pub fn get(id: u32, ledger: &EnergyLedger, p: &SoilParameters) -> Option<f64> {
    Some(match id {
        0 => ledger.max_sinkage,
        1 => f64::from(ledger.loaded),
        2 => p.n,
        3 => p.k_c,
        4 => p.k_phi,
        5 => p.c_pa,
        6 => p.phi_rad,
        7 => p.K_m,
        8 => p.unloading(),
        9 => ledger.dissipated,
        10 => ledger.elastic,
        11 => ledger.lifted,
        _ => return None,
    })
}

/// Changes a shared parameter after a check of its bounds.
pub fn set(variable: &Variable, value: f64, p: &mut SoilParameters) -> Result {
    check(variable, value)?;
    let mut changed = *p;
    match variable.id {
        2 => changed.n = value,
        3 => changed.k_c = value,
        4 => changed.k_phi = value,
        5 => changed.c_pa = value,
        6 => changed.phi_rad = value,
        7 => changed.K_m = value,
        8 => changed.elastic_stiffness_pa_m = Some(value),
        _ => return Err(Error::Refused(format!("`{}` can only be read", variable.name))),
    }
    changed.check()?;
    *p = changed;
    Ok(())
}

/// Refuses a value that is not a number or outside the bounds of the variable.
pub fn check(variable: &Variable, value: f64) -> Result {
    let inside = value >= variable.min && value <= variable.max;
    if inside {
        return Ok(());
    }
    let Variable { name, min, max, .. } = variable;
    Err(Error::Refused(format!("`{name}` = {value} is outside {min} … {max}")))
}
