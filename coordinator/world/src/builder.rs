//! From the scenes, states and fields of subsystems to a world.

use crate::bounds::Bounds;
use crate::error::{Error, Result};
use crate::fixed::{Fixed, Solid};
use crate::ground::Ground;
use crate::mesh::Mesh;
use crate::model::{Member, Parallel, Shape, WorldModel};
use crate::motion::{Motion, is_place};
use crate::moving::{Carried, Form, Moving};
use crate::primitive::Primitive;
use std::sync::Arc;
use terraglue_ground::{Rotation, compose};
use terraglue_subsystem::{BodyState, FieldInfo, Geometry, JointKind, Pose, Scene, SceneShape, ShapeRef};

/// Collects what is there.
#[derive(Default)]
pub struct WorldBuilder {
    names: Vec<String>,
    members: Vec<Member>,
    bodies: Vec<Motion>,
    is_fixed: Vec<bool>,
    shapes: Vec<Shape>,
    fixed: Fixed,
    boxes: Vec<Bounds>,
    moving: Moving,
    parallel: Option<Parallel>,
}

impl WorldBuilder {
    /// Nothing so far.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a subsystem; subsystems are numbered from 0 in this order. `states` are those of its bodies at the start; a body with
    /// `is_fixed` never leaves its place ([`fixed_bodies`]).
    ///
    /// # Errors
    /// [`Error::Name`]: the name is taken. [`Error::Count`]: not one state and one flag for each body. [`Error::Shape`]: a shape
    /// with numbers that make none.
    pub fn subsystem(
        &mut self,
        name: &str,
        scene: &Scene,
        states: &[BodyState],
        is_fixed: &[bool],
    ) -> Result<u32> {
        if self.names.iter().any(|n| n == name) {
            return Err(Error::Name(format!("there are two subsystems `{name}`")));
        }
        for (given, what) in [(states.len(), "states"), (is_fixed.len(), "flags")] {
            let bodies = scene.bodies.len();
            if given != bodies {
                return Err(Error::Count { subsystem: name.into(), bodies, given, what });
            }
        }
        for shape in &scene.shapes {
            if let Some(why) = wrong(shape, scene.bodies.len()) {
                return Err(Error::Shape { subsystem: name.into(), shape: shape.name.clone(), why });
            }
        }
        let number = self.names.len() as u32;
        let (first_body, first_shape) = (self.bodies.len(), self.shapes.len());
        self.bodies.extend(states.iter().map(|state| Motion::new(state, state)));
        self.is_fixed.extend_from_slice(is_fixed);
        let mut shapes: Vec<&SceneShape> = scene.shapes.iter().collect();
        shapes.sort_by_key(|s| s.id);
        shapes.into_iter().for_each(|shape| self.add_shape(number, first_body, shape));
        self.names.push(name.to_owned());
        self.members.push(Member {
            scene: scene.clone(),
            bodies: first_body..self.bodies.len(),
            shapes: first_shape..self.shapes.len(),
            ground: None,
            ground_rank: 0,
        });
        Ok(number)
    }

    /// Adds the ground of a subsystem: its field `height`. It is there from the first [`crate::Update::ground`] on.
    ///
    /// # Errors
    /// [`Error::Name`]: there is no such subsystem. [`Error::Lattice`]: the field has no nodes or no positive spacing.
    pub fn ground(&mut self, subsystem: u32, info: &FieldInfo) -> Result {
        let none = || Error::Name(format!("there is no subsystem number {subsystem}"));
        let member = self.members.get_mut(subsystem as usize).ok_or_else(none)?;
        let name = &self.names[subsystem as usize];
        let no_lattice = || Error::Lattice { subsystem: name.clone(), field: info.name.clone() };
        member.ground = Some(Ground::new(info).ok_or_else(no_lattice)?);
        Ok(())
    }

    /// Casts batches of rays on these threads; without them on that of the caller.
    pub fn parallel(&mut self, parallel: Parallel) -> &mut Self {
        self.parallel = Some(parallel);
        self
    }

    /// The world at a time, s, with all bodies at rest.
    pub fn build(self, time: f64) -> WorldModel {
        let mut world = WorldModel {
            interval: [time; 2],
            names: self.names,
            members: self.members,
            bodies: self.bodies,
            movable: (0..).zip(&self.is_fixed).filter(|(_, fixed)| !**fixed).map(|(k, _)| k).collect(),
            is_fixed: self.is_fixed,
            shapes: self.shapes,
            fixed: self.fixed,
            moving: self.moving,
            parallel: self.parallel,
        };
        world.fixed.build(&self.boxes);
        world.rank();
        drop(world.update([time; 2]));
        world
    }

    fn add_shape(&mut self, subsystem: u32, first_body: usize, shape: &SceneShape) {
        let number = self.shapes.len() as u32;
        let of = ShapeRef { subsystem, body: shape.body, shape: shape.id };
        self.shapes.push(Shape { of, material: shape.material, is_visible: true, rank: 0 });
        let body = first_body + shape.body as usize;
        let bounds = Bounds::of_geometry(&shape.geometry);
        let form = Primitive::of(&shape.geometry).map(Form::Primitive);
        let Some(form) = form.or_else(|| Mesh::of(&shape.geometry).map(Arc::new).map(Form::Mesh)) else {
            return;
        };
        let from = &shape.body_from_shape;
        let motion = &self.bodies[body];
        if !self.is_fixed[body] {
            let (position, rotation) = (from.position, Rotation::from_quaternion(from.orientation));
            let bounds = bounds.moved(position, &rotation);
            return self.moving.add(Carried {
                form,
                position,
                rotation,
                bounds,
                body: body as u32,
                shape: number,
            });
        }
        if !motion.is_somewhere {
            return;
        }
        let Pose { position, orientation } = compose(&motion.after.world_from_body, from);
        let rotation = Rotation::from_quaternion(orientation);
        match form {
            Form::Primitive(primitive) => {
                self.boxes.push(bounds.moved(position, &rotation));
                self.fixed.add_solid(Solid { primitive, position, rotation, shape: number });
            }
            Form::Mesh(mesh) => self.fixed.add_mesh(mesh, position, rotation, number),
        }
    }
}

impl WorldModel {
    /// Orders shapes and grounds by the names of their subsystems and their ids.
    fn rank(&mut self) {
        let mut order: Vec<usize> = (0..self.names.len()).collect();
        order.sort_by_key(|k| &self.names[*k]);
        let mut rank = 0;
        for k in order {
            let member = &mut self.members[k];
            for shape in &mut self.shapes[member.shapes.clone()] {
                shape.rank = rank;
                rank += 1;
            }
            member.ground_rank = rank;
            rank += 1;
        }
    }
}

/// Bodies that joints hold to the world for ever: by joints that are fixed and cannot break.
pub fn fixed_bodies(scene: &Scene) -> Vec<bool> {
    let mut is_fixed = vec![false; scene.bodies.len()];
    let held =
        |k: u32, is_fixed: &[bool]| k == u32::MAX || is_fixed.get(k as usize).copied().unwrap_or(false);
    for _ in 0..scene.bodies.len() {
        let before = is_fixed.clone();
        for joint in scene.joints.iter().filter(|j| j.kind == JointKind::Fixed && j.break_action.is_empty()) {
            if held(joint.parent, &is_fixed)
                && let Some(child) = is_fixed.get_mut(joint.child as usize)
            {
                *child = true;
            }
        }
        if before == is_fixed {
            break;
        }
    }
    is_fixed
}

/// Why a shape cannot be seen; none where it can.
fn wrong(shape: &SceneShape, bodies: usize) -> Option<&'static str> {
    let lengths = |all: &[f64]| all.iter().all(|x| (0.0..1e9).contains(x));
    let places = |points: &[[f64; 3]]| points.as_flattened().iter().all(|x| x.abs() < 1e9);
    let known =
        |count: usize, triangles: &[[u32; 3]]| triangles.as_flattened().iter().all(|k| (*k as usize) < count);
    let sound = match &shape.geometry {
        Geometry::Sphere { radius } => lengths(&[*radius]),
        Geometry::Box { half_extents } => lengths(half_extents),
        Geometry::Capsule { half_length, radius } | Geometry::Cylinder { half_length, radius } => {
            lengths(&[*half_length, *radius])
        }
        Geometry::ConeFrustum { half_length, radius_bottom, radius_top } => {
            lengths(&[*half_length, *radius_bottom, *radius_top])
        }
        Geometry::Ellipsoid { semi_axes } => lengths(semi_axes) && semi_axes.iter().all(|x| *x > 0.0),
        Geometry::ConvexMesh { points, triangles } | Geometry::Mesh { points, triangles } => {
            if !known(points.len(), triangles) {
                return Some("a triangle has a corner that is not there");
            }
            places(points)
        }
    };
    match () {
        () if shape.body as usize >= bodies => Some("its body is not there"),
        () if !is_place(&shape.body_from_shape) => Some("its pose is none"),
        () if !sound => Some("its sizes are no lengths from 0 to 1e9 m"),
        () => None,
    }
}
