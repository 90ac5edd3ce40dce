//! One law five times – built in, as text, as a module in Rust, in C and in Python – below plates and below the walking robot; and
//! further features of a law: a state, shorter steps.

use std::path::Path;
use std::process::Command;
use terraglue::Testbed;
use terraglue::testbed::Options;
use terraglue_acceptance::{ROOT, shipped, steps};
use terraglue_numerics::extremes::larger;

const PYTHON: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../modules/law-bekker-python/law_bekker.py");

/// Builds the law in C into a folder of its own.
fn build_law(folder: &Path, switches: &[&str]) -> String {
    let source = format!("{ROOT}/tests/modules/law-bekker-c/law_bekker.c");
    let include = format!("{ROOT}/interfaces/plugin/include");
    let library = folder.join("liblaw_bekker_c_plugin.so");
    let flags =
        ["-std=c11", "-O2", "-Wall", "-Wextra", "-Werror", "-fPIC", "-shared", "-I", &include, &source];
    let switches = switches.iter().map(|s| format!("-D{s}"));
    let done = Command::new("cc").args(flags).args(switches).arg("-o").arg(&library).arg("-lm").output();
    let done = done.expect("the C compiler `cc`");
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    library.display().to_string()
}

fn build(scenario: &str, sets: &[(&str, &str)]) -> Testbed {
    let scenario = shipped(scenario, sets);
    let options = Options { threads: 1, ..Options::default() };
    Testbed::build_with(&scenario, &options, &terraglue::library()).unwrap_or_else(|e| panic!("{e}"))
}

fn read(testbed: &Testbed, name: &str) -> f64 {
    testbed.read(name).unwrap_or_else(|| panic!("no variable {name}"))
}

/// The names of the other ways, with their settings in the scenario.
fn ways(c: &str) -> [(&'static str, Vec<(&'static str, String)>); 4] {
    let text = |key, text: &str| (key, text.to_owned());
    [
        (
            "text",
            vec![
                text("soil.law.pressure", "(k_c/b + k_phi)*z^n"),
                text("soil.law.shear", "(c + sigma*tan(phi))*(1 - exp(-j/K))"),
            ],
        ),
        ("Rust", vec![text("soil.law.plugin", "law-bekker")]),
        ("C", vec![text("soil.law.plugin", c)]),
        ("Python", vec![text("soil.law.plugin", PYTHON)]),
    ]
}

fn with<'a>(base: &[(&'a str, &'a str)], more: &'a [(&'static str, String)]) -> Vec<(&'a str, &'a str)> {
    base.iter().copied().chain(more.iter().map(|(key, text)| (*key, text.as_str()))).collect()
}

/// Forces of both plates of the bevameter on their way into the soil.
fn plate_curve(sets: &[(&str, &str)]) -> Vec<f64> {
    let mut testbed = build("plate_sinkage", sets);
    let mut forces = Vec::new();
    for _ in 0..50 {
        steps(&mut testbed, 20);
        for plate in ["small_plate", "large_plate"] {
            forces.push(read(&testbed, &format!("bevameter.{plate}.contact_normal")));
        }
    }
    forces
}

fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    let scale = a.iter().fold(1.0_f64, |m, x| larger(m, x.abs()));
    a.iter().zip(b).fold(0.0_f64, |worst, (a, b)| larger(worst, (a - b).abs() / scale))
}

#[test]
fn the_plate_curve_is_the_same_every_way_on_both_soils() {
    let folder = tempfile::tempdir().expect("folder");
    let c = build_law(folder.path(), &[]);
    for soil in ["soil-bekker", "soil-cellular-automaton"] {
        let base = [("soil.module", soil), ("terrain.spacing_m", "0.01")];
        let built_in = plate_curve(&base);
        assert!(built_in.iter().fold(0.0_f64, |m, f| larger(m, *f)) > 100.0, "{soil}: {built_in:?}");
        for (way, sets) in ways(&c) {
            let difference = largest_difference(&built_in, &plate_curve(&with(&base, &sets)));
            assert!(difference < 1e-12, "{soil}, {way}: {difference:e}");
        }
    }
}

#[test]
fn the_robot_sinks_the_same_four_times() {
    let folder = tempfile::tempdir().expect("folder");
    let c = build_law(folder.path(), &[]);
    let walk = |sets: &[(&str, &str)]| {
        let mut testbed = build("moon_walk", sets);
        steps(&mut testbed, 1200);
        [read(&testbed, "soil.max_sinkage"), read(&testbed, "robot.body.z"), read(&testbed, "robot.body.x")]
    };
    let built_in = walk(&[]);
    assert!(built_in[0] > 1e-4, "{built_in:?}");
    // the law in Python is compared below the plates: a walk asks it too often
    for (way, sets) in ways(&c).into_iter().filter(|(way, _)| *way != "Python") {
        let difference = largest_difference(&built_in, &walk(&with(&[], &sets)));
        assert!(difference < 1e-9, "{way}: {difference:e}");
    }
}

#[test]
fn a_law_with_a_state_unloads_by_itself_and_goes_back_with_a_snapshot() {
    let folder = tempfile::tempdir().expect("folder");
    let keeps = build_law(folder.path(), &["KEEPS"]);
    // k_u of the law that keeps its state
    let stiff = ("soil.elastic_stiffness_pa_m", "4e8");
    let base = [("soil.module", "soil-bekker"), ("terrain.spacing_m", "0.01"), stiff];
    let turn = |testbed: &mut Testbed| {
        // down, up and down again
        let mut forces = Vec::new();
        for speed in [0.01, -0.01, 0.01] {
            testbed.set("bevameter.small_press.velocity_target", &speed.into()).expect("accepted");
            for _ in 0..65 {
                steps(testbed, 10);
                forces.push(read(testbed, "bevameter.small_plate.contact_normal"));
            }
        }
        forces
    };
    let mut built_in = build("plate_sinkage", &base);
    let expected = turn(&mut built_in);
    let mut testbed = build("plate_sinkage", &with(&base, &[("soil.law.plugin", keeps)]));
    let start = testbed.snapshot(0).expect("saved");
    let first = turn(&mut testbed);
    testbed.restore(&start).expect("restored");
    let again = turn(&mut testbed);
    assert_eq!(first, again, "a snapshot brings the state of the law back");
    let difference = largest_difference(&expected[..130], &first[..130]);
    assert!(difference < 1e-9, "down and up: {difference:e}");
    // where no foot stands the soil keeps the depth of a print in sixteenths of a unit, the law its double
    let difference = largest_difference(&expected, &first);
    assert!(difference < 1e-4, "down again: {difference:e}");
    assert!(first[64] > 10.0 && first[129] == 0.0, "pressed {}, lifted {}", first[64], first[129]);
}

#[test]
fn a_law_may_ask_for_shorter_steps() {
    let folder = tempfile::tempdir().expect("folder");
    let short = build_law(folder.path(), &["SHORT"]);
    let sets = [("soil.module", "soil-bekker".to_owned()), ("soil.law.plugin", short)];
    let mut testbed = build("plate_sinkage", &with(&[], &sets));
    steps(&mut testbed, 600);
    let index = testbed.view(|view| view.step_index);
    assert!(index > 900, "{index} communication points in 600 steps");
    assert!(read(&testbed, "bevameter.small_plate.contact_normal") > 1.0);
}

#[test]
fn slip_sinkage_is_refused_for_a_law_that_it_cannot_act_on() {
    let bekker = ("soil.law.pressure", "(k_c/b + k_phi)*z^n");
    let lyasko = ("soil.slip_sinkage", "lyasko");
    build("plate_sinkage", &[bekker, lyasko]);
    let stiffening = ("soil.law.pressure", "(k_c/b + k_phi)*z^n*(1 + 0.01*z/K)");
    let scenario = shipped("plate_sinkage", &[stiffening, lyasko]);
    let options = Options { threads: 1, ..Options::default() };
    let told = Testbed::build_with(&scenario, &options, &terraglue::library())
        .err()
        .map(|e| e.to_string())
        .unwrap_or_default();
    assert!(told.contains("`slip_sinkage` acts on power laws"), "{told}");
}
