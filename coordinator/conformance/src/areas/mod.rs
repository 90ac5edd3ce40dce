//! The tests, one file per area.

mod call_order;
mod host_untouched;
mod law;
mod library;
mod life_cycle;
mod numbers;
mod physics_controller;
mod physics_robot;
mod physics_soil;
mod resources;
mod sight;
mod soil_cooperation;
mod soil_energy;
mod soil_symmetry;
mod state;
mod values;

use super::definition::Test;
pub use host_untouched::OUTPUT;

/// The lists of all areas, in the order in which they build on each other.
pub const ALL: [&[Test]; 17] = [
    library::TESTS,
    host_untouched::AT_LOADING,
    law::TESTS,
    life_cycle::TESTS,
    call_order::TESTS,
    host_untouched::TESTS,
    values::TESTS,
    state::TESTS,
    numbers::TESTS,
    physics_soil::TESTS,
    soil_symmetry::TESTS,
    soil_cooperation::TESTS,
    soil_energy::TESTS,
    physics_robot::TESTS,
    physics_controller::TESTS,
    sight::TESTS,
    resources::TESTS,
];
