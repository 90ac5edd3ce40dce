//! The port of the shapes of a piece that touch: its patch and its nodes.

use super::frame::{Patch, extent};
use super::ground::{Cut, Reader};
use super::shape::Shape;
use super::touching::{Touching, part};
use terraglue_ground::{Surface, nodes_below, nodes_below_parts};
use terraglue_subsystem::{Law, Node, Port, PortKind, component};

/// Which shapes of a piece come near the ground; kept from step to step.
#[derive(Default)]
pub struct Found {
    /// Their indices.
    pub near: Vec<usize>,
    /// Which of them have nodes.
    hit: Vec<bool>,
}

impl Found {
    /// For pieces of up to so many shapes.
    pub fn with_capacity(shapes: usize) -> Self {
        Self { near: Vec::with_capacity(shapes), hit: Vec::with_capacity(shapes) }
    }

    /// The port of the shapes that come near: of those that have nodes, the others do not count. `reach`: how far any of them can get, and
    /// [`Touching::relief`] of their piece, m.
    pub fn port(
        &mut self,
        shapes: &[Shape],
        reader: &Reader,
        reach: [f64; 2],
        nodes: &mut Vec<Node>,
    ) -> Option<Port> {
        self.hit.clear();
        self.hit.resize(self.near.len(), false);
        let first = nodes.len();
        let port = port_of(&Touching::of(shapes, &self.near)?, reader, reach, &mut self.hit, nodes)?;
        let count = self.hit.iter().filter(|h| **h).count();
        if count == 0 || count == self.near.len() {
            return Some(port);
        }
        let mut hit = self.hit.iter();
        self.near.retain(|_| hit.next().copied().unwrap_or(false));
        nodes.truncate(first);
        port_of(&Touching::of(shapes, &self.near)?, reader, reach, &mut self.hit, nodes)
    }
}

/// The port without key and node range, whose nodes are appended; `None` when it cannot touch.
fn port_of(
    touching: &Touching,
    reader: &Reader,
    [reach, relief]: [f64; 2],
    hit: &mut [bool],
    nodes: &mut Vec<Node>,
) -> Option<Port> {
    let patch = Patch::find(touching, &reader.undisturbed(), reader);
    let vertical = patch.vertical(reach);
    let (first, below) = (nodes.len(), vertical + relief);
    match touching.single() {
        Some(shape) => nodes_below(&shape.placed, &Cut(reader), below, nodes),
        None => nodes_below_parts(touching.each().map(part), &Cut(reader), below, |k, node| {
            hit[k] = true;
            nodes.push(node);
        }),
    }
    if nodes.len() == first && patch.origin[2] < patch.ground + vertical {
        nodes.extend(node_between(touching, reader, &patch));
    }
    if nodes.len() == first {
        return None;
    }
    let frame = patch.frame();
    Some(Port {
        key: 0,
        kind: PortKind::Contact as u32,
        side: 1,
        mask: component::WRENCH,
        first: 0,
        body: touching.largest.body,
        shape: touching.largest.id,
        first_node: 0,
        node_count: 0,
        origin: patch.origin,
        frame,
        extent: extent(touching, &Cut(reader), vertical, &patch, &frame, &nodes[first..]),
        law: Law::UNILATERAL,
    })
}

/// A shape smaller than a cell can slip between the nodes: then the nearest one carries it.
fn node_between(touching: &Touching, reader: &Reader, patch: &Patch) -> Option<Node> {
    let lattice = reader.lattice();
    let bounds = &touching.bounds;
    let (width, depth) = (bounds.max[0] - bounds.min[0], bounds.max[1] - bounds.min[1]);
    let small = width < 2.0 * lattice.spacing && depth < 2.0 * lattice.spacing;
    let [i, j] = lattice.coordinates(patch.origin[0], patch.origin[1]).map(|c| c.round() as i32);
    let area = (width * depth).min(lattice.spacing * lattice.spacing);
    (small && lattice.has(i, j)).then_some(Node {
        i,
        j,
        area,
        lower: patch.origin[2],
        slope: touching.main().underside_slope(patch.origin),
    })
}
