//! A tree of boxes around shapes, eight to a node, that finds the few shapes near a ray.
//!
//! Single precision: boxes are rounded outwards and grown by more than all rounding on the way, so a shape that is hit is never
//! passed by; what is hit, and where, is computed in double precision by the caller. The binary tree comes from obvhs. Its own
//! wide nodes are compressed for graphics processors; taking the bytes apart costs more here than reading boxes as they are
//! (`docs/decisions/0026-rays-through-boxes-of-our-own.md`).

use crate::bounds::Bounds;
use glam::{Vec3A, Vec4};
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, leaf_collapser::collapse, reinsertion::ReinsertionOptimizer};
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

/// Boxes grow by this share of the size of the whole: four times what single precision can lose on the way.
const ROUNDING: f64 = 1e-6;
/// Boxes grow by at least this, m.
const LEAST_MARGIN: f64 = 1e-6;
/// 1/component of a direction at most.
pub(crate) const STEEPEST: f64 = 1e20;
/// Scatters numbers: 2³² over the golden ratio.
const SCATTER: u32 = 0x9e37_79b9;
/// Shapes in a leaf at most, where there is time to build well.
const LARGEST_LEAF: u32 = 8;

/// A half line in double precision.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    pub origin: [f64; 3],
    pub direction: [f64; 3],
}

impl Line {
    /// 1/direction, finite.
    #[inline(always)]
    pub fn inverse(&self) -> [f64; 3] {
        let [x, y, z] = self.direction;
        let one = |d: f64| if d.abs() < 1e-300 { 1e300_f64.copysign(d) } else { 1.0 / d };
        [one(x), one(y), one(z)]
    }

    #[inline(always)]
    pub fn at(&self, t: f64) -> [f64; 3] {
        let (o, d) = (self.origin, self.direction);
        [o[0] + t * d[0], o[1] + t * d[1], o[2] + t * d[2]]
    }
}

/// Marks the shapes of a leaf among what a node holds: LEAF, first place in the order of shapes, 4 bits of their number.
const LEAF: u32 = 1 << 31;
/// Bits of the number of shapes of a leaf.
const COUNT: u32 = 4;

/// Boxes in a node.
const WIDTH: usize = 8;
/// Vectors of four that hold them.
const HALVES: usize = WIDTH / 4;

/// Eight boxes and what is in them.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
struct Node {
    /// Low and high sides along x, y, z.
    sides: [[[Vec4; HALVES]; 3]; 2],
    /// Numbers of nodes, or leaves.
    inside: [u32; WIDTH],
}

impl Node {
    const EMPTY: Self = Self {
        sides: [[[Vec4::INFINITY; HALVES]; 3], [[Vec4::NEG_INFINITY; HALVES]; 3]],
        inside: [LEAF; WIDTH],
    };
}

impl Node {
    /// A bit for each box that a line meets before `far`, and where it enters them.
    #[inline(always)]
    fn met(&self, way: &TreeRay, far: f32) -> (u32, [f32; WIDTH]) {
        let (mut met, mut near) = (0, [0.0; WIDTH]);
        for half in 0..HALVES {
            let (mut enter, mut leave) = (Vec4::ZERO, Vec4::splat(far));
            for k in 0..3 {
                let (first, last) =
                    (self.sides[way.back[k] & 1][k][half], self.sides[!way.back[k] & 1][k][half]);
                enter = enter.max((first - way.origin[k]) * way.inverse[k]);
                leave = leave.min((last - way.origin[k]) * way.inverse[k]);
            }
            met |= enter.cmple(leave).bitmask() << (4 * half);
            near[4 * half..4 * half + 4].copy_from_slice(&enter.to_array());
        }
        (met, near)
    }

    /// Takes a box out of those that are met: where the line enters it, and what is inside.
    #[inline(always)]
    fn take(&self, met: &mut u32, near: &[f32; WIDTH]) -> u64 {
        let slot = met.trailing_zeros() as usize % WIDTH;
        *met &= *met - 1;
        u64::from(near[slot].to_bits()) << 32 | u64::from(self.inside[slot])
    }
}

/// A line in single precision, from where it enters the whole.
struct TreeRay {
    origin: [Vec4; 3],
    inverse: [Vec4; 3],
    /// 1 where it runs backwards.
    back: [usize; 3],
}

impl TreeRay {
    #[inline(always)]
    fn new(entry: [f64; 3], centre: [f64; 3], inverse: [f64; 3]) -> Self {
        let splat = |x: f64| Vec4::splat(x as f32);
        Self {
            origin: [splat(entry[0] - centre[0]), splat(entry[1] - centre[1]), splat(entry[2] - centre[2])],
            inverse: inverse.map(|i| splat(i.clamp(-STEEPEST, STEEPEST))),
            back: inverse.map(|i| usize::from(i < 0.0)),
        }
    }
}

/// Boxes that wait, used again by every ray: the bits of the distance at which the ray enters one, which order as it does, and what
/// is inside.
#[derive(Debug, Default)]
pub(crate) struct Stack(Vec<u64>);

/// Buffers for building a tree, reused by every build.
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
        workshop.boxes.extend(indices.iter().map(|k| {
            // no two alike: of thousands at one place, pairs would be found one after the other
            let margin = margin * (1.0 + f64::from(k.wrapping_mul(SCATTER)) / f64::from(u32::MAX));
            let Bounds { low, high } = &boxes[*k as usize];
            Aabb { min: local(*low, -margin), max: local(*high, margin) }
        }));
        self.order.clone_from(&indices);
        // what obvhs orders are places in the list of shapes that are somewhere
        indices.iter_mut().enumerate().for_each(|(place, k)| *k = place as u32);
        workshop.join(indices, care);
        let present = std::mem::take(&mut self.order);
        self.order.extend(workshop.binary.primitive_indices.iter().map(|place| present[*place as usize]));
        self.widen(workshop);
    }

    /// Takes the binary tree into wide nodes.
    fn widen(&mut self, workshop: &mut Workshop) {
        let binary = &workshop.binary;
        let open = &mut workshop.open;
        open.clear();
        self.nodes.push(Node::EMPTY);
        open.push((0, 0, 1));
        self.depth = 1;
        while let Some((root, place, depth)) = open.pop() {
            self.depth = self.depth.max(depth as usize);
            let (children, count) = widest(binary, root);
            for (slot, child) in children[..count].iter().enumerate() {
                let node = &binary.nodes[*child as usize];
                let (low, high) = (node.aabb().min, node.aabb().max);
                let next = self.nodes.len() as u32;
                let wide = &mut self.nodes[place as usize];
                for k in 0..3 {
                    let (half, lane) = (slot / 4, slot % 4);
                    (wide.sides[0][k][half][lane], wide.sides[1][k][half][lane]) = (low[k], high[k]);
                }
                if node.is_leaf() {
                    wide.inside[slot] = LEAF | node.first_index << COUNT | node.prim_count;
                } else {
                    wide.inside[slot] = next;
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
    #[inline(always)]
    pub fn cast(&self, line: &Line, mut best: f64, stack: &mut Stack, mut visit: impl FnMut(u32) -> f64) {
        if self.nodes.is_empty() {
            return;
        }
        let inverse = line.inverse();
        let inside = self.bounds.clip(line.origin, inverse);
        let Some([start, end]) = inside.filter(|[start, _]| *start <= best) else { return };
        best = best.min(end);
        let way = TreeRay::new(line.at(start), self.centre, inverse);
        let farthest = |best: f64| ((best - start) as f32).next_up();
        let mut far = farthest(best);
        if stack.0.len() < (WIDTH - 1) * self.depth {
            stack.0.resize((WIDTH - 1) * self.depth, 0);
        }
        let waiting = &mut stack.0[..];
        let (mut top, mut inside) = (0, 0);
        loop {
            if inside & LEAF == 0 {
                let node = &self.nodes[inside as usize];
                let (mut met, near) = node.met(&way, far);
                if met != 0 {
                    let mut nearest = node.take(&mut met, &near);
                    while met != 0 {
                        let other = node.take(&mut met, &near);
                        waiting[top] = nearest.max(other);
                        nearest = nearest.min(other);
                        top += 1;
                    }
                    inside = nearest as u32;
                    continue;
                }
            } else {
                for k in self.leaf(inside) {
                    best = best.min(visit(*k));
                }
                far = farthest(best);
            }
            loop {
                if top == 0 {
                    return;
                }
                top -= 1;
                if f32::from_bits((waiting[top] >> 32) as u32) <= far {
                    break;
                }
            }
            inside = waiting[top] as u32;
        }
    }

    /// The shapes of a leaf.
    #[inline(always)]
    fn leaf(&self, leaf: u32) -> &[u32] {
        let (first, count) = ((leaf & !LEAF) >> COUNT, leaf & ((1 << COUNT) - 1));
        &self.order[first as usize..(first + count) as usize]
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
            for slot in 0..WIDTH {
                let (half, lane) = (slot / 4, slot % 4);
                let beside = |k: usize| {
                    (node.sides[0][k][half][lane] - local[k])
                        .max(local[k] - node.sides[1][k][half][lane])
                        .max(0.0)
                };
                if (0..3).any(|k| beside(k) > reach) {
                    continue;
                }
                let inside = node.inside[slot];
                if inside & LEAF == 0 {
                    open.push(inside);
                    continue;
                }
                self.leaf(inside).iter().for_each(|k| visit(*k));
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
            ReinsertionOptimizer::default().run(&mut self.binary, 1.0, None);
            collapse(&mut self.binary, LARGEST_LEAF, 1.0);
        }
    }
}

/// Up to eight nodes below a node of a binary tree that together hold all that it holds: the largest are opened first.
fn widest(binary: &Bvh2, root: u32) -> ([u32; WIDTH], usize) {
    let (mut children, mut count) = ([root; WIDTH], 1);
    while count < WIDTH {
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
