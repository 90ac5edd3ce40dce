//! Soil after Bekker with unloading, Mohr-Coulomb strength and Janosi-Hanamoto shear.
//!
//! Pressure and shear act node by node as in `terraglue-soil-law`. The permanent sinkage lowers the ground under
//! the foot: the soil is compacted, nothing is heaped up around it. With `material_transport` the ruts slide by the
//! rules of the automaton (`terraglue-soil-material`); pressed soil still becomes denser in place, unless
//! `compacted_fraction` sends a part of it to the rim.

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

use std::sync::Arc;
use terraglue_soil_contact::{Covered, FieldSoil, Ground, Material};
use terraglue_soil_material::{Automaton, Settings};
use terraglue_subsystem::{Config, Host, Kind, Module, Parameter, ParameterType, Result, Schema, Subsystem};

/// The module.
pub struct SoilBekker;

impl Module for SoilBekker {
    fn schema() -> Schema {
        Schema {
            name: "soil-bekker".into(),
            kind: Kind::Soil,
            help: "Bekker pressure-sinkage with unloading, Mohr-Coulomb and Janosi-Hanamoto shear".into(),
            parameters: parameters(),
        }
    }

    fn instantiate(config: &Config, host: Arc<dyn Host>) -> Result<Box<dyn Subsystem>> {
        if config.flag(TRANSPORT)? {
            let settings = Settings::from_config(&config.clone().with_defaults(&Self::schema()))?;
            return Ok(Box::new(FieldSoil::new(config, host.clone(), Automaton::new(settings, host))?));
        }
        Ok(Box::new(FieldSoil::new(config, host, Compaction)?))
    }
}

/// Key of the option.
const TRANSPORT: &str = "material_transport";
/// Default share of the pressed volume that becomes denser: all, as without transport.
const ALL: f64 = 1.0;

fn parameters() -> Vec<Parameter> {
    let mut parameters = terraglue_soil_contact::schema();
    let help = "material slides by the rules of the automaton: the walls of ruts fall in, mass is conserved";
    parameters.push(Parameter::of(TRANSPORT, ParameterType::Bool, help).or(false));
    parameters.extend(terraglue_soil_material::schema(ALL));
    parameters
}

/// Lowers the ground to the depth that stays when the foot leaves.
#[derive(Clone, Copy, Debug, Default)]
pub struct Compaction;

impl Material for Compaction {
    type Saved = ();
    const READS_VIRGIN: bool = false;

    fn redistribute(&mut self, ground: &mut Ground, covered: &[Covered], _: f64, _: f64) -> f64 {
        for node in covered.iter().filter(|node| node.pressure > 0.0) {
            let units = ground.surface_units(node.i, node.j);
            ground.heights.set_units(node.i, node.j, units);
        }
        // compacted material stays at its height
        0.0
    }
}
