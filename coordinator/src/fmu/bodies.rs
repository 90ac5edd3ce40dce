//! Glue by a map of names: variables of a unit that are the place, the velocity and the force of a body.
//!
//! `[x.bodies.NAME]` with `position`, `velocity` and `force`, each a list of the names along world x, y and z (`""` for
//! none), or with `terminal`, the name of a terminal of FMI 3 whose members are these. The body can then be named by
//! `[[glue]]`. It translates; it has no orientation.

use terraglue_fmi::{Slave, SlaveState};
use terraglue_subsystem::{
    BodyState, Error, Pose, Response, Result, Scene, SceneBody, Step, ValueType, Variable, component,
};

use serde_json::{Map, Value};

/// Names of one body along x, y, z.
#[derive(Clone, Debug)]
struct Body {
    name: String,
    position: [Option<Axis>; 3],
    velocity: [Option<Axis>; 3],
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
}

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
            const KEYS: [&str; 4] = ["position", "velocity", "force", "terminal"];
            if let Some(key) = keys.keys().find(|k| !KEYS.contains(&k.as_str())) {
                let text = format!("has no key `{key}`; it has position, velocity and force, or terminal");
                return Err(wrong(name, &text));
            }
            let plug = keys.get("terminal").map(|t| members(name, t, terminals, variables)).transpose()?;
            let keys = match &plug {
                Some(_) if keys.len() > 1 => {
                    return Err(wrong(name, "`terminal` stands for the three others"));
                }
                Some(found) => found,
                None => keys,
            };
            let axes = |key: &str, set: bool| axes(name, key, keys.get(key), variables, &place, set);
            let body = Body {
                name: name.clone(),
                position: axes("position", false)?,
                velocity: axes("velocity", false)?,
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
        Ok(Self { all: all.collect::<Result<_>>()?, before: Vec::new() })
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
    pub fn pull(&self, slave: &Slave, step: &Step, t: &[f64], out: &mut Response, fail: Fail) -> Result {
        let mut after = Vec::with_capacity(self.all.len());
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
        out.t.copy_from_slice(t);
        Ok(())
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
        let done = slave.do_step(terraglue_fmi::Advance { t: step.t, h: SHORT_S, for_good: false });
        let short = Step { h: SHORT_S, ..*step };
        let told = done.map_err(fail).and_then(|_| self.pull(slave, &short, t, out, fail));
        slave.restore(&here).map_err(fail)?;
        slave.release(&mut here).map_err(fail)?;
        told?;
        out.x.fill(0.0);
        Ok(())
    }
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
