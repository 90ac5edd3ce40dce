//! Physics of bodies: momentum, gravity, action and reaction, the rigid estimate.

use crate::definition::Test;
use crate::finding::{Stop, Verdict};
use crate::fixture::{BodyFixture, dot};
use crate::scope::{Area, Level};
use crate::test_context::TestContext;
use terraglue_subsystem::{Capabilities, Kind};

const fn test(name: &'static str, promise: &'static str, run: fn(&TestContext) -> Verdict) -> Test {
    let (area, level, after) = (Area::Physics, Level::Quick, &["steps"]);
    Test { name, area, level, kinds: &[Kind::Robot], after, promise, run }
}

/// The tests of this area.
pub const TESTS: &[Test] = {
    &[
        test("falls", "without contact, momentum grows by m g h", falls),
        test("no-gravity", "without gravity and forces, momentum stays", no_gravity),
        test("force-moves", "a force on a port changes momentum by F h", force_moves),
        test("velocity", "bodies move with the velocity that they show", velocity),
        test("fall-energy", "a free fall gains no mechanical energy", fall_energy),
        test("passive-jacobian", "dX/dT is symmetric and never negative", passive_jacobian),
        test(
            "estimate-holds",
            "under T* the body rests on what it stands on, and T* never pulls",
            estimate_holds,
        ),
        test("estimate-apart", "T* is zero where the ground is out of reach", estimate_apart),
        test("unit-quaternions", "orientations keep their length", quaternions),
    ]
};

const G: [f64; 3] = [0.0, 0.0, -9.81];
const H: f64 = 1e-3;

fn mass(fixture: &BodyFixture) -> f64 {
    fixture.robot.scene().bodies.iter().map(|b| b.mass).sum()
}

/// Several bodies carry momentum of their frames' origins only: those tests are for a single body.
fn single(fixture: &BodyFixture) -> Verdict {
    match fixture.robot.scene().bodies.len() {
        1 if mass(fixture) > 0.0 => Ok(()),
        1 => Err(Stop::Skip("its body has no mass in the scene: its momentum is unknown".into())),
        _ => Err(Stop::Skip("several bodies: the scene does not tell where their masses lie".into())),
    }
}

fn grew(call: &str, given: &str, got: [f64; 3], expected: [f64; 3], scale: f64) -> Verdict {
    let gap: [f64; 3] = std::array::from_fn(|k| got[k] - expected[k]);
    if dot(gap, gap).sqrt() <= 1e-6 * scale {
        return Ok(());
    }
    let (got, expected) = (format!("momentum grew by {got:?} N s"), format!("{expected:?} N s"));
    Err(Stop::fail(call, given, got, expected))
}

fn after(fixture: &mut BodyFixture, steps: usize) -> Verdict<[f64; 3]> {
    let before = fixture.momentum()?;
    for _ in 0..steps {
        fixture.fall(H)?;
    }
    let now = fixture.momentum()?;
    Ok(std::array::from_fn(|k| now[k] - before[k]))
}

fn falls(context: &TestContext) -> Verdict {
    let mut fixture = BodyFixture::new(context.instance()?);
    single(&fixture)?;
    let m = mass(&fixture);
    let got = after(&mut fixture, 50)?;
    grew("advance", "50 free steps of 1 ms", got, G.map(|g| m * g * 50.0 * H), m * 9.81 * 50.0 * H)
}

fn no_gravity(context: &TestContext) -> Verdict {
    let module = context.module()?;
    let mut services = context.services();
    services.gravity = [0.0; 3];
    let made = module.instantiate("checked", context.config(module.schema()), &services);
    let made = made.map_err(|e| Stop::fail("instantiate", "no gravity", e.to_string(), "an instance"))?;
    let mut fixture = BodyFixture::new(made);
    single(&fixture)?;
    let scale = mass(&fixture) * 9.81 * 50.0 * H;
    let got = after(&mut fixture, 50)?;
    grew("advance", "50 free steps of 1 ms without gravity", got, [0.0; 3], scale)
}

fn force_moves(context: &TestContext) -> Verdict {
    let mut fixture = BodyFixture::new(context.instance()?);
    single(&fixture)?;
    let m = mass(&fixture);
    let before = fixture.momentum()?;
    fixture.place_port()?;
    let t = [3.0 * m, 2.0 * m, -m];
    fixture.try_force(&t, H)?;
    fixture.commit(&t, H)?;
    let now = fixture.momentum()?;
    let port = &fixture.ports_before[0];
    let (force, _) = port.wrench_in_world(&t);
    let expected = std::array::from_fn(|k| (force[k] + m * G[k]) * H);
    // A body that turns under the force moves its frame's origin too, where that is not its centre of mass.
    let states = fixture.states()?;
    let turns = dot(states[0].angular_velocity, states[0].angular_velocity) > 0.0;
    let scale = m * 9.81 * H * if turns { 1e4 } else { 1.0 };
    grew(
        "advance",
        &format!("a force of {force:?} N for 1 ms"),
        std::array::from_fn(|k| now[k] - before[k]),
        expected,
        scale,
    )
}

fn velocity(context: &TestContext) -> Verdict {
    let mut fixture = BodyFixture::new(context.instance()?);
    for _ in 0..20 {
        fixture.fall(H)?;
    }
    let before = fixture.states()?;
    fixture.fall(H)?;
    let now = fixture.states()?;
    for (k, (a, b)) in before.iter().zip(&now).enumerate() {
        for axis in 0..3 {
            let moved = (b.world_from_body.position[axis] - a.world_from_body.position[axis]) / H;
            let (low, high) = (a.linear_velocity[axis], b.linear_velocity[axis]);
            let room = 0.05 + 0.1 * (low.abs() + high.abs());
            if moved < low.min(high) - room || moved > low.max(high) + room {
                let got = format!("body {k} moved with {moved:.4} m/s along axis {axis}");
                let expected = format!("a velocity between {low:.4} and {high:.4} m/s, as it shows");
                return Err(Stop::fail("body_states", "a free step of 1 ms", got, expected));
            }
        }
    }
    Ok(())
}

fn fall_energy(context: &TestContext) -> Verdict {
    let mut fixture = BodyFixture::new(context.instance()?);
    fixture.fall(H)?;
    let start = fixture.robot.energy()?;
    if (start.mechanical() + start.actuator_work).is_nan() {
        return Err(Stop::Skip("it keeps no energy ledger: reports show its energy as unknown".into()));
    }
    for _ in 0..100 {
        fixture.fall(H)?;
    }
    let end = fixture.robot.energy()?;
    let gained = end.mechanical() - start.mechanical() - (end.actuator_work - start.actuator_work);
    if gained > 0.02 * (end.kinetic - start.kinetic).abs() + 1e-9 {
        let got = format!("{gained:.5} J more than its motors put in");
        return Err(Stop::fail("energy", "100 free steps of 1 ms", got, "no gain"));
    }
    Ok(())
}

fn passive_jacobian(context: &TestContext) -> Verdict {
    let mut fixture = BodyFixture::new(context.instance()?);
    if !fixture.robot.capabilities().has(Capabilities::DERIVATIVES) {
        return Err(Stop::Skip(
            "no interface_jacobian: the coordinator takes finite differences, at more trials".into(),
        ));
    }
    fixture.place_port()?;
    fixture.try_force(&[20.0, 1.0, 2.0], H)?;
    let g = fixture.jacobian(H)?;
    let size = g.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
        let (a, b) = (g[3 * j + i], g[3 * i + j]);
        if (a - b).abs() > 1e-6 * size {
            let got = format!("entries ({i}, {j}) and ({j}, {i}): {a:e} and {b:e} m/N");
            return Err(Stop::fail("interface_jacobian", "a force at one port", got, "a symmetric matrix"));
        }
        let minor = g[4 * i] * g[4 * j] - a * b;
        if g[4 * i] <= 0.0 || minor < -1e-9 * size * size {
            let got = format!("diagonal {:e} m/N, minor {minor:e}", g[4 * i]);
            return Err(Stop::fail(
                "interface_jacobian",
                "a force at one port",
                got,
                "a matrix that is never negative",
            ));
        }
    }
    Ok(())
}

/// A body that stands on a rigid plane at its lowest point.
fn estimate_holds(context: &TestContext) -> Verdict {
    let mut fixture = BodyFixture::new(context.instance()?);
    needs_estimate(&fixture)?;
    fixture.place_port()?;
    let estimate = fixture.estimate(&[0.0; 3], H)?;
    let t_n = estimate.t_star[0];
    if t_n < -1e-9 {
        return Err(Stop::fail(
            "estimate_forces",
            "ground at its lowest point",
            format!("T*_n = {t_n} N"),
            ">= 0",
        ));
    }
    fixture.try_force(&estimate.t_star, H)?;
    let gap = fixture.out.x[0];
    let free = estimate.x_free[0];
    if gap < -1e-3 * free.abs() - 1e-9 {
        let got = format!("it sinks by {:e} m under T*_n = {t_n:.5} N, freely by {:e} m", -gap, -free);
        return Err(Stop::fail(
            "estimate_forces",
            "ground at its lowest point",
            got,
            "no motion into the ground",
        ));
    }
    Ok(())
}

fn estimate_apart(context: &TestContext) -> Verdict {
    let mut fixture = BodyFixture::new(context.instance()?);
    needs_estimate(&fixture)?;
    fixture.place_port()?;
    let estimate = fixture.estimate(&[-0.1, 0.0, 0.0], H)?;
    if estimate.t_star.iter().any(|t| t.abs() > 1e-9) || estimate.active[0] != 0 {
        let got = format!("T* = {:?} N, active {}", estimate.t_star, estimate.active[0]);
        return Err(Stop::fail("estimate_forces", "ground 10 cm below it", got, "zero"));
    }
    Ok(())
}

fn needs_estimate(fixture: &BodyFixture) -> Verdict {
    if fixture.robot.capabilities().has(Capabilities::ESTIMATE) {
        return Ok(());
    }
    Err(Stop::Skip("no estimate_forces: the coordinator solves for T* by itself".into()))
}

fn quaternions(context: &TestContext) -> Verdict {
    let mut fixture = BodyFixture::new(context.instance()?);
    for step in 0..200 {
        if step % 3 == 0 && fixture.robot.scene().shapes.iter().any(|s| s.collides) {
            fixture.place_port()?;
            let t = [5.0, 20.0, -20.0];
            fixture.try_force(&t, H)?;
            fixture.commit(&t, H)?;
        } else {
            fixture.fall(H)?;
        }
        for (k, state) in fixture.states()?.iter().enumerate() {
            let length = state.world_from_body.orientation.iter().map(|q| q * q).sum::<f64>().sqrt();
            if (length - 1.0).abs() > 1e-6 {
                let got = format!("the quaternion of body {k} has the length {length}");
                return Err(Stop::fail("body_states", format!("step {step}"), got, "1"));
            }
        }
    }
    Ok(())
}
