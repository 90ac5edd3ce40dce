//! The module soil-cellular-automaton as a dynamic library.
terraglue_plugin::export_subsystem!(terraglue_soil_cellular_automaton::SoilCellularAutomaton);
