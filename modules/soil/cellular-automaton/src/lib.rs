//! Soil as a cellular automaton: angle of repose, curvature, active nodes, force-equivalent height.
//!
//! The module `soil-cellular-automaton`: the paper's automaton under the laws of pressure and shear that all soils share.
//!
//! `terraglue-soil-material` moves the material, `terraglue-soil-contact` computes the force on a foot.

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

pub use terraglue_soil_material::{Automaton, Compaction, Counts, Settings, Sweeper, relax};

use std::sync::Arc;
use terraglue_soil_contact::FieldSoil;
use terraglue_soil_material::DEFAULT_COMPACTION;
use terraglue_subsystem::{Config, Host, Kind, Module, Result, Schema, Subsystem};

/// The module.
pub struct SoilCellularAutomaton;

impl Module for SoilCellularAutomaton {
    fn schema() -> Schema {
        let mut parameters = terraglue_soil_contact::schema();
        parameters.extend(terraglue_soil_material::schema(DEFAULT_COMPACTION));
        Schema {
            name: "soil-cellular-automaton".into(),
            kind: Kind::Soil,
            help: "cellular automaton that moves material; pressure and shear by the shared soil laws".into(),
            parameters,
        }
    }

    fn instantiate(config: &Config, host: Arc<dyn Host>) -> Result<Box<dyn Subsystem>> {
        let automaton = Automaton::new(Settings::from_config(config)?, host.clone());
        Ok(Box::new(FieldSoil::new(config, host, automaton)?))
    }
}
