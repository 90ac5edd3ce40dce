//! Several groups of glued subsystems in one scenario, snapshots of the memory of strategies, and steps set by the
//! energy residual of the interface.

use terraglue::Testbed;
use terraglue_acceptance::{glued, read};

fn build(text: &str) -> Testbed {
    glued(text).unwrap_or_else(|e| panic!("{e}\n{text}"))
}

fn head(gluing: &str) -> String {
    format!(
        "[time]\nstep_s = 0.01\nduration_s = 2.0\n[world]\ngravity_m_s2 = [0.0, 0.0, -9.81]\n[gluing]\n{gluing}\n"
    )
}

fn mass(name: &str, place: f64) -> String {
    format!(
        "[{name}]\nmodule = \"mass-chain\"\nmass_kg = [1.0]\nspring_n_m = [40.0]\nposition_m = [{place:?}]\n"
    )
}

fn spring(a: &str, b: &str, more: &str) -> String {
    format!(
        "[[glue]]\nside_1 = \"{a}.m0\"\nside_2 = \"{b}.m0\"\ncomponents = \"x\"\ncompliance_m_n = 0.006\n{more}\n"
    )
}

const FOOT: &str = "[foot]\nmodule = \"table-on-feet\"\nmass_kg = 5.0\nstart = [0.0, 0.0, 0.0, 0.5]\n\
    [soil]\nmodule = \"power-columns\"\nK = [8340.0]\nn = [1.0]\nk_u = [2e5]\n";
const FOOT_GLUE: &str = "[[glue]]\nkind = \"contact\"\nside_1 = \"foot.foot0\"\nside_2 = \"soil.c0\"\n";

#[test]
fn groups_are_solved_apart_each_by_its_own_strategy() {
    let two = head("strategy = \"iterative\"")
        + &mass("a", 1.0)
        + &mass("b", 0.0)
        + &mass("c", -0.5)
        + &mass("d", 0.25)
        + FOOT
        + &spring("c", "d", "strategy = \"gauss-seidel\"")
        + &spring("a", "b", "")
        + FOOT_GLUE;
    let mut both = build(&two);
    let mut first = build(
        &(head("strategy = \"iterative\"") + &mass("a", 1.0) + &mass("b", 0.0) + &spring("a", "b", "")),
    );
    let mut second = build(
        &(head("strategy = \"gauss-seidel\"") + &mass("c", -0.5) + &mass("d", 0.25) + &spring("c", "d", "")),
    );
    let mut third = build(&(head("strategy = \"iterative\"") + FOOT + FOOT_GLUE));
    for _ in 0..100 {
        for testbed in [&mut both, &mut first, &mut second, &mut third] {
            testbed.step().unwrap_or_else(|e| panic!("{e}"));
        }
        for (own, names) in [
            (&first, ["a.m0.x", "b.m0.x"]),
            (&second, ["c.m0.x", "d.m0.x"]),
            (&third, ["foot.heave", "soil.max_sinkage"]),
        ] {
            for name in names {
                assert_eq!(read(&both, name), read(own, name), "{name} at {} s", both.t_s());
            }
        }
        let count = |t: &Testbed| t.report().evaluations_bodies;
        assert_eq!(count(&both), count(&first) + count(&second) + count(&third));
        assert_eq!(both.report().ports.len(), 3);
    }
}

#[test]
fn glue_of_one_group_names_one_strategy_and_a_refusal_says_where() {
    let chain = |b: &str, c: &str| {
        head("strategy = \"iterative\"")
            + &mass("a", 1.0)
            + &mass("b", 0.0)
            + &mass("c", 0.0)
            + &spring("a", "b", &format!("strategy = \"{b}\""))
            + &spring("c", "b", &format!("strategy = \"{c}\""))
    };
    let refused = glued(&chain("jacobi", "gauss-seidel")).err().expect("two strategies in one group");
    assert!(refused.to_string().contains("another strategy is named before"), "{refused}");
    build(&chain("jacobi", "jacobi"));
    // the contact group can be cooperative, the joint between c and d cannot
    let joint = spring("c", "d", "").replace("compliance_m_n = 0.006", "");
    let mixed = |own: &str| {
        head("strategy = \"cooperative\"")
            + FOOT
            + FOOT_GLUE
            + &mass("c", 0.0)
            + &mass("d", 0.0)
            + &joint
            + own
    };
    let refused = glued(&mixed("")).err().expect("a joint needs another strategy");
    assert!(refused.to_string().contains("co-operates at contacts"), "{refused}");
    build(&mixed("strategy = \"iterative\"\n"));
    let unchecked = glued(&(head("strategy = \"semi-implicit\"") + FOOT + FOOT_GLUE)).err();
    let unchecked = unchecked.expect("one unchecked step is not enough for a contact").to_string();
    assert!(unchecked.contains("does not check it"), "{unchecked}");
}

/// Two rods, cut at their pin.
fn pendulum(gluing: &str) -> String {
    let rod = |name: &str, x: f64, pins: &str| {
        format!(
            "[{name}]\nmodule = \"planar-bodies\"\nmass_kg = [1.0]\ninertia_kg_m2 = [0.0833]\npose = [{x:?}, 0.0, 0.0]\n{pins}\n"
        )
    };
    head(gluing).replace("[0.0, 0.0, -9.81]", "[0.0, -9.81, 0.0]")
        + &rod("upper", 0.5, "pins = [0, -1, 0.0, 0.0]")
        + &rod("lower", 1.5, "")
        + "[[glue]]\nside_1 = \"upper.b0\"\nside_2 = \"lower.b0\"\nat_m = [1.0, 0.0, 0.0]\ncomponents = [\"x\", \"y\"]\n"
}

/// Steps and answers all that can be seen of each.
fn look(testbed: &mut Testbed, names: &[&str]) -> Vec<Vec<u64>> {
    let mut all = Vec::new();
    for _ in 0..20 {
        testbed.step().unwrap_or_else(|e| panic!("{e}"));
        let report = testbed.report();
        let mut seen = vec![
            u64::from(report.evaluations_bodies),
            u64::from(report.evaluations_soil),
            u64::from(report.evaluations_jacobian),
            testbed.step_index(),
        ];
        seen.extend(report.ports.iter().flat_map(|p| p.wrench).map(f64::to_bits));
        seen.extend(names.iter().map(|n| read(testbed, n).to_bits()));
        all.push(seen);
    }
    all
}

#[test]
fn a_run_goes_on_from_a_snapshot_to_the_bit_whatever_its_strategy_remembers() {
    let oscillator = |gluing: &str| head(gluing) + &mass("a", 0.1) + &mass("b", 0.0) + &spring("a", "b", "");
    let foot = |gluing: &str| head(gluing) + FOOT + FOOT_GLUE;
    let (masses, rods, feet) =
        (["a.m0.x", "b.m0.v"], ["upper.b0.angle", "lower.b0.omega"], ["foot.heave", "soil.max_sinkage"]);
    for (text, names) in [
        (oscillator("strategy = \"gauss-seidel\"\nenergy_residual_j = 1e-4"), &masses),
        (pendulum("strategy = \"iterative\"\njacobian = \"broyden\""), &rods),
        (pendulum("strategy = \"semi-implicit\""), &rods),
        (pendulum("strategy = \"monolithic\""), &rods),
        (foot("strategy = \"jacobi\""), &feet),
        (foot("strategy = \"iterative\""), &feet),
        (foot("strategy = \"cooperative-compliant\""), &feet),
        (foot("strategy = \"jacobi\"\nenergy_residual_j = 1e-3"), &feet),
    ] {
        let mut testbed = build(&text);
        let start = testbed.snapshot(0).unwrap_or_else(|e| panic!("{e}"));
        let from_start = look(&mut testbed, names);
        let on_the_way = testbed.snapshot(1).unwrap_or_else(|e| panic!("{e}"));
        let later = look(&mut testbed, names);
        testbed.restore(&on_the_way).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(look(&mut testbed, names), later, "{text}");
        testbed.restore(&start).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(look(&mut testbed, names), from_start, "{text}");
    }
}

#[test]
fn the_energy_residual_sets_the_steps_where_there_is_one() {
    let oscillator = |tolerance: &str| {
        let gluing = format!("strategy = \"gauss-seidel\"\n{tolerance}");
        let mut testbed = build(&(head(&gluing) + &mass("a", 0.1) + &mass("b", 0.0) + &spring("a", "b", "")));
        let (mut parts, mut most) = (0, 0);
        while testbed.t_s() < 1.0 - 1e-9 {
            testbed.step().unwrap_or_else(|e| panic!("{e}"));
            parts += u64::from(testbed.report().parts);
            most = most.max(testbed.report().parts);
        }
        assert_eq!(
            parts,
            testbed.step_index(),
            "{tolerance}: parts of nominal steps are communication steps"
        );
        assert_eq!(most == 1, tolerance.is_empty(), "{tolerance}: up to {most} parts");
        parts
    };
    let (fixed, coarse, fine) =
        (oscillator(""), oscillator("energy_residual_j = 1e-4"), oscillator("energy_residual_j = 1e-6"));
    println!("{fixed}, {coarse} and {fine} steps");
    assert!(fixed == 100 && fixed < coarse && 2 * coarse < fine);
    let refused = glued(&pendulum("energy_residual_j = 1e-4\nstrategy = \"iterative\"")).err();
    let refused = refused.expect("rigid joints have no residual").to_string();
    assert!(refused.contains("no soil and no spring is glued"), "{refused}");
    let text =
        head("strategy = \"iterative\"\nenergy_residual_j = 1e-4\nstep_min_s = 0.1") + FOOT + FOOT_GLUE;
    let refused = glued(&text).err().expect("the shortest step is longer than the longest").to_string();
    assert!(refused.contains("longer than time.step_s"), "{refused}");
}
