//! The same numbers every time, finite ones, and derivatives that are those of the answers.

use super::life_cycle::same;
use crate::definition::Test;
use crate::derivative::{Columns, compare};
use crate::finding::{ANSWER, Stop, Verdict};
use crate::fixture::{BodyFixture, Foot, Runner, SoilFixture, committed, script};
use crate::other_process::{RemoteRun, in_other_process};
use crate::scope::{Area, Level};
use crate::test_context::TestContext;
use terraglue_host::Workers;
use terraglue_subsystem::{Capabilities, Kind, Level as Derivative};

const fn test(
    name: &'static str,
    level: Level,
    kinds: &'static [Kind],
    after: &'static [&'static str],
    promise: &'static str,
    run: fn(&TestContext) -> Verdict,
) -> Test {
    Test { name, area: Area::Numbers, level, kinds, after, promise, run }
}

/// The tests of this area.
pub const TESTS: &[Test] = {
    use Level::{Quick, Standard};
    const SOIL: &[Kind] = &[Kind::Soil];
    const ROBOT: &[Kind] = &[Kind::Robot];
    const BOTH: &[Kind] = &[Kind::Soil, Kind::Robot];
    &[
        test("same-again", Quick, &[], &["steps"], "the same run gives the same bytes", again),
        test("same-process", Standard, &[], &["same-again"], "another process gives the same bytes", process),
        test(
            "same-thread",
            Quick,
            &[],
            &["same-again"],
            "calls from changing threads give the same bytes",
            thread,
        ),
        test("same-workers", Quick, &[], &["same-again"], "the host's threads do not change a byte", workers),
        test(
            "same-locale",
            Standard,
            &[],
            &["same-process"],
            "another locale and time zone give the same bytes",
            locale,
        ),
        test(
            "extremes-soil",
            Quick,
            SOIL,
            &["steps"],
            "tiny and huge motions and forces are answered by finite numbers",
            extremes,
        ),
        test(
            "extremes-robot",
            Quick,
            ROBOT,
            &["steps"],
            "tiny and huge forces are answered by finite numbers",
            extremes_robot,
        ),
        test(
            "zero-step",
            Quick,
            BOTH,
            &["steps"],
            "a step of h = 0 is answered, and nothing moves",
            zero_step,
        ),
        test(
            "jacobian-soil",
            Quick,
            SOIL,
            &["trials-repeat"],
            "the derivative after a motion is that of the force",
            jacobian_soil,
        ),
        test(
            "jacobian-force",
            Quick,
            SOIL,
            &["trials-repeat"],
            "the derivative after a force is that of the surface",
            jacobian_force,
        ),
        test(
            "jacobian-robot",
            Quick,
            ROBOT,
            &["trials-repeat"],
            "the derivative after a force is that of the motion",
            jacobian_robot,
        ),
    ]
};

fn again(context: &TestContext) -> Verdict {
    let run = || script(context.instance()?, 90, 1).map(|(bits, _)| bits);
    same("the same run again", &run()?, &run()?)
}

fn process(context: &TestContext) -> Verdict {
    let (here, _) = script(context.instance()?, 90, 0)?;
    same("the same run in another process", &here, &in_other_process(context, &RemoteRun::fresh(90), &[])?)
}

/// Every step from another thread, as the coordinator may do.
fn thread(context: &TestContext) -> Verdict {
    let (here, _) = script(context.instance()?, 40, 0)?;
    let mut runner = Runner::new(context.instance()?)?;
    let mut bits = Vec::new();
    for k in 0..40 {
        let (back, step) = std::thread::scope(|scope| {
            let job = scope.spawn(move || {
                let mut bits = Vec::new();
                let done = runner.step(k, 0, 0, &mut bits);
                (runner, done.map(|()| bits))
            });
            job.join().map_err(|_| Stop::fail("a step", "from another thread", "a panic", "an answer"))
        })?;
        runner = back;
        bits.extend(step?);
    }
    bits.extend(committed(runner.instance())?);
    same("the run with every step from another thread", &here, &bits)
}

fn workers(context: &TestContext) -> Verdict {
    let module = context.module()?;
    let run = |threads: usize| {
        let mut services = context.services();
        services.workers = std::sync::Arc::new(Workers::new(threads));
        let made = module.instantiate("checked", context.config(module.schema()), &services);
        let made =
            made.map_err(|e| Stop::fail("instantiate", "usual parameters", e.to_string(), "an instance"))?;
        script(made, 90, 0).map(|(bits, _)| bits)
    };
    same("the run with three threads of the host", &run(1)?, &run(3)?)
}

fn locale(context: &TestContext) -> Verdict {
    let (here, _) = script(context.instance()?, 60, 0)?;
    let there = in_other_process(
        context,
        &RemoteRun::fresh(60),
        &[("LC_ALL", "de_DE.UTF-8"), ("TZ", "Asia/Kolkata")],
    )?;
    same("the run in a German locale and Indian time", &here, &there)?;
    match terraglue_host::has_locale("de_DE.UTF-8") {
        true => Ok(()),
        false => Err(Stop::Skip("de_DE.UTF-8 is not installed: only the time zone was another".into())),
    }
}

fn extremes(context: &TestContext) -> Verdict {
    let feet = [Foot::sphere(-0.1, 0.0), Foot::plate(0.1, 0.0)];
    for depth in [1e-12, 1e-6, 1e-2, 0.2, 1.0] {
        let mut fixture = SoilFixture::new(context, &feet)?;
        for (sideways, v) in [(0.0, depth / 1e-3), (5.0, 0.0), (-5.0, -2.0 * depth / 1e-3)] {
            let velocities = [[sideways, 0.0, -v], [0.0, sideways, -v]];
            fixture.go(&velocities, 1e-3)?;
        }
    }
    let mut fixture = SoilFixture::new(context, &feet)?;
    if !fixture.soil.capabilities().has(Capabilities::FORCE) {
        return Ok(());
    }
    let still = [[0.0, 0.0, -0.05]; 2];
    for _ in 0..10 {
        fixture.go(&still, 1e-3)?;
    }
    for size in [0.0, 1e-12, 1.0, 1e4, 1e5, 1e6, 1e7] {
        fixture.meet(&still, 1e-3)?;
        let (x, v) = fixture.motion_of(&still, 1e-3);
        let t = fixture.packed_normal(size);
        fixture.try_force(&t, None, 1e-3)?;
        fixture.try_force(&t, Some((&x, &v)), 1e-3)?;
    }
    Ok(())
}

fn extremes_robot(context: &TestContext) -> Verdict {
    let mut fixture = BodyFixture::new(context.instance()?);
    fixture.place_port()?;
    for size in [0.0, 1e-12, 1.0, 1e4, -1e4] {
        for h in [1e-6, 1e-3, 1e-2] {
            fixture.try_force(&[size, 0.1 * size, -0.3 * size], h)?;
        }
    }
    // joints may be torn by forces that no robot withstands, if the robot says so
    for size in [1e7, -1e7] {
        match fixture.try_force(&[size, 0.1 * size, -0.3 * size], 1e-3) {
            Err(Stop::Fail(refused)) if refused.expected == ANSWER => {}
            other => other?,
        }
    }
    Ok(())
}

fn zero_step(context: &TestContext) -> Verdict {
    let moved = |x: &[f64]| {
        x.iter().find(|x| x.abs() > 1e-12).map(|x| {
            let got = format!("a displacement of {x:e} m");
            Stop::fail("advance", "a step of h = 0", got, "accelerations at t only; X and V stay")
        })
    };
    match context.instance()?.kind() {
        Kind::Robot => {
            let mut fixture = BodyFixture::new(context.instance()?);
            fixture.fall(1e-3)?;
            fixture.place_port()?;
            if let Err(Stop::Fail(refused)) = fixture.try_force(&[10.0, 0.0, 0.0], 0.0) {
                let cost = "forces at the start of a run are those of the first step";
                return Err(Stop::Skip(format!("no step of h = 0 ({}): {cost}", refused.got)));
            }
            moved(&fixture.out.x).map_or(Ok(()), Err)
        }
        _ => {
            let mut fixture = SoilFixture::new(context, &[Foot::sphere(0.0, 0.0)])?;
            for _ in 0..5 {
                fixture.go(&[[0.0, 0.0, -0.1]], 1e-3)?;
            }
            fixture.meet(&[[0.0, 0.0, -0.1]], 1e-3)?;
            fixture.ask_ports(0.0)?;
            let (x, v) = fixture.motion_of(&[[0.0, 0.0, 0.0]], 0.0);
            fixture.try_motion(&x, &v, 0.0)
        }
    }
}

/// Along a trajectory with loading, sliding, unloading and reloading, at several points of each.
fn jacobian_soil(context: &TestContext) -> Verdict {
    let feet = [Foot::sphere(-0.1, 0.003), Foot::plate(0.15, -0.05)];
    let mut fixture = SoilFixture::new(context, &feet)?;
    if !fixture.soil.capabilities().has(Capabilities::DERIVATIVES) {
        return Err(Stop::Skip(
            "no interface_jacobian: the coordinator takes finite differences, at more trials".into(),
        ));
    }
    // Never quite straight down: at rest along the ground, sticking and first slip meet. Never up and down by the same: back
    // at its largest depth a plate has a corner under all nodes at once, where turning it loads one half from either side.
    let phases = [[0.004, -0.2], [0.3, -0.02], [0.02, -0.1], [0.01, 0.047], [-0.01, -0.05]];
    for step in 0..context.count(40).min(200) {
        let [vx, vz] = phases[(step / 8) % phases.len()];
        let velocities = [[vx, 0.3 * vx, vz], [-vx, 0.1 * vx, 0.7 * vz]];
        if step % 4 == 3 {
            fixture.meet(&velocities, 1e-3)?;
            let (x, v) = fixture.motion_of(&velocities, 1e-3);
            fixture.try_motion(&x, &v, 1e-3)?;
            // Where a foot hardly touches, node after node comes into contact: corners everywhere.
            let pressed = fixture.components_above(1.0);
            let k = fixture.jacobian(Derivative::Position, 1e-3)?;
            let columns = Columns::of(
                &k,
                |x| {
                    fixture.try_motion(x, &v, 1e-3)?;
                    // The wrench on the soil is -T, and as for a spring it grows with the motion that presses it.
                    Ok(fixture.out.t.iter().map(|t| -t).collect())
                },
                &x,
                1e-7,
            )?;
            compare(&fixture.ports, &columns.only(&pressed), "motion", fixture.t)?;
        }
        fixture.go(&velocities, 1e-3)?;
    }
    Ok(())
}

fn jacobian_force(context: &TestContext) -> Verdict {
    let mut fixture = SoilFixture::new(context, &[Foot::sphere(0.0, 0.003)])?;
    let can = fixture.soil.capabilities();
    if !can.has(Capabilities::DERIVATIVES) || !can.has(Capabilities::FORCE) {
        return Err(Stop::Skip(
            "no derivative after a force: the form T-T of the gluing takes finite differences".into(),
        ));
    }
    for step in 0..40 {
        let velocities = [[0.0, 0.0, if step < 24 { -0.1 } else { 0.02 }]];
        if step % 6 == 5 {
            fixture.meet(&velocities, 1e-3)?;
            let (x, v) = fixture.motion_of(&velocities, 1e-3);
            fixture.try_motion(&x, &v, 1e-3)?;
            // Where a foot hardly touches, soils take another slope than that of a law that starts flat.
            let pressed = fixture.components_above(0.1);
            let mut t = fixture.out.t.clone();
            t.iter_mut().for_each(|t| *t *= 1.02);
            fixture.try_force(&t, None, 1e-3)?;
            let g = fixture.jacobian(Derivative::Position, 1e-3)?;
            let mut normals = fixture.normal_components();
            normals.retain(|place| pressed.contains(place));
            // The soil feels -T: dX/d(wrench on itself) = -dX/dT.
            let all = Columns::of(
                &g,
                |t| {
                    fixture.try_force(t, None, 1e-3)?;
                    Ok(fixture.out.x.iter().map(|x| -x).collect())
                },
                &t,
                1e-4,
            )?;
            compare(&fixture.ports, &all.only(&normals), "force", fixture.t)?;
        }
        fixture.go(&velocities, 1e-3)?;
    }
    Ok(())
}

fn jacobian_robot(context: &TestContext) -> Verdict {
    let mut fixture = BodyFixture::new(context.instance()?);
    if !fixture.robot.capabilities().has(Capabilities::DERIVATIVES) {
        return Err(Stop::Skip(
            "no interface_jacobian: the coordinator takes finite differences, at more trials".into(),
        ));
    }
    for step in 0..30 {
        if step % 5 == 4 {
            fixture.place_port()?;
            let t = [30.0, 2.0, -1.0];
            fixture.try_force(&t, 1e-3)?;
            let g = fixture.jacobian(1e-3)?;
            let columns = Columns::of(
                &g,
                |t| {
                    fixture.try_force(t, 1e-3)?;
                    Ok(fixture.out.x.clone())
                },
                &t,
                1.0,
            )?;
            let ports = fixture.ports.clone();
            compare(&ports, &columns, "force", fixture.t)?;
        }
        fixture.fall(1e-3)?;
    }
    Ok(())
}
