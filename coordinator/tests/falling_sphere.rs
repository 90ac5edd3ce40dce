//! A sphere falls on ground: the whole chain with the smallest body and the smallest soil, linked in.

use point_mass::PointMass;
use soil_column::SoilColumnModule;
use terraglue::Testbed;
use terraglue::scenario::Scenario;
use terraglue::testbed::Options;

const MASS: f64 = 5.0;
const STIFFNESS: f64 = 8340.0;

fn testbed(strategy: &str, gravity: f64) -> Testbed {
    let text = format!(
        r#"
[time]
step_s = 0.001
duration_s = 3.0
[world]
gravity_m_s2 = [0.0, 0.0, -{gravity}]
[terrain]
kind = "flat"
size_m = [0.4, 0.4]
spacing_m = 0.01
[gluing]
strategy = "{strategy}"
[foot]
module = "point-mass"
mass_kg = {MASS}
position_m = [0.0, 0.0, 0.05]
[soil]
module = "soil-column"
"#
    );
    let scenario = Scenario::parse(&text, "falling_sphere.toml", &[]).expect("scenario");
    let library = terraglue::library().with::<PointMass>().with::<SoilColumnModule>();
    Testbed::build_with(&scenario, &Options::default(), &library).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn it_comes_to_rest_where_the_column_carries_it_and_does_not_creep() {
    for strategy in ["cooperative", "iterative"] {
        let mut testbed = testbed(strategy, 9.81);
        for _ in 0..3000 {
            testbed.step().unwrap_or_else(|e| panic!("{strategy}: {e}"));
        }
        let z = testbed.read("foot.mass.z").expect("z");
        let weight = MASS * 9.81;
        let force = testbed.report().ports[0].wrench[0];
        println!("{strategy}: z {z}, T {force}, {:?}", testbed.report());
        assert!((force / weight - 1.0).abs() < 1e-8, "{strategy}: {force}");
        // it falls 2 cm, so it sinks deeper than the static depth mg/K, up to the depth of the impact
        let depth = 0.03 - z;
        assert!(depth > weight / STIFFNESS && depth < 0.05, "{strategy}: {depth}");
        for _ in 0..1000 {
            testbed.step().unwrap_or_else(|e| panic!("{strategy}: {e}"));
            assert!((testbed.read("foot.mass.z").expect("z") - z).abs() <= 1e-12, "{strategy}");
        }
    }
}

#[test]
fn energy_of_the_body_is_conserved_in_flight() {
    let mut testbed = testbed("cooperative", 1.62);
    let start = testbed.energy().mechanical();
    for _ in 0..100 {
        testbed.step().unwrap_or_else(|e| panic!("{e}"));
    }
    // semi-implicit Euler: m·g·(h/2)·v per step, exactly g²·h·t/2·m after t
    let error = testbed.energy().mechanical() - start;
    assert!(error.abs() <= 0.5 * MASS * 1.62 * 1.62 * 0.001 * 0.1 * 1.001, "{error}");
    assert_eq!(testbed.report().ports.len(), 0);
}

#[test]
fn a_snapshot_brings_the_same_bits_back() {
    let mut testbed = testbed("iterative", 9.81);
    for _ in 0..80 {
        testbed.step().unwrap_or_else(|e| panic!("{e}"));
    }
    let snapshot = testbed.snapshot(0).expect("all modules save");
    let run = |testbed: &mut Testbed| {
        for _ in 0..100 {
            testbed.step().unwrap_or_else(|e| panic!("{e}"));
        }
        testbed.read("foot.mass.z").expect("z").to_bits()
    };
    let first = run(&mut testbed);
    testbed.restore(&snapshot).expect("restored");
    assert_eq!(run(&mut testbed), first);
}

/// Both sides of the interface are booked by their own wrenches: where the soil's law carries another force than the body
/// feels, the work of the interface shows it.
#[test]
fn the_work_of_the_interface_is_that_of_both_sides() {
    let fallen = |strategy: &str| {
        let mut testbed = testbed(strategy, 9.81);
        let (mut error, mut path) = (0.0, 0.0);
        for _ in 0..400 {
            testbed.step().unwrap_or_else(|e| panic!("{strategy}: {e}"));
            let report = testbed.report();
            assert_eq!(
                (report.single_pass, report.has_gap()),
                (strategy == "cooperative", strategy != "cooperative")
            );
            error += report.interface_work_error_j;
            path += report.port_work_path_j;
        }
        (error, path, testbed.energy())
    };
    let (error, path, energy) = fallen("iterative");
    assert!(path > 1.0 && error < 1e-6 * path, "{error:e} of {path} J");
    // The work on the sphere is that on the columns, and the column's ledger is whole.
    assert!(energy.is_known() && energy.port_work.abs() < 1e-6 * path, "{energy:?}");
    let (error, path, energy) = fallen("cooperative");
    assert!(error > 1e-4 * path, "{error:e} of {path} J: the column is told T1 and carries its law's force");
    assert!(energy.port_work.abs() <= error * (1.0 + 1e-9), "{energy:?} against {error}");
}
