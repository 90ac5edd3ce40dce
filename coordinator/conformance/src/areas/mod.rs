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
pub const ALL: [fn() -> Vec<Test>; 17] = [
    library::tests,
    host_untouched::at_loading,
    law::tests,
    life_cycle::tests,
    call_order::tests,
    host_untouched::tests,
    values::tests,
    state::tests,
    numbers::tests,
    physics_soil::tests,
    soil_symmetry::tests,
    soil_cooperation::tests,
    soil_energy::tests,
    physics_robot::tests,
    physics_controller::tests,
    sight::tests,
    resources::tests,
];
