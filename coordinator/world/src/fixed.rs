//! Shapes of bodies that never move: one tree over all of them, built once, with meshes as single triangles of the world.

use crate::bounds::Bounds;
use crate::mesh::Mesh;
use crate::primitive::Primitive;
use crate::tree::{Care, Line, Stack, Tree};
use crate::triangle::{Sheared, distance_squared, normal};
use std::sync::Arc;
use terraglue_ground::Rotation;

/// Marks the number of a triangle in the order of the tree.
const FACET: u32 = 1 << 31;

/// A shape with a closed form at its place.
#[derive(Clone, Debug)]
pub(crate) struct Solid {
    pub primitive: Primitive,
    pub position: [f64; 3],
    pub rotation: Rotation,
    /// Index of the shape among all of the world.
    pub shape: u32,
}

impl Solid {
    /// A line of the world in the frame of the shape.
    #[inline(always)]
    pub fn local(&self, line: &Line) -> Line {
        to_local(line, self.position, &self.rotation)
    }
}

/// A line of the world in a frame.
#[inline]
pub(crate) fn to_local(line: &Line, position: [f64; 3], rotation: &Rotation) -> Line {
    let from = std::array::from_fn(|k| line.origin[k] - position[k]);
    Line { origin: rotation.to_shape(from), direction: rotation.to_shape(line.direction) }
}

/// A triangle of the world.
#[derive(Clone, Debug)]
pub(crate) struct Facet {
    pub corners: [[f64; 3]; 3],
    /// Index of the shape among all of the world.
    pub shape: u32,
    /// Number in its mesh.
    pub number: u32,
}

/// A convex mesh, for what lies inside.
#[derive(Debug)]
struct Hull {
    mesh: Arc<Mesh>,
    position: [f64; 3],
    rotation: Rotation,
    shape: u32,
}

/// All of them.
#[derive(Debug, Default)]
pub(crate) struct Fixed {
    tree: Tree,
    solids: Vec<Solid>,
    facets: Vec<Facet>,
    hulls: Vec<Hull>,
}

impl Fixed {
    pub fn add_solid(&mut self, solid: Solid) {
        self.solids.push(solid);
    }

    /// A mesh at its place.
    pub fn add_mesh(&mut self, mesh: Arc<Mesh>, position: [f64; 3], rotation: Rotation, shape: u32) {
        let world = |p: [f64; 3]| {
            let turned = rotation.to_world(p);
            std::array::from_fn(|k| position[k] + turned[k])
        };
        let facets = mesh.corners().iter().zip(0..);
        self.facets.extend(facets.map(|(c, number)| Facet { corners: c.map(world), shape, number }));
        if mesh.is_convex() {
            self.hulls.push(Hull { mesh, position, rotation, shape });
        }
    }

    /// Builds the tree, and puts shapes in its order.
    pub fn build(&mut self, boxes_of_solids: &[Bounds]) {
        let of_facets = self.facets.iter().map(|f| Bounds::of_points(&f.corners));
        let boxes: Vec<_> = boxes_of_solids.iter().copied().chain(of_facets).collect();
        self.tree = Tree::of(&boxes, Care::Static);
        let (solids, facets) = (std::mem::take(&mut self.solids), std::mem::take(&mut self.facets));
        self.tree.renumber(|k| match facets.get((k as usize).wrapping_sub(solids.len())) {
            Some(facet) => {
                self.facets.push(facet.clone());
                FACET | (self.facets.len() - 1) as u32
            }
            None => {
                self.solids.push(solids[k as usize].clone());
                (self.solids.len() - 1) as u32
            }
        });
    }

    /// Offers intersections of a line; shapes in boxes farther away than the last answer of `offer` are skipped.
    #[inline(always)]
    pub fn cast(&self, line: &Line, best: f64, stack: &mut Stack, mut offer: impl FnMut(f64, Met) -> f64) {
        let sheared = Sheared::new(line);
        self.tree.cast(line, best, stack, |k| {
            if k & FACET != 0 {
                let number = k & !FACET;
                let t = sheared.cast(&self.facets[number as usize].corners);
                return offer(t, Met::Facet(number));
            }
            let solid = &self.solids[k as usize];
            offer(solid.primitive.cast(&solid.local(line)), Met::Solid(k))
        });
    }

    /// Shape and number of the triangle of what was met.
    #[inline(always)]
    pub fn what(&self, met: Met) -> (u32, u32) {
        match met {
            Met::Facet(k) => (self.facets[k as usize].shape, self.facets[k as usize].number),
            Met::Solid(k) => (self.solids[k as usize].shape, 0),
        }
    }

    /// Outward direction of what was met, of any length.
    pub fn outward(&self, met: Met, line: &Line, t: f64) -> [f64; 3] {
        match met {
            Met::Facet(k) => normal(&self.facets[k as usize].corners),
            Met::Solid(k) => {
                let solid = &self.solids[k as usize];
                solid.rotation.to_world(solid.primitive.outward(solid.local(line).at(t)))
            }
        }
    }

    /// Calls `found` with the shapes that a sphere touches, some more than once.
    pub fn overlap(&self, centre: [f64; 3], radius: f64, found: &mut dyn FnMut(u32)) {
        let local = |position: [f64; 3], rotation: &Rotation| {
            rotation.to_shape(std::array::from_fn(|k| centre[k] - position[k]))
        };
        self.tree.near(centre, radius, &mut |k| {
            if k & FACET != 0 {
                let facet = &self.facets[(k & !FACET) as usize];
                if distance_squared(&facet.corners, centre) <= radius * radius {
                    found(facet.shape);
                }
                return;
            }
            let solid = &self.solids[k as usize];
            if solid.primitive.distance(local(solid.position, &solid.rotation)) <= radius {
                found(solid.shape);
            }
        });
        let inside = |hull: &&Hull| hull.mesh.contains(local(hull.position, &hull.rotation));
        self.hulls.iter().filter(inside).for_each(|hull| found(hull.shape));
    }
}

/// Something fixed that a line meets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Met {
    Facet(u32),
    Solid(u32),
}
