//! The list of the automaton's own variables.

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
