//! The triangles of a mesh in its own frame, with a tree of their own: what a mesh that moves is asked for.

use crate::bounds::Bounds;
use crate::tree::{Care, Line, Stack, Tree};
use crate::triangle::{Sheared, distance_squared, normal};
use terraglue_ground::Placed;
use terraglue_numerics::rotation::{dot, minus};
use terraglue_subsystem::{Geometry, Pose};

/// A mesh.
#[derive(Debug)]
pub(crate) struct Mesh {
    corners: Vec<[[f64; 3]; 3]>,
    tree: Tree,
    /// Whether it has an inside: the triangles are the faces of a convex body.
    is_convex: bool,
}

impl Mesh {
    /// Of a geometry whose indices were checked; none: it has a closed form.
    pub fn of(geometry: &Geometry) -> Option<Self> {
        let (Geometry::Mesh { points, triangles } | Geometry::ConvexMesh { points, triangles }) = geometry
        else {
            return None;
        };
        let corner = |k: &u32| points[*k as usize];
        let corners: Vec<_> = triangles.iter().map(|[a, b, c]| [corner(a), corner(b), corner(c)]).collect();
        let boxes: Vec<_> = corners.iter().map(|c| Bounds::of_points(c)).collect();
        let is_convex = matches!(geometry, Geometry::ConvexMesh { .. })
            && Placed::new(geometry, &Pose::IDENTITY).is_convex();
        Some(Self { tree: Tree::of(&boxes, Care::Static), corners, is_convex })
    }

    /// Triangles, in their order.
    pub fn corners(&self) -> &[[[f64; 3]; 3]] {
        &self.corners
    }

    pub fn is_convex(&self) -> bool {
        self.is_convex
    }

    /// Distance along a line and the number of the triangle that is met first, not behind `best`; of two the one with the lower number.
    pub fn cast(&self, line: &Line, best: f64, stack: &mut Stack) -> Option<(f64, u32)> {
        let sheared = Sheared::new(line);
        let mut first = (best, u32::MAX);
        self.tree.cast(line, best, stack, |k| {
            let t = sheared.cast(&self.corners[k as usize]);
            if t < f64::INFINITY && (t, k) < first {
                first = (t, k);
            }
            first.0
        });
        (first.1 != u32::MAX).then_some(first)
    }

    /// Normal of a triangle, of any length.
    pub fn normal(&self, number: u32) -> [f64; 3] {
        normal(&self.corners[number as usize])
    }

    /// Whether a point lies inside; a mesh that is not convex has no inside.
    pub fn contains(&self, p: [f64; 3]) -> bool {
        self.is_convex && self.corners.iter().all(|c| dot(minus(p, c[0]), normal(c)) <= 0.0)
    }

    /// Whether a sphere touches or lies inside it.
    pub fn is_touched(&self, centre: [f64; 3], radius: f64) -> bool {
        let mut touched = self.contains(centre);
        self.tree.near(centre, radius, &mut |k| {
            touched |= distance_squared(&self.corners[k as usize], centre) <= radius * radius;
        });
        touched
    }
}
