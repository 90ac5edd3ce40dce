//! Where a body of an FMU is and how it moves, and what that is at a port.

use super::Fail;
use super::names::{Axes, Body, Point};
use terraglue_fmi::FmuInstance;
use terraglue_numerics::rotation::{
    IDENTITY, Quaternion, Vector, conjugate, cross, minus, plus, product, rotation_vector, swing, turned,
};
use terraglue_subsystem::{Error, Port, Result};

/// By how much the length of a quaternion may differ from 1.
const UNIT: f64 = 1e-6;

/// Motion of a body at one time, as the FMU reports it.
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    /// Place, m.
    pub position: Vector,
    /// World from body; of a body that only translates no rotation.
    pub orientation: Quaternion,
    /// m/s; 0 where it is not given.
    pub velocity: Vector,
    /// rad/s; 0 where it is not given.
    pub angular_velocity: Vector,
    /// Where force and moment act, world, m.
    pub loaded: Vector,
}

impl Motion {
    /// As the FMU reports it now.
    ///
    /// # Errors
    /// A number that is not finite, or a quaternion that is not of unit length.
    pub fn read(instance: &FmuInstance, body: &Body, fail: Fail) -> Result<Self> {
        let position = vector(instance, body, "position", &body.position, fail)?;
        let orientation = orientation(instance, body, fail)?;
        let point = match &body.force_at {
            Point::Given(point) => *point,
            Point::Told(axes) => vector(instance, body, "force_at", axes, fail)?,
        };
        Ok(Self {
            position,
            orientation,
            velocity: vector(instance, body, "velocity", &body.velocity, fail)?,
            angular_velocity: vector(instance, body, "angular_velocity", &body.angular_velocity, fail)?,
            loaded: plus(position, turned(orientation, point)),
        })
    }

    /// Velocity of a point at `arm` from the position, m/s.
    fn velocity_at(&self, arm: Vector) -> Vector {
        plus(self.velocity, cross(self.angular_velocity, arm))
    }
}

/// Three numbers of a body, 0 where there is no name.
pub fn vector(instance: &FmuInstance, body: &Body, key: &str, axes: &Axes, fail: Fail) -> Result<Vector> {
    let mut out = [0.0; 3];
    for (out, axis) in out.iter_mut().zip(axes) {
        if let Some(axis) = axis {
            *out = finite(body, key, axis.get(instance, fail)?)?;
        }
    }
    Ok(out)
}

fn finite(body: &Body, key: &str, value: f64) -> Result<f64> {
    match value.is_finite() {
        true => Ok(value),
        false => Err(Error::Failed(format!("the motion of body `{}` is {value} (`{key}`)", body.name))),
    }
}

fn orientation(instance: &FmuInstance, body: &Body, fail: Fail) -> Result<Quaternion> {
    let Some(axes) = &body.orientation else { return Ok(IDENTITY) };
    let mut q = IDENTITY;
    for (q, axis) in q.iter_mut().zip(axes) {
        *q = finite(body, "orientation", axis.get(instance, fail)?)?;
    }
    let length = q.iter().map(|x| x * x).sum::<f64>().sqrt();
    match (length - 1.0).abs() <= UNIT {
        true => Ok(q.map(|x| x / length)),
        false => Err(Error::Failed(format!(
            "the `orientation` of body `{}` is {q:?}, of length {length}; a unit quaternion w, x, y, z has the length 1",
            body.name
        ))),
    }
}

/// Motion of the material point of a body at a port's origin within a step: translation and rotation.
pub struct AtPort {
    /// Displacement, m, and rotation vector, rad.
    pub way: [Vector; 2],
    /// Velocity at the end, m/s, and angular velocity, rad/s.
    pub rate: [Vector; 2],
    /// Mean acceleration, m/s², and mean angular acceleration, rad/s².
    pub change: [Vector; 2],
    /// From the body's position to the point at the end, m.
    pub arm: Vector,
}

impl AtPort {
    /// From the motions at both ends of a step of length h. Rates that the FMU does not provide are means of the step.
    pub fn new(body: &Body, port: &Port, before: &Motion, after: &Motion, h: f64) -> Self {
        let arm = minus(port.origin, before.position);
        let turn = product(after.orientation, conjugate(before.orientation));
        let swung = swing(turn, arm);
        let end = plus(arm, swung);
        let moved = minus(after.position, before.position);
        let angle = rotation_vector(turn);
        let told = |axes: &Axes| axes.iter().any(Option::is_some);
        let rate = Motion {
            velocity: if told(&body.velocity) { after.velocity } else { moved.map(|x| x / h) },
            angular_velocity: match told(&body.angular_velocity) {
                true => after.angular_velocity,
                false => angle.map(|x| x / h),
            },
            ..*after
        };
        let mean = |b: Vector, a: Vector| minus(b, a).map(|x| x / h);
        Self {
            way: [plus(moved, swung), angle],
            rate: [rate.velocity_at(end), rate.angular_velocity],
            change: [
                mean(after.velocity_at(end), before.velocity_at(arm)),
                mean(after.angular_velocity, before.angular_velocity),
            ],
            arm: end,
        }
    }
}
