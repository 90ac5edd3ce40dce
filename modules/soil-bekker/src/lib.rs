//! Soil after Bekker with unloading, Mohr-Coulomb strength and Janosi-Hanamoto shear.
//!
//! Pressure and shear act node by node as `terraglue-soil-law` says. The permanent sinkage lowers the ground under
//! the foot: the soil is compacted, nothing is heaped up beside it. Where the displaced material goes is the
//! business of `soil-cellular-automaton`.

use std::sync::Arc;
use terraglue_soil_contact::{Covered, FieldSoil, Ground, Material};
use terraglue_subsystem::{Config, Host, Kind, Module, Result, Schema, Subsystem};

/// The module.
pub struct SoilBekker;

impl Module for SoilBekker {
    fn schema() -> Schema {
        Schema {
            name: "soil-bekker".into(),
            kind: Kind::Soil,
            help: "Bekker pressure-sinkage with unloading, Mohr-Coulomb and Janosi-Hanamoto shear".into(),
            parameters: terraglue_soil_contact::schema(),
        }
    }

    fn instantiate(config: &Config, host: Arc<dyn Host>) -> Result<Box<dyn Subsystem>> {
        Ok(Box::new(FieldSoil::new(config, host, Compaction)?))
    }
}

/// Lowers the ground to the depth that stays when the foot leaves.
#[derive(Clone, Copy, Debug, Default)]
pub struct Compaction;

impl Material for Compaction {
    type Saved = ();

    fn settle(&mut self, ground: &mut Ground, covered: &[Covered], _: &[[i32; 2]], _: f64) {
        for node in covered.iter().filter(|node| node.pressure > 0.0) {
            let units = ground.surface_units(node.i, node.j);
            ground.heights.set_units(node.i, node.j, units);
        }
    }
}
