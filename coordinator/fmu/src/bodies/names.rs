//! The table of a body, `[x.bodies.NAME]`: lists of names, or a terminal of FMI 3 in place of them.

use super::axis::Axis;
use serde_json::{Map, Value};
use terraglue_numerics::rotation::Vector;
use terraglue_subsystem::{Effect, Error, Result, ValueType, Variable};

/// Keys of the lists of a body, and names of the members of a terminal that are no array.
const KEYS: [(&str, &[&str]); 9] = [
    ("position", &["x", "y", "z"]),
    ("orientation", &["qw", "qx", "qy", "qz"]),
    ("velocity", &["vx", "vy", "vz"]),
    ("angular_velocity", &["wx", "wy", "wz"]),
    ("acceleration", &["ax", "ay", "az"]),
    ("angular_acceleration", &["alpha_x", "alpha_y", "alpha_z"]),
    ("force", &["force_x", "force_y", "force_z"]),
    ("moment", &["moment_x", "moment_y", "moment_z"]),
    ("force_at", &["force_at_x", "force_at_y", "force_at_z"]),
];
/// Those without meaning for a body without orientation.
const OF_TURNING: [&str; 4] = ["angular_velocity", "angular_acceleration", "moment", "force_at"];

/// Numbers along world x, y and z.
pub type Axes = [Option<Axis>; 3];

/// The point of a body on which its force acts and about which its moment is, from its position in body axes, m.
#[derive(Clone, Copy, Debug)]
pub enum Point {
    /// As the scenario says.
    Given(Vector),
    /// As the FMU reports it.
    Told(Axes),
}

/// Where the numbers of a body lie.
#[derive(Clone, Debug)]
pub struct Body {
    /// Name in the scenario.
    pub name: String,
    /// Place, m.
    pub position: Axes,
    /// Unit quaternion w, x, y, z, world from body; absent: the body only translates.
    pub orientation: Option<[Axis; 4]>,
    /// m/s, of the point of `position`.
    pub velocity: Axes,
    /// rad/s.
    pub angular_velocity: Axes,
    /// m/s², of the point of `position`.
    pub acceleration: Axes,
    /// rad/s².
    pub angular_acceleration: Axes,
    /// N, at `force_at`.
    pub force: Axes,
    /// N m, about `force_at`.
    pub moment: Axes,
    /// Where force and moment act.
    pub force_at: Point,
}

/// Terminals with the names of their members and of the variables behind them.
pub type Terminals = Vec<(String, Vec<(String, String)>)>;

/// Those of an FMU.
pub fn terminals(description: &terraglue_fmi::ModelDescription) -> Terminals {
    let names = |t: &terraglue_fmi::description::Terminal| {
        t.members.iter().map(|(name, k)| (name.clone(), description.variables[*k].name.clone())).collect()
    };
    description.terminals.iter().map(|t| (t.name.clone(), names(t))).collect()
}

/// Error about a body of a scenario.
pub fn wrong(body: &str, text: &str) -> Error {
    Error::Refused(format!("body `{body}` of the FMU: {text}"))
}

/// The FMU in which names are looked up.
pub struct Lookup<'a, ValueLocation> {
    /// Its variables.
    pub variables: &'a [Variable],
    /// Its terminals.
    pub terminals: &'a Terminals,
    /// Where a variable lies, by its id.
    pub place: ValueLocation,
}

impl<ValueLocation: Fn(u32) -> Option<Axis>> Lookup<'_, ValueLocation> {
    /// Reads the table of one body.
    ///
    /// # Errors
    /// A key or a name that does not exist or does not fit, or names that make no body together.
    pub fn body(&self, name: &str, table: &Value) -> Result<Body> {
        let keys = table.as_object().ok_or_else(|| wrong(name, "takes a table"))?;
        let known = |key: &str| key == "terminal" || KEYS.iter().any(|(k, _)| *k == key);
        if let Some(key) = keys.keys().find(|k| !known(k)) {
            let all: Vec<&str> = KEYS.iter().map(|(k, _)| *k).collect();
            let text = format!("has no key `{key}`; it has {}, or terminal", all.join(", "));
            return Err(wrong(name, &text));
        }
        let plug = keys.get("terminal").map(|t| self.members(name, t)).transpose()?;
        let keys = match &plug {
            Some(_) if keys.len() > 1 => return Err(wrong(name, "`terminal` stands for the others")),
            Some(found) => found,
            None => keys,
        };
        let axes = |key: &str, set: bool| self.axes(name, key, keys.get(key), set);
        let body = Body {
            name: name.to_owned(),
            position: axes("position", false)?,
            orientation: keys.get("orientation").map(|list| self.quaternion(name, list)).transpose()?,
            velocity: axes("velocity", false)?,
            angular_velocity: axes("angular_velocity", false)?,
            acceleration: axes("acceleration", false)?,
            angular_acceleration: axes("angular_acceleration", false)?,
            force: axes("force", true)?,
            moment: axes("moment", true)?,
            force_at: self.point(name, keys.get("force_at"))?,
        };
        fits(&body, keys)?;
        Ok(body)
    }

    /// Names of the variables of a terminal, as the lists that replace it. Other members are ignored, and so are those of
    /// rotation where there is no orientation.
    fn members(&self, body: &str, terminal: &Value) -> Result<Map<String, Value>> {
        let name = terminal.as_str().ok_or_else(|| wrong(body, "`terminal` takes a name in quotes"))?;
        let Some((_, members)) = self.terminals.iter().find(|(n, _)| n == name) else {
            let near = hint(name, self.terminals.iter().map(|(n, _)| n.as_str()));
            return Err(wrong(body, &format!("the FMU has no terminal `{name}`{near}")));
        };
        let of = |member: &str| members.iter().find(|(m, _)| m == member).map(|(_, v)| v.as_str());
        let mut out = Map::new();
        for (key, single) in KEYS {
            let whole = of(key).map(|base| self.elements(base, single.len()));
            let whole = whole.filter(|names| names.len() == single.len());
            let single = || single.iter().map(|axis| of(axis).unwrap_or_default().to_owned()).collect();
            let names = whole.unwrap_or_else(single);
            let told = names.iter().filter(|n| !n.is_empty()).count();
            if told > 0 && (key != "orientation" || told == 4) {
                out.insert(key.into(), names.into());
            }
        }
        if !out.contains_key("orientation") {
            OF_TURNING.iter().for_each(|key| drop(out.remove(*key)));
        }
        let has = |keys: [&str; 2]| keys.iter().all(|k| out.contains_key(*k));
        if has(["position", "force"]) || has(["orientation", "moment"]) {
            return Ok(out);
        }
        let has: Vec<&str> = members.iter().map(|(m, _)| m.as_str()).collect();
        let text = format!(
            "terminal `{name}` has neither position and force nor orientation and moment; its members are {}",
            has.join(", ")
        );
        Err(wrong(body, &text))
    }

    /// Names of the first elements of an array.
    fn elements(&self, base: &str, count: usize) -> Vec<String> {
        let of_it = |v: &&Variable| v.name.strip_prefix(base).is_some_and(|rest| rest.starts_with('['));
        self.variables.iter().filter(of_it).take(count).map(|v| v.name.clone()).collect()
    }

    fn axes(&self, body: &str, key: &str, names: Option<&Value>, set: bool) -> Result<Axes> {
        let Some(names) = names else { return Ok([None; 3]) };
        let list = names.as_array().filter(|l| l.len() <= 3);
        let list =
            list.ok_or_else(|| wrong(body, &format!("`{key}` takes up to three names, along x, y, z")))?;
        let mut out = [None; 3];
        for (place, name) in out.iter_mut().zip(list) {
            *place = self.axis(body, key, name, set)?;
        }
        Ok(out)
    }

    fn quaternion(&self, body: &str, names: &Value) -> Result<[Axis; 4]> {
        let four =
            || wrong(body, "`orientation` takes four names, of the quaternion w, x, y, z, world from body");
        let list = names.as_array().filter(|l| l.len() == 4).ok_or_else(four)?;
        let found: Result<Vec<_>> = list.iter().map(|n| self.axis(body, "orientation", n, false)).collect();
        match found?[..] {
            [Some(w), Some(x), Some(y), Some(z)] => Ok([w, x, y, z]),
            _ => Err(four()),
        }
    }

    fn point(&self, body: &str, value: Option<&Value>) -> Result<Point> {
        let Some(value) = value else { return Ok(Point::Given([0.0; 3])) };
        let numbers: Option<Vec<f64>> = value.as_array().and_then(|l| l.iter().map(Value::as_f64).collect());
        match numbers.as_deref() {
            Some([x, y, z]) => Ok(Point::Given([*x, *y, *z])),
            Some(_) => Err(wrong(body, "`force_at` takes three numbers (m, body axes) or three names")),
            None => self.axes(body, "force_at", Some(value), false).map(Point::Told),
        }
    }

    /// The number behind a name; none behind an empty one.
    fn axis(&self, body: &str, key: &str, name: &Value, set: bool) -> Result<Option<Axis>> {
        let name = name.as_str().ok_or_else(|| wrong(body, &format!("`{key}` takes names in quotes")))?;
        if name.is_empty() {
            return Ok(None);
        }
        let found = self.variables.iter().find(|v| v.name == name && v.value_type == ValueType::F64);
        let Some(found) = found else {
            let near = hint(name, self.variables.iter().map(|v| v.name.as_str()));
            return Err(wrong(body, &format!("there is no f64 variable `{name}`{near}")));
        };
        if set && found.effect != Effect::Live {
            return Err(wrong(body, &format!("`{name}` cannot be set between steps")));
        }
        Ok((self.place)(found.id))
    }
}

fn hint<'a>(name: &str, all: impl Iterator<Item = &'a str>) -> String {
    terraglue_scenario::did_you_mean(name, all).map(|near| format!("; {near}")).unwrap_or_default()
}

/// Refuses names that make no body together.
fn fits(body: &Body, keys: &Map<String, Value>) -> Result {
    if let Some(k) = (0..3).find(|k| body.force[*k].is_some() && body.position[*k].is_none()) {
        let axis = "xyz".as_bytes()[k] as char;
        return Err(wrong(&body.name, &format!("takes a force along {axis} but has no position")));
    }
    match OF_TURNING.iter().find(|key| keys.contains_key(**key)) {
        Some(key) if body.orientation.is_none() => Err(wrong(
            &body.name,
            &format!(
                "`{key}` belongs to a body that turns: map its `orientation` (quaternion w, x, y, z), too"
            ),
        )),
        _ => Ok(()),
    }
}
