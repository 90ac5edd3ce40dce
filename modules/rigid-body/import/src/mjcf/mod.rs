//! From the text of an MJCF file to the checked robot.
//!
//! Bodies, free, hinge and slide joints, geoms, planes, position, velocity and torque motors, armature, damping,
//! friction, springs, limits, default classes, excluded pairs. What acts on the mechanics and is not known here is
//! named in a warning with its line; what would make another mechanism of it is refused. Step, gravity and solver are
//! the scenario's.

mod actuators;
mod defaults;
mod geom;

use crate::check::{mass_spread, physical};
use crate::error::{Error, Source};
use crate::model::{AxisData, Base, Body, Joint, JointKind, Robot, Shape};
use defaults::{Defaults, Element};
use geom::{Geom, compound, geom};
use nalgebra::{Isometry3, Matrix3, Translation3, Unit, Vector3};
use roxmltree::{Document, Node};
use std::path::Path;

/// Elements that say nothing about the mechanics.
const SEEN_ONLY: [&str; 9] =
    ["site", "camera", "light", "visual", "statistic", "asset", "size", "compiler", "default"];

/// Reads a file.
pub fn read_mjcf(path: &Path) -> Result<Robot, Error> {
    let file = path.display().to_string();
    let text = std::fs::read_to_string(path)
        .map_err(|e| Error::Read { file: file.clone(), reason: e.to_string() })?;
    read_mjcf_text(&file, &text)
}

/// Reads the text of a file; `file` appears in messages.
pub fn read_mjcf_text(file: &str, text: &str) -> Result<Robot, Error> {
    let document =
        Document::parse(text).map_err(|e| Error::Syntax { file: file.into(), reason: e.to_string() })?;
    let root = document.root_element();
    let defaults = Defaults::new(Source { file, text }, root);
    let mut reader = Reader { d: &defaults, robot: empty(root.attribute("model").unwrap_or("robot")) };
    reader.sections(root)?;
    let mut robot = reader.robot;
    if robot.bodies.is_empty() {
        return Err(defaults.source.tree("there is no body that moves; a robot needs at least one"));
    }
    // The first body that moves freely is the robot's; others start where the file says.
    robot.base = match robot.others.first() {
        Some((0, pose)) => Base::Free(*pose),
        _ => Base::World,
    };
    robot.others.retain(|(body, _)| *body != 0);
    robot.warnings.extend(mass_spread(file, &robot.bodies));
    Ok(robot)
}

fn empty(name: &str) -> Robot {
    Robot {
        name: name.into(),
        base: Base::World,
        bodies: Vec::new(),
        joints: Vec::new(),
        others: Vec::new(),
        world_shapes: Vec::new(),
        planes: Vec::new(),
        excluded: Vec::new(),
        warnings: Vec::new(),
    }
}

/// Where an element of the tree is.
#[derive(Clone, Copy)]
struct Place<'a> {
    /// Body that it belongs to; none: the world.
    body: Option<usize>,
    /// Its frame in that of the body, or in the world.
    frame: Isometry3<f64>,
    /// Inherited default class.
    class: Option<&'a str>,
}

struct Reader<'d, 's> {
    d: &'d Defaults<'s>,
    robot: Robot,
}

impl<'d, 's> Reader<'d, 's> {
    fn sections(&mut self, root: Node) -> Result<(), Error> {
        if !root.has_tag_name("mujoco") {
            return Err(self.d.wrong(&self.d.element(root, None), "the root of MJCF is <mujoco>".into()));
        }
        let section = |name: &'static str| {
            root.children()
                .filter(move |n| n.has_tag_name(name))
                .flat_map(|n| n.children())
                .filter(Node::is_element)
        };
        if let Some(include) = root.descendants().find(|n| n.has_tag_name("include")) {
            let problem = "files are not included; put its text here";
            return Err(self.d.wrong(&self.d.element(include, None), problem.into()));
        }
        for node in root.children().filter(|n| n.has_tag_name("worldbody")) {
            let world =
                Place { body: None, frame: Isometry3::identity(), class: node.attribute("childclass") };
            self.contents(node, world, "world")?;
        }
        for node in section("contact") {
            self.exclude(node)?;
        }
        for node in section("actuator") {
            self.actuator(node)?;
        }
        let known = ["worldbody", "contact", "actuator", "option"];
        for node in root.children().filter(Node::is_element) {
            let name = node.tag_name().name();
            if !known.contains(&name) && !SEEN_ONLY.contains(&name) {
                node.children()
                    .filter(Node::is_element)
                    .for_each(|n| self.warn(n, "is not supported and does nothing"));
            }
        }
        Ok(())
    }

    fn warn(&mut self, node: Node, what: &str) {
        let (file, line) = (self.d.source.file, self.d.line(node));
        let name = node.attribute("name").map(|n| format!(" `{n}`")).unwrap_or_default();
        self.robot.warnings.push(format!("{file}:{line}: <{}>{name} {what}", node.tag_name().name()));
    }

    /// Geoms and bodies of a body or the world, which are at `place`.
    fn contents<'a>(&mut self, node: Node<'a, '_>, place: Place<'a>, owner: &str) -> Result<(), Error> {
        for child in node.children().filter(Node::is_element) {
            match child.tag_name().name() {
                "geom" => self.shape(child, place, owner)?,
                "body" => self.body(child, place)?,
                "inertial" | "joint" | "freejoint" => {}
                name if SEEN_ONLY.contains(&name) => {}
                _ => self.warn(child, "is not supported and does nothing"),
            }
        }
        Ok(())
    }

    fn shape<'a>(&mut self, node: Node<'a, '_>, place: Place<'a>, owner: &str) -> Result<(), Error> {
        let e = self.d.element(node, place.class);
        match geom(self.d, &e, owner)? {
            Geom::Shape { shape, .. } => {
                let shape = Shape { body_from_shape: place.frame * shape.body_from_shape, ..shape };
                match place.body {
                    Some(body) => self.robot.bodies[body].shapes.push(shape),
                    None => self.robot.world_shapes.push(shape),
                }
            }
            Geom::Plane(plane) if place.body.is_none() => self.robot.planes.push(plane),
            Geom::Plane(_) => {
                self.warn(node, "is a plane on a body; planes belong to the world, it is left out")
            }
            Geom::Unknown(kind) => {
                self.warn(node, &format!("of type `{kind}` is not supported and is left out"))
            }
        }
        Ok(())
    }

    fn body<'a>(&mut self, node: Node<'a, '_>, above: Place<'a>) -> Result<(), Error> {
        let class = node.attribute("childclass").or(above.class);
        let e = self.d.element(node, None);
        let frame = above.frame * self.d.pose(&e)?;
        let name =
            node.attribute("name").map_or_else(|| format!("body{}", self.robot.bodies.len()), str::to_owned);
        let joints: Vec<Node> =
            node.children().filter(|n| n.has_tag_name("joint") || n.has_tag_name("freejoint")).collect();
        if joints.len() > 1 {
            let problem = format!(
                "has {} joints; one joint per body can be simulated: put a body with a mass of its own between them",
                joints.len()
            );
            return Err(self.d.wrong(&e, problem));
        }
        let inertial = self.inertial(node, class, &name)?;
        let place = match (joints.first(), inertial) {
            // It moves with what is above it and weighs nothing.
            (None, None) => Place { frame, class, ..above },
            // Of the world.
            (None, Some(_)) if above.body.is_none() => Place { frame, class, ..above },
            (_, None) => {
                let problem = "moves but has no mass; give it an <inertial> or a geom with mass";
                return Err(self.d.wrong(&e, problem.into()));
            }
            (joint, Some((mass, com, inertia))) => {
                physical(&inertia).map_err(|problem| self.d.wrong(&e, problem))?;
                if self.robot.bodies.iter().any(|b| b.name == name) {
                    return Err(self
                        .d
                        .wrong(&e, "the name is used twice; names of bodies are unique".into()));
                }
                let child = self.robot.bodies.len();
                self.robot.bodies.push(Body { name: name.clone(), mass, com, inertia, shapes: Vec::new() });
                let joint = joint.map(|j| self.d.element(*j, class));
                self.hang(joint, above.body, child, frame, &name)?;
                Place { body: Some(child), frame: Isometry3::identity(), class }
            }
        };
        self.contents(node, place, &name)
    }

    /// `<inertial>`, or what the geoms weigh.
    fn inertial(
        &self,
        node: Node,
        class: Option<&str>,
        name: &str,
    ) -> Result<Option<(f64, Vector3<f64>, Matrix3<f64>)>, Error> {
        let d = self.d;
        if let Some(inertial) = node.children().find(|n| n.has_tag_name("inertial")) {
            let e = d.element(inertial, None);
            let mass = d.number(&e, "mass")?.filter(|m| *m > 0.0);
            let mass = mass.ok_or_else(|| d.wrong(&e, "needs a positive mass".into()))?;
            let tensor = match (d.vector(&e, "diaginertia")?, d.numbers(&e, "fullinertia")?.as_deref()) {
                (Some(diagonal), _) => Matrix3::from_diagonal(&diagonal),
                (None, Some([xx, yy, zz, xy, xz, yz])) => {
                    Matrix3::new(*xx, *xy, *xz, *xy, *yy, *yz, *xz, *yz, *zz)
                }
                _ => return Err(d.wrong(&e, "needs diaginertia (three numbers) or fullinertia (six)".into())),
            };
            let pose = d.pose(&e)?;
            let r = pose.rotation.to_rotation_matrix();
            return Ok(Some((mass, pose.translation.vector, r * tensor * r.transpose())));
        }
        let mut weighed = Vec::new();
        for node in node.children().filter(|n| n.has_tag_name("geom")) {
            if let Geom::Shape { shape, mass } = geom(d, &d.element(node, class), name)? {
                weighed.push((shape, mass));
            }
        }
        Ok(compound(&weighed))
    }

    /// Hangs a body on its parent; `frame`: its pose there or in the world.
    fn hang(
        &mut self,
        joint: Option<Element>,
        parent: Option<usize>,
        child: usize,
        frame: Isometry3<f64>,
        body: &str,
    ) -> Result<(), Error> {
        let d = self.d;
        let Some(e) = joint else {
            self.robot.joints.push(Joint {
                name: format!("{body}_fixed"),
                kind: JointKind::Fixed,
                parent,
                child,
                parent_from_joint: frame,
                child_from_joint: Isometry3::identity(),
                axis: Vector3::x_axis(),
                limits: None,
                data: AxisData::default(),
            });
            return Ok(());
        };
        let kind =
            if e.node.has_tag_name("freejoint") { "free" } else { d.text(&e, "type").unwrap_or("hinge") };
        let kind = match kind {
            "hinge" => JointKind::Revolute,
            "slide" => JointKind::Prismatic,
            "free" if parent.is_none() => {
                self.robot.others.push((child, frame));
                return Ok(());
            }
            other => {
                let problem = format!(
                    "type `{other}` cannot be simulated here; hinge, slide and free (in the world) can"
                );
                return Err(d.wrong(&e, problem));
            }
        };
        let name = e.node.attribute("name").map_or_else(|| format!("{body}_joint"), str::to_owned);
        let axis = d.vector(&e, "axis")?.unwrap_or_else(Vector3::z);
        let axis = Unit::try_new(axis, 1e-9).ok_or_else(|| d.wrong(&e, "axis has no direction".into()))?;
        let anchor = Isometry3::from(Translation3::from(d.vector(&e, "pos")?.unwrap_or_else(Vector3::zeros)));
        if d.number(&e, "ref")?.unwrap_or(0.0) != 0.0 {
            self.warn(
                e.node,
                "has a `ref`, which is not supported: its coordinate is 0 in the pose of the file",
            );
        }
        if self.robot.joints.iter().any(|j| j.name == name) {
            return Err(d.wrong(&e, format!("the name `{name}` is used twice; names of joints are unique")));
        }
        let unit = if kind == JointKind::Revolute { d.angle } else { 1.0 };
        let not_negative = |what: &str| match d.number(&e, what)?.unwrap_or(0.0) {
            x if x >= 0.0 => Ok(x),
            x => Err(d.wrong(&e, format!("{what} = {x} is negative: it would drive the joint"))),
        };
        let data = AxisData {
            damping: not_negative("damping")?,
            friction: not_negative("frictionloss")?,
            armature: not_negative("armature")?,
            stiffness: not_negative("stiffness")?,
            reference: unit * d.number(&e, "springref")?.unwrap_or(0.0),
            drive: None,
        };
        let limits = self.limits(&e, unit)?;
        self.robot.joints.push(Joint {
            name,
            kind,
            parent,
            child,
            parent_from_joint: frame * anchor,
            child_from_joint: anchor,
            axis,
            limits,
            data,
        });
        Ok(())
    }

    fn limits(&self, e: &Element, unit: f64) -> Result<Option<[f64; 2]>, Error> {
        let range = self.d.numbers(e, "range")?;
        match (self.d.text(e, "limited"), range.as_deref()) {
            (Some("false"), _) | (_, None) => Ok(None),
            (_, Some([lower, upper])) if lower < upper => Ok(Some([unit * lower, unit * upper])),
            (_, Some(other)) => Err(self.d.wrong(e, format!("range = {other:?} leaves no room"))),
        }
    }

    fn exclude(&mut self, node: Node) -> Result<(), Error> {
        if !node.has_tag_name("exclude") {
            self.warn(node, "is not supported and does nothing");
            return Ok(());
        }
        let mut pair = [0; 2];
        for (slot, name) in pair.iter_mut().zip(["body1", "body2"]) {
            let wanted = node.attribute(name).unwrap_or_default();
            let found = self.robot.bodies.iter().position(|b| b.name == wanted);
            *slot = found.ok_or_else(|| {
                self.d.wrong(
                    &self.d.element(node, None),
                    format!("{name}: there is no body `{wanted}` that moves"),
                )
            })?;
        }
        self.robot.excluded.push(pair);
        Ok(())
    }
}
