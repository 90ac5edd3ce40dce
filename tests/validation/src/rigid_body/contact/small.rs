//! Boxes on an incline, a stack, a tonne on a kilogram.

use super::scenes::{alone, cuboid, several};
use crate::process::Outcome;
use crate::rigid_body::fixture::{Fixture, G, pose};
use crate::{Context, Figure, Limit};
use nalgebra::Vector3;

const H: f64 = 1e-3;
/// g(sin 35° − 0.5 cos 35°), m/s².
const SLIDES: f64 = 1.608_844_063_366_257;

/// All of them.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    let mut all = sticks(context)?;
    all.extend(slides(context)?);
    all.extend(stack(context)?);
    all.push(heavy(context)?);
    Ok(all)
}

fn on_incline(context: &Context, degrees: f64) -> Outcome<Fixture> {
    let angle = degrees.to_radians();
    let gravity = [G * libm::sin(angle), 0.0, -G * libm::cos(angle)];
    let body = cuboid("b", 1.0, [0.2, 0.2, 0.1]);
    alone(
        context,
        &format!("incline{degrees}"),
        &body,
        [0.0, 0.0, 0.05],
        r#", "friction": 0.5"#,
        (gravity, H),
    )
}

fn place(fixture: &Fixture, body: usize) -> Outcome<Vector3<f64>> {
    Ok(pose(&fixture.states()?[body]).0)
}

fn go(fixture: &mut Fixture, until: f64) -> Outcome {
    fixture.run(until, |_| Ok(()))
}

fn sticks(context: &Context) -> Outcome<Vec<Figure>> {
    let mut fixture = on_incline(context, 20.0)?;
    go(&mut fixture, 5.0)?;
    let before = place(&fixture, 0)?.x;
    go(&mut fixture, 10.0)?;
    let creep = (place(&fixture, 0)?.x - before).abs() / 5.0;
    let what = "box on 20° with μ = 0.5, 5 s to 10 s: creep, mm/s";
    Ok(vec![Figure::new("rigid-body.incline.creep", 1e3 * creep, Limit::AtMost(1e-9), what)])
}

/// Positions of the scheme are half a step ahead of its rates: both are given.
fn slides(context: &Context) -> Outcome<Vec<Figure>> {
    let mut fixture = on_incline(context, 35.0)?;
    go(&mut fixture, 2.0)?;
    let x = place(&fixture, 0)?.x;
    let v = fixture.states()?[0].linear_velocity[0];
    let error = |x: f64| (x / 2.0 / SLIDES - 1.0).abs();
    let id = "rigid-body.incline.acceleration";
    Ok(vec![
        Figure::new(
            id,
            error(x - 0.5 * H * v),
            Limit::AtMost(1e-4),
            "box on 35° with μ = 0.5, 2 s: error of 2x/t², x at the time of the rates",
        ),
        Figure::new(
            format!("{id}_at_end"),
            error(x),
            Limit::AtMost(1e-4),
            "the same with x at the end of the step, half a step ahead (h/t = 5e-4)",
        ),
    ])
}

fn stack(context: &Context) -> Outcome<Vec<Figure>> {
    let bodies: Vec<_> = (0..10)
        .map(|k| (cuboid(&format!("b{k}"), 1.0, [0.2; 3]), [0.0, 0.0, 0.1 + 0.2 * f64::from(k)]))
        .collect();
    let mut fixture = several(context, "stack", &bodies, r#", "friction": 0.6"#, ([0.0, 0.0, -G], H))?;
    let start = place(&fixture, 10)?;
    go(&mut fixture, 2.5)?;
    let middle = place(&fixture, 10)?;
    go(&mut fixture, 5.0)?;
    let end = place(&fixture, 10)?;
    let id = "rigid-body.stack";
    Ok(vec![
        Figure::new(
            format!("{id}.sink"),
            1e3 * (start.z - end.z).abs(),
            Limit::AtMost(0.1),
            "ten boxes of 1 kg, 5 s: sink of the top, mm",
        ),
        Figure::new(
            format!("{id}.drift"),
            1e3 * (end - start).xy().norm(),
            Limit::AtMost(1e-3),
            "the same: sideways, mm",
        ),
        Figure::new(
            format!("{id}.creep"),
            1e3 * (end - middle).norm() / 2.5,
            Limit::AtMost(1e-6),
            "the same: motion of the top from 2.5 s to 5 s, mm/s",
        ),
    ])
}

fn heavy(context: &Context) -> Outcome<Figure> {
    let bodies =
        [(cuboid("b0", 1.0, [0.2; 3]), [0.0, 0.0, 0.1]), (cuboid("b1", 1000.0, [0.2; 3]), [0.0, 0.0, 0.3])];
    let mut fixture = several(context, "heavy", &bodies, r#", "friction": 0.6"#, ([0.0, 0.0, -G], H))?;
    go(&mut fixture, 5.0)?;
    let sink = (place(&fixture, 2)?.z - 0.3).abs();
    let what = "1000 kg on 1 kg, 5 s: sink, mm";
    Ok(Figure::new("rigid-body.heavy.sink", 1e3 * sink, Limit::AtMost(0.01), what))
}
