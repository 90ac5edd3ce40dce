//! Properties of every soil: rest, plates, stick, shear, derivatives, states, energy.

use crate::bars;
use crate::support;

bars::contact_tests!(terraglue_soil_cellular_automaton::SoilCellularAutomaton, false);
