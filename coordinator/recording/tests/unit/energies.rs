//! Sums of energies over a run.

use super::*;

fn drifting(drift_j: Option<f64>, turnover_j: f64) -> Energies {
    Energies { drift_j, turnover_j, ..Energies::default() }
}

#[test]
fn a_drift_is_off_beyond_a_hundredth_of_what_was_turned_over() {
    assert!(!drifting(Some(-0.9), 100.0).is_off() && drifting(Some(-1.1), 100.0).is_off());
    assert!(!drifting(Some(9e-10), 0.0).is_off() && drifting(Some(2e-9), 0.0).is_off());
    assert_eq!(drifting(Some(2.0), 0.0).drift_share(), None);
}

#[test]
fn the_drift_is_held_against_the_largest_of_what_was_turned_over() {
    let at =
        |kinetic: f64, work: f64| EnergySums { kinetic, potential: 1.0, soil_heat: 0.0, heat: 0.0, work };
    let of = |track: EnergyTrack| track.figures(&MotorWork::default());
    let ends = Some((at(0.0, 0.0), at(0.0, 2.0)));
    let driven = of(EnergyTrack { ends, work_path_j: 2.0, port_path_j: 1.0, ..EnergyTrack::default() });
    assert_eq!((driven.turnover_j, driven.measure()), (2.0, "of the motors' work"));
    // a robot that stands: its soil heats, its motors hold
    let ends = Some((at(0.0, 0.0), at(0.0, 1e-12)));
    let stands = of(EnergyTrack { ends, work_path_j: 1e-12, port_path_j: 7e-5, ..EnergyTrack::default() });
    assert_eq!((stands.turnover_j, stands.measure()), (7e-5, "of the work at the ports"));
    // one that falls
    let ends = Some((at(0.0, 0.0), at(3.0, 0.0)));
    let falls = of(EnergyTrack { ends, port_path_j: 1.0, ..EnergyTrack::default() });
    assert_eq!(falls.turnover_j, 3.0);
    assert!(falls.by_changes && !falls.by_ports);
}

#[test]
fn an_unknown_drift_is_neither_off_nor_nothing() {
    let mut unknown = drifting(None, 100.0);
    assert!(!unknown.is_off() && unknown.drift_share().is_none());
    unknown.without_book = vec!["soil".into()];
    assert_eq!(unknown.why_unknown(), "soil keeps no energy ledger");
    unknown.without_book.push("robot".into());
    assert_eq!(unknown.why_unknown(), "soil, robot keep no energy ledger");
}
