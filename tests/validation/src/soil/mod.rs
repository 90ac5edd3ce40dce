//! Area `soil`: the promises of both soils, part by part.

mod automaton;
mod drags;
mod drive;
mod energy;
mod fit;
#[path = "../../../../modules/soil/contact/tests/support/mod.rs"]
mod fixture;
mod found_wheels;
mod grousers;
mod moves;
mod moves_picture;
mod panel;
mod plate_wheel;
mod plates;
mod real_wheel;
mod rig_scenario;
mod rows;
mod stick;
mod wheel_picture;
mod wheel_rig;
mod wheels;
mod wong_reece;

pub use automaton::print_hash;
pub use moves::press_sphere;
pub use panel::Panel;

use super::Part;
use crate::process::Outcome;
pub use plates::Maker;
use plates::level;
use terraglue_soil_bekker::SoilBekker;
use terraglue_soil_cellular_automaton::SoilCellularAutomaton;

/// The parts, in the order of the table.
pub const PARTS: [Part; 14] = [
    ("automaton", automaton::figures),
    ("cost", automaton::cost),
    ("plates", plates::figures),
    ("fit", fit::figures),
    ("plate-wheel", plate_wheel::figures),
    ("moves", moves::figures),
    ("drags", drags::figures),
    ("energy", energy::figures),
    ("wheels", wheels::figures),
    ("rig-scenario", rig_scenario::figures),
    ("found-wheels", found_wheels::figures),
    ("grousers", grousers::figures),
    ("stick", stick::figures),
    ("wong-reece", wong_reece::figures),
];

/// Draws the pictures of docs/images.
pub fn write_pictures() -> Outcome {
    automaton::write_picture()?;
    moves_picture::write_picture()?;
    wheel_picture::write_picture()
}

/// Both soils: name in the figures and how an instance is made.
pub const MODULES: [(&str, Maker); 2] =
    [("automaton", level::<SoilCellularAutomaton>), ("bekker", level::<SoilBekker>)];

/// Keys of the automaton for material that stays where it is pressed, as integrals of stresses assume: all becomes denser in
/// place, and walls stand.
const STILL: &str = r#""compacted_fraction":1.0,"angle_of_repose_rad":1.4"#;
