//! Joints that are cut and glued again move like the mechanism uncut, and close to known solutions.
//!
//! Models, integrators and figures: `tests/reference/gluing/README.md`.

use glue_cases::{MassChain, PlanarBodies};
use terraglue::testbed::Options;
use terraglue::{Testbed, scenario::Scenario};
use terraglue_numerics::extremes::larger;

fn build(text: &str) -> Testbed {
    let scenario = Scenario::parse(text, "test.toml", &[]).unwrap_or_else(|e| panic!("{e}: {:?}", e.help));
    let library = terraglue::library().with::<MassChain>().with::<PlanarBodies>();
    let options = Options { threads: 1, ..Options::default() };
    Testbed::build_with(&scenario, &options, &library).unwrap_or_else(|e| panic!("{e}"))
}

/// Steps to t and answers the mean evaluations per step.
fn run(testbed: &mut Testbed, until: f64, mut look: impl FnMut(&Testbed)) -> f64 {
    let (mut evaluations, mut steps) = (0, 0);
    while testbed.t_s() < until - 1e-9 {
        testbed.step().unwrap_or_else(|e| panic!("{e}"));
        evaluations += testbed.report().evaluations_bodies;
        steps += 1;
        look(testbed);
    }
    f64::from(evaluations) / f64::from(steps)
}

fn read(testbed: &Testbed, name: &str) -> f64 {
    testbed.read(name).unwrap_or_else(|| panic!("no variable {name}"))
}

const OSCILLATOR: &str = r#"
[time]
step_s = 0.01
duration_s = 1.0
[world]
gravity_m_s2 = [0.0, 0.0, 0.0]
[gluing]
strategy = "iterative"
[a]
module = "mass-chain"
mass_kg = [1.0]
spring_n_m = [39.47841760435743]
position_m = [1.0]
integrator = "INTEGRATOR"
[b]
module = "mass-chain"
mass_kg = [1.0]
spring_n_m = [39.47841760435743]
integrator = "INTEGRATOR"
[[glue]]
side_1 = "a.m0"
side_2 = "b.m0"
components = "x"
compliance_m_n = 0.006332573977646111
"#;

#[test]
fn the_two_halves_of_an_oscillator_move_as_one() {
    for (integrator, x1, x2, force) in [
        ("newmark", 0.999228632098135, 0.000769234009919, -157.670388315),
        ("generalized-alpha", 0.999097968030, 0.000898590746, -157.629327475),
    ] {
        let mut testbed = build(&OSCILLATOR.replace("INTEGRATOR", integrator));
        let evaluations = run(&mut testbed, 1.0, |_| ());
        let (got1, got2) = (read(&testbed, "a.m0.x"), read(&testbed, "b.m0.x"));
        let t = testbed.report().ports[0].wrench[0];
        println!("{integrator}: {got1} {got2} {t} {evaluations}");
        assert!(
            (got1 - x1).abs() < 1e-9 && (got2 - x2).abs() < 1e-9 && (t - force).abs() < 2e-9 * force.abs()
        );
        assert_eq!(evaluations, 2.0);
    }
}

const DOUBLE_PENDULUM: &str = r#"
[time]
step_s = 0.005
duration_s = 1.0
[world]
gravity_m_s2 = [0.0, -9.81, 0.0]
[gluing]
strategy = "iterative"
[upper]
module = "planar-bodies"
mass_kg = [1.0]
inertia_kg_m2 = [0.08333333333333333]
pose = [0.5, 0.0, 0.0]
pins = [0, -1, 0.0, 0.0]
integrator = "generalized-alpha"
[lower]
module = "planar-bodies"
mass_kg = [1.0]
inertia_kg_m2 = [0.08333333333333333]
pose = [1.5, 0.0, 0.0]
integrator = "generalized-alpha"
[[glue]]
side_1 = "upper.b0"
side_2 = "lower.b0"
at_m = [1.0, 0.0, 0.0]
components = ["x", "y"]
"#;

const UNCUT: &str = r#"
[time]
step_s = 0.005
duration_s = 1.0
[world]
gravity_m_s2 = [0.0, -9.81, 0.0]
[all]
module = "planar-bodies"
mass_kg = [1.0, 1.0]
inertia_kg_m2 = [0.08333333333333333, 0.08333333333333333]
pose = [0.5, 0.0, 0.0, 1.5, 0.0, 0.0]
pins = [0, -1, 0.0, 0.0, 0, 1, 1.0, 0.0]
integrator = "generalized-alpha"
"#;

#[test]
fn a_double_pendulum_cut_and_glued_equals_the_uncut_one() {
    let (mut cut, mut whole) = (build(DOUBLE_PENDULUM), build(UNCUT));
    let (mut worst, mut gap): (f64, f64) = (0.0, 0.0);
    let evaluations = run(&mut cut, 1.0, |cut| {
        whole.step().unwrap_or_else(|e| panic!("{e}"));
        for (a, b) in [("upper.b0.angle", "all.b0.angle"), ("lower.b0.angle", "all.b1.angle")] {
            worst = larger(worst, (read(cut, a) - read(&whole, b)).abs());
        }
        gap = larger(gap, cut.report().max_gap_m);
    });
    println!("difference {worst} rad, gap {gap} m, {evaluations} evaluations");
    assert!(worst <= 1e-9 && gap <= 1e-10 && evaluations <= 3.3);
    // DOP853 at 1 s, tests/reference/gluing/double_pendulum_ref.csv
    let error = (read(&cut, "upper.b0.angle") + 2.778512564986).abs();
    assert!(error <= 9e-4, "{error}");
}
