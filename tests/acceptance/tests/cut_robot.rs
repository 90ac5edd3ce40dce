//! A robot that a scenario cuts at a joint, and glues again, moves like the whole one.

use terraglue::host::Library;
use terraglue::testbed::Options;
use terraglue::{Testbed, scenario::Scenario};
use terraglue_rigid_body::RigidBody;

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// A scenario of robots (name, lines), glued where a second one is.
fn text(step_s: f64, gravity: f64, robots: &[(&str, String)], glue: &str) -> String {
    let head = format!(
        "[time]\nstep_s = {step_s}\nduration_s = 10.0\n[world]\ngravity_m_s2 = [0.0, 0.0, {gravity:?}]\n\
         [gluing]\nstrategy = \"iterative\"\n"
    );
    let tables = robots.iter().map(|(name, keys)| format!("[{name}]\nmodule = \"rigid-body\"\n{keys}\n"));
    head + &tables.collect::<String>() + glue
}

fn build(text: &str) -> Result<Testbed, String> {
    let scenario = Scenario::parse(text, "test.toml", &[]).map_err(|e| format!("{e}: {:?}", e.help))?;
    let options = Options { threads: 1, ..Options::default() };
    Testbed::build_with(&scenario, &options, &Library::new().with::<RigidBody>()).map_err(|e| e.to_string())
}

/// Largest difference of these variables, evaluations per step and largest gap over so many steps.
fn compare(whole: &str, cut: &str, steps: u32, pairs: &[(&str, &str)]) -> (f64, f64, f64) {
    let [mut whole, mut cut] = [whole, cut].map(|t| build(t).unwrap_or_else(|e| panic!("{e}\n{t}")));
    let (mut worst, mut gap, mut evaluations) = (0.0_f64, 0.0_f64, 0);
    for _ in 0..steps {
        whole.step().unwrap_or_else(|e| panic!("whole: {e}"));
        cut.step().unwrap_or_else(|e| panic!("cut: {e}"));
        evaluations += cut.report().evaluations_bodies;
        gap = gap.max(cut.report().max_gap_m);
        for (a, b) in pairs {
            let read = |t: &Testbed, name: &str| t.read(name).unwrap_or_else(|| panic!("no variable {name}"));
            worst = worst.max((read(&whole, a) - read(&cut, b)).abs());
        }
    }
    (worst, f64::from(evaluations) / f64::from(steps), gap)
}

fn pendulum(integrator: &str, cut: &str) -> String {
    format!(
        "model = \"{ROOT}/tests/models/double_pendulum.urdf\"\nmotor = \"off\"\nintegrator = \"{integrator}\"\n\
         joints = {{ shoulder = 1.5, elbow = 0.3 }}\njoint_rates = {{ elbow = 0.5 }}\n{cut}\n"
    )
}

const ELBOW: &str = "[[glue]]\nside_1 = \"robot.upper\"\nside_2 = \"forearm.upper\"\n";

#[test]
fn a_double_pendulum_cut_at_the_elbow_moves_like_the_whole_one() {
    for integrator in ["symplectic-euler", "generalized-alpha", "energy-momentum"] {
        let whole = text(0.002, -9.81, &[("robot", pendulum(integrator, ""))], "");
        let parts = [
            ("robot", pendulum(integrator, "cut = { elbow = \"root\" }")),
            ("forearm", pendulum(integrator, "cut = { elbow = \"tip\" }")),
        ];
        let cut = text(0.002, -9.81, &parts, ELBOW);
        let pairs =
            [("robot.shoulder.angle", "robot.shoulder.angle"), ("robot.elbow.angle", "forearm.elbow.angle")];
        let (worst, evaluations, gap) = compare(&whole, &cut, 500, &pairs);
        println!("{integrator}: {worst:e} rad, {evaluations} evaluations, gap {gap:e} m");
        assert!(worst <= 1e-9 && gap <= 1e-10, "{integrator}: {worst:e} rad, gap {gap:e} m");
        assert!(evaluations <= 5.0, "{integrator}: {evaluations} evaluations");
    }
}

fn hexapod(cut: &str) -> String {
    format!(
        "model = \"{ROOT}/models/hexapod.urdf\"\nposition_m = [0.0, 0.0, 0.5]\n\
         joints = {{ \"*_j2\" = 0.96, \"*_j3\" = -1.38, \"*_j4\" = -1.15 }}\njoint_rates = {{ LF_j2 = 2.0, RM_j3 = -1.0 }}\n{cut}\n"
    )
}

#[test]
fn a_leg_cut_at_a_driven_joint_keeps_its_motor() {
    let whole = text(0.001, -1.62, &[("robot", hexapod(""))], "");
    let parts =
        [("robot", hexapod("cut = { LF_j2 = \"root\" }")), ("leg", hexapod("cut = { LF_j2 = \"tip\" }"))];
    let link = upper_link();
    let glue = format!("[[glue]]\nside_1 = \"robot.{link}\"\nside_2 = \"leg.{link}\"\n");
    let cut = text(0.001, -1.62, &parts, &glue);
    let pairs = [
        ("robot.LF_j1.angle", "robot.LF_j1.angle"),
        ("robot.LF_j2.angle", "leg.LF_j2.angle"),
        ("robot.LF_j4.angle", "leg.LF_j4.angle"),
        ("robot.RM_j3.angle", "robot.RM_j3.angle"),
    ];
    let (worst, evaluations, gap) = compare(&whole, &cut, 300, &pairs);
    println!("{worst:e} rad, {evaluations} evaluations, gap {gap:e} m");
    assert!(worst <= 1e-9 && gap <= 1e-10);
}

/// The link above LF_j2, by its name in the robot file.
fn upper_link() -> String {
    let file = std::fs::read_to_string(format!("{ROOT}/models/hexapod.urdf")).expect("the model");
    let joint = file.split("<joint name=\"LF_j2\"").nth(1).expect("the joint");
    joint.split("<parent link=\"").nth(1).and_then(|s| s.split('"').next()).expect("its parent").to_owned()
}

#[test]
fn what_cannot_be_cut_is_refused() {
    for (cut, said) in [
        ("cut = { shoulder = \"tip\" }", "hangs from the world"),
        ("cut = { knee = \"tip\" }", "no joint is called `knee`"),
        ("cut = { elbow = \"tip\" }\ncut_share = 1.0", "`cut_share`"),
    ] {
        let text = text(0.01, 0.0, &[("robot", pendulum("symplectic-euler", cut))], "");
        let error = build(&text).err().unwrap_or_else(|| panic!("{cut} was taken"));
        assert!(error.contains(said), "{cut}: {error}");
    }
}
