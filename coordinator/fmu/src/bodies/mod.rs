//! Glue by a map of names: variables of an FMU that are the motion of a body, and the force and moment on it.
//!
//! `[x.bodies.NAME]` has lists of names along world x, y and z (`""` for none): `position`, `velocity`, `acceleration` and
//! `force`. With `orientation`, a quaternion, the body turns, and has `angular_velocity`, `angular_acceleration` and
//! `moment`. `terminal` is the name of a terminal of FMI 3 whose members are these. The body can then be named by
//! `[[glue]]`. [`names`] reads the table, [`motion`] gives the motion of a port of the body, [`jacobian`] the Jacobian.

mod axis;
mod jacobian;
mod motion;
mod names;

pub use axis::Axis;
pub use names::{Terminals, terminals};

use motion::{AtPort, Motion, vector};
use names::{Body, Lookup, wrong};
use serde_json::{Map, Value};
use terraglue_fmi::{FmuInstance, FmuState};
use terraglue_numerics::rotation::{cross, dot, minus, plus};
use terraglue_subsystem::{
    BodyState, Error, Pose, Response, Result, Scene, SceneBody, Step, Variable, component,
};

/// How a state that is read becomes an error of the subsystem.
type Fail = fn(terraglue_fmi::Error) -> Error;

/// All bodies that a scenario maps onto variables of an FMU.
#[derive(Clone, Debug, Default)]
pub struct Bodies {
    all: Vec<Body>,
    /// Motions before the present trial, in the order of the bodies.
    before: Vec<Motion>,
    /// The same after it.
    after: Vec<Motion>,
    /// T and X of the last two trials of the step.
    trials: Vec<[Vec<f64>; 2]>,
}

impl Bodies {
    /// Reads the table `bodies` of an FMU with these terminals; `place` finds where a variable lies.
    ///
    /// # Errors
    /// A name that the FMU does not have, or that is no f64, or that cannot be set where it must be.
    pub fn read(
        table: &Map<String, Value>,
        variables: &[Variable],
        terminals: &Terminals,
        place: impl Fn(u32) -> Option<Axis>,
    ) -> Result<Self> {
        let lookup = Lookup { variables, terminals, place };
        let all = table.iter().map(|(name, keys)| lookup.body(name, keys));
        Ok(Self { all: all.collect::<Result<_>>()?, ..Self::default() })
    }

    /// Whether nothing is mapped.
    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// Bodies without shapes.
    pub fn scene(&self) -> Scene {
        let bodies = self.all.iter().map(|b| SceneBody { name: b.name.clone(), mass: 0.0 });
        Scene { bodies: bodies.collect(), shapes: Vec::new(), joints: Vec::new() }
    }

    /// Components along axes that no force is mapped to, or about axes without a moment, cannot be glued.
    ///
    /// # Errors
    /// The body, by name, and what it lacks.
    pub fn check(&self, step: &Step) -> Result {
        for port in step.ports {
            let Some(body) = self.all.get(port.body as usize) else { continue };
            if body.orientation.is_some() && body.moment.iter().all(Option::is_none) {
                let text = "tells an `orientation` but takes no `moment`, so a force beside its point could not turn \
                            it: map `moment`, or leave `orientation` out";
                return Err(wrong(&body.name, text));
            }
            for (_, c) in port.components() {
                let direction = port.direction(c);
                let turns = 1 << c > component::T2;
                let (taken, key, way) = match turns {
                    true => (&body.moment, "moment", "about"),
                    false => (&body.force, "force", "along"),
                };
                if (0..3).any(|k| direction[k].abs() > 1e-12 && taken[k].is_none()) {
                    let text = format!("glue {way} {direction:?}, for which no `{key}` is mapped");
                    return Err(wrong(&body.name, &text));
                }
            }
        }
        Ok(())
    }

    /// States of all bodies.
    pub fn states(&self, instance: &FmuInstance, out: &mut [BodyState], fail: Fail) -> Result {
        for (out, body) in out.iter_mut().zip(&self.all) {
            let Motion { position, orientation, velocity, angular_velocity, .. } =
                Motion::read(instance, body, fail)?;
            let world_from_body = Pose { position, orientation };
            *out = BodyState { world_from_body, linear_velocity: velocity, angular_velocity };
        }
        Ok(())
    }

    fn motions(&self, instance: &FmuInstance, out: &mut Vec<Motion>, fail: Fail) -> Result {
        out.clear();
        for body in &self.all {
            out.push(Motion::read(instance, body, fail)?);
        }
        Ok(())
    }

    /// Before a trial: remembers where the bodies are and hands the wrench over.
    pub fn push(&mut self, instance: &mut FmuInstance, step: &Step, t: &[f64], fail: Fail) -> Result {
        let mut before = std::mem::take(&mut self.before);
        let read = self.motions(instance, &mut before, fail);
        self.before = before;
        read?;
        for (b, body) in self.all.iter().enumerate() {
            let (mut force, mut moment) = ([0.0; 3], [0.0; 3]);
            for port in step.ports.iter().filter(|p| p.body as usize == b) {
                let (own, about) = port.wrench_in_world(t);
                let lever = cross(minus(port.origin, self.before[b].loaded), own);
                let side = f64::from(port.side);
                force = plus(force, own.map(|x| side * x));
                moment = plus(moment, plus(about, lever).map(|x| side * x));
            }
            let axes = body.force.iter().chain(&body.moment);
            for (axis, value) in axes.zip(force.into_iter().chain(moment)) {
                axis.map_or(Ok(()), |axis| axis.set(instance, value, fail))?;
            }
        }
        Ok(())
    }

    /// After a trial: the motion at all ports.
    pub fn pull(
        &mut self,
        instance: &FmuInstance,
        step: &Step,
        t: &[f64],
        out: &mut Response,
        fail: Fail,
    ) -> Result {
        let mut after = std::mem::take(&mut self.after);
        let read = self.motions(instance, &mut after, fail);
        self.after = after;
        read?;
        for port in step.ports {
            let b = port.body as usize;
            let mut at = AtPort::new(&self.all[b], port, &self.before[b], &self.after[b], step.h);
            self.accelerate(instance, b, &mut at, fail)?;
            for (i, c) in port.components() {
                let (d, kind) = (port.direction(c), c / 3);
                out.x[i] = dot(d, at.way[kind]);
                out.v[i] = dot(d, at.rate[kind]);
                out.a[i] = dot(d, at.change[kind]);
            }
        }
        out.t.copy_from_slice(t);
        if self.trials.len() > 1 {
            self.trials.remove(0);
        }
        self.trials.push([t.to_vec(), out.x.to_vec()]);
        Ok(())
    }

    /// Accelerations where the body has them, in the place of means: of a body that turns both kinds are needed.
    fn accelerate(&self, instance: &FmuInstance, b: usize, at: &mut AtPort, fail: Fail) -> Result {
        let body = &self.all[b];
        let told = [&body.acceleration, &body.angular_acceleration].map(|a| a.iter().any(Option::is_some));
        if told[1] {
            at.change[1] = vector(instance, body, "angular_acceleration", &body.angular_acceleration, fail)?;
        }
        if told[0] && (told[1] || body.orientation.is_none()) {
            let own = vector(instance, body, "acceleration", &body.acceleration, fail)?;
            let rate = at.rate[1];
            let inward = cross(rate, cross(rate, at.arm));
            at.change[0] = plus(own, plus(cross(at.change[1], at.arm), inward));
        }
        Ok(())
    }

    /// A new step begins.
    pub fn forget_trials(&mut self) {
        self.trials.clear();
    }

    /// A step of h = 0: place and velocity stay, the acceleration comes from a very short step that is taken back.
    pub fn still(
        &mut self,
        instance: &mut FmuInstance,
        step: &Step,
        t: &[f64],
        out: &mut Response,
        fail: Fail,
    ) -> Result {
        const SHORT_S: f64 = 1e-6;
        let mut here = FmuState::default();
        instance.save(&mut here).map_err(fail)?;
        self.push(instance, step, t, fail)?;
        let done = instance.do_step(terraglue_fmi::Advance { t: step.t, h: SHORT_S, for_good: true });
        let short = Step { h: SHORT_S, ..*step };
        let told = done.map_err(fail).and_then(|_| self.pull(instance, &short, t, out, fail));
        instance.restore(&here).map_err(fail)?;
        instance.release(&mut here).map_err(fail)?;
        told?;
        out.x.fill(0.0);
        Ok(())
    }
}
