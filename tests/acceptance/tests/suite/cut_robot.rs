//! A robot that a scenario cuts at a joint, and glues again, moves like the whole one.

use terraglue::testbed::Options;
use terraglue::{Testbed, scenario::Scenario};
use terraglue_gait::Gait;
use terraglue_numerics::extremes::larger;
use terraglue_rigid_body::RigidBody;
use terraglue_soil_bekker::SoilBekker;
use terraglue_soil_cellular_automaton::SoilCellularAutomaton;

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
    build_scenario(&scenario)
}

fn build_scenario(scenario: &Scenario) -> Result<Testbed, String> {
    let options = Options { threads: 1, ..Options::default() };
    let library = terraglue::library()
        .with::<RigidBody>()
        .with::<SoilBekker>()
        .with::<SoilCellularAutomaton>()
        .with::<Gait>();
    Testbed::build_with(scenario, &options, &library).map_err(|e| e.to_string())
}

/// Largest difference of these variables, evaluations per step and largest gap over so many steps.
fn compare(whole: &str, cut: &str, steps: u32, pairs: &[(&str, &str)]) -> (f64, f64, f64) {
    let [mut whole, mut cut] = [whole, cut].map(|t| build(t).unwrap_or_else(|e| panic!("{e}\n{t}")));
    let (mut worst, mut gap, mut evaluations) = (0.0_f64, 0.0_f64, 0);
    for _ in 0..steps {
        whole.step().unwrap_or_else(|e| panic!("whole: {e}"));
        cut.step().unwrap_or_else(|e| panic!("cut: {e}"));
        evaluations += cut.report().evaluations_bodies;
        gap = larger(gap, cut.report().max_gap_m);
        for (a, b) in pairs {
            let read = |t: &Testbed, name: &str| t.read(name).unwrap_or_else(|| panic!("no variable {name}"));
            worst = larger(worst, (read(&whole, a) - read(&cut, b)).abs());
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
        for (step_s, steps) in [(0.002, 500), (0.005, 200)] {
            let (whole, cut) = pendulums(integrator, step_s);
            let (worst, evaluations, gap) = compare(&whole, &cut, steps, &ANGLES);
            println!("{integrator} {step_s}: {worst:e} rad, {evaluations} evaluations, gap {gap:e} m");
            assert!(worst <= 1e-9 && gap <= 1e-10, "{integrator}: {worst:e} rad, gap {gap:e} m");
            assert!(evaluations <= 3.3, "{integrator} {step_s}: {evaluations} evaluations");
        }
    }
}

const ANGLES: [(&str, &str); 2] =
    [("robot.shoulder.angle", "robot.shoulder.angle"), ("robot.elbow.angle", "forearm.elbow.angle")];

/// The double pendulum whole and cut at the elbow.
fn pendulums(integrator: &str, step_s: f64) -> (String, String) {
    let parts = [
        ("robot", pendulum(integrator, "cut = { elbow = \"root\" }")),
        ("forearm", pendulum(integrator, "cut = { elbow = \"tip\" }")),
    ];
    let whole = text(step_s, -9.81, &[("robot", pendulum(integrator, ""))], "");
    (whole, text(step_s, -9.81, &parts, ELBOW))
}

#[test]
fn one_unchecked_newton_step_holds_the_elbow_for_ten_seconds() {
    for integrator in ["symplectic-euler", "generalized-alpha", "energy-momentum"] {
        let (_, cut) = pendulums(integrator, 0.002);
        let mut cut = build(&cut.replace("iterative", "semi-implicit")).unwrap_or_else(|e| panic!("{e}"));
        let (mut gap, mut early) = (0.0_f64, 0.0_f64);
        for step in 0..5000 {
            cut.step().unwrap_or_else(|e| panic!("{integrator} at step {step}: {e}"));
            gap = larger(gap, cut.report().max_gap_m);
            early = if step < 500 { gap } else { early };
        }
        println!("{integrator}: gap {early:e} m in 1 s, {gap:e} m in 10 s");
        assert!(gap <= 1e-6, "{integrator}: {gap:e} m");
    }
}

/// A rod of the double pendulum as a robot of its own; `joint`: its suspension.
fn rod(name: &str, joint: &str) -> String {
    let text = format!(
        "<robot name=\"{name}\">{joint}<link name=\"{name}\"><inertial><origin xyz=\"0 0 -0.5\"/><mass value=\"1.0\"/>\
         <inertia ixx=\"0.0833333333333\" ixy=\"0\" ixz=\"0\" iyy=\"0.0833333333333\" iyz=\"0\" izz=\"0.002\"/>\
         </inertial></link></robot>"
    );
    let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("rod-{name}.urdf"));
    std::fs::write(&path, text).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    format!("model = \"{}\"\nmotor = \"off\"\n", path.display())
}

/// The joint itself is glue here, half a metre from the centres of mass of both rods: the arm of its force has to turn
/// with the rods as that of a joint does.
#[test]
fn rods_that_glue_joins_move_like_rods_on_a_joint() {
    let shoulder = "<link name=\"world\"/><joint name=\"shoulder\" type=\"continuous\"><parent link=\"world\"/>\
        <child link=\"upper\"/><axis xyz=\"0 1 0\"/></joint>";
    // 1.5 rad about y takes the hanging rod from (0, 0, −1) here.
    let (sin, cos) = (f64::sin(1.5), f64::cos(1.5));
    let end = format!("{:?}, 0.0, {:?}", -sin, -cos);
    let lower = rod("lower", "") + &format!("position_m = [{end}]\nplace_on_ground = false\n");
    let glue = format!(
        "[[glue]]\nside_1 = \"robot.upper\"\nside_2 = \"rod.lower\"\nat_m = [{end}]\ncomponents = [\"x\", \"y\", \"z\"]\n"
    );
    let pairs = [
        ("robot.shoulder.angle", "robot.shoulder.angle"),
        ("robot.lower.x", "rod.lower.x"),
        ("robot.lower.z", "rod.lower.z"),
    ];
    for integrator in ["symplectic-euler", "generalized-alpha", "energy-momentum"] {
        let rule = format!("integrator = \"{integrator}\"\n");
        let upper = rod("upper", shoulder) + "joints = { shoulder = 1.5 }\n" + &rule;
        // The elbow of the whole robot turns about an axis askew; here both turn about y.
        let model =
            std::fs::read_to_string(format!("{ROOT}/tests/models/double_pendulum.urdf")).expect("the model");
        let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("straight_pendulum.urdf");
        std::fs::write(&path, model.replace("0.6 0.8 0", "0 1 0")).expect("written");
        let whole = format!(
            "model = \"{}\"\nmotor = \"off\"\njoints = {{ shoulder = 1.5, elbow = -1.5 }}\n{rule}",
            path.display()
        );
        let parts = [("robot", upper), ("rod", lower.clone() + &rule)];
        let (whole, cut) = (text(0.005, -9.81, &[("robot", whole)], ""), text(0.005, -9.81, &parts, &glue));
        let (worst, evaluations, gap) = compare(&whole, &cut, 200, &pairs);
        println!("{integrator}: {worst:e} rad or m, {evaluations} evaluations, gap {gap:e} m");
        assert!(worst <= 1e-8 && gap <= 1e-9, "{integrator}: {worst:e} rad or m, gap {gap:e} m");
        assert!(evaluations <= 3.3, "{integrator}: {evaluations} evaluations");
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

/// The hexapod over its soil, whole or cut at the hip of a leg, walking where a gait is given.
fn on_soil(soil: &str, gait: &str, parts: &[(&str, &str)]) -> String {
    let legs = "joints = { \"*_j2\" = 0.958192, \"*_j3\" = -1.379634, \"*_j4\" = -1.149354 }\nmotor = \"position\"\n\
                stiffness = 600.0\ndamping = 10.0\nmax_torque = 60.0\n";
    let robots: Vec<(&str, String)> = parts
        .iter()
        .map(|(name, cut)| (*name, format!("model = \"{ROOT}/models/hexapod.urdf\"\n{legs}{cut}\n")))
        .collect();
    let ground = format!(
        "[terrain]\nkind = \"undulating\"\nsize_m = [3.0, 3.0]\nspacing_m = 0.01\nrms_m = 0.015\n\
         wavelengths_m = [0.3, 3.0]\n[soil]\nmodule = \"{soil}\"\nparameters = \"lunar_nominal_Apollo\"\n\
         parameters_file = \"{ROOT}/models/soils.csv\"\n"
    );
    let glue = if parts.len() > 1 {
        let link = upper_link();
        format!("[[glue]]\nside_1 = \"robot.{link}\"\nside_2 = \"leg.{link}\"\n")
    } else {
        String::new()
    };
    // the motors beyond the cut are in the other part
    let connect = |joints: &&str| {
        let to =
            if parts.len() > 1 && ["LF_j2", "LF_j3", "LF_j4"].contains(joints) { "leg" } else { "robot" };
        format!("[[connect]]\nfrom = \"gait.{joints}.angle_target\"\nto = \"{to}.{joints}.angle_target\"\n")
    };
    let joints = ["R*", "LM*", "LR*", "LF_j1", "LF_j2", "LF_j3", "LF_j4"];
    let driven: String = joints.iter().filter(|_| !gait.is_empty()).map(connect).collect();
    let driven = gait.to_owned() + &driven;
    text(0.001, -1.62, &robots, &(ground + &glue + &driven))
}

#[test]
fn a_cut_hexapod_stands_and_walks_on_soil_like_the_whole_one() {
    let pairs = [
        ("robot.body.z", "robot.body.z"),
        ("robot.body.x", "robot.body.x"),
        ("robot.LF_j2.angle", "leg.LF_j2.angle"),
        ("robot.LF_j4.angle", "leg.LF_j4.angle"),
        ("robot.RM_j3.angle", "robot.RM_j3.angle"),
    ];
    let cut = [("robot", "cut = { LF_j2 = \"root\" }"), ("leg", "cut = { LF_j2 = \"tip\" }")];
    let walk =
        "[gait]\nmodule = \"gait\"\ngait = \"tripod\"\nspeed_m_s = 0.15\nstand_s = 0.0\nramp_s = 0.05\n";
    for soil in ["soil-bekker", "soil-cellular-automaton"] {
        for (gait, steps) in [("", 60), (walk, 100)] {
            let [whole, cut] = [&[("robot", "")][..], &cut].map(|parts| on_soil(soil, gait, parts));
            let (worst, evaluations, gap) = compare(&whole, &cut, steps, &pairs);
            println!("{soil}, {steps} steps: {worst:e} rad or m, {evaluations} evaluations, gap {gap:e} m");
            // 1e-8 of the weight of 43 N may be left in every step: on a link of 0.1 kg 4e-12 m
            assert!(worst <= 4e-12 * f64::from(steps), "{soil}: {worst:e}");
        }
    }
}

/// What `scenarios/cut_robot.toml` says of itself: it is the robot of sand_walk, and takes the same way; to rounding until the first feet
/// lift off. A foot that slides as it does so is held by the cohesion of its last inclined nodes, and its step has two answers
/// (`gluing.forms` in tests/known-failures.tsv): the pieces may take the one, and the whole the other.
#[test]
fn the_shipped_cut_robot_walks_like_the_whole_one() {
    let [mut whole, mut cut] = [
        ("sand_walk", &[("soil.module", "soil-bekker"), ("gluing.strategy", "iterative")][..]),
        ("cut_robot", &[]),
    ]
    .map(|(name, sets)| shipped(name, sets));
    for (until, limit) in [(0.6, 1e-9), (1.0, 1e-6)] {
        let mut worst = 0.0_f64;
        while whole.t_s() < until {
            for testbed in [&mut whole, &mut cut] {
                testbed.step().unwrap_or_else(|e| panic!("{e}"));
            }
            for name in ["robot.body.x", "robot.body.y", "robot.body.z"] {
                let read = |t: &Testbed| t.read(name).unwrap_or_else(|| panic!("no variable {name}"));
                worst = larger(worst, (read(&whole) - read(&cut)).abs());
            }
        }
        println!("{worst:e} m");
        assert!(worst <= limit, "{worst:e} m until {until} s");
    }
    assert_eq!(whole.t_s(), cut.t_s());
}

/// A scenario of the folder, edited, with the modules of this test.
fn shipped(name: &str, sets: &[(&str, &str)]) -> Testbed {
    let sets: Vec<_> = sets.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
    let path = format!("{ROOT}/scenarios/{name}.toml");
    let scenario = Scenario::load(path.as_ref(), &sets).unwrap_or_else(|e| panic!("{e}: {:?}", e.help));
    build_scenario(&scenario).unwrap_or_else(|e| panic!("{name}: {e}"))
}

#[test]
fn the_pass_of_contacts_refuses_a_cut_robot_and_says_what_would_do() {
    let cut = [("robot", "cut = { LF_j2 = \"root\" }"), ("leg", "cut = { LF_j2 = \"tip\" }")];
    let text = on_soil("soil-bekker", "", &cut).replace("iterative", "cooperative");
    let error = build(&text).err().unwrap_or_else(|| panic!("it was taken"));
    assert!(error.contains("the soil cannot say how a joint between bodies pulls"), "{error}");
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

#[test]
fn parts_that_do_not_make_the_robot_whole_are_refused() {
    let part = |cut: &str| pendulum("symplectic-euler", cut);
    let [root, tip] = ["root", "tip"].map(|side| format!("cut = {{ elbow = \"{side}\" }}"));
    let with = |root: String, tip: String, glue: &str| {
        text(0.002, -9.81, &[("robot", part(&root)), ("forearm", part(&tip))], glue)
    };
    let other_angle = |text: String| text.replacen("shoulder = 1.5", "shoulder = 1.4", 1);
    let other_rate = |text: String| text.replacen("elbow = 0.5 }\n", "elbow = 0.5, shoulder = 0.1 }\n", 1);
    let hinge = format!("{ELBOW}components = [\"x\", \"y\", \"z\"]\n");
    let fits = with(root.clone(), tip.clone(), ELBOW);
    build(&fits).map(drop).unwrap_or_else(|e| panic!("{e}"));
    for (text, said) in [
        (with(root.clone(), tip.clone(), ""), "only 0.25 of it is there"),
        (with(root.clone(), tip.clone(), &hinge), "only 0.25 of it is there"),
        (with(root.clone(), format!("{tip}\ncut_share = 0.5"), ELBOW), "make 1.25 of it"),
        (with(root.clone(), format!("{tip}\ncut_share = 0.1"), ELBOW), "only 0.85 of it is there"),
        (other_angle(fits.clone()), "do not start as one"),
        (other_rate(fits.clone()), "do not start as one"),
        (text(0.002, -9.81, &[("robot", part(&root))], ""), "only 0.75 of it is there"),
    ] {
        let error = build(&text).err().unwrap_or_else(|| panic!("it was taken, instead of: {said}"));
        assert!(error.contains(said), "{error}");
    }
}
