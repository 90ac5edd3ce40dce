//! Properties on which gluing relies: force and motion answer each other, the estimate is respected, the ledgers are true.

use crate::definition::Test;
use crate::finding::{Stop, Verdict};
use crate::fixture::{Foot, SoilFixture, dot};
use crate::scope::{Area, Level};
use crate::test_context::TestContext;
use terraglue_subsystem::{Capabilities, Kind};

const fn test(name: &'static str, promise: &'static str, run: fn(&TestContext) -> Verdict) -> Test {
    let (area, level, after) = (Area::Physics, Level::Quick, &["steps"]);
    Test { name, area, level, kinds: &[Kind::Soil], after, promise, run }
}

/// The tests of this area.
pub const TESTS: &[Test] = {
    &[
        test("surface-below-foot", "set_ports answers 0 along n in contact and minus the gap above", surface),
        test("force-now", "set_ports answers the force of the step before", force_now),
        test(
            "force-and-motion",
            "the surface under a force gives that force back as a motion",
            force_and_motion,
        ),
        test(
            "estimate-respected",
            "T1 is the law's at the motion that follows, or at most T* and the law",
            estimate,
        ),
        test("energy-book", "the work in its energy ledger is the work that feet did", energy_ledger),
        test("no-ground-from-nothing", "pressing and dragging never raise the volume of the ground", volume),
        test("ground-follows-foot", "where a foot has been, no ground stands in its way", follows),
    ]
};

fn surface(context: &TestContext) -> Verdict {
    let mut fixture = SoilFixture::new(context, &[Foot::sphere(0.0, 0.0).lifted(4e-4)])?;
    fixture.meet(&[[0.0, 0.0, -1.0]], 1e-3)?;
    let Some(n) = fixture.normal_components().first().copied() else { return Ok(()) };
    let gap = fixture.now.x[n];
    // A ground on a lattice has its height between nodes only to this accuracy.
    if (gap + 4e-4).abs() > 1e-5 {
        let got = format!("x = {gap:e} m along n");
        return Err(Stop::fail(
            "set_ports",
            "a sphere 0.4 mm above level ground",
            got,
            "-4e-4 m: minus the gap",
        ));
    }
    fixture.drag([0.0, 0.0, -0.005], 20)?;
    fixture.meet(&[[0.0, 0.0, -0.1]], 1e-3)?;
    let at = fixture.normal_components().first().map_or(0.0, |n| fixture.now.x[*n]);
    if at.abs() > 1e-6 {
        let got = format!("x = {at:e} m along n");
        return Err(Stop::fail(
            "set_ports",
            "a sphere pressed 5 mm deep",
            got,
            "0: the surface is at the foot",
        ));
    }
    Ok(())
}

fn force_now(context: &TestContext) -> Verdict {
    let mut fixture = SoilFixture::new(context, &[Foot::plate(0.0, 0.0)])?;
    for _ in 0..30 {
        fixture.go(&[[0.02, 0.0, -0.2]], 1e-3)?;
        let before = fixture.moved[0].normal;
        fixture.meet(&[[0.0, 0.0, 0.0]], 1e-3)?;
        let now = fixture.normal_components().first().map_or(0.0, |n| fixture.now.t[*n]);
        if (now - before).abs() > 0.1 * before.max(1.0) {
            let given = format!("after a commit with {before:.4} N along n at t = {:.3} s", fixture.t);
            return Err(Stop::fail(
                "set_ports",
                given,
                format!("{now:.4} N"),
                "the force of the committed state",
            ));
        }
    }
    Ok(())
}

fn force_and_motion(context: &TestContext) -> Verdict {
    let mut fixture = SoilFixture::new(context, &[Foot::sphere(0.0, 0.0)])?;
    let can = fixture.soil.capabilities();
    if !can.has(Capabilities::FORCE) {
        return Err(Stop::Skip(
            "it takes no force: the form T-T of the gluing is not offered with it".into(),
        ));
    }
    for step in 0..30 {
        let down = [[0.0, 0.0, if step < 20 { -0.2 } else { 0.005 }]];
        fixture.meet(&down, 1e-3)?;
        let (x, v) = fixture.motion_of(&down, 1e-3);
        fixture.try_motion(&x, &v, 1e-3)?;
        let (t, n) = (fixture.out.t.clone(), fixture.normal_components());
        if let Some(n) = n.first().copied().filter(|n| t[*n] > 1.0) {
            fixture.try_force(&t, Some((&x, &v)), 1e-3)?;
            let surface = fixture.out.x[n];
            if (surface - x[n]).abs() > 1e-7 + 1e-3 * x[n].abs() {
                let given = format!(
                    "the force {:.6} N, that of a motion of {:e} m, at t = {:.3} s",
                    t[n], x[n], fixture.t
                );
                return Err(Stop::fail(
                    "advance",
                    given,
                    format!("a surface at {surface:e} m"),
                    "at that motion",
                ));
            }
        }
        fixture.go(&down, 1e-3)?;
    }
    Ok(())
}

fn estimate(context: &TestContext) -> Verdict {
    let mut fixture = SoilFixture::new(context, &[Foot::sphere(-0.1, 0.0), Foot::plate(0.1, 0.0)])?;
    if !fixture.soil.capabilities().has(Capabilities::SOLVE) {
        return Err(Stop::Skip(
            "no solve_compatibility: the coordinator's own plain pass takes its place".into(),
        ));
    }
    for step in 0..20 {
        let down = [[0.01, 0.0, -0.2]; 2];
        fixture.meet(&down, 1e-3)?;
        let law = fixture.now.t.clone();
        for size in [0.0, 1.0, 1e4] {
            let t_star = fixture.packed_normal(size);
            fixture.try_estimate(&t_star, 1e-3)?;
            let answer = fixture.out.t.clone();
            // the estimate of this fixture: no motion without soil, and h²/m of 1 kg
            let x: Vec<f64> = answer.iter().map(|t| 1e-6 * t).collect();
            let v: Vec<f64> = x.iter().map(|x| x / 1e-3).collect();
            let told = fixture.soil.capabilities().has(Capabilities::MOTION);
            if told {
                fixture.try_motion(&x, &v, 1e-3)?;
            }
            for n in fixture.normal_components() {
                let (t1, most) = (answer[n], size.min(law[n]));
                let is_law = told && (t1 - fixture.out.t[n]).abs() <= 1e-6 * t1.abs() + 1e-9;
                if t1 < -1e-9 || !is_law && t1 > most * (1.0 + 1e-9) + 1e-9 {
                    let given = format!("T* = {size} N, law {:.4} N, step {step}", law[n]);
                    let expected = format!("the law's, or 0 <= T1 <= min(T*, F) = {most:.4} N");
                    return Err(Stop::fail(
                        "solve_compatibility",
                        given,
                        format!("T1 = {t1:.4} N"),
                        expected,
                    ));
                }
            }
        }
        fixture.go(&down, 1e-3)?;
    }
    Ok(())
}

fn energy_ledger(context: &TestContext) -> Verdict {
    let mut fixture = SoilFixture::new(context, &[Foot::sphere(0.0, 0.0)])?;
    if !fixture.soil.energy()?.is_known() {
        return Err(Stop::Skip("it keeps no energy ledger: reports show its energy as unknown".into()));
    }
    let (mut work, mut dissipated) = (0.0, 0.0);
    for step in 0..90 {
        let v = [[0.0, 0.0, -0.2], [0.1, 0.0, 0.0], [0.0, 0.0, 0.05]][step / 30];
        fixture.go(&[v], 1e-3)?;
        work -= 1e-3 * dot(fixture.moved[0].force, v);
        let ledger = fixture.soil.energy()?;
        if ledger.dissipated < dissipated - 1e-9 {
            let got = format!("{:e} J after {dissipated:e} J", ledger.dissipated);
            return Err(Stop::fail("energy", format!("step {step}"), got, "`dissipated` never falls"));
        }
        dissipated = ledger.dissipated;
    }
    let ledger = fixture.soil.energy()?;
    let difference = (ledger.port_work - work).abs();
    // a ledger that has stopped being a number fails too
    if difference.is_nan() || difference > 0.1 * work.abs() + 1e-6 {
        let got = format!("port_work = {:.5} J", ledger.port_work);
        let expected = format!("{work:.5} J, the forces times the motions, by 10 %");
        return Err(Stop::fail("energy", "down, along and up with a sphere", got, expected));
    }
    Ok(())
}

fn volume(context: &TestContext) -> Verdict {
    let mut fixture = SoilFixture::new(context, &[Foot::sphere(0.0, 0.0)])?;
    let Some(start) = fixture.ground_volume()? else {
        return Err(Stop::Skip("no field `height`: contacts are found on the terrain of the start".into()));
    };
    for step in 0..120 {
        let v = [[0.0, 0.0, -0.3], [0.4, 0.1, 0.0], [0.0, 0.0, 0.3]][step / 40];
        fixture.go(&[v], 1e-3)?;
    }
    let grown = fixture.ground_volume()?.unwrap_or(start) - start;
    if grown > 1e-9 {
        let got = format!("{:.3} cm3 more ground", 1e6 * grown);
        return Err(Stop::fail(
            "field_tile",
            "the field `height` after pressing and dragging",
            got,
            "no more ground than before",
        ));
    }
    Ok(())
}

fn follows(context: &TestContext) -> Verdict {
    let mut fixture = SoilFixture::new(context, &[Foot::sphere(0.0, 0.0)])?;
    if fixture.ground_height(0.0, 0.0)?.is_none() {
        return Err(Stop::Skip("no field `height`: contacts are found on the terrain of the start".into()));
    }
    for step in 0..40 {
        fixture.go(&[[0.0, 0.0, -0.3]], 1e-3)?;
        let foot = fixture.states[0].world_from_body.position[2] - 0.04;
        let ground = fixture.ground_height(0.0, 0.0)?.unwrap_or(foot);
        // Firm clay is elastic for some millimetres and springs back by them when the foot is gone.
        if foot < -6e-3 && ground > 0.5 * foot && fixture.moved[0].touched {
            let got = format!("ground at {:.3} mm below a foot at {:.3} mm", 1e3 * ground, 1e3 * foot);
            return Err(Stop::fail(
                "commit",
                format!("a sphere pressed down, step {step}"),
                got,
                "at the foot, less what springs back, or below it",
            ));
        }
    }
    Ok(())
}
