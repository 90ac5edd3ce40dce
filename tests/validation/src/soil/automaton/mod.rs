//! The cellular automaton: slopes, curvature, mass, reproducibility, contact geometry, cost.

mod cone;
mod cost;
#[path = "../../../../../modules/soil/cellular-automaton/tests/suite/feet/mod.rs"]
mod feet;
mod field;
mod footprint;
mod geometry;
mod hash;
mod machine;
mod mass;
mod picture;

pub use feet::Soil;
pub use hash::print as print_hash;
pub use picture::write_picture;

use crate::process::Outcome;
use crate::{Context, Figure};

/// Default of κ_max, 1/m.
const CURVATURE: f64 = 40.0;

/// All figures but those that a clock measures.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    let mut all = cone::cones(context)?;
    all.extend(cone::planes(context)?);
    all.extend(footprint::figures(context)?);
    all.push(mass::figure(context)?);
    all.extend(hash::figures(context)?);
    all.extend(geometry::figures(context));
    Ok(all)
}

/// Cost of the automaton; nothing where no clock is to be read.
pub fn cost(context: &Context) -> Outcome<Vec<Figure>> {
    if !context.timing {
        return Ok(Vec::new());
    }
    Ok(cost::figures(context)?.into_iter().map(Figure::timed).collect())
}

/// The automaton itself on level ground.
pub fn automaton_on(config: &str, size: u32, spacing: f64) -> Soil {
    let terrain = field::Function { size: [size; 2], spacing, height: |_, _| 0.0 };
    let machine = std::sync::Arc::new(machine::Machine::new(Box::new(terrain), 1));
    feet::instance::<terraglue_soil_cellular_automaton::SoilCellularAutomaton>(config, machine)
}
