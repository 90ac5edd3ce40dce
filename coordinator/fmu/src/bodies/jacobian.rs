//! The interface Jacobian of glued bodies from directional or adjoint derivatives of their FMU.
//!
//! Those are of outputs at one time, so they give dA/d(wrench). A wrench that stays over the step makes dV = h·dA and
//! dX = c·h²·dA of it, with c = ½ until two trials of the step show the effect of the FMU's own integration.

use super::axis::Axis;
use super::motion::Motion;
use super::names::Body;
use super::{Bodies, Fail};
use terraglue_fmi::FmuInstance;
use terraglue_numerics::rotation::{
    IDENTITY, Quaternion, Vector, conjugate, cross, minus, product, quaternion, rotation_vector, turned,
};
use terraglue_subsystem::{Level, Port, Result, Step};

/// dX = ½·h²·dA where a force stays over the step and the FMU integrates well.
const SHARE: f64 = 0.5;

/// Force and moment, or acceleration and angular acceleration.
type Six = [Option<Axis>; 6];

/// Force and moment on a body.
fn inputs(body: &Body) -> Six {
    join(body.force, body.moment)
}

fn outputs(body: &Body) -> Six {
    join(body.acceleration, body.angular_acceleration)
}

fn join([a, b, c]: [Option<Axis>; 3], [d, e, f]: [Option<Axis>; 3]) -> Six {
    [a, b, c, d, e, f]
}

/// One packed component of the step.
struct Component {
    /// Number in packed vectors.
    place: usize,
    body: usize,
    side: f64,
    /// Force and moment about the point of force, per unit of the wrench on the body.
    push: [f64; 6],
    /// Its acceleration in terms of the body's acceleration and angular acceleration.
    row: [f64; 6],
}

/// References and weights of what a component needs of them.
fn weighed(of: &Six, weights: &[f64; 6]) -> (Vec<u32>, Vec<f64>) {
    let own = of.iter().zip(weights).filter(|(_, weight)| **weight != 0.0);
    own.filter_map(|(axis, weight)| axis.map(|axis| (axis.reference, *weight))).unzip()
}

/// Weights times what was found of one body, which comes without what has no name.
fn sum(of: &Six, weights: &[f64; 6], found: &[f64]) -> f64 {
    let own = of.iter().zip(weights).filter(|(axis, _)| axis.is_some());
    own.zip(found).map(|((_, weight), found)| weight * found).sum()
}

/// References of all bodies, one after the other, and where those of each begin.
fn all(bodies: &[Body], of: fn(&Body) -> Six) -> (Vec<u32>, Vec<usize>) {
    let (mut references, mut first) = (Vec::new(), Vec::new());
    for body in bodies {
        first.push(references.len());
        references.extend(of(body).iter().flatten().map(|axis| axis.reference));
    }
    (references, first)
}

impl Bodies {
    /// Whether derivatives provide dA/d(wrench): every force and moment has its acceleration, none in an array.
    pub fn tell_derivatives(&self) -> bool {
        let own = |body: &Body| {
            inputs(body).iter().zip(outputs(body)).all(|(input, output)| match (input, output) {
                (None, _) => true,
                (Some(input), Some(output)) => input.count == 1 && output.count == 1,
                (Some(_), None) => false,
            })
        };
        self.all.iter().flat_map(inputs).any(|axis| axis.is_some()) && self.all.iter().all(own)
    }

    /// dX, dV or dA/d(wrench on itself), n × n, column-major, from the FMU's derivatives.
    pub fn jacobian(
        &self,
        instance: &FmuInstance,
        step: &Step,
        level: Level,
        out: &mut [f64],
        fail: Fail,
    ) -> Result {
        let components = self.components(instance, step, level, fail)?;
        match instance.description().capabilities.directional_derivatives {
            true => self.columns(instance, &components, out, fail)?,
            false => self.rows(instance, &components, out, fail)?,
        }
        let scale = match level {
            Level::Acceleration => 1.0,
            Level::Velocity => step.h,
            Level::Position => step.h * step.h * self.share(step, &components, out),
        };
        out.iter_mut().for_each(|g| *g *= scale);
        Ok(())
    }

    /// All packed components: pushed with the arms of the start of the step, answered as the last trial of it has turned.
    fn components(
        &self,
        instance: &FmuInstance,
        step: &Step,
        level: Level,
        fail: Fail,
    ) -> Result<Vec<Component>> {
        let mut out = Vec::new();
        for port in step.ports {
            let b = port.body as usize;
            let (start, turn) = match self.trials.is_empty() {
                true => (Motion::read(instance, &self.all[b], fail)?, IDENTITY),
                false => {
                    let (before, after) = (self.before[b], self.after[b]);
                    (before, product(after.orientation, conjugate(before.orientation)))
                }
            };
            let of = |(place, c)| component(port, (place, c), &start, turn, level);
            out.extend(port.components().map(of));
        }
        Ok(out)
    }

    /// dA/d(wrench on itself) by directional derivatives: one call for each component of the wrench.
    fn columns(
        &self,
        instance: &FmuInstance,
        components: &[Component],
        out: &mut [f64],
        fail: Fail,
    ) -> Result {
        let (unknowns, first) = all(&self.all, outputs);
        let mut change = vec![f64::NAN; unknowns.len()];
        for column in components {
            let (knowns, seed) = weighed(&inputs(&self.all[column.body]), &column.push);
            instance.directional_derivative(&unknowns, &knowns, &seed, &mut change).map_err(fail)?;
            for row in components {
                let own = outputs(&self.all[row.body]);
                out[column.place * components.len() + row.place] =
                    sum(&own, &row.row, &change[first[row.body]..]);
            }
        }
        Ok(())
    }

    /// The same by adjoint derivatives: one call for each component of the acceleration.
    fn rows(&self, instance: &FmuInstance, components: &[Component], out: &mut [f64], fail: Fail) -> Result {
        let (knowns, first) = all(&self.all, inputs);
        let mut change = vec![f64::NAN; knowns.len()];
        for row in components {
            let (unknowns, seed) = weighed(&outputs(&self.all[row.body]), &row.row);
            instance.adjoint_derivative(&unknowns, &knowns, &seed, &mut change).map_err(fail)?;
            for column in components {
                let own = inputs(&self.all[column.body]);
                out[column.place * components.len() + row.place] =
                    sum(&own, &column.push, &change[first[column.body]..]);
            }
        }
        Ok(())
    }

    /// c by the last two trials, from dA/d(wrench on itself).
    fn share(&self, step: &Step, components: &[Component], slopes: &[f64]) -> f64 {
        let [[t0, x0], [t1, x1]] = self.trials.as_slice() else { return SHARE };
        let n = components.len();
        if [t0, x0, t1, x1].iter().any(|v| v.len() != n) {
            return SHARE;
        }
        let (mut both, mut square) = (0.0, 0.0);
        for row in 0..n {
            let of = |c: &Component| slopes[c.place * n + row] * c.side * (t1[c.place] - t0[c.place]);
            let told = step.h * step.h * components.iter().map(of).sum::<f64>();
            both += told * (x1[row] - x0[row]);
            square += told * told;
        }
        let share = both / square;
        if share > 0.01 && share < 100.0 { share } else { SHARE }
    }
}

fn component(
    port: &Port,
    (place, c): (usize, usize),
    start: &Motion,
    turn: Quaternion,
    level: Level,
) -> Component {
    let d = port.direction(c);
    let six = |[x, y, z]: Vector, [mx, my, mz]: Vector| [x, y, z, mx, my, mz];
    let (push, row) = match c < 3 {
        true => {
            let arm = turned(turn, minus(port.origin, start.position));
            // The lever turns with the body within the step: by half of its turn in the mean.
            let mean = if level == Level::Position { half(turn) } else { IDENTITY };
            let lever = turned(conjugate(mean), cross(arm, d));
            (six(d, cross(minus(port.origin, start.loaded), d)), six(d, lever))
        }
        false => (six([0.0; 3], d), six([0.0; 3], d)),
    };
    Component { place, body: port.body as usize, side: f64::from(port.side), push, row }
}

/// Half of a rotation, the short way round.
fn half(turn: Quaternion) -> Quaternion {
    quaternion(rotation_vector(turn).map(|x| 0.5 * x))
}
