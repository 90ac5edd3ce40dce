//! From the text of an MJCF file to the checked robot.
//!
//! Bodies, free, hinge, slide and ball joints, geoms, planes, position, velocity and torque motors, armature, damping,
//! friction, springs, limits, default classes, excluded pairs, included files. Unknown elements that act on the mechanics are
//! named in a warning with their line; those that would change the mechanism are refused. Step, gravity and solver are the
//! scenario's.

mod actuators;
mod assets;
mod defaults;
mod equality;
mod geom;
mod hang;
mod ignored;
mod include;
mod several;
mod survey;

use crate::Options;
use crate::check::{mass_spread, unique};
use crate::error::{Error, Source};
use crate::inertia::{Inertial, flaw, in_range};
use crate::model::{Base, Robot, Shape};
use crate::plausible;
use assets::Assets;
use defaults::Defaults;
use geom::{Around, Geom, compound, geom};
use ignored::Ignored;
use include::MergedFile;
use nalgebra::{Isometry3, Matrix3};
use roxmltree::{Document, Node};
use std::collections::BTreeMap;
use survey::survey;

/// Elements without effect on the mechanics.
const SEEN_ONLY: [&str; 9] =
    ["site", "camera", "light", "visual", "statistic", "asset", "size", "compiler", "default"];

/// Reads the text of a file; `file` appears in messages and gives the folder of meshes.
///
/// # Errors
/// [`Error`] with line and element: a part that cannot be read or simulated.
pub fn read_mjcf_text(file: &str, text: &str, options: &Options) -> Result<Robot, Error> {
    let whole = MergedFile::read(file, text)?;
    let source = Source { file, text: &whole.text };
    crate::syntax::check_depth(&source)?;
    let document = Document::parse(&whole.text);
    let document = document.map_err(|e| source.syntax(e.pos().row as usize, e.to_string()))?;
    let root = document.root_element();
    let defaults = Defaults::new(&whole, root)?;
    survey(&defaults, root)?;
    let assets = Assets::read(&defaults, root, &options.folders(file))?;
    let robot = empty(root.attribute("model").unwrap_or("robot"));
    let mut reader = MjcfReader {
        d: &defaults,
        robot,
        assets: &assets,
        frames: BTreeMap::new(),
        ignored: Ignored::default(),
    };
    reader.sections(root)?;
    let mut robot = reader.robot;
    robot.warnings.extend(reader.ignored.warnings());
    if robot.bodies.is_empty() {
        return Err(source.tree("there is no body that moves; a robot needs at least one"));
    }
    // The first body that moves freely is the robot's; others start where the file places them.
    robot.base = match robot.others.first() {
        Some((0, pose)) => Base::Free(*pose),
        _ => Base::World,
    };
    robot.others.retain(|(body, _)| *body != 0);
    set_total_mass(&defaults, root, &mut robot)?;
    robot.warnings.extend(mass_spread(file, &robot.bodies));
    unique(&source, &robot)?;
    Ok(robot)
}

/// Scales masses and inertias to the total of `<compiler settotalmass>`, where that is above 0.
fn set_total_mass(d: &Defaults, root: Node, robot: &mut Robot) -> Result<(), Error> {
    let compilers = root.children().filter(|n| n.has_tag_name("compiler"));
    for e in compilers.map(|n| d.element(n, None)) {
        let Some(wanted) = d.number(&e, "settotalmass")?.filter(|m| *m > 0.0) else { continue };
        let scale = wanted / robot.bodies.iter().map(|b| b.mass).sum::<f64>();
        for body in &mut robot.bodies {
            body.mass *= scale;
            body.inertia *= scale;
        }
    }
    Ok(())
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
        couplings: Vec::new(),
        loops: Vec::new(),
        warnings: Vec::new(),
        notices: Vec::new(),
    }
}

/// Place of an element of the tree.
#[derive(Clone, Copy)]
struct ElementPlace<'a> {
    /// Body that it belongs to; none: the world.
    body: Option<usize>,
    /// Its frame in that of the body, or in the world.
    frame: Isometry3<f64>,
    /// Inherited default class.
    class: Option<&'a str>,
}

struct MjcfReader<'d, 's> {
    d: &'d Defaults<'s>,
    robot: Robot,
    assets: &'d Assets,
    /// By name of a body of the file: the body that it belongs to (none: the world) and its frame there.
    frames: BTreeMap<String, (Option<usize>, Isometry3<f64>)>,
    ignored: Ignored,
}

impl<'d, 's> MjcfReader<'d, 's> {
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
        for node in root.children().filter(|n| n.has_tag_name("worldbody")) {
            let world = ElementPlace {
                body: None,
                frame: Isometry3::identity(),
                class: node.attribute("childclass"),
            };
            self.contents(node, world, "world")?;
        }
        for node in section("contact") {
            self.exclude(node)?;
        }
        for node in section("actuator") {
            self.warn_ignored(node, None);
            self.actuator(node)?;
        }
        for node in section("equality") {
            self.warn_ignored(node, None);
            self.equality(node)?;
        }
        let heads = root.children().filter(|n| n.has_tag_name("compiler") || n.has_tag_name("option"));
        for node in heads.chain(section("asset")).chain(section("option")) {
            self.warn_ignored(node, None);
        }
        let known = ["worldbody", "contact", "actuator", "equality", "option"];
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
        let text = self.place(node, what);
        self.robot.warnings.push(text);
    }

    /// A message about an element, with its place.
    fn place(&self, node: Node, what: &str) -> String {
        let (file, line) = self.d.place(node);
        let name = node.attribute("name").map(|n| format!(" `{n}`")).unwrap_or_default();
        format!("{file}:{line}: <{}>{name} {what}", node.tag_name().name())
    }

    /// Geoms and bodies of a body or the world, which are at `place`.
    fn contents<'a>(
        &mut self,
        node: Node<'a, '_>,
        place: ElementPlace<'a>,
        owner: &str,
    ) -> Result<(), Error> {
        for child in node.children().filter(Node::is_element) {
            match child.tag_name().name() {
                "geom" => self.shape(child, place, owner)?,
                "body" => self.body(child, place)?,
                "inertial" | "freejoint" => self.warn_ignored(child, None),
                "joint" => {}
                name if SEEN_ONLY.contains(&name) => {}
                _ => self.warn(child, "is not supported and does nothing"),
            }
        }
        Ok(())
    }

    fn shape<'a>(&mut self, node: Node<'a, '_>, place: ElementPlace<'a>, owner: &str) -> Result<(), Error> {
        self.warn_ignored(node, place.class);
        let e = self.d.element(node, place.class);
        if let Some(condim @ ("4" | "6")) = self.d.text(&e, "condim") {
            self.ignore(node, "condim", condim);
        }
        let around = Around { assets: self.assets, owner, still: place.body.is_none() };
        match geom(self.d, &e, around)? {
            Geom::Shape(weighed) => {
                if let Some(said) = weighed.notice {
                    let said = self.place(node, &said);
                    self.robot.notices.push(said);
                }
                let shape = weighed.shape;
                let odd =
                    plausible::shape(&shape.geometry).filter(|_| place.body.is_some() && shape.collides);
                odd.iter().for_each(|odd| self.warn(node, odd));
                let shape = Shape { body_from_shape: place.frame * shape.body_from_shape, ..shape };
                match place.body {
                    Some(body) => self.robot.bodies[body].shapes.push(shape),
                    None => self.robot.world_shapes.push(shape),
                }
            }
            Geom::Plane(plane) if place.body.is_none() => {
                let normal = place.frame.rotation * plane.normal;
                let offset = plane.offset + normal.dot(&place.frame.translation.vector);
                self.robot.planes.push(crate::model::Plane { normal, offset, ..plane });
            }
            Geom::Plane(_) => {
                self.warn(node, "is a plane on a body; planes belong to the world, it is left out")
            }
            Geom::Unused(why) => self.warn(node, &why),
        }
        Ok(())
    }

    fn body<'a>(&mut self, node: Node<'a, '_>, above: ElementPlace<'a>) -> Result<(), Error> {
        let class = node.attribute("childclass").or(above.class);
        let e = self.d.element(node, None);
        self.warn_ignored(node, class);
        let frame = above.frame * self.d.pose(&e)?;
        let name =
            node.attribute("name").map_or_else(|| format!("body{}", self.robot.bodies.len()), str::to_owned);
        let joints: Vec<Node> =
            node.children().filter(|n| n.has_tag_name("joint") || n.has_tag_name("freejoint")).collect();
        let inertial = self.inertial(node, class, &name)?;
        let place = match (joints.first(), inertial) {
            // It moves with its parent and weighs nothing.
            (None, None) => ElementPlace { frame, class, ..above },
            // Of the world.
            (None, Some(_)) if above.body.is_none() => ElementPlace { frame, class, ..above },
            (_, None) => {
                let problem = "moves but has no mass; give it an <inertial> or a geom with mass";
                return Err(self.d.wrong(&e, problem.into()));
            }
            (_, Some(inertial)) => {
                // MuJoCo refuses such a file, too.
                in_range(inertial.mass, &inertial.tensor)
                    .and_then(|()| flaw(&inertial.tensor).map_or(Ok(()), Err))
                    .map_err(|problem| self.d.wrong(&e, problem))?;
                if let Some(odd) = plausible::body(&inertial) {
                    self.warn(node, &odd);
                }
                let hangs = ElementPlace { class, ..above };
                let child = self.hang_by(&joints, hangs, (&name, frame), inertial)?;
                ElementPlace { body: Some(child), frame: Isometry3::identity(), class }
            }
        };
        self.frames.insert(name.clone(), (place.body, place.frame));
        self.contents(node, place, &name)
    }

    /// `<inertial>`, or the inertial of the geoms.
    fn inertial(&self, node: Node, class: Option<&str>, name: &str) -> Result<Option<Inertial>, Error> {
        let d = self.d;
        let inertial = node.children().find(|n| n.has_tag_name("inertial"));
        if let Some(inertial) = inertial.filter(|_| !d.weigh_geoms) {
            let e = d.element(inertial, None);
            let mass = d.number(&e, "mass")?.unwrap_or(0.0);
            if mass <= 0.0 {
                return Err(d.wrong(&e, format!("mass = {mass}: needs a positive mass in kg")));
            }
            let tensor = match (d.vector(&e, "diaginertia")?, d.numbers(&e, "fullinertia")?.as_deref()) {
                (Some(diagonal), _) => Matrix3::from_diagonal(&diagonal),
                (None, Some([xx, yy, zz, xy, xz, yz])) => {
                    Matrix3::new(*xx, *xy, *xz, *xy, *yy, *yz, *xz, *yz, *zz)
                }
                _ => return Err(d.wrong(&e, "needs diaginertia (three numbers) or fullinertia (six)".into())),
            };
            let pose = d.pose(&e)?;
            let r = pose.rotation.to_rotation_matrix();
            let tensor = r * tensor * r.transpose();
            return Ok(Some(Inertial { mass, com: pose.translation.vector, tensor }));
        }
        let mut weighed = Vec::new();
        let around = Around { assets: self.assets, owner: name, still: false };
        for node in node.children().filter(|n| n.has_tag_name("geom")) {
            if let Geom::Shape(shape) = geom(d, &d.element(node, class), around)? {
                weighed.push(shape);
            }
        }
        Ok(compound(&weighed))
    }

    fn exclude(&mut self, node: Node) -> Result<(), Error> {
        self.warn_ignored(node, None);
        if !node.has_tag_name("exclude") {
            self.warn(node, "is not supported and does nothing");
            return Ok(());
        }
        let moving = |name: &str| {
            let wanted = node.attribute(name).unwrap_or_default();
            let found = if wanted == "world" { Some(None) } else { self.frames.get(wanted).map(|f| f.0) };
            let unknown = || format!("{name}: there is no body `{wanted}`");
            found.ok_or_else(|| self.d.wrong(&self.d.element(node, None), unknown()))
        };
        match (moving("body1")?, moving("body2")?) {
            (Some(a), Some(b)) if a != b => self.robot.excluded.push([a, b]),
            // Parts of one body never touch.
            (a, b) if a == b => {}
            _ => self.warn(node, "names a body that stands still: what moves touches it all the same"),
        }
        Ok(())
    }
}
