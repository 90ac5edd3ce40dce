//! Cases with closed solutions: sliding that becomes rolling, rebound, balls in a row, Painlevé's rod.
//!
//! The solutions are in `analytic.json` of the reference cases. Orders are those between three steps.

use super::scenes::{alone, several, sphere, throw};
use crate::process::Outcome;
use crate::rigid_body::fixture::{Fixture, G, pose};
use crate::{Context, Figure, Limit};
use terraglue_numerics::extremes::larger;

const DOWN: [f64; 3] = [0.0, 0.0, -G];
/// Steps, s; each half of the one before.
const STEPS: [f64; 3] = [2e-3, 1e-3, 5e-4];

/// Until then nothing but jamming can make an impulse, s.
const EARLY: f64 = 5e-3;

/// All of them.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    let mut all = slide_to_roll(context)?;
    all.push(roll(context)?);
    all.extend(bounce(context)?);
    all.extend(cradle(context)?);
    all.extend(rod(context)?);
    Ok(all)
}

/// Order between the first and the last of three errors, and the errors in words.
fn order(errors: [f64; 3]) -> (f64, String) {
    let order = 0.5 * libm::log2(errors[0] / errors[2]);
    (order, format!("errors {:.2e} {:.2e} {:.2e} at 2, 1, ½ ms", errors[0], errors[1], errors[2]))
}

fn slide_to_roll(context: &Context) -> Outcome<Vec<Figure>> {
    let (v0, mu, t) = (2.0, 0.3, 0.6);
    let rolls = 2.0 * v0 / (7.0 * mu * G);
    let exact = 12.0 * v0 * v0 / (49.0 * mu * G) + 5.0 / 7.0 * v0 * (t - rolls);
    let run = |h: f64| -> Outcome<[f64; 2]> {
        let body = sphere("s", 1.0, 0.1);
        let mut fixture = alone(context, "slide", &body, [0.0, 0.0, 0.1], r#", "friction": 0.3"#, (DOWN, h))?;
        throw(&mut fixture, "s", [v0, 0.0, 0.0], h)?;
        fixture.run(t, |_| Ok(()))?;
        let state = fixture.states()?[0];
        Ok([state.world_from_body.position[0] - exact, state.linear_velocity[0] - 5.0 / 7.0 * v0])
    };
    let [a, b, c] = STEPS.map(run);
    let (a, b, c) = (a?, b?, c?);
    let (order, errors) = order([a[0].abs(), b[0].abs(), c[0].abs()]);
    let id = "rigid-body.slide_to_roll";
    let what = format!("sphere thrown at 2 m/s, μ = 0.3: order of the place at 0.6 s; {errors} (m)");
    let rate = "the same: rate of rolling at 1 ms − 5/7·v0, m/s";
    Ok(vec![
        Figure::new(format!("{id}.order"), order, Limit::AtLeast(0.9), what),
        Figure::new(format!("{id}.place"), b[0].abs(), Limit::AtMost(1e-3), "the same: error at 1 ms, m"),
        Figure::new(format!("{id}.rate"), b[1].abs(), Limit::AtMost(1e-10), rate),
    ])
}

fn roll(context: &Context) -> Outcome<Figure> {
    let angle = 20.0_f64.to_radians();
    let gravity = [G * libm::sin(angle), 0.0, -G * libm::cos(angle)];
    let body = sphere("s", 1.0, 0.1);
    let mut fixture =
        alone(context, "roll", &body, [0.0, 0.0, 0.1], r#", "friction": 0.5"#, (gravity, 1e-3))?;
    fixture.run(2.0, |_| Ok(()))?;
    let a = fixture.states()?[0].linear_velocity[0] / 2.0;
    let error = (a / (5.0 / 7.0 * G * libm::sin(angle)) - 1.0).abs();
    let what = "sphere rolling down 20°, 2 s: relative error of the acceleration";
    Ok(Figure::new("rigid-body.roll", error, Limit::AtMost(1e-9), what))
}

/// Heights of the first four apexes of a ball dropped from 1 m.
fn apexes(context: &Context, h: f64) -> Outcome<Vec<f64>> {
    let body = sphere("s", 1.0, 0.1);
    let mut fixture = alone(context, "bounce", &body, [0.0, 0.0, 1.1], r#", "restitution": 0.8"#, (DOWN, h))?;
    // The highest place between two impacts.
    let (mut tops, mut top, mut before) = (Vec::new(), 0.0_f64, 0.0);
    fixture.run(3.5, |fixture| {
        let state = fixture.states()?[0];
        let v = state.linear_velocity[2];
        if v > 0.0 && before < 0.0 {
            tops.push(top - 0.1);
            top = 0.0;
        }
        (top, before) = (larger(top, state.world_from_body.position[2]), v);
        Ok(())
    })?;
    Ok(tops.into_iter().skip(1).collect())
}

fn bounce(context: &Context) -> Outcome<Vec<Figure>> {
    let error = |h: f64| -> Outcome<f64> {
        let tops = apexes(context, h)?;
        let errors = (0..4)
            .map(|k| (tops.get(k).copied().unwrap_or(f64::NAN) - libm::pow(0.64, k as f64 + 1.0)).abs());
        Ok(errors.fold(0.0, larger))
    };
    let [a, b, c] = STEPS.map(error);
    let errors = [a?, b?, c?];
    let (order, words) = order(errors);
    let what = format!("ball dropped from 1 m, e = 0.8: order of the first four heights; {words} (m)");
    let size = "the same: largest error of the heights at 1 ms, m";
    Ok(vec![
        Figure::new("rigid-body.bounce.order", order, Limit::AtLeast(0.7), what),
        Figure::new("rigid-body.bounce.height", errors[1], Limit::AtMost(0.01), size),
    ])
}

/// Five equal balls in a row, the first with 1 m/s.
fn cradle(context: &Context) -> Outcome<Vec<Figure>> {
    let h = 1e-3;
    let bodies: Vec<_> = (0..5)
        .map(|k| {
            (
                sphere(&format!("b{k}"), 1.0, 0.1),
                [0.2 * f64::from(k) - 0.05 * f64::from(u8::from(k == 0)), 0.0, 1.0],
            )
        })
        .collect();
    let more = r#", "friction": 0.0, "restitution": 1.0"#;
    let mut fixture = several(context, "cradle", &bodies, more, ([0.0; 3], h))?;
    throw(&mut fixture, "b0", [1.0, 0.0, 0.0], h)?;
    fixture.run(0.1, |_| Ok(()))?;
    let v: Vec<f64> = fixture.states()?[1..].iter().map(|s| s.linear_velocity[0]).collect();
    let momentum = (v.iter().sum::<f64>() - 1.0).abs();
    let energy = v.iter().map(|v| v * v).sum::<f64>();
    let shown = v.iter().map(|v| format!("{v:.4}")).collect::<Vec<_>>().join(", ");
    let what = format!(
        "four touching balls are hit by a fifth at 1 m/s, e = 1, Newton's law for all at once: {shown} m/s; error of the momentum, N s"
    );
    let id = "rigid-body.cradle";
    Ok(vec![
        Figure::new(format!("{id}.momentum"), momentum, Limit::AtMost(1e-10), what),
        Figure::new(
            format!("{id}.energy"),
            energy,
            Limit::AtMost(1.0 + 1e-10),
            "the same: kinetic energy / that before",
        ),
    ])
}

/// A slender rod of 2 m and 1 kg whose lower end slides at 1 m/s against its lean.
fn rod_rig(context: &Context, degrees: f64, mu: f64, v: f64) -> Outcome<Fixture> {
    let (l, r) = (1.0, 1e-6);
    let (c, s) = (libm::cos(degrees.to_radians()), libm::sin(degrees.to_radians()));
    let i = l * l / 3.0;
    let ends = [1.0, -1.0].map(|e| {
        format!(
            r#"<collision><origin xyz="{} 0 {}"/><geometry><sphere radius="{r}"/></geometry></collision>"#,
            e * l * c,
            e * l * s
        )
    });
    // I·(1 − d·dᵀ), and a little about the rod itself.
    let (xx, yy, zz, xz) = (i * s * s + 1e-6, i, i * c * c + 1e-6, -i * s * c);
    let body = format!(
        r#"<link name="rod"><inertial><mass value="1"/><inertia ixx="{xx}" iyy="{yy}" izz="{zz}" ixy="0" ixz="{xz}"
        iyz="0"/></inertial>{}{}</link>"#,
        ends[0], ends[1]
    );
    let more = format!(r#", "friction": {mu}, "velocity_m_s": [{v}, 0, 0]"#);
    alone(context, "rod", &body, [0.0, 0.0, l * s + r], &more, (DOWN, 1e-3))
}

fn rod(context: &Context) -> Outcome<Vec<Figure>> {
    let (mut largest, mut gained, mut residual, mut jams) = (0.0_f64, 0.0_f64, 0.0_f64, 0.0);
    for (mu, degrees) in [(1.2, 60.0), (1.5, 60.0), (2.0, 40.0), (2.0, 60.0), (2.0, 78.0)] {
        for v in [-1.0, 1.0] {
            let mut fixture = rod_rig(context, degrees, mu, v)?;
            let [normal, told] = [fixture.id("rod.contact_normal")?, fixture.id("contact.residual")?];
            let mut before = fixture.energy().mechanical();
            let (mut impulse, mut early) = (0.0_f64, 0.0_f64);
            fixture.run(1.0, |fixture| {
                let now = fixture.energy().mechanical();
                gained = larger(gained, now - before);
                before = now;
                impulse = larger(impulse, 1e-3 * fixture.get(normal)?);
                if fixture.t() < EARLY {
                    early = larger(early, 1e-3 * fixture.get(normal)?);
                }
                residual = larger(residual, fixture.get(told)?);
                let (place, q) = pose(&fixture.states()?[0]);
                let finite = place.iter().chain(q.coords.iter()).all(|x| x.is_finite());
                if finite { Ok(()) } else { Err("Painlevé's rod: not a number".into()) }
            })?;
            largest = larger(largest, impulse);
            jams += f64::from(early > 0.1);
        }
    }
    let id = "rigid-body.painleve";
    let what = "rods of 1 kg sliding at 1 m/s where no finite force exists (μ 1.2 … 2): largest impulse in a step, N s";
    Ok(vec![
        Figure::new(format!("{id}.impulse"), largest, Limit::AtMost(10.0), what),
        Figure::new(
            format!("{id}.energy"),
            gained,
            Limit::AtMost(1e-4),
            "the same: largest gain of energy in a step, J",
        ),
        Figure::new(format!("{id}.residual"), residual, Limit::AtMost(1e-6), "the same: largest residual"),
        Figure::new(
            format!("{id}.jams"),
            jams,
            Limit::AtLeast(1.0),
            "the same: runs of ten that jam, > 0.1 N s within 5 ms (the weight gives 0.01 N s a step)",
        ),
    ])
}
