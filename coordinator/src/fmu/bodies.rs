//! Glue by a map of names: variables of a unit that are the place, the velocity and the force of a body.
//!
//! `[x.bodies.NAME]` with `position`, `velocity`, `acceleration` and `force`, each a list of the names along world x, y and z (`""` for
//! none), or with `terminal`, the name of a terminal of FMI 3 whose members are these. The body can then be named by
//! `[[glue]]`. It translates; it has no orientation.

use terraglue_fmi::{Slave, SlaveState};
use terraglue_subsystem::{
    BodyState, Error, Level, Port, Pose, Response, Result, Scene, SceneBody, Step, ValueType, Variable,
    component,
};

use serde_json::{Map, Value};

/// Names of one body along x, y, z.
#[derive(Clone, Debug)]
struct Body {
    name: String,
    position: [Option<Axis>; 3],
    velocity: [Option<Axis>; 3],
    acceleration: [Option<Axis>; 3],
    force: [Option<Axis>; 3],
}

/// Where a component lies in the unit: a variable, or an element of an array.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    /// Number in calls.
    pub reference: u32,
    /// Element, row by row.
    pub element: usize,
    /// Elements of the whole variable.
    pub count: usize,
}

/// Elements of an array that fit without asking for memory.
const SMALL: usize = 48;

impl Axis {
    /// Runs `look` on all elements, as they are now.
    fn whole<R>(self, slave: &Slave, fail: Fail, look: impl FnOnce(&mut [f64]) -> R) -> Result<R> {
        let (mut few, mut many) = ([f64::NAN; SMALL], Vec::new());
        let all = match few.get_mut(..self.count) {
            Some(few) => few,
            None => {
                many.resize(self.count, f64::NAN);
                &mut many[..]
            }
        };
        slave.get_f64(&[self.reference], all).map_err(fail)?;
        Ok(look(all))
    }

    fn get(self, slave: &Slave, fail: Fail) -> Result<f64> {
        self.whole(slave, fail, |all| all[self.element])
    }

    fn set(self, slave: &Slave, value: f64, fail: Fail) -> Result {
        if self.count == 1 {
            return slave.set_f64(&[self.reference], &[value]).map_err(fail);
        }
        self.whole(slave, fail, |all| {
            all[self.element] = value;
            slave.set_f64(&[self.reference], all).map_err(fail)
        })?
    }
}

/// All bodies that a scenario maps onto variables of a unit.
#[derive(Clone, Debug, Default)]
pub struct Bodies {
    all: Vec<Body>,
    /// States before the present trial, in the order of the bodies.
    before: Vec<[[f64; 3]; 2]>,
    /// T and X of the last two trials of the step.
    trials: Vec<[Vec<f64>; 2]>,
    /// The same after it.
    after: Vec<[[f64; 3]; 2]>,
}

/// dX = ½·h²·dA where a force stays over the step and the unit integrates well.
const SHARE: f64 = 0.5;

/// How a state that is read becomes an error of the subsystem.
type Fail = fn(terraglue_fmi::Error) -> Error;

impl Bodies {
    /// Reads the table `bodies` of a unit with these terminals; `place` finds where a variable lies.
    ///
    /// # Errors
    /// A name that the unit does not have, or that is no f64, or that cannot be set where it must be.
    pub fn read(
        table: &Map<String, Value>,
        variables: &[Variable],
        terminals: &[(String, Vec<(String, String)>)],
        place: impl Fn(u32) -> Option<Axis>,
    ) -> Result<Self> {
        let all = table.iter().map(|(name, keys)| {
            let keys = keys.as_object().ok_or_else(|| wrong(name, "takes a table"))?;
            const KEYS: [&str; 5] = ["position", "velocity", "acceleration", "force", "terminal"];
            if let Some(key) = keys.keys().find(|k| !KEYS.contains(&k.as_str())) {
                let text = format!(
                    "has no key `{key}`; it has position, velocity, acceleration and force, or terminal"
                );
                return Err(wrong(name, &text));
            }
            let plug = keys.get("terminal").map(|t| members(name, t, terminals, variables)).transpose()?;
            let keys = match &plug {
                Some(_) if keys.len() > 1 => {
                    return Err(wrong(name, "`terminal` stands for the others"));
                }
                Some(found) => found,
                None => keys,
            };
            let axes = |key: &str, set: bool| axes(name, key, keys.get(key), variables, &place, set);
            let body = Body {
                name: name.clone(),
                position: axes("position", false)?,
                velocity: axes("velocity", false)?,
                acceleration: axes("acceleration", false)?,
                force: axes("force", true)?,
            };
            match (0..3).find(|k| body.force[*k].is_some() && body.position[*k].is_none()) {
                Some(k) => Err(wrong(
                    name,
                    &format!("takes a force along {} but tells no position", "xyz".as_bytes()[k] as char),
                )),
                None => Ok(body),
            }
        });
        Ok(Self {
            all: all.collect::<Result<_>>()?,
            before: Vec::new(),
            after: Vec::new(),
            trials: Vec::new(),
        })
    }

    /// Whether nothing is mapped.
    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// Bodies without shapes.
    pub fn scene(&self) -> Scene {
        let bodies = self.all.iter().map(|b| SceneBody { name: b.name.clone(), mass: 0.0 });
        Scene { bodies: bodies.collect(), shapes: Vec::new() }
    }

    /// Components along axes that no force is mapped to cannot be glued.
    ///
    /// # Errors
    /// The component, by name.
    pub fn check(&self, step: &Step) -> Result {
        for port in step.ports {
            let Some(body) = self.all.get(port.body as usize) else { continue };
            for (_, c) in port.components() {
                let direction = port.direction(c);
                let lacks = (0..3).any(|k| direction[k].abs() > 1e-12 && body.force[k].is_none());
                if 1 << c > component::T2 || lacks {
                    let text = "glue along a direction, or about an axis, for which no `force` is mapped";
                    return Err(wrong(&body.name, text));
                }
            }
        }
        Ok(())
    }

    fn motion(&self, slave: &Slave, body: &Body, fail: Fail) -> Result<[[f64; 3]; 2]> {
        let mut out = [[0.0; 3]; 2];
        for (row, names) in out.iter_mut().zip([&body.position, &body.velocity]) {
            for (value, reference) in row.iter_mut().zip(names) {
                if let Some(axis) = reference {
                    *value = axis.get(slave, fail)?;
                    if !value.is_finite() {
                        return Err(Error::Failed(format!("the motion of body `{}` is {value}", body.name)));
                    }
                }
            }
        }
        Ok(out)
    }

    /// States of all bodies.
    pub fn states(&self, slave: &Slave, out: &mut [BodyState], fail: Fail) -> Result {
        for (out, body) in out.iter_mut().zip(&self.all) {
            let [position, linear_velocity] = self.motion(slave, body, fail)?;
            let world_from_body = Pose { position, ..Pose::IDENTITY };
            *out = BodyState { world_from_body, linear_velocity, ..BodyState::REST };
        }
        Ok(())
    }

    /// Before a trial: remembers where the bodies are and hands the wrench over.
    pub fn push(&mut self, slave: &mut Slave, step: &Step, t: &[f64], fail: Fail) -> Result {
        let mut before = std::mem::take(&mut self.before);
        before.clear();
        for body in &self.all {
            before.push(self.motion(slave, body, fail)?);
        }
        self.before = before;
        for (b, body) in self.all.iter().enumerate() {
            let mut force = [0.0; 3];
            for port in step.ports.iter().filter(|p| p.body as usize == b) {
                let (own, _) = port.wrench_in_world(t);
                (0..3).for_each(|k| force[k] += f64::from(port.side) * own[k]);
            }
            for (value, axis) in force.iter().zip(&body.force) {
                axis.map_or(Ok(()), |axis| axis.set(slave, *value, fail))?;
            }
        }
        Ok(())
    }

    /// After a trial: the motion at all ports.
    pub fn pull(&mut self, slave: &Slave, step: &Step, t: &[f64], out: &mut Response, fail: Fail) -> Result {
        let mut after = std::mem::take(&mut self.after);
        after.clear();
        for body in &self.all {
            after.push(self.motion(slave, body, fail)?);
        }
        for port in step.ports {
            let b = port.body as usize;
            let ([x0, v0], [x1, v1]) = (self.before[b], after[b]);
            let has_velocity = self.all[b].velocity.iter().any(Option::is_some);
            for (i, c) in port.components() {
                let d = port.direction(c);
                let along = |a: [f64; 3], b: [f64; 3]| (0..3).map(|k| d[k] * (b[k] - a[k])).sum::<f64>();
                out.x[i] = along(x0, x1);
                out.v[i] = if has_velocity { along([0.0; 3], v1) } else { out.x[i] / step.h };
                out.a[i] = along(v0, v1) / step.h;
            }
        }
        self.after = after;
        self.pull_accelerations(slave, step, out, fail)?;
        out.t.copy_from_slice(t);
        if self.trials.len() > 1 {
            self.trials.remove(0);
        }
        self.trials.push([t.to_vec(), out.x.to_vec()]);
        Ok(())
    }

    /// Accelerations at the ports of bodies that tell them.
    fn pull_accelerations(&self, slave: &Slave, step: &Step, out: &mut Response, fail: Fail) -> Result {
        for port in step.ports {
            let axes = &self.all[port.body as usize].acceleration;
            if axes.iter().all(Option::is_none) {
                continue;
            }
            let mut a = [0.0; 3];
            for (a, axis) in a.iter_mut().zip(axes) {
                *a = axis.map_or(Ok(0.0), |axis| axis.get(slave, fail))?;
            }
            for (i, c) in port.components() {
                let d = port.direction(c);
                out.a[i] = (0..3).map(|k| d[k] * a[k]).sum();
            }
        }
        Ok(())
    }

    /// A new step begins.
    pub fn forget_trials(&mut self) {
        self.trials.clear();
    }

    /// Whether directional derivatives can tell dA/d(force): every force has its acceleration, none in an array.
    pub fn tell_slopes(&self) -> bool {
        let own = |b: &Body| {
            (0..3).all(|k| match (b.force[k], b.acceleration[k]) {
                (None, _) => true,
                (Some(f), Some(a)) => f.count == 1 && a.count == 1,
                (Some(_), None) => false,
            })
        };
        self.all.iter().flat_map(|b| &b.force).any(Option::is_some) && self.all.iter().all(own)
    }

    /// dX, dV or dA/d(wrench on itself), n × n, column-major, from the unit's derivatives.
    ///
    /// Those speak of outputs at one time, so they give dA; a force that stays over the step makes dV = h·dA and
    /// dX = c·h²·dA of it, with c = ½ until two trials of the step say what the unit's own integration makes of it.
    pub fn slopes(&self, slave: &Slave, step: &Step, level: Level, out: &mut [f64], fail: Fail) -> Result {
        match slave.description().capabilities.directional_derivatives {
            true => self.columns(slave, step, out, fail)?,
            false => self.rows(slave, step, out, fail)?,
        }
        let scale = match level {
            Level::Acceleration => 1.0,
            Level::Velocity => step.h,
            Level::Position => step.h * step.h * self.share(step, out),
        };
        out.iter_mut().for_each(|g| *g *= scale);
        Ok(())
    }

    /// dA/d(wrench on itself) by directional derivatives: one call for each component of the wrench.
    fn columns(&self, slave: &Slave, step: &Step, out: &mut [f64], fail: Fail) -> Result {
        let n = step.n as usize;
        let told = |b: &Body| b.acceleration.into_iter().flatten().map(|a| a.reference);
        let unknowns: Vec<u32> = self.all.iter().flat_map(told).collect();
        let mut change = vec![f64::NAN; unknowns.len()];
        for (column, port, d) in components(step) {
            let force = self.all[port.body as usize].force;
            let along = |k: usize| force[k].filter(|_| d[k] != 0.0).map(|axis| (axis.reference, d[k]));
            let (knowns, seed): (Vec<u32>, Vec<f64>) = (0..3).filter_map(along).unzip();
            slave.directional_derivative(&unknowns, &knowns, &seed, &mut change).map_err(fail)?;
            for (row, port, d) in components(step) {
                let mut next = self.all[..port.body as usize].iter().map(|b| told(b).count()).sum::<usize>();
                let mut sum = 0.0;
                for k in (0..3).filter(|k| self.all[port.body as usize].acceleration[*k].is_some()) {
                    sum += d[k] * change[next];
                    next += 1;
                }
                out[column * n + row] = sum;
            }
        }
        Ok(())
    }

    /// The same by adjoint derivatives: one call for each component of the acceleration.
    fn rows(&self, slave: &Slave, step: &Step, out: &mut [f64], fail: Fail) -> Result {
        let n = step.n as usize;
        let taken = |b: &Body| b.force.into_iter().flatten().map(|f| f.reference);
        let knowns: Vec<u32> = self.all.iter().flat_map(taken).collect();
        let mut change = vec![f64::NAN; knowns.len()];
        for (row, port, d) in components(step) {
            let acceleration = self.all[port.body as usize].acceleration;
            let along = |k: usize| acceleration[k].filter(|_| d[k] != 0.0).map(|axis| (axis.reference, d[k]));
            let (unknowns, seed): (Vec<u32>, Vec<f64>) = (0..3).filter_map(along).unzip();
            slave.adjoint_derivative(&unknowns, &knowns, &seed, &mut change).map_err(fail)?;
            for (column, port, d) in components(step) {
                let first = self.all[..port.body as usize].iter().map(|b| taken(b).count()).sum::<usize>();
                let own = (0..3).filter(|k| self.all[port.body as usize].force[*k].is_some());
                out[column * n + row] = own.zip(&change[first..]).map(|(k, change)| d[k] * change).sum();
            }
        }
        Ok(())
    }

    /// c of [`Bodies::slopes`] by the last two trials, from dA/d(wrench on itself).
    fn share(&self, step: &Step, slopes: &[f64]) -> f64 {
        let [[t0, x0], [t1, x1]] = self.trials.as_slice() else { return SHARE };
        let n = step.n as usize;
        if [t0, x0, t1, x1].iter().any(|v| v.len() != n) {
            return SHARE;
        }
        let (mut both, mut square) = (0.0, 0.0);
        for row in 0..n {
            let of = |(c, port, _): (usize, &Port, _)| {
                slopes[c * n + row] * f64::from(port.side) * (t1[c] - t0[c])
            };
            let told = step.h * step.h * components(step).map(of).sum::<f64>();
            both += told * (x1[row] - x0[row]);
            square += told * told;
        }
        let share = both / square;
        if share > 0.01 && share < 100.0 { share } else { SHARE }
    }

    /// A step of h = 0: place and velocity stay, the acceleration comes from a very short step that is taken back.
    pub fn still(
        &mut self,
        slave: &mut Slave,
        step: &Step,
        t: &[f64],
        out: &mut Response,
        fail: Fail,
    ) -> Result {
        const SHORT_S: f64 = 1e-6;
        let mut here = SlaveState::default();
        slave.save(&mut here).map_err(fail)?;
        self.push(slave, step, t, fail)?;
        let done = slave.do_step(terraglue_fmi::Advance { t: step.t, h: SHORT_S, for_good: true });
        let short = Step { h: SHORT_S, ..*step };
        let told = done.map_err(fail).and_then(|_| self.pull(slave, &short, t, out, fail));
        slave.restore(&here).map_err(fail)?;
        slave.release(&mut here).map_err(fail)?;
        told?;
        out.x.fill(0.0);
        Ok(())
    }
}

/// Number in packed vectors, port and world direction of every component.
fn components<'a>(step: &'a Step) -> impl Iterator<Item = (usize, &'a Port, [f64; 3])> {
    step.ports.iter().flat_map(|port| port.components().map(move |(i, c)| (i, port, port.direction(c))))
}

fn wrong(body: &str, text: &str) -> Error {
    Error::Refused(format!("body `{body}` of the unit: {text}"))
}

/// Names of the variables of a terminal along x, y and z, as the three lists that stand for it. Its members are arrays
/// `position`, `velocity`, `force`, or numbers `x`, `vx`, `force_x` and so on; others are left alone.
fn members(
    body: &str,
    terminal: &Value,
    terminals: &[(String, Vec<(String, String)>)],
    variables: &[Variable],
) -> Result<Map<String, Value>> {
    let name = terminal.as_str().ok_or_else(|| wrong(body, "`terminal` takes a name in quotes"))?;
    let Some((_, members)) = terminals.iter().find(|(n, _)| n == name) else {
        let near = crate::scenario::did_you_mean(name, terminals.iter().map(|(n, _)| n.as_str()));
        let near = near.map(|n| format!("; {n}")).unwrap_or_default();
        return Err(wrong(body, &format!("the unit has no terminal `{name}`{near}")));
    };
    let of = |member: &str| members.iter().find(|(m, _)| m == member).map(|(_, v)| v.as_str());
    let elements = |base: &str| {
        let own = variables.iter().filter(|v| v.name.strip_prefix(base).is_some_and(|r| r.starts_with('[')));
        own.take(3).map(|v| v.name.clone()).collect::<Vec<_>>()
    };
    let mut out = Map::new();
    for (key, axes) in [
        ("position", ["x", "y", "z"]),
        ("velocity", ["vx", "vy", "vz"]),
        ("acceleration", ["ax", "ay", "az"]),
        ("force", ["force_x", "force_y", "force_z"]),
    ] {
        let whole = of(key).map(elements).filter(|names| names.len() == 3);
        let single = axes.map(|axis| of(axis).unwrap_or_default().to_owned());
        let names = whole.unwrap_or_else(|| single.to_vec());
        if names.iter().any(|n| !n.is_empty()) {
            out.insert(key.into(), names.into());
        }
    }
    if out.contains_key("position") && out.contains_key("force") {
        return Ok(out);
    }
    let has: Vec<&str> = members.iter().map(|(m, _)| m.as_str()).collect();
    let text = format!("terminal `{name}` has no position or no force; its members are {}", has.join(", "));
    Err(wrong(body, &text))
}

fn axes(
    body: &str,
    key: &str,
    names: Option<&Value>,
    variables: &[Variable],
    locate: &impl Fn(u32) -> Option<Axis>,
    set: bool,
) -> Result<[Option<Axis>; 3]> {
    let Some(names) = names else { return Ok([None; 3]) };
    let list = names.as_array().filter(|l| l.len() <= 3);
    let list = list.ok_or_else(|| wrong(body, &format!("`{key}` takes up to three names, along x, y, z")))?;
    let mut out = [None; 3];
    for (place, name) in out.iter_mut().zip(list) {
        let name = name.as_str().ok_or_else(|| wrong(body, &format!("`{key}` takes names in quotes")))?;
        if name.is_empty() {
            continue;
        }
        let found = variables.iter().find(|v| v.name == name && v.value_type == ValueType::F64);
        let Some(found) = found else {
            let near = crate::scenario::did_you_mean(name, variables.iter().map(|v| v.name.as_str()));
            let near = near.map(|n| format!("; {n}")).unwrap_or_default();
            return Err(wrong(body, &format!("there is no f64 variable `{name}`{near}")));
        };
        if set && found.effect != terraglue_subsystem::Effect::Live {
            return Err(wrong(body, &format!("`{name}` cannot be set between steps")));
        }
        *place = locate(found.id);
    }
    Ok(out)
}
