//! Connections from the scenario: `[[robot.loop]]`, `[[robot.spring]]`, `[[robot.coupling]]`.

use super::{Closure, ClosureLaw, Points, Spring};
use crate::joint::{Joint, Kind};
use crate::math::{Q, V3, frame_along};
use crate::model::Model;
use crate::motion::Motion;
use serde_json::{Map, Value};
use terraglue_robot_import as import;
use terraglue_subsystem::{Config, Error, Parameter, ParameterType, Result};

/// A closure may be open by this at the start, m or rad; the first step takes it back.
const OPEN: f64 = 1e-6;
const LOOP: [&str; 9] =
    ["name", "kind", "links", "origin", "axis", "second_axis", "origin_2", "axis_2", "length"];
const SPRING: [&str; 7] = ["name", "links", "origin", "origin_2", "stiffness", "damping", "rest_length"];
const COUPLING: [&str; 4] = ["name", "joints", "ratio", "offset"];
const KINDS: [(&str, Kind); 7] = [
    ("revolute", Kind::Revolute),
    ("prismatic", Kind::Prismatic),
    ("fixed", Kind::Fixed),
    ("cylindrical", Kind::Cylindrical),
    ("universal", Kind::Universal),
    ("spherical", Kind::Spherical),
    ("planar", Kind::Planar),
];

/// Parameters of the scenario.
pub(crate) fn parameters() -> Vec<Parameter> {
    let of = |name: &str, help: &str| Parameter::of(name, ParameterType::Tables, help).optional();
    vec![
        of(
            "loop",
            "Joints that close loops: name, kind (revolute, prismatic, fixed, cylindrical, universal, spherical, planar, rod), \
             links (two; `world` is one), origin and axis in the first link's frame; origin_2, axis_2 in the second's if they \
             are not to follow from the initial pose; second_axis of a universal joint; length of a rod",
        ),
        of(
            "spring",
            "Springs and dampers between two points: name, links, origin, origin_2, stiffness (N/m), damping (N s/m), \
             rest_length (m, default: the initial one)",
        ),
        of(
            "coupling",
            "Joint coordinates that follow others: name, joints = [follower, leader], ratio, offset",
        ),
    ]
}

/// All connections for a robot in its initial pose with its initial coordinates.
pub(crate) fn closures(
    config: &Config,
    model: &Model,
    (bodies, angles): (&[Motion], &[f64]),
    (couplings, loops): (&[import::Coupling], &[import::Loop]),
) -> Result<Vec<Closure>> {
    let mut all: Vec<Closure> = couplings.iter().map(|c| from_coupling(c, model)).collect();
    all.extend(loops.iter().map(|l| from_loop(l, model, bodies)));
    let mut names: Vec<&str> = all.iter().map(|c| c.name.as_str()).collect();
    names.sort_unstable();
    if let Some(twice) = names.windows(2).find(|n| n[0] == n[1]) {
        return Err(Error::Refused(format!("the robot file gives two connections the name `{}`", twice[0])));
    }
    type Read = fn(&Entry, &Model, &[Motion], &[f64]) -> Result<ClosureLaw>;
    let tables: [(&str, &[&str], Read); 3] =
        [("loop", &LOOP, closing), ("spring", &SPRING, spring), ("coupling", &COUPLING, coupling)];
    for (table, keys, read) in tables {
        for (index, entry) in entries(config, table)?.iter().enumerate() {
            let entry = Entry { table, index, map: entry };
            entry.check_keys(keys)?;
            let name = entry.text("name")?.to_owned();
            let taken = model.joints.iter().any(|j| j.name == name)
                || model.bodies.iter().any(|b| b.name == name)
                || all.iter().any(|c| c.name == name);
            if taken || name.is_empty() {
                return Err(entry.refuse("name", &format!("`{name}` is empty or taken already")));
            }
            let closure = Closure { law: read(&entry, model, bodies, angles)?, name };
            check_closed(&entry, &closure, model, bodies, angles)?;
            all.push(closure);
        }
    }
    Ok(all)
}

/// A joint that follows another, as the robot file defines.
fn from_coupling(c: &import::Coupling, model: &Model) -> Closure {
    let (follower, leader) = (model.joint_of_file(c.follower), model.joint_of_file(c.leader));
    Closure {
        name: c.name.clone(),
        law: ClosureLaw::Coupling { follower, leader, ratio: c.ratio, offset: c.offset },
    }
}

/// Two bodies held together as they stand, as the robot file defines.
fn from_loop(l: &import::Loop, model: &Model, bodies: &[Motion]) -> Closure {
    let (origin, q) = frame(model, bodies, l.bodies[0]);
    let point = origin + q * l.origin;
    let (parent, child) = match l.bodies {
        [parent, Some(child)] => (parent, child),
        // One of two different bodies moves.
        [child, None] => (None, child.unwrap_or(0)),
    };
    let inverse = |body: Option<usize>| body.map_or_else(Q::identity, |b| bodies[b].q.inverse());
    let law = ClosureLaw::Joint(Joint {
        name: l.name.clone(),
        kind: if l.rigid { Kind::Fixed } else { Kind::Spherical },
        parent,
        child,
        parent_anchor: local(bodies, parent, &point),
        child_anchor: local(bodies, Some(child), &point),
        parent_frame: inverse(parent),
        child_frame: inverse(Some(child)),
        limits: None,
        data: import::AxisData::default(),
    });
    Closure { name: l.name.clone(), law }
}

pub(crate) fn entries<'a>(config: &'a Config, table: &str) -> Result<Vec<&'a Map<String, Value>>> {
    let wrong = || Error::Refused(format!("parameter `{table}` is a list of tables: write [[NAME.{table}]]"));
    match config.get(table) {
        None | Some(Value::Null) => Ok(Vec::new()),
        Some(Value::Array(list)) => list.iter().map(|v| v.as_object().ok_or_else(wrong)).collect(),
        Some(_) => Err(wrong()),
    }
}

/// Largest number of a table, in any unit, and largest length: no mechanism has larger ones.
const LARGEST: f64 = 1e15;
const LARGEST_M: f64 = 1e6;

/// One table of a list.
pub(crate) struct Entry<'a> {
    pub table: &'a str,
    pub index: usize,
    pub map: &'a Map<String, Value>,
}

impl Entry<'_> {
    pub fn refuse(&self, key: &str, problem: &str) -> Error {
        let name = self.map.get("name").and_then(Value::as_str).unwrap_or("");
        Error::Refused(format!("`{}` number {} (`{name}`), `{key}`: {problem}", self.table, self.index + 1))
    }

    pub fn check_keys(&self, keys: &[&str]) -> Result {
        match self.map.keys().find(|k| !keys.contains(&k.as_str())) {
            Some(key) => Err(self.refuse(key, &format!("unknown key; it takes {}", keys.join(", ")))),
            None => Ok(()),
        }
    }

    pub fn text(&self, key: &str) -> Result<&str> {
        self.map.get(key).and_then(Value::as_str).ok_or_else(|| self.refuse(key, "a text is needed"))
    }

    pub fn number(&self, key: &str) -> Result<Option<f64>> {
        let value = self.map.get(key);
        let number = value.map(|v| v.as_f64().filter(|x| x.abs() <= LARGEST));
        let refused = || self.refuse(key, &format!("a number of at most {LARGEST:e} is needed"));
        number.map(|x| x.ok_or_else(refused)).transpose()
    }

    pub fn vector(&self, key: &str) -> Result<Option<V3>> {
        let Some(value) = self.map.get(key) else { return Ok(None) };
        let list: Option<Vec<f64>> = value.as_array().and_then(|a| a.iter().map(Value::as_f64).collect());
        match list.as_deref() {
            Some([x, y, z]) if [x, y, z].iter().all(|x| x.abs() <= LARGEST_M) => {
                Ok(Some(V3::new(*x, *y, *z)))
            }
            Some([_, _, _]) => {
                Err(self.refuse(key, &format!("{value} is out of range: plausible is at most {LARGEST_M:e}")))
            }
            _ => Err(self.refuse(key, &format!("{value} is not a list of x, y, z"))),
        }
    }

    fn direction(&self, key: &str) -> Result<Option<V3>> {
        let direction = self.vector(key)?;
        match direction.filter(|d| d.norm() > 1e-9).map(|d| d.normalize()) {
            None if direction.is_some() => Err(self.refuse(key, "a direction has a length")),
            found => Ok(found),
        }
    }

    fn two(&self, key: &str) -> Result<[&str; 2]> {
        let list = self.map.get(key).and_then(Value::as_array);
        let texts: Option<Vec<&str>> = list.and_then(|l| l.iter().map(Value::as_str).collect());
        match texts.as_deref() {
            Some([a, b]) => Ok([*a, *b]),
            _ => Err(self.refuse(key, "a list of two names is needed")),
        }
    }

    /// The two bodies; none: the world.
    fn links(&self, model: &Model) -> Result<[Option<usize>; 2]> {
        let [a, b] = self.two("links")?;
        let body = |name: &str| match model.bodies.iter().position(|b| b.name == name) {
            None if name == "world" => Ok(None),
            None => {
                let names = model.bodies.iter().map(|b| b.name.as_str());
                let near = names.min_by_key(|n| strsim::damerau_levenshtein(n, name)).unwrap_or("world");
                Err(self.refuse("links", &format!("there is no body `{name}`; did you mean `{near}`?")))
            }
            some => Ok(some),
        };
        let links = [body(a)?, body(b)?];
        if links[0] == links[1] {
            return Err(self.refuse("links", "two different bodies are needed"));
        }
        Ok(links)
    }
}

/// Pose of a link's frame: origin and orientation; the world is the world.
fn frame(model: &Model, bodies: &[Motion], body: Option<usize>) -> (V3, Q) {
    body.map_or((V3::zeros(), Q::identity()), |b| (bodies[b].point(&-model.bodies[b].com), bodies[b].q))
}

/// A world point from the centre of mass of a body in its axes.
fn local(bodies: &[Motion], body: Option<usize>, point: &V3) -> V3 {
    body.map_or(*point, |b| bodies[b].q.inverse_transform_vector(&(point - bodies[b].c)))
}

/// The two points; the second link is the child unless it is the world.
fn points(entry: &Entry, model: &Model, bodies: &[Motion], follow: bool) -> Result<Points> {
    let links = entry.links(model)?;
    let world = |k: usize, point: &V3| {
        let (origin, q) = frame(model, bodies, links[k]);
        origin + q * point
    };
    let first = world(0, &entry.vector("origin")?.unwrap_or_else(V3::zeros));
    let second = match entry.vector("origin_2")? {
        Some(point) => world(1, &point),
        None if follow => first,
        None => return Err(entry.refuse("origin_2", "the point on the second link is needed")),
    };
    let ends = [(links[0], first), (links[1], second)];
    let (parent, child) = if links[1].is_some() { (ends[0], ends[1]) } else { (ends[1], ends[0]) };
    Ok(Points {
        parent: parent.0,
        // One of two different links is a body.
        child: child.0.unwrap_or(0),
        parent_point: local(bodies, parent.0, &parent.1),
        child_point: local(bodies, child.0, &child.1),
    })
}

fn closing(entry: &Entry, model: &Model, bodies: &[Motion], _: &[f64]) -> Result<ClosureLaw> {
    let name = entry.text("kind")?;
    if name == "rod" {
        let points = points(entry, model, bodies, false)?;
        let length = entry.number("length")?.unwrap_or_else(|| points.length(bodies));
        if length < 1e-9 {
            return Err(entry.refuse("length", "a rod has a length; two points in one place are `spherical`"));
        }
        return Ok(ClosureLaw::Rod(points, length));
    }
    let Some((_, kind)) = KINDS.iter().find(|(n, _)| *n == name) else {
        let names: Vec<&str> = KINDS.iter().map(|(n, _)| *n).collect();
        return Err(entry.refuse("kind", &format!("`{name}` is none of {}, rod", names.join(", "))));
    };
    let points = points(entry, model, bodies, true)?;
    let links = entry.links(model)?;
    let world = |k: usize, axis: V3| frame(model, bodies, links[k]).1 * axis;
    let first = world(0, entry.direction("axis")?.unwrap_or_else(V3::z));
    let second = entry.direction("axis_2")?.map_or(first, |axis| world(1, axis));
    let along = |axis: &V3| match (*kind, entry.direction("second_axis")) {
        (Kind::Universal, Ok(Some(second))) => with_second(axis, &world(0, second)),
        _ => frame_along(axis),
    };
    let (parent_axis, child_axis) = if links[1].is_some() { (first, second) } else { (second, first) };
    let inverse = |body: Option<usize>| body.map_or_else(Q::identity, |b| bodies[b].q.inverse());
    Ok(ClosureLaw::Joint(Joint {
        name: entry.text("name")?.to_owned(),
        kind: *kind,
        parent: points.parent,
        child: points.child,
        parent_anchor: points.parent_point,
        child_anchor: points.child_point,
        parent_frame: inverse(points.parent) * along(&parent_axis),
        child_frame: inverse(Some(points.child)) * along(&child_axis),
        limits: None,
        data: import::AxisData::default(),
    }))
}

/// Frame with x along the axis and y along the part of `second` across it.
fn with_second(axis: &V3, second: &V3) -> Q {
    let across = second - axis * axis.dot(second);
    if across.norm() < 1e-9 {
        return frame_along(axis);
    }
    let y = across.normalize();
    let m = crate::math::M3::from_columns(&[*axis, y, axis.cross(&y)]);
    Q::from_rotation_matrix(&nalgebra::Rotation3::from_matrix_unchecked(m))
}

fn spring(entry: &Entry, model: &Model, bodies: &[Motion], _: &[f64]) -> Result<ClosureLaw> {
    let points = points(entry, model, bodies, false)?;
    let positive = |key: &str| match entry.number(key)? {
        Some(x) if x < 0.0 => Err(entry.refuse(key, &format!("{x} is negative"))),
        x => Ok(x),
    };
    let (stiffness, damping) = (positive("stiffness")?.unwrap_or(0.0), positive("damping")?.unwrap_or(0.0));
    if stiffness == 0.0 && damping == 0.0 {
        return Err(entry.refuse("stiffness", "neither stiffness nor damping is given"));
    }
    let rest_length = positive("rest_length")?.unwrap_or_else(|| points.length(bodies));
    Ok(ClosureLaw::Spring(points, Spring { stiffness, damping, rest_length }))
}

fn coupling(entry: &Entry, model: &Model, _: &[Motion], angles: &[f64]) -> Result<ClosureLaw> {
    let joint = |name: &str| {
        let found = model.joints.iter().position(|j| j.moves() && j.name == name);
        found.ok_or_else(|| entry.refuse("joints", &format!("no moving joint is called `{name}`")))
    };
    let [follower, leader] = entry.two("joints")?;
    let (follower, leader) = (joint(follower)?, joint(leader)?);
    if follower == leader {
        return Err(entry.refuse("joints", "a joint cannot follow itself"));
    }
    let ratio = entry.number("ratio")?.unwrap_or(1.0);
    let offset = entry.number("offset")?.unwrap_or(angles[follower] - ratio * angles[leader]);
    Ok(ClosureLaw::Coupling { follower, leader, ratio, offset })
}

fn check_closed(
    entry: &Entry,
    closure: &Closure,
    model: &Model,
    bodies: &[Motion],
    angles: &[f64],
) -> Result {
    if closure.spring().is_some() {
        return Ok(());
    }
    let mut open = vec![0.0; closure.len()];
    closure.values(&super::Poses { joints: &model.joints, before: None, bodies, near: angles }, &mut open);
    let worst = open.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    if worst <= OPEN {
        return Ok(());
    }
    let problem = format!(
        "it is open by {worst:.3e} (m or rad) in the initial pose; set `joints` so that it closes, or leave \
         origin_2, axis_2, length, offset out: they follow from the initial pose"
    );
    Err(entry.refuse("origin_2", &problem))
}
