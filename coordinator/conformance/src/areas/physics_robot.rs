//! What bodies obey: momentum, gravity, action and reaction, the rigid estimate.

use crate::catalogue::{Area, Level, Test};
use crate::finding::{Stop, Verdict};
use crate::lab::Lab;
use crate::rig::{BodyBench, dot};
use terraglue_subsystem::{Capabilities, Kind};

const fn test(name: &'static str, promise: &'static str, run: fn(&Lab) -> Verdict) -> Test {
    let (area, level, after) = (Area::Physics, Level::Quick, &["steps"]);
    Test { name, area, level, kinds: &[Kind::Robot], after, promise, run }
}

/// The tests of this area.
pub fn tests() -> Vec<Test> {
    vec![
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
}

const G: [f64; 3] = [0.0, 0.0, -9.81];
const H: f64 = 1e-3;

fn mass(bench: &BodyBench) -> f64 {
    bench.robot.scene().bodies.iter().map(|b| b.mass).sum()
}

/// Several bodies carry momentum of their frames' origins only: those tests are for a single body.
fn single(bench: &BodyBench) -> Verdict {
    match bench.robot.scene().bodies.len() {
        1 if mass(bench) > 0.0 => Ok(()),
        1 => Err(Stop::Skip("its body has no mass in the scene: momentum cannot be told".into())),
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

fn after(bench: &mut BodyBench, steps: usize) -> Verdict<[f64; 3]> {
    let before = bench.momentum()?;
    for _ in 0..steps {
        bench.fall(H)?;
    }
    let now = bench.momentum()?;
    Ok(std::array::from_fn(|k| now[k] - before[k]))
}

fn falls(lab: &Lab) -> Verdict {
    let mut bench = BodyBench::new(lab.instance()?);
    single(&bench)?;
    let m = mass(&bench);
    let got = after(&mut bench, 50)?;
    grew("advance", "50 free steps of 1 ms", got, G.map(|g| m * g * 50.0 * H), m * 9.81 * 50.0 * H)
}

fn no_gravity(lab: &Lab) -> Verdict {
    let module = lab.module()?;
    let mut services = lab.services();
    services.gravity = [0.0; 3];
    let made = module.instantiate("checked", lab.config(module.schema()), &services);
    let made = made.map_err(|e| Stop::fail("instantiate", "no gravity", e.to_string(), "an instance"))?;
    let mut bench = BodyBench::new(made);
    single(&bench)?;
    let scale = mass(&bench) * 9.81 * 50.0 * H;
    let got = after(&mut bench, 50)?;
    grew("advance", "50 free steps of 1 ms without gravity", got, [0.0; 3], scale)
}

fn force_moves(lab: &Lab) -> Verdict {
    let mut bench = BodyBench::new(lab.instance()?);
    single(&bench)?;
    let m = mass(&bench);
    let before = bench.momentum()?;
    bench.place_port()?;
    let t = [3.0 * m, 2.0 * m, -m];
    bench.try_force(&t, H)?;
    bench.commit(&t, H)?;
    let now = bench.momentum()?;
    let port = &bench.ports_before[0];
    let (force, _) = port.wrench_in_world(&t);
    let expected = std::array::from_fn(|k| (force[k] + m * G[k]) * H);
    // A body that turns under the force moves its frame's origin too, where that is not its centre of mass.
    let states = bench.states()?;
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

fn velocity(lab: &Lab) -> Verdict {
    let mut bench = BodyBench::new(lab.instance()?);
    for _ in 0..20 {
        bench.fall(H)?;
    }
    let before = bench.states()?;
    bench.fall(H)?;
    let now = bench.states()?;
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

fn fall_energy(lab: &Lab) -> Verdict {
    let mut bench = BodyBench::new(lab.instance()?);
    bench.fall(H)?;
    let start = bench.robot.energy()?;
    if (start.mechanical() + start.actuator_work).is_nan() {
        return Err(Stop::Skip("it keeps no book: reports show its energy as unknown".into()));
    }
    for _ in 0..100 {
        bench.fall(H)?;
    }
    let end = bench.robot.energy()?;
    let gained = end.mechanical() - start.mechanical() - (end.actuator_work - start.actuator_work);
    if gained > 0.02 * (end.kinetic - start.kinetic).abs() + 1e-9 {
        let got = format!("{gained:.5} J more than its motors put in");
        return Err(Stop::fail("energy", "100 free steps of 1 ms", got, "no gain"));
    }
    Ok(())
}

fn passive_jacobian(lab: &Lab) -> Verdict {
    let mut bench = BodyBench::new(lab.instance()?);
    if !bench.robot.capabilities().has(Capabilities::DERIVATIVES) {
        return Err(Stop::Skip(
            "no interface_jacobian: the coordinator takes finite differences, at more trials".into(),
        ));
    }
    bench.place_port()?;
    bench.try_force(&[20.0, 1.0, 2.0], H)?;
    let g = bench.jacobian(H)?;
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
fn estimate_holds(lab: &Lab) -> Verdict {
    let mut bench = BodyBench::new(lab.instance()?);
    needs_estimate(&bench)?;
    bench.place_port()?;
    let estimate = bench.estimate(&[0.0; 3], H)?;
    let t_n = estimate.t_star[0];
    if t_n < -1e-9 {
        return Err(Stop::fail(
            "estimate_forces",
            "ground at its lowest point",
            format!("T*_n = {t_n} N"),
            ">= 0",
        ));
    }
    bench.try_force(&estimate.t_star, H)?;
    let gap = bench.out.x[0];
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

fn estimate_apart(lab: &Lab) -> Verdict {
    let mut bench = BodyBench::new(lab.instance()?);
    needs_estimate(&bench)?;
    bench.place_port()?;
    let estimate = bench.estimate(&[-0.1, 0.0, 0.0], H)?;
    if estimate.t_star.iter().any(|t| t.abs() > 1e-9) || estimate.active[0] != 0 {
        let got = format!("T* = {:?} N, active {}", estimate.t_star, estimate.active[0]);
        return Err(Stop::fail("estimate_forces", "ground 10 cm below it", got, "zero"));
    }
    Ok(())
}

fn needs_estimate(bench: &BodyBench) -> Verdict {
    if bench.robot.capabilities().has(Capabilities::ESTIMATE) {
        return Ok(());
    }
    Err(Stop::Skip("no estimate_forces: the coordinator solves for T* by itself".into()))
}

fn quaternions(lab: &Lab) -> Verdict {
    let mut bench = BodyBench::new(lab.instance()?);
    for step in 0..200 {
        if step % 3 == 0 && bench.robot.scene().shapes.iter().any(|s| s.collides) {
            bench.place_port()?;
            let t = [5.0, 20.0, -20.0];
            bench.try_force(&t, H)?;
            bench.commit(&t, H)?;
        } else {
            bench.fall(H)?;
        }
        for (k, state) in bench.states()?.iter().enumerate() {
            let length = state.world_from_body.orientation.iter().map(|q| q * q).sum::<f64>().sqrt();
            if (length - 1.0).abs() > 1e-6 {
                let got = format!("the quaternion of body {k} has the length {length}");
                return Err(Stop::fail("body_states", format!("step {step}"), got, "1"));
            }
        }
    }
    Ok(())
}
