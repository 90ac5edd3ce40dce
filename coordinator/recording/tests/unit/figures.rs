//! The figures that a run is judged by, in closed form: work, distance asked for, prints, peak force, height.

use super::fixture::*;
use super::*;
use terraglue_subsystem::{Causality, Variable};

/// A second of the synthetic walk, recorded.
fn summary_of(fixture: &mut Fixture) -> Summary {
    let f = tempfile::tempdir().expect("temporary folder");
    let mut recorder =
        Recorder::create(f.path(), &fixture.scenario, RecorderOptions::default()).expect("created");
    fixture.run(&mut recorder, 1000).expect("ran");
    recorder.finish(2.0, 1.5, None, Status::Done).expect("finished")
}

#[test]
fn motors_drive_and_brake_and_a_metre_costs_both() {
    let s = summary_of(&mut Fixture::new("iterative"));
    // 4 N m against 0.3·2π·cos(2πt) rad/s: as much forwards as back, 2.4 J in half a second each.
    let e = &s.energy.energies;
    assert!((e.driving_j - 2.4).abs() < 4e-3 && (e.braking_j - 2.4).abs() < 4e-3, "{e:?}");
    assert!((e.driving_j + e.braking_j - s.energy.energy_j).abs() < 1e-12);
    let near = |a: Option<f64>, b: f64| assert!((a.expect("known") / b - 1.0).abs() < 1e-9, "{a:?} {b}");
    near(s.energy.energy_j_per_m, s.energy.energy_j / SPEED);
    near(s.energy.electrical_energy_j, 3.0);
    near(s.energy.electrical_energy_j_per_m, 3.0 / SPEED);
    near(s.energy.electrical_cost_of_transport, 3.0 / (25.0 * 1.62 * SPEED));
}

#[test]
fn what_a_controller_tells_is_of_the_step_before_and_what_it_is_told_of_the_next() {
    let asked = |causality: Causality| {
        let mut fixture = Fixture::new("iterative");
        fixture.parts[0].1.tell(Variable::real(0, "speed", "m/s", causality, "speed"));
        let mut observer = SummaryObserver::new(&fixture.scenario);
        fixture.parts[0].1.speed = 0.0;
        fixture.start(&mut observer).expect("started");
        fixture.parts[0].1.speed = 0.2;
        fixture.show(1, &mut observer).expect("stepped");
        observer.summary(1.0, 1.0, None, Status::Done).motion.commanded_distance_m
    };
    assert_eq!(asked(Causality::Parameter), Some(0.0));
    assert_eq!(asked(Causality::Output), Some(0.2 * H));
}

#[test]
fn a_print_counts_once_and_the_weight_is_that_of_the_robot() {
    let s = summary_of(&mut Fixture::new("iterative"));
    let p = s.print_depth.expect("prints");
    // three feet stand for the first half of the second, the others for the rest; all press to the same depth
    assert_eq!(p.count, 6);
    assert!(p.p10_m <= p.median_m && p.median_m <= p.p90_m && p.p90_m <= s.max_sinkage_m.expect("known"));
    assert!((p.median_m / DEPTH - 1.0).abs() < 0.2, "{p:?}");
    let peak = 3.0 * 13.5 / (25.0 * 1.62);
    assert!((s.motion.peak_force_over_weight.expect("known") / peak - 1.0).abs() < 1e-3, "{s:?}");
}

#[test]
fn height_is_against_gravity_and_none_without_it() {
    let gained = |gravity: [f64; 3]| {
        let mut fixture = Fixture::new("iterative");
        fixture.scenario.world.gravity_m_s2 = gravity;
        summary_of(&mut fixture).motion.height_gained_m
    };
    let risen = 0.01 * (libm::cos(12.0) - 1.0);
    let level = gained([0.0, 0.0, -9.81]).expect("known");
    assert!((level - risen).abs() < 1e-12, "{level}");
    // 10 degrees uphill along x, as in rover_slope
    let (sin, cos) = (libm::sin(10_f64.to_radians()), libm::cos(10_f64.to_radians()));
    let uphill = gained([-9.81 * sin, 0.0, -9.81 * cos]).expect("known");
    assert!((uphill - (SPEED * sin + risen * cos)).abs() < 1e-12, "{uphill}");
    assert_eq!(gained([0.0; 3]), None);
}

#[test]
fn the_report_begins_with_what_is_asked_first_and_tells_no_electrical_energy_of_ideal_motors() {
    let f = tempfile::tempdir().expect("temporary folder");
    super::record(f.path(), "iterative", 300);
    let mut summary = Summary::read(f.path()).expect("readable");
    let recording = Recording::open(f.path()).expect("readable");
    let page = report::render(&recording, Some(&summary)).expect("made");
    let labels = [
        "Distance",
        "Energy per metre",
        "Energy balance",
        "Depth of the prints",
        "Peak force",
        "Real-time factor",
    ];
    let at = |page: &str, label: &str| page.find(&format!("<dt>{label}</dt>"));
    let places = labels.map(|label| at(&page, label).unwrap_or_else(|| panic!("{label} is missing")));
    assert!(places.is_sorted() && at(&page, "Largest tilt") > Some(places[5]), "{places:?}");
    assert!(at(&page, "Electrical energy").is_some() && page.contains("electrical; cost of transport"));
    summary.energy.electrical_energy_j = None;
    summary.energy.electrical_energy_j_per_m = None;
    let page = report::render(&recording, Some(&summary)).expect("made");
    assert!(
        at(&page, "Electrical energy").is_none() && page.contains("work of the motors, driving and braking")
    );
}
