//! What every soil must hold: rest, plates, stick, shear, derivatives, states, energy.

#[path = "../../../interfaces/soil-contact/tests/support/bars.rs"]
mod bars;
#[path = "../../../interfaces/soil-contact/tests/support/mod.rs"]
mod support;

use support::{DRY_SAND, LETE, LUNAR};
use terraglue_soil_cellular_automaton::SoilCellularAutomaton as Soil;

#[test]
fn a_ball_rests_in_the_plain_pass() {
    for soil in [LUNAR, LETE, DRY_SAND] {
        bars::ball_rests::<Soil>(soil, false);
    }
}

#[test]
fn a_ball_rests_under_the_iteration() {
    for soil in [LUNAR, LETE, DRY_SAND] {
        bars::ball_rests::<Soil>(soil, true);
    }
}

#[test]
fn plates_follow_the_pressure_law() {
    bars::plates_follow_bekker::<Soil>(LUNAR, [1.0, 1400.0, 820e3], false);
    bars::plates_follow_bekker::<Soil>(LETE, [0.793, 102e3, 5301e3], false);
    bars::plates_follow_bekker::<Soil>(DRY_SAND, [1.1, 990.0, 1_528_430.0], false);
}

#[test]
fn a_disc_sticks_below_its_limit_and_slides_above() {
    for share in [0.3, 0.9] {
        bars::disc_sticks::<Soil>(share);
    }
}

#[test]
fn a_plate_shears_after_janosi_and_hanamoto() {
    bars::plate_shears::<Soil>();
}

#[test]
fn derivatives_are_those_of_the_answers() {
    for soil in [LUNAR, LETE, DRY_SAND] {
        bars::derivatives_are_exact::<Soil>(soil);
    }
}

#[test]
fn the_inverse_of_the_normal_law_is_exact() {
    for soil in [LUNAR, LETE, DRY_SAND] {
        bars::normal_inverse_is_exact::<Soil>(soil);
    }
}

#[test]
fn a_gap_is_reported_from_the_unrounded_state() {
    bars::gap_is_reported::<Soil>();
}

#[test]
fn saved_states_come_back_exactly() {
    bars::states_are_exact::<Soil>();
}

#[test]
fn energy_goes_into_storage_or_heat() {
    for soil in [LUNAR, LETE, DRY_SAND] {
        bars::energy_balances::<Soil>(soil);
    }
}

#[test]
fn regions_of_a_mask_have_their_laws() {
    bars::regions_have_their_laws::<Soil>();
    bars::derivatives_are_exact::<Soil>(&bars::two_soils());
    bars::normal_inverse_is_exact::<Soil>(&bars::two_soils());
}

#[test]
fn adhesion_pulls_only_where_it_is_set_and_lets_go() {
    bars::adhesion_holds_until_it_lets_go::<Soil>(false);
}

#[test]
fn no_law_yields_energy_in_cycles() {
    bars::cycles_yield_no_energy::<Soil>(false);
}
