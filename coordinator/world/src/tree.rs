//! A tree of boxes around shapes, four to a node, that finds the few shapes near a ray.
//!
//! Single precision: boxes are rounded outwards and grown by more than all rounding on the way, so a shape that is hit is never
//! passed by; what is hit, and where, is computed in double precision by the caller. The binary tree comes from obvhs. Its own
//! wide nodes are compressed for graphics processors; taking the bytes apart costs more here than reading four boxes as they are
//! (`docs/performance.md`).

use crate::bounds::Bounds;
use glam::{Vec3A, Vec4};
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, leaf_collapser::collapse, reinsertion::ReinsertionOptimizer};
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

/// Boxes grow by this share of the size of the whole: four times what single precision can lose on the way.
const ROUNDING: f64 = 1e-6;
/// Boxes grow by at least this, m.
const LEAST_MARGIN: f64 = 1e-6;
/// A component of a direction below this counts as this.
const LEAST_COMPONENT: f32 = 1e-20;
/// Shapes in a leaf at most, where there is time to build well.
const LEAF: u32 = 8;

/// A half line in double precision.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    pub origin: [f64; 3],
    pub direction: [f64; 3],
}

impl Line {
    pub fn at(&self, t: f64) -> [f64; 3] {
        std::array::from_fn(|k| self.origin[k] + t * self.direction[k])
    }
}

/// Four boxes and what is in them.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Node {
    low: [Vec4; 3],
    high: [Vec4; 3],
    /// First place in the order of shapes, or number of a node.
    first: [u32; 4],
    /// Shapes; 0: a node.
    count: [u32; 4],
}

impl Node {
    const EMPTY: Self =
        Self { low: [Vec4::INFINITY; 3], high: [Vec4::NEG_INFINITY; 3], first: [0; 4], count: [0; 4] };
}

/// A box that waits: what is in it, and where the ray enters it.
#[derive(Clone, Copy, Debug, Default)]
struct Waiting {
    first: u32,
    count: u32,
    near: f32,
}

/// Room for the boxes that wait, used again by every ray.
#[derive(Debug, Default)]
pub(crate) struct Stack(Vec<Waiting>);

/// What a tree is built with, used again by every building.
pub(crate) struct Workshop {
    builder: PlocBuilder,
    binary: Bvh2,
    boxes: Vec<Aabb>,
    open: Vec<(u32, u32, u32)>,
}

impl Default for Workshop {
    fn default() -> Self {
        Self { builder: PlocBuilder::new(), binary: Bvh2::default(), boxes: Vec::new(), open: Vec::new() }
    }
}

/// How much time a building may take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Care {
    /// Once.
    Static,
    /// In every step.
    Moving,
}

/// The boxes of a list of shapes.
#[derive(Debug)]
pub(crate) struct Tree {
    nodes: Vec<Node>,
    /// Shapes, leaf by leaf.
    order: Vec<u32>,
    centre: [f64; 3],
    bounds: Bounds,
    /// Boxes that can wait at once.
    depth: usize,
}

impl Default for Tree {
    fn default() -> Self {
        Self { nodes: Vec::new(), order: Vec::new(), centre: [0.0; 3], bounds: Bounds::EMPTY, depth: 0 }
    }
}

impl Tree {
    /// A tree of shapes with these boxes, whose numbers are their places.
    pub fn of(boxes: &[Bounds], care: Care) -> Self {
        let mut tree = Self::default();
        tree.build(boxes, care, &mut Workshop::default());
        tree
    }

    /// Builds anew. Empty boxes belong to shapes that are nowhere.
    pub fn build(&mut self, boxes: &[Bounds], care: Care, workshop: &mut Workshop) {
        self.nodes.clear();
        let mut indices = std::mem::take(&mut workshop.binary.primitive_indices);
        indices.clear();
        indices.extend((0..boxes.len() as u32).filter(|k| !boxes[*k as usize].is_empty()));
        let whole = boxes.iter().fold(Bounds::EMPTY, |all, b| all.joined(b));
        if indices.is_empty() {
            (self.bounds, workshop.binary.primitive_indices) = (Bounds::EMPTY, indices);
            return self.order.clear();
        }
        let margin = (ROUNDING * whole.diagonal()).max(LEAST_MARGIN);
        (self.centre, self.bounds) = (whole.centre(), whole.grown(2.0 * margin));
        let local = |p: [f64; 3], by: f64| {
            Vec3A::from_array(std::array::from_fn(|k| (p[k] - self.centre[k] + by) as f32))
        };
        workshop.boxes.clear();
        workshop.boxes.extend(
            indices
                .iter()
                .map(|k| &boxes[*k as usize])
                .map(|b| Aabb { min: local(b.low, -margin), max: local(b.high, margin) }),
        );
        self.order.clone_from(&indices);
        // what obvhs orders are places in the list of shapes that are somewhere
        indices.iter_mut().enumerate().for_each(|(place, k)| *k = place as u32);
        workshop.join(indices, care);
        let present = std::mem::take(&mut self.order);
        self.order.extend(workshop.binary.primitive_indices.iter().map(|place| present[*place as usize]));
        self.widen(workshop);
    }

    /// Takes the binary tree into nodes of four.
    fn widen(&mut self, workshop: &mut Workshop) {
        let binary = &workshop.binary;
        let open = &mut workshop.open;
        open.clear();
        self.nodes.push(Node::EMPTY);
        open.push((0, 0, 1));
        self.depth = 1;
        while let Some((root, place, depth)) = open.pop() {
            self.depth = self.depth.max(depth as usize);
            let (children, count) = four(binary, root);
            for (slot, child) in children[..count].iter().enumerate() {
                let node = &binary.nodes[*child as usize];
                let (low, high) = (node.aabb().min, node.aabb().max);
                let next = self.nodes.len() as u32;
                let wide = &mut self.nodes[place as usize];
                for k in 0..3 {
                    (wide.low[k][slot], wide.high[k][slot]) = (low[k], high[k]);
                }
                if node.is_leaf() {
                    (wide.first[slot], wide.count[slot]) = (node.first_index, node.prim_count);
                } else {
                    wide.first[slot] = next;
                    self.nodes.push(Node::EMPTY);
                    open.push((*child, next, depth + 1));
                }
            }
        }
    }

    /// Gives shapes other numbers, leaf by leaf: what is near each other in space gets numbers one after the other.
    pub fn renumber(&mut self, mut new: impl FnMut(u32) -> u32) {
        self.order.iter_mut().for_each(|k| *k = new(*k));
    }

    /// Calls `visit` with shapes near a line, roughly from near to far, as long as their boxes begin before the distance that
    /// it answers: that of the nearest hit so far. `best` is that at the start.
    #[inline]
    pub fn cast(&self, line: &Line, mut best: f64, stack: &mut Stack, mut visit: impl FnMut(u32) -> f64) {
        let Some([start, end]) = self.bounds.clip(line.origin, line.direction) else { return };
        if start > best || self.nodes.is_empty() {
            return;
        }
        best = best.min(end);
        let entry = line.at(start);
        let origin: [f32; 3] = std::array::from_fn(|k| (entry[k] - self.centre[k]) as f32);
        let inverse = line.direction.map(|d| {
            let d = d as f32;
            if d.abs() < LEAST_COMPONENT { f32::copysign(1.0 / LEAST_COMPONENT, d) } else { 1.0 / d }
        });
        let back = inverse.map(|i| i < 0.0);
        let (origin, inverse) = (origin.map(Vec4::splat), inverse.map(Vec4::splat));
        let farthest = |best: f64| ((best - start) as f32).next_up();
        let mut far = farthest(best);
        let need = 3 * self.depth + 4;
        if stack.0.len() < need {
            stack.0.resize(need, Waiting::default());
        }
        let waiting = &mut stack.0[..];
        let mut top = 1;
        waiting[0] = Waiting::default();
        while top > 0 {
            top -= 1;
            let Waiting { first, count, near } = waiting[top];
            if near > far {
                continue;
            }
            if count > 0 {
                for k in &self.order[first as usize..(first + count) as usize] {
                    best = best.min(visit(*k));
                }
                far = farthest(best);
                continue;
            }
            let node = &self.nodes[first as usize];
            let (mut near, mut end) = (Vec4::ZERO, Vec4::splat(far));
            for k in 0..3 {
                let (a, b) = if back[k] { (node.high[k], node.low[k]) } else { (node.low[k], node.high[k]) };
                near = near.max((a - origin[k]) * inverse[k]);
                end = end.min((b - origin[k]) * inverse[k]);
            }
            let mut met = near.cmple(end).bitmask();
            let (near, base) = (near.to_array(), top);
            while met != 0 {
                let slot = met.trailing_zeros() as usize & 3;
                met &= met - 1;
                let new = Waiting { first: node.first[slot], count: node.count[slot], near: near[slot] };
                let mut place = top;
                while place > base && waiting[place - 1].near < new.near {
                    waiting[place] = waiting[place - 1];
                    place -= 1;
                }
                waiting[place] = new;
                top += 1;
            }
        }
    }

    /// Calls `visit` with the shapes whose boxes come as near to a point as `radius` (m).
    pub fn near(&self, point: [f64; 3], radius: f64, visit: &mut dyn FnMut(u32)) {
        if self.nodes.is_empty() || self.bounds.distance_squared(point) > radius * radius {
            return;
        }
        let local: [f32; 3] = std::array::from_fn(|k| (point[k] - self.centre[k]) as f32);
        let reach = (radius as f32).next_up();
        let mut open = vec![0_u32];
        while let Some(place) = open.pop() {
            let node = &self.nodes[place as usize];
            for slot in 0..4 {
                let beside =
                    |k: usize| (node.low[k][slot] - local[k]).max(local[k] - node.high[k][slot]).max(0.0);
                if (0..3).any(|k| beside(k) > reach) {
                    continue;
                }
                match node.count[slot] {
                    0 => open.push(node.first[slot]),
                    count => {
                        let first = node.first[slot] as usize;
                        self.order[first..first + count as usize].iter().for_each(|k| visit(*k));
                    }
                }
            }
        }
    }
}

impl Workshop {
    /// The binary tree over the boxes.
    fn join(&mut self, indices: Vec<u32>, care: Care) {
        let distance = match care {
            Care::Static => PlocSearchDistance::Medium,
            Care::Moving => PlocSearchDistance::Minimum,
        };
        self.builder.build_with_bvh(&mut self.binary, distance, &self.boxes, indices, SortPrecision::U64, 0);
        if care == Care::Static {
            ReinsertionOptimizer::default().run(&mut self.binary, 0.15, None);
            collapse(&mut self.binary, LEAF, 1.0);
        }
    }
}

/// Up to four nodes below a node of a binary tree that together hold all that it holds: the largest are opened first.
fn four(binary: &Bvh2, root: u32) -> ([u32; 4], usize) {
    let (mut children, mut count) = ([root; 4], 1);
    while count < 4 {
        let area = |k: &u32| binary.nodes[*k as usize].aabb().half_area();
        let inner = (0..count).filter(|slot| !binary.nodes[children[*slot] as usize].is_leaf());
        let Some(largest) = inner.max_by(|a, b| area(&children[*a]).total_cmp(&area(&children[*b]))) else {
            break;
        };
        let first = binary.nodes[children[largest] as usize].first_index;
        (children[largest], children[count]) = (first, first + 1);
        count += 1;
    }
    (children, count)
}

impl std::fmt::Debug for Workshop {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str("Workshop")
    }
}
