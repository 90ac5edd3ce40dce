//! Properties of every soil: rest, plates, stick, shear, derivatives, states, energy.

#[path = "../../contact/tests/support/bars.rs"]
mod bars;
#[path = "../../contact/tests/support/mod.rs"]
mod support;

bars::contact_tests!(terraglue_soil_cellular_automaton::SoilCellularAutomaton, false);
