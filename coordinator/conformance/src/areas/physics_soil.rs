//! Physics of every ground, whatever its law: energy is not made, it pushes and never pulls, friction opposes.

use crate::definition::Test;
use crate::finding::{Stop, Verdict};
use crate::fixture::{Flat, Foot, Moved, SoilFixture, dot};
use crate::scope::{Area, Level};
use crate::test_context::TestContext;
use terraglue_subsystem::Kind;

const fn test(
    name: &'static str,
    level: Level,
    promise: &'static str,
    run: fn(&TestContext) -> Verdict,
) -> Test {
    Test { name, area: Area::Physics, level, kinds: &[Kind::Soil], after: &["steps"], promise, run }
}

/// The tests of this area.
pub const TESTS: &[Test] = {
    use Level::{Quick, Standard};
    &[
        test("pushes-back", Quick, "a foot that sinks is pushed up, not less when deeper", pushes_back),
        test("no-force-apart", Quick, "a foot above the ground feels nothing", no_force_apart),
        test("no-tension", Quick, "the ground never pulls a foot down", no_tension),
        test("passive", Standard, "from untouched ground, no path of a foot gains energy", passive),
        test(
            "cycles-dissipate",
            Quick,
            "pressing and lifting, again and again, gains no energy",
            vertical_cycles,
        ),
        test("shear-dissipates", Quick, "dragging to and fro gains no energy", shear_cycles),
        test("opposes-sliding", Quick, "the force along the ground opposes the sliding", opposes),
        test(
            "friction-bound",
            Quick,
            "without cohesion, the force along the ground stays below mu N",
            friction_bound,
        ),
        test(
            "friction-reached",
            Quick,
            "a long drag reaches the friction that is declared",
            friction_reached,
        ),
        test(
            "shear-forgotten",
            Quick,
            "after lift-off, a foot comes down without the shear of before",
            shear_forgotten,
        ),
        test("moment-arm", Quick, "the pressure below a plate acts inside the plate", moment_arm),
        test("step-size", Standard, "half the step gives nearly the same forces", step_size),
    ]
};

/// Work that feet did on the soil, J: trapezoids over the forces at the ends of the steps.
struct Work {
    before: Vec<Moved>,
    sum: f64,
    turned: f64,
}

impl Work {
    fn new(feet: usize) -> Self {
        Self { before: vec![Moved::default(); feet], sum: 0.0, turned: 0.0 }
    }

    fn step(&mut self, fixture: &mut SoilFixture, velocities: &[[f64; 3]], h: f64) -> Verdict {
        fixture.go(velocities, h)?;
        for ((before, after), v) in self.before.iter().zip(&fixture.moved).zip(velocities) {
            let work = -0.5 * h * (dot(before.force, *v) + dot(after.force, *v));
            // Where a foot lifts off within the step, it gives out between nothing and this much: a straight line through
            // the corner overestimates it, for a spring by up to an eighth of its stiffness times the step squared.
            let lifts = before.normal > 0.0 && after.normal <= 0.0 && work < 0.0;
            self.sum += if lifts { 0.0 } else { work };
            self.turned += work.abs();
        }
        self.before.clone_from(&fixture.moved);
        Ok(())
    }
}

fn gained(given: String, work: f64, turned: f64) -> Verdict {
    if work >= -2e-3 * turned - 1e-9 {
        return Ok(());
    }
    let got =
        format!("the soil gave out {:.4e} J more than it took in, of {turned:.4e} J turned over", -work);
    Err(Stop::fail("advance", given, got, "work on the soil >= 0"))
}

fn pushes_back(context: &TestContext) -> Verdict {
    let mut fixture = SoilFixture::new(context, &[Foot::sphere(0.0, 0.0)])?;
    let mut before = 0.0;
    for step in 1..=40 {
        fixture.go(&[[0.0, 0.0, -0.5]], 1e-3)?;
        let now = fixture.moved[0];
        if step >= 10 && !(now.force[2] > 0.0 && now.normal > 0.0) {
            let (given, got) = (depth(step, 0.5), format!("a force of {:.3e} N upwards", now.force[2]));
            return Err(Stop::fail("advance", given, got, "a force upwards"));
        }
        if now.normal < 0.7 * before {
            let got = format!("{:.3e} N after {before:.3e} N one step before", now.normal);
            return Err(Stop::fail("advance", depth(step, 0.5), got, "no sudden loss when pressed further"));
        }
        before = now.normal;
    }
    Ok(())
}

fn depth(step: usize, speed: f64) -> String {
    format!("a sphere of 4 cm radius, {:.1} mm below the ground", speed * step as f64)
}

fn no_force_apart(context: &TestContext) -> Verdict {
    let mut fixture = SoilFixture::new(context, &[Foot::sphere(0.0, 0.0).lifted(8e-4)])?;
    slide_above(&mut fixture, "a foot 0.7 mm above untouched ground")?;
    fixture.drag([0.0, 0.0, -0.01], 20)?;
    fixture.drag([0.0, 0.0, 0.03], 30)?;
    slide_above(&mut fixture, "a foot lifted 2 cm above the ground it had pressed 1 cm deep")
}

fn slide_above(fixture: &mut SoilFixture, given: &str) -> Verdict {
    for _ in 0..10 {
        fixture.go(&[[0.05, 0.02, -0.01]], 1e-3)?;
        let force = fixture.moved[0].force;
        if dot(force, force).sqrt() > 1e-9 {
            return Err(Stop::fail("advance", given, format!("a force of {force:?} N"), "none"));
        }
    }
    Ok(())
}

fn no_tension(context: &TestContext) -> Verdict {
    let mut fixture = SoilFixture::new(context, &[Foot::sphere(-0.1, 0.0), Foot::plate(0.1, 0.0)])?;
    for step in 0..160 {
        let vz = if (step / 40) % 2 == 0 { -0.2 } else { 0.22 };
        fixture.go(&[[0.02, 0.0, vz], [0.0, 0.02, vz]], 1e-3)?;
        if let Some(foot) = fixture.moved.iter().find(|m| m.normal < -1e-9) {
            let given = format!("a foot that moves with {vz} m/s at t = {:.3} s", fixture.t);
            let got = format!("a normal force of {:.3e} N", foot.normal);
            return Err(Stop::fail("advance", given, got, ">= 0: no adhesion is declared (t_min = 0)"));
        }
    }
    Ok(())
}

/// Random ways of a foot that stays near the surface.
fn passive(context: &TestContext) -> Verdict {
    let mut random = context.random("passive");
    for walk in 0..context.count(4) {
        let mut fixture = SoilFixture::new(context, &[Foot::sphere(0.0, 0.0)])?;
        let mut work = Work::new(1);
        let mut signed = || 2.0 * random.unit() - 1.0;
        for _ in 0..25 {
            let z = fixture.states[0].world_from_body.position[2] - 0.04;
            // Back to a depth between 1 and 8 mm now and then, so that it does not drift away.
            let vz = if z > 0.003 {
                -0.3
            } else if z < -0.012 {
                0.3
            } else {
                0.3 * signed()
            };
            let v = [0.1 * signed(), 0.1 * signed(), vz];
            for _ in 0..10 {
                work.step(&mut fixture, &[v], 1e-3)?;
                gained(
                    format!("random walk {walk} of a sphere, at t = {:.3} s", fixture.t),
                    work.sum,
                    work.turned,
                )?;
            }
        }
    }
    Ok(())
}

fn vertical_cycles(context: &TestContext) -> Verdict {
    let mut fixture = SoilFixture::new(context, &[Foot::plate(0.0, 0.0)])?;
    let mut before = 0.0;
    let mut work = Work::new(1);
    for cycle in 0..5 {
        for (steps, v) in [(25, -0.2), (25, 0.2)] {
            for _ in 0..steps {
                work.step(&mut fixture, &[[0.0, 0.0, v]], 1e-3)?;
            }
        }
        let given = format!("cycle {} of a plate, 5 mm down and up", cycle + 1);
        gained(given, work.sum - before, work.turned)?;
        before = work.sum;
    }
    Ok(())
}

fn shear_cycles(context: &TestContext) -> Verdict {
    let mut fixture = SoilFixture::new(context, &[Foot::plate(0.0, 0.0)])?;
    fixture.drag([0.0, 0.0, -0.005], 25)?;
    let mut work = Work::new(1);
    let mut before = 0.0;
    for cycle in 0..context.count(5).clamp(2, 5) {
        for direction in [1.0, -1.0] {
            for _ in 0..75 {
                work.step(&mut fixture, &[[0.4 * direction, 0.0, 0.0]], 1e-3)?;
            }
        }
        let given = format!("cycle {} of a plate, 3 cm to and fro at constant depth", cycle + 1);
        gained(given, work.sum - before, work.turned)?;
        before = work.sum;
    }
    Ok(())
}

/// Mean forces on a foot that is pressed 8 mm deep and dragged by 6 cm along the unit vector `d`, the ground without
/// cohesion.
pub fn dragged(context: &TestContext, foot: Foot, ground: Flat, d: [f64; 2]) -> Verdict<Moved> {
    let module = context.module()?;
    let soil = context.instance_with(&module, ground, &[("c_pa", 0.0), ("cohesion_pa", 0.0)])?;
    let mut fixture = SoilFixture::around(soil, &ground, &[foot])?;
    fixture.drag([0.0, 0.0, -0.008], 40)?;
    let mut sum = Moved::default();
    for step in 0..60 {
        let now = fixture.drag([1e-3 * d[0], 1e-3 * d[1], 0.0], 1)?;
        // The mean over 3 cm: the lattice passes below the foot node by node.
        if step >= 30 {
            (0..3).for_each(|k| sum.force[k] += now.force[k] / 30.0);
            (sum.normal, sum.tangential) =
                (sum.normal + now.normal / 30.0, sum.tangential + now.tangential / 30.0);
        }
        sum.mu = now.mu;
    }
    Ok(sum)
}

fn opposes(context: &TestContext) -> Verdict {
    for d in [[1.0, 0.0], [-0.6, 0.8]] {
        let m = dragged(context, Foot::sphere(0.0, 0.0), Flat::LEVEL, d)?;
        let power = m.force[0] * d[0] + m.force[1] * d[1];
        if power > 1e-6 * m.normal.max(1.0) {
            let got = format!("a force of {power:.3e} N along the motion");
            return Err(Stop::fail(
                "advance",
                format!("a sphere dragged along {d:?}"),
                got,
                "against the motion",
            ));
        }
    }
    Ok(())
}

fn friction_bound(context: &TestContext) -> Verdict {
    // A plate: a round foot pushes soil in its way aside, and that is no friction.
    for d in [[1.0, 0.0], [0.0, -1.0]] {
        let m = dragged(context, Foot::plate(0.0, 0.0), Flat::LEVEL, d)?;
        if m.mu.is_finite() && m.tangential > 1.01 * m.mu * m.normal + 1e-9 {
            let got =
                format!("{:.4} N along the ground, {:.4} N on it, mu = {:.4}", m.tangential, m.normal, m.mu);
            return Err(Stop::fail("advance", "a plate dragged by 6 cm", got, "|T_t| <= mu T_n"));
        }
    }
    Ok(())
}

fn friction_reached(context: &TestContext) -> Verdict {
    let m = dragged(context, Foot::plate(0.0, 0.0), Flat::LEVEL, [1.0, 0.0])?;
    if !m.mu.is_finite() {
        return Err(Stop::Warning(
            "it declares no friction (laws[p].mu): strategies bound sticking by nothing".into(),
        ));
    }
    if m.tangential < 0.6 * m.mu * m.normal {
        let share = m.tangential / (m.mu * m.normal).max(f64::MIN_POSITIVE);
        let got = format!("{:.0} % of mu N after 6 cm, mu = {:.4}", 100.0 * share, m.mu);
        return Err(Stop::fail(
            "advance",
            "a plate dragged by 6 cm",
            got,
            "the friction of laws[p].mu, by 60 % at least",
        ));
    }
    Ok(())
}

fn shear_forgotten(context: &TestContext) -> Verdict {
    let mut fixture = SoilFixture::new(context, &[Foot::sphere(0.0, 0.0)])?;
    fixture.drag([0.0, 0.0, -0.006], 30)?;
    let dragged = fixture.drag([0.02, 0.0, 0.0], 40)?;
    fixture.drag([0.0, 0.0, 0.05], 50)?;
    fixture.drag([0.1, 0.0, 0.0], 20)?;
    let fresh = fixture.drag([0.0, 0.0, -0.056], 60)?;
    if fresh.tangential > 0.02 * fresh.normal + 1e-9 {
        let got = format!("{:.3e} N along the ground with {:.3e} N on it", fresh.tangential, fresh.normal);
        let given = format!("straight down, 10 cm away, after a drag with {:.3e} N", dragged.tangential);
        return Err(Stop::fail("advance", given, got, "no force along the ground"));
    }
    Ok(())
}

/// The centre of pressure follows from the moments about the centre of the plate.
fn moment_arm(context: &TestContext) -> Verdict {
    let mut fixture = SoilFixture::new(context, &[Foot::plate(0.0, 0.0)])?;
    let m = fixture.drag([0.0, 0.0, -0.008], 40)?;
    let arm = [-m.moment[1] / m.force[2], m.moment[0] / m.force[2]];
    // Level ground, level plate: below its centre, up to the lattice below its edges.
    if !(arm[0].abs() <= 0.1 * 0.05 && arm[1].abs() <= 0.1 * 0.03) {
        let got = format!("the pressure acts {:.2} mm, {:.2} mm from the centre", 1e3 * arm[0], 1e3 * arm[1]);
        let given = "a plate of 10 cm by 6 cm pressed straight into level ground";
        return Err(Stop::fail("advance", given, got, "below the centre, by a tenth of the half lengths"));
    }
    Ok(())
}

/// Loading, dragging and unloading with steps of 1 and of 0.5 ms.
fn step_size(context: &TestContext) -> Verdict {
    let run = |h: f64| {
        let mut fixture = SoilFixture::new(context, &[Foot::sphere(0.0, 0.0)])?;
        let mut ends = Vec::new();
        for (v, time) in [([0.0, 0.0, -0.2], 0.04), ([0.1, 0.0, -0.02], 0.04), ([0.0, 0.0, -0.1], 0.02)] {
            for _ in 0..(time / h).round() as usize {
                fixture.go(&[v], h)?;
            }
            ends.push(fixture.moved[0]);
        }
        Ok::<_, Stop>(ends)
    };
    let (coarse, fine) = (run(1e-3)?, run(0.5e-3)?);
    for (phase, (a, b)) in coarse.iter().zip(&fine).enumerate() {
        let difference: [f64; 3] = std::array::from_fn(|k| a.force[k] - b.force[k]);
        let (gap, size) = (dot(difference, difference).sqrt(), dot(b.force, b.force).sqrt());
        if gap > 0.15 * size + 1e-6 {
            let got = format!("{:?} N instead of {:?} N", a.force, b.force);
            let given = format!("end of phase {} with h = 1 ms instead of 0.5 ms", phase + 1);
            return Err(Stop::fail("advance", given, got, "a difference below 15 %"));
        }
    }
    Ok(())
}
