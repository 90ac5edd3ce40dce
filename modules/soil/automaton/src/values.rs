//! The automaton's own variables.

use crate::automaton::Automaton;
use terraglue_ground::UNIT_M;
use terraglue_soil_contact::Ground;
use terraglue_subsystem::{Causality, Variable};

/// The variables, numbered from `first`.
pub fn variables(first: u32) -> Vec<Variable> {
    let out = |k, name: &str, unit, help| Variable::real(first + k, name, unit, Causality::Output, help);
    let live = |k, name: &str, unit, help| Variable::real(first + k, name, unit, Causality::Parameter, help);
    vec![
        out(0, "active_nodes", "", "nodes that the next step will visit"),
        out(1, "visited_nodes", "", "visits of nodes in the last step; 0 on ground at rest"),
        out(2, "sweeps", "", "sweeps of the last step"),
        out(
            3,
            "mass_error_units",
            "",
            "units of material gained or not booked since the start; 0: none was lost",
        ),
        out(4, "mass_error_relative", "", "material gained since the start over material moved"),
        out(
            5,
            "moved_volume",
            "m^3",
            "volume of material that left its node since the start, repeats counted",
        ),
        live(6, "curvature_max_per_m", "", "largest curvature of the surface, 1/m").within(0.1, 1e6),
        live(7, "angle_of_repose_rad", "rad", "angle of repose").within(0.01, 1.4),
        live(8, "sweeps_per_step", "", "sweeps per step at most; 0: a slide's front runs sqrt(g h)")
            .within(0.0, 1e6),
        live(9, "compacted_fraction", "", "share of the pressed volume that becomes denser").within(0.0, 1.0),
        out(10, "compacted_volume", "m^3", "volume that became denser under feet since the start"),
    ]
}

/// Value of variable k.
pub fn value(automaton: &Automaton, k: u32, ground: &Ground) -> f64 {
    let counts = automaton.counts();
    let spacing = ground.heights.lattice().spacing;
    match k {
        0 => automaton.active_nodes() as f64,
        1 => counts.visited as f64,
        2 => f64::from(counts.sweeps),
        3 => counts.gained as f64,
        4 => counts.gained as f64 / (counts.moved.max(1)) as f64,
        5 => counts.moved as f64 * UNIT_M * spacing * spacing,
        6 => automaton.settings().curvature_max,
        7 => automaton.repose(),
        8 => automaton.settings().sweeps_per_step.unwrap_or(0.0),
        9 => automaton.settings().compacted_fraction,
        10 => automaton.compaction().total() as f64 * UNIT_M * spacing * spacing,
        _ => f64::NAN,
    }
}
