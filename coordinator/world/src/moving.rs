//! Shapes of bodies that move: a small tree over the boxes that they sweep within a step, built anew in every step.

use crate::bounds::Bounds;
use crate::fixed::to_local;
use crate::mesh::Mesh;
use crate::motion::Motion;
use crate::primitive::Primitive;
use crate::tree::{Care, Line, Stack, Tree, Workshop};
use std::sync::Arc;
use terraglue_ground::Rotation;

/// Geometry of a shape.
#[derive(Clone, Debug)]
pub(crate) enum Form {
    Primitive(Primitive),
    Mesh(Arc<Mesh>),
}

/// A shape on a body that moves.
#[derive(Clone, Debug)]
pub(crate) struct Carried {
    pub form: Form,
    pub position: [f64; 3],
    pub rotation: Rotation,
    /// Box in the body.
    pub bounds: Bounds,
    /// Index of the body, and of the shape, among all of the world.
    pub body: u32,
    pub shape: u32,
}

impl Carried {
    /// A line of the world in the frame of the shape.
    #[inline(always)]
    fn local(&self, line: &Line, motion: &Motion, share: f64) -> Line {
        let (position, rotation) = motion.at(share);
        to_local(&to_local(line, position, &rotation), self.position, &self.rotation)
    }
}

/// All of them.
#[derive(Debug, Default)]
pub(crate) struct Moving {
    tree: Tree,
    shapes: Vec<Carried>,
    boxes: Vec<Bounds>,
    workshop: Workshop,
}

impl Moving {
    pub fn add(&mut self, shape: Carried) {
        self.shapes.push(shape);
    }

    /// Builds the tree for a step; what is nowhere is left out.
    pub fn build(&mut self, bodies: &[Motion]) {
        self.boxes.clear();
        self.boxes.extend(self.shapes.iter().map(|shape| {
            let motion = &bodies[shape.body as usize];
            if motion.is_somewhere { motion.swept(&shape.bounds) } else { Bounds::EMPTY }
        }));
        self.tree.build(&self.boxes, Care::Moving, &mut self.workshop);
    }

    /// Offers intersections of a line at a share of the step: distance, number of the shape here, number of the triangle.
    /// Shapes in boxes farther away than the last answer of `offer` are skipped.
    #[inline(always)]
    pub fn cast(
        &self,
        (line, share): (&Line, f64),
        bodies: &[Motion],
        best: f64,
        [stack, inner]: &mut [Stack; 2],
        mut offer: impl FnMut(f64, [u32; 2]) -> f64,
    ) {
        let mut best = best;
        self.tree.cast(line, best, stack, |k| {
            let shape = &self.shapes[k as usize];
            let local = shape.local(line, &bodies[shape.body as usize], share);
            best = match &shape.form {
                Form::Primitive(primitive) => offer(primitive.cast(&local), [k, 0]),
                Form::Mesh(mesh) => match mesh.cast(&local, best, inner) {
                    Some((t, number)) => offer(t, [k, number]),
                    None => best,
                },
            };
            best
        });
    }

    /// Shape number k.
    #[inline(always)]
    pub fn shape(&self, k: u32) -> &Carried {
        &self.shapes[k as usize]
    }

    /// Outward direction of what was met, of any length.
    pub fn outward(
        &self,
        [k, number]: [u32; 2],
        (line, share): (&Line, f64),
        bodies: &[Motion],
        t: f64,
    ) -> [f64; 3] {
        let shape = self.shape(k);
        let motion = &bodies[shape.body as usize];
        let outward = match &shape.form {
            Form::Primitive(primitive) => primitive.outward(shape.local(line, motion, share).at(t)),
            Form::Mesh(mesh) => mesh.normal(number),
        };
        motion.at(share).1.to_world(shape.rotation.to_world(outward))
    }

    /// Calls `found` with the shapes that a sphere touches at the end of the step.
    pub fn overlap(&self, centre: [f64; 3], radius: f64, bodies: &[Motion], found: &mut dyn FnMut(u32)) {
        self.tree.near(centre, radius, &mut |k| {
            let shape = self.shape(k);
            // a line without a direction is its start
            let start = Line { origin: centre, direction: [0.0; 3] };
            let p = shape.local(&start, &bodies[shape.body as usize], 1.0).origin;
            let touched = match &shape.form {
                Form::Primitive(primitive) => primitive.distance(p) <= radius,
                Form::Mesh(mesh) => mesh.is_touched(p, radius),
            };
            if touched {
                found(shape.shape);
            }
        });
    }
}
