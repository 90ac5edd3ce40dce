//! A ball at rest on the automaton.

#[path = "../../../interfaces/soil-contact/tests/support/bars.rs"]
mod bars;
#[path = "../../../interfaces/soil-contact/tests/support/mod.rs"]
mod support;

use support::{DRY_SAND, LETE, LUNAR};
use terraglue_soil_cellular_automaton::SoilCellularAutomaton;

#[test]
fn a_ball_rests_in_the_plain_pass() {
    for soil in [LUNAR, LETE, DRY_SAND] {
        bars::ball_rests::<SoilCellularAutomaton>(soil, false);
    }
}

#[test]
fn a_ball_rests_under_the_iteration() {
    for soil in [LUNAR, LETE, DRY_SAND] {
        bars::ball_rests::<SoilCellularAutomaton>(soil, true);
    }
}
