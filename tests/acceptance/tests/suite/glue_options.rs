//! Every option of `[gluing]` has its documented effect and no other: Jacobians, levels, friction, soil columns.
//!
//! Models, integrators and figures: `tests/reference/gluing/README.md`.

use terraglue::scenario::JacobianChoice;
use terraglue::{Result, Testbed};
use terraglue_acceptance::{glued, glued_with, read};
use terraglue_numerics::extremes::larger;

fn build(text: &str) -> Testbed {
    glued(text).unwrap_or_else(|e| panic!("{e}"))
}

/// Figures of a run: mean evaluations of the bodies, Jacobian refreshes, evaluations for them, largest gap.
#[derive(Debug, Default)]
struct Did {
    steps: f64,
    evaluations: f64,
    refreshes: u32,
    gap: f64,
}

fn run(testbed: &mut Testbed, until: f64) -> Result<Did> {
    let mut did = Did::default();
    while testbed.t_s() < until - 1e-9 {
        testbed.step()?;
        let report = testbed.report();
        did.steps += 1.0;
        did.evaluations += f64::from(report.evaluations_bodies);
        did.refreshes += report.jacobian_refreshes;
        did.gap = larger(did.gap, report.max_gap_m);
    }
    did.evaluations /= did.steps;
    Ok(did)
}

/// Two rods, cut at their pin.
fn pendulum(gluing: &str) -> String {
    format!(
        r#"
[time]
step_s = 0.005
duration_s = 1.0
[world]
gravity_m_s2 = [0.0, -9.81, 0.0]
[gluing]
strategy = "iterative"
{gluing}
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
"#
    )
}

#[test]
fn jacobians_by_differences_give_the_same_motion() {
    let mut analytic = build(&pendulum(""));
    let own = run(&mut analytic, 1.0).unwrap_or_else(|e| panic!("{e}"));
    for jacobian in ["directional", "finite-differences"] {
        let mut other = build(&pendulum(&format!("jacobian = \"{jacobian}\"")));
        let did = run(&mut other, 1.0).unwrap_or_else(|e| panic!("{e}"));
        let apart = (read(&other, "lower.b0.angle") - read(&analytic, "lower.b0.angle")).abs();
        println!("{jacobian}: {apart:.1e} rad, {did:?}, analytic {own:?}");
        assert!(apart <= 1e-8 && did.evaluations <= own.evaluations + 0.5);
        assert!(did.refreshes >= 10, "one in 20 steps");
    }
}

#[test]
fn a_frozen_jacobian_fails_when_the_rods_have_turned() {
    let frozen = glued_with(&pendulum(""), |gluing| gluing.jacobian = JacobianChoice::Frozen);
    let mut frozen = frozen.unwrap_or_else(|e| panic!("{e}"));
    let failed = run(&mut frozen, 1.0).expect_err("a frozen Jacobian glues nothing that turns");
    println!("{failed}");
    assert!(failed.to_string().contains("the step was halved 4 times"), "{failed}");
    // a clean stop: the last committed state stands, and the report names the strategies that failed
    let (t, angle) = (frozen.t_s(), read(&frozen, "lower.b0.angle"));
    assert!(t > 0.0 && t < 1.0 && angle.is_finite());
    assert!(!frozen.report().converged && frozen.report().evaluations_bodies > 5 * 20);
    assert!(frozen.step().is_err(), "the same step fails again");
    assert_eq!((frozen.t_s(), read(&frozen, "lower.b0.angle")), (t, angle));
}

#[test]
fn velocity_level_keeps_the_order_and_stabilisation_the_gap() {
    let error = |gluing: &str, until: f64| {
        let mut testbed = build(&pendulum(gluing));
        let did = run(&mut testbed, 1.0).unwrap_or_else(|e| panic!("{e}"));
        // DOP853 at 1 s
        let error = (read(&testbed, "upper.b0.angle") + 2.778512564986).abs();
        let later = run(&mut testbed, until).unwrap_or_else(|e| panic!("{e}"));
        (error, did.gap, later.gap)
    };
    let (free, drift, later) = error("level = \"velocity\"", 3.0);
    let (held, kept, still) = error("level = \"velocity\"\nstabilisation = 0.2", 3.0);
    println!(
        "velocity level: {free:.1e} rad, gap {drift:.1e}, {later:.1e} m; stabilised {held:.1e} rad, gap {kept:.1e}, {still:.1e} m"
    );
    assert!(free < 2e-3 && held < 2e-3, "{free} {held}");
    // residuals of the steps add up without stabilisation; with a share of 0.2 that of the last five steps remains
    assert!(later > 1.5 * drift && kept < 0.35 * drift && still < 0.35 * later, "{later} {kept} {still}");
}

/// Two free masses with exact inner integration, pulled apart at the start.
fn masses(gluing: &str) -> String {
    format!(
        r#"
[time]
step_s = 0.01
duration_s = 1.0
[world]
gravity_m_s2 = [0.0, 0.0, 0.0]
[gluing]
strategy = "iterative"
{gluing}
[a]
module = "mass-chain"
mass_kg = [1.0]
velocity_m_s = [1.0]
integrator = "exact"
[b]
module = "mass-chain"
mass_kg = [3.0]
integrator = "exact"
[[glue]]
side_1 = "a.m0"
side_2 = "b.m0"
components = ["x"]
"#
    )
}

#[test]
fn velocity_level_gives_subsystems_that_sub_cycle_one_velocity() {
    // common velocity after one step, then no force; the gap of that step stays
    let mut level = build(&masses("level = \"velocity\""));
    run(&mut level, 0.1).unwrap_or_else(|e| panic!("{e}"));
    let (a, b) = (read(&level, "a.m0.v"), read(&level, "b.m0.v"));
    assert!((a - 0.25).abs() < 1e-12 && (b - 0.25).abs() < 1e-12, "{a} {b}");
}

/// A block on the world with friction.
fn block(velocity: f64, push: f64) -> String {
    format!(
        r#"
[time]
step_s = 0.001
duration_s = 1.0
[world]
gravity_m_s2 = [{}, -9.81, 0.0]
[gluing]
strategy = "iterative"
tolerance = 1e-12
[block]
module = "planar-bodies"
mass_kg = [2.0]
inertia_kg_m2 = [0.1]
pose = [0.0, 0.0, 0.0]
rate = [{velocity}, 0.0, 0.0]
integrator = "implicit-euler"
[[glue]]
kind = "contact"
side_1 = "block.b0"
side_2 = "world"
normal = [0.0, 1.0, 0.0]
mu = 0.4
"#,
        push / 2.0
    )
}

#[test]
fn a_block_slides_stops_and_sticks_by_coulombs_law() {
    let mut sliding = build(&block(1.5, 0.0));
    run(&mut sliding, 1.0).unwrap_or_else(|e| panic!("{e}"));
    let (x, v) = (read(&sliding, "block.b0.x"), read(&sliding, "block.b0.vx"));
    let expected = 1.5 * 1.5 / (2.0 * 0.4 * 9.81) - 0.5e-3 * 1.5;
    println!("stops at {x}, expected {expected}, v = {v:e}");
    assert!((x - expected).abs() <= 1e-6 && v.abs() <= 1e-14);
    // 5 N do not move it, 10 N do
    let mut stuck = build(&block(0.0, 5.0));
    run(&mut stuck, 1.0).unwrap_or_else(|e| panic!("{e}"));
    assert!(read(&stuck, "block.b0.vx").abs() <= 1e-14);
    let tangential = stuck.report().ports[0].wrench[1];
    assert!((tangential + 5.0).abs() < 1e-9, "{tangential}");
    let mut pushed = build(&block(0.0, 10.0));
    run(&mut pushed, 1.0).unwrap_or_else(|e| panic!("{e}"));
    assert!((read(&pushed, "block.b0.vx") - 1.0760).abs() < 1e-4);
}

#[test]
fn a_contact_of_bodies_is_refused_where_a_soil_would_be_asked() {
    let said = |text: &str| glued(text).err().map(|e| format!("{e:?}")).unwrap_or_default();
    for strategy in ["cooperative", "cooperative-compliant", "xt-newton", "relaxed"] {
        let refused = said(&block(1.5, 0.0).replace("\"iterative\"", &format!("\"{strategy}\"")));
        assert!(refused.contains("side 2 of glue 1 is a body"), "{strategy}: {refused}");
        assert!(refused.contains("these would work: iterative, monolithic"), "{strategy}: {refused}");
    }
    let flat = said(&block(1.5, 0.0).replace("[0.0, 1.0, 0.0]\nmu", "[0.0, 0.0, 0.0]\nmu"));
    assert!(flat.contains("a normal of no length"), "{flat}");
    let joint = said(&block(1.5, 0.0).replace("kind = \"contact\"", "kind = \"joint\""));
    assert!(joint.contains("`normal` is of contacts; this glue is a joint"), "{joint}");
}

/// A foot above one column of soil, trapezoidal rule or implicit Euler.
fn foot(integrator: &str, soil: &str, duration: f64) -> String {
    format!(
        r#"
[time]
step_s = 0.001
duration_s = {duration}
[world]
gravity_m_s2 = [0.0, 0.0, -9.81]
[gluing]
strategy = "iterative"
tolerance = 1e-12
[foot]
module = "table-on-feet"
mass_kg = 5.0
start = [0.0, 0.0, 0.0, 0.5]
integrator = "{integrator}"
[soil]
module = "power-columns"
{soil}
[[glue]]
kind = "contact"
side_1 = "foot.foot0"
side_2 = "soil.c0"
"#
    )
}

/// `tests/reference/gluing/foot_exact.csv` and the errors that the README states for the integrators at 1 ms.
#[test]
fn a_foot_sinks_into_power_law_soil_as_deep_as_its_energy_carries_it() {
    let soils = [
        ("K = [8340.0]\nn = [1.0]\nk_u = [2e5]", 0.06, 0.01946325823806, 3e-4, -0.0280),
        ("K = [15383.3]\nn = [1.1]\nk_u = [4e5]", 0.06, 0.01739549831024, 3e-4, -0.0303),
        ("K = [8240.5]\nn = [0.5]\nk_u = [2e5]", 0.02, 0.002664777058788, 2e-2, -0.143),
        ("K = [2404.2]\nn = [1.6]\nk_u = [5e4]", 0.23, 0.1670526528772, 3e-4, -0.0078),
    ];
    for (soil, until, z_max, bar, euler) in soils {
        let deepest = |integrator| {
            let mut testbed = build(&foot(integrator, soil, until));
            run(&mut testbed, until).unwrap_or_else(|e| panic!("{soil}: {e}"));
            read(&testbed, "soil.max_sinkage") / z_max - 1.0
        };
        let (second, first) = (deepest("newmark"), deepest("implicit-euler"));
        println!("{soil:?}: {second:.1e} and {first:.4}");
        assert!(second.abs() <= bar, "{soil}: {second}");
        assert!((first - euler).abs() <= 0.05 * euler.abs(), "{soil}: {first}");
    }
}

#[test]
fn six_feet_on_springs_rest_where_statics_puts_them() {
    let table = format!(
        r#"
[time]
step_s = 1.0
duration_s = 40.0
[world]
gravity_m_s2 = [0.0, 0.0, -9.81]
[gluing]
strategy = "iterative"
tolerance = 1e-12
[table]
module = "table-on-feet"
mass_kg = 60.0
roll_inertia_kg_m2 = 2.0
pitch_inertia_kg_m2 = 4.0
feet_m = [0.4, 0.3, 0.0, 0.3, -0.4, 0.3, 0.4, -0.3, 0.0, -0.3, -0.4, -0.3]
offset_m = [0.05, 0.02]
integrator = "implicit-euler"
[soil]
module = "power-columns"
K = [15e3, 15e3, 15e3, 15e3, 15e3, 15e3]
k_u = [15e3, 15e3, 15e3, 15e3, 15e3, 15e3]
{}"#,
        (0..6)
            .map(|i| format!(
                "[[glue]]\nkind = \"contact\"\nside_1 = \"table.foot{i}\"\nside_2 = \"soil.c{i}\"\n"
            ))
            .collect::<String>()
    );
    let mut testbed = build(&table);
    run(&mut testbed, 40.0).unwrap_or_else(|e| panic!("{e}"));
    let forces: Vec<f64> = testbed.report().ports.iter().map(|p| p.wrench[0]).collect();
    println!("{forces:?}");
    for (got, want) in forces.iter().zip([123.03375, 104.64, 86.24625, 109.95375, 91.56, 73.16625]) {
        assert!((got - want).abs() < 1e-9 * want, "{got} {want}");
    }
    assert!((read(&testbed, "table.heave") - 0.006722347916667).abs() < 1e-11);
}

/// Two rods glued at their centres, which are one metre apart.
fn apart(more: &str) -> String {
    let text = pendulum("").replace("pose = [1.5, 0.0, 0.0]", "pose = [1.5, 0.05, 0.0]");
    text.replace("at_m = [1.0, 0.0, 0.0]", more)
}

#[test]
fn a_gap_at_the_start_is_refused_unless_a_ramp_closes_it() {
    let refused = glued(&apart("")).err().map(|e| e.to_string()).unwrap_or_default();
    assert!(refused.contains("are 1.0012 m apart"), "{refused}");
    let mut testbed = build(&apart("ramp_s = 0.5"));
    let gap = |t: &Testbed| {
        let d = |axis: &str| read(t, &format!("upper.b0.{axis}")) - read(t, &format!("lower.b0.{axis}"));
        d("x").hypot(d("y"))
    };
    let (start, mut before, mut fastest) = (gap(&testbed), 0.0, 0.0_f64);
    while testbed.t_s() < 0.6 {
        testbed.step().unwrap_or_else(|e| panic!("{e}"));
        let now = gap(&testbed);
        let s: f64 = (testbed.t_s() / 0.5).min(1.0);
        let left = start * (1.0 - s * s * s * (10.0 + s * (6.0 * s - 15.0)));
        assert!((now - left).abs() < 1e-9, "at {} s: {now} m, wanted {left} m", testbed.t_s());
        fastest = fastest.max((before - now) / 0.005);
        before = now;
    }
    // 15/8 of the mean rate, and no jump
    assert!(before < 1e-9 && fastest < 1.9 * start / 0.5, "{before} {fastest}");
}
