//! The lattice nodes below a shape, each with the part of its cell that the shape covers.

use crate::Surface;
use crate::excerpt::Excerpt;
use crate::joined::{Part, nodes_below_parts};
use crate::outline::{Cell, Outline, reaches_beside};
use crate::shape::{Aabb, Placed};
use terraglue_subsystem::Node;

/// Heights that are read at once.
const CHUNK: usize = 64;

/// Appends the nodes whose cells the shape covers and whose surface lies less than `margin` (m, vertical) below
/// the shape's underside, and those on the inclined underside next to them, row by row: the soil can reach into their cells, and they
/// show how the underside goes on.
///
/// `area` is the covered part of the cell: exact for spheres, boxes and upright cylinders and capsules, of polygons with 34
/// corners for other cylinders and capsules, of the hull of corners farthest in 32 directions for convex meshes, and from 8 × 8 points for
/// other shapes. `lower` is the exact underside at the node;
/// where the vertical line through the node misses the shape, that of the nearest covered point. A mesh that is not convex:
/// see [`nodes_below_parts`].
pub fn nodes_below<S: Surface + ?Sized>(shape: &Placed, surface: &S, margin: f64, out: &mut Vec<Node>) {
    let lattice = surface.lattice();
    let bounds = shape.aabb();
    if !shape.is_convex() {
        let part = Part { placed: shape, bounds: &bounds };
        return nodes_below_parts(std::iter::once(part), surface, margin, |_, node| out.push(node));
    }
    let i = lattice.cell_range(0, bounds.min[0], bounds.max[0]);
    let j = lattice.cell_range(1, bounds.min[1], bounds.max[1]);
    let below = Footprint { shape, bounds: &bounds, margin, i, j };
    // at the rim each node is asked for its neighbours
    match Excerpt::around(surface, i, j) {
        Some(excerpt) => below.list(&excerpt, out),
        None => below.list(surface, out),
    }
}

/// What [`nodes_below`] looks for: the ranges of the nodes along x and y, ends included.
struct Footprint<'a> {
    shape: &'a Placed,
    bounds: &'a Aabb,
    margin: f64,
    i: (i32, i32),
    j: (i32, i32),
}

impl Footprint<'_> {
    fn list<S: Surface + ?Sized>(&self, surface: &S, out: &mut Vec<Node>) {
        let Self { shape, bounds, margin, i: (i0, i1), j: (j0, j1) } = *self;
        let (lattice, outline) = (surface.lattice(), Outline::of(shape));
        let mut heights = [0.0; CHUNK];
        for j in j0..=j1 {
            for first in (i0..=i1).step_by(CHUNK) {
                let row = &mut heights[..CHUNK.min((i1 - first + 1) as usize)];
                surface.heights(first, j, row);
                for (i, height) in (first..).zip(row) {
                    let reach = *height + margin;
                    if bounds.min[2] >= reach {
                        continue;
                    }
                    let cell = Cell { at: lattice.position(i, j), half: 0.5 * lattice.spacing };
                    let beside = |point| reaches_beside(shape, surface, margin, [i, j], point);
                    if let Some((area, [x, y, lower])) = outline.node(shape, &cell, reach, beside) {
                        let slope = shape.underside_slope([x, y, lower]);
                        out.push(Node { i, j, area, lower, slope });
                    }
                }
            }
        }
    }
}
