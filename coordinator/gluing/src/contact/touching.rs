//! The shapes of a piece that may touch: its patch, nodes and port.

use super::frame::{Patch, extent, mask};
use super::ground::{Cut, Reader};
use super::shape::Shape;
use terraglue_ground::{Aabb, Part, Placed, Surface, bounds_of, nodes_below, nodes_below_parts};
use terraglue_subsystem::{Law, Node, Port, PortKind, component};

/// Some shapes of a piece, at least one.
#[derive(Clone, Copy)]
pub struct Touching<'a> {
    /// All shapes of the subsystem.
    pub shapes: &'a [Shape],
    /// Indices of those meant.
    pub which: &'a [usize],
    /// The largest of them.
    largest: &'a Shape,
    /// Box around them, world.
    pub bounds: Aabb,
}

/// Which shapes of a piece come near the ground; kept from step to step.
#[derive(Default)]
pub struct Found {
    /// Their indices.
    pub near: Vec<usize>,
    /// Which of them have nodes.
    hit: Vec<bool>,
}

impl<'a> Touching<'a> {
    /// None of no shape.
    pub fn of(shapes: &'a [Shape], which: &'a [usize]) -> Option<Self> {
        let each = || which.iter().map(|k| &shapes[*k]);
        let largest = each().reduce(|a, b| if b.size > a.size { b } else { a })?;
        let bounds = bounds_of(each().map(part))?;
        Some(Self { shapes, which, largest, bounds })
    }

    fn each(&self) -> impl Iterator<Item = &'a Shape> + Clone + use<'a> {
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

    /// Half of the width of all along a world direction (unit), m.
    pub fn half_width(&self, direction: [f64; 3]) -> f64 {
        if self.which.len() == 1 {
            return self.main().half_width(direction);
        }
        let far =
            |d: [f64; 3]| self.each().map(|s| dot(s.placed.support(d), d)).fold(f64::NEG_INFINITY, f64::max);
        0.5 * (far(direction) + far(direction.map(|c| -c)))
    }

    /// Whether all of it is one sphere.
    pub fn is_sphere(&self) -> bool {
        self.mask() == component::FORCE
    }

    /// Components that the contact carries.
    pub fn mask(&self) -> u32 {
        self.single().map_or(component::WRENCH, |s| mask(s.placed.geometry()))
    }

    /// The port without key and node range, whose nodes are appended; `None` when it cannot touch.
    pub fn port(&self, reader: &Reader, reach: f64, hit: &mut [bool], nodes: &mut Vec<Node>) -> Option<Port> {
        let patch = Patch::find(self, &reader.undisturbed(), reader);
        let vertical = patch.vertical(reach);
        let first = nodes.len();
        match self.single() {
            Some(shape) => nodes_below(&shape.placed, &Cut(reader), vertical, nodes),
            None => nodes_below_parts(self.each().map(part), &Cut(reader), vertical, |k, node| {
                hit[k] = true;
                nodes.push(node);
            }),
        }
        if nodes.len() == first && patch.origin[2] < patch.ground + vertical {
            nodes.extend(self.node_between(reader, &patch));
        }
        if nodes.len() == first {
            return None;
        }
        let frame = patch.frame();
        Some(Port {
            key: 0,
            kind: PortKind::Contact as u32,
            side: 1,
            mask: self.mask(),
            first: 0,
            body: self.largest.body,
            shape: self.largest.id,
            first_node: 0,
            node_count: 0,
            origin: patch.origin,
            frame,
            extent: extent(self, &Cut(reader), vertical, &patch, &frame, &nodes[first..]),
            law: Law::UNILATERAL,
        })
    }

    /// A shape smaller than a cell can slip between the nodes: then the nearest one carries it.
    fn node_between(&self, reader: &Reader, patch: &Patch) -> Option<Node> {
        let lattice = reader.lattice();
        let bounds = &self.bounds;
        let (width, depth) = (bounds.max[0] - bounds.min[0], bounds.max[1] - bounds.min[1]);
        let small = width < 2.0 * lattice.spacing && depth < 2.0 * lattice.spacing;
        let [i, j] = lattice.coordinates(patch.origin[0], patch.origin[1]).map(|c| c.round() as i32);
        let area = (width * depth).min(lattice.spacing * lattice.spacing);
        (small && lattice.has(i, j)).then_some(Node {
            i,
            j,
            area,
            lower: patch.origin[2],
            slope: self.main().underside_slope(patch.origin),
        })
    }
}

impl Found {
    /// For pieces of up to so many shapes.
    pub fn with_capacity(shapes: usize) -> Self {
        Self { near: Vec::with_capacity(shapes), hit: Vec::with_capacity(shapes) }
    }

    /// The port of the shapes that come near: of those that have nodes, the others do not count.
    pub fn port(
        &mut self,
        shapes: &[Shape],
        reader: &Reader,
        reach: f64,
        nodes: &mut Vec<Node>,
    ) -> Option<Port> {
        self.hit.clear();
        self.hit.resize(self.near.len(), false);
        let first = nodes.len();
        let port = Touching::of(shapes, &self.near)?.port(reader, reach, &mut self.hit, nodes)?;
        let count = self.hit.iter().filter(|h| **h).count();
        if count == 0 || count == self.near.len() {
            return Some(port);
        }
        let mut hit = self.hit.iter();
        self.near.retain(|_| hit.next().copied().unwrap_or(false));
        nodes.truncate(first);
        Touching::of(shapes, &self.near)?.port(reader, reach, &mut self.hit, nodes)
    }
}

fn part(shape: &Shape) -> Part<'_> {
    Part { placed: &shape.placed, bounds: &shape.bounds }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
