//! The shapes of a piece that may touch, as one: their extent and what a contact of them carries.

use super::shape::Shape;
use terraglue_ground::{Aabb, Part, Placed, bounds_of};
use terraglue_numerics::rotation::{dot, minus};
use terraglue_subsystem::Geometry;

/// Of the radius of a mesh with dents, how far soil between its lugs may stand out of it.
const LUGS: f64 = 0.1;
/// Vertical over radial distance at a rim that meets the soil at 80°.
const STEEP_RIM: f64 = 6.0;

/// Some shapes of a piece, at least one.
#[derive(Clone, Copy)]
pub struct Touching<'a> {
    /// All shapes of the subsystem.
    pub shapes: &'a [Shape],
    /// Indices of those meant.
    pub which: &'a [usize],
    /// The largest of them.
    pub largest: &'a Shape,
    /// Box around them, world.
    pub bounds: Aabb,
}

impl<'a> Touching<'a> {
    /// None of no shape.
    pub fn of(shapes: &'a [Shape], which: &'a [usize]) -> Option<Self> {
        let each = || which.iter().map(|k| &shapes[*k]);
        let largest = each().reduce(|a, b| if b.size > a.size { b } else { a })?;
        let bounds = bounds_of(each().map(part))?;
        Some(Self { shapes, which, largest, bounds })
    }

    /// Each of them.
    pub fn each(&self) -> impl Iterator<Item = &'a Shape> + Clone + use<'a> {
        let shapes = self.shapes;
        self.which.iter().map(move |k| &shapes[*k])
    }

    /// The shape, where it is one.
    pub fn single(&self) -> Option<&'a Shape> {
        (self.which.len() == 1).then_some(self.largest)
    }

    /// The shape whose form says how the patch turns and is drawn.
    pub fn main(&self) -> &'a Placed {
        &self.largest.placed
    }

    /// Reference point of the contact with ground of the given unit normal: that of the largest shape. The level of what
    /// sticks out of it, such as grousers, would jump as one after the other passes below.
    pub fn patch_origin(&self, normal: [f64; 3]) -> [f64; 3] {
        self.main().patch_origin(normal)
    }

    /// Vertical distance by which soil that is caught between grousers may lie below the underside, m: of a cylinder with other shapes how
    /// far these stand out of it, of a mesh with dents a part of its size; 0 for all others.
    pub fn relief(&self) -> f64 {
        let main = self.main();
        let stands_out = match main.geometry() {
            _ if !main.is_convex() => LUGS * self.largest.size,
            Geometry::Cylinder { radius, .. } => self.each().fold(0.0, |most: f64, shape| {
                let axis = main.rotation().0[2];
                let out = across(axis, minus(shape.placed.pose().position, main.pose().position));
                let size = dot(out, out).sqrt();
                let direction = out.map(|c| c / size);
                let far = dot(minus(shape.placed.support(direction), main.pose().position), direction);
                if size > 0.0 { most.max(far - radius) } else { most }
            }),
            _ => 0.0,
        };
        STEEP_RIM * stands_out
    }

    /// Half of the width of all along a world direction (unit), m.
    pub fn half_width(&self, direction: [f64; 3]) -> f64 {
        if self.which.len() == 1 {
            return self.main().half_width(direction);
        }
        let far =
            |d: [f64; 3]| self.each().map(|s| dot(s.placed.support(d), d)).fold(f64::NEG_INFINITY, f64::max);
        0.5 * (far(direction) + far(direction.map(|c| -c)))
    }
}

/// A shape as the ground sees it.
pub fn part(shape: &Shape) -> Part<'_> {
    Part { placed: &shape.placed, bounds: &shape.bounds }
}

/// Part of a vector across a unit vector.
fn across(axis: [f64; 3], v: [f64; 3]) -> [f64; 3] {
    let along = dot(axis, v);
    [0, 1, 2].map(|k| v[k] - along * axis[k])
}
