//! A ray over the ground: down the pyramid of blocks from near to far, into those whose heights it can meet, to the two
//! triangles of a cell.
//!
//! Along x and y lengths are counted in cells, so that the borders of blocks are whole numbers. Which blocks are near is found in
//! single precision from where the ray enters the ground; blocks are grown by more than it can lose. Triangles that share an edge
//! agree on which of them is hit: nothing slips through.

use super::{Ground, TILE_LEVEL};
use crate::bounds::Bounds;
use crate::tree::{Line, STEEPEST};
use crate::triangle::{Sheared, normal};
use glam::{Vec4, vec4};

/// Blocks are grown by this, cells.
const OVERLAP: f64 = 1e-6;
/// And by this share of their distance and height: five times what single precision can lose.
const ROUNDING: f32 = 1e-6;
/// And by this much in height, m: at height 0 there is no share.
const LIFT: f32 = 1e-6;

/// A block that waits.
#[derive(Clone, Copy, Debug, Default)]
struct Block {
    /// Where the ray enters it.
    near: f32,
    level: u32,
    at: [u32; 2],
}

/// Blocks that wait, used again by every ray.
#[derive(Debug, Default)]
pub(crate) struct Path(Vec<Block>);

/// A ray in cells, cells and m, from where it enters the ground.
struct GroundRay {
    line: Line,
    sheared: Sheared,
    inverse: [Vec4; 3],
    back: [bool; 3],
    /// Height of the start, less and more what single precision can lose.
    start: [Vec4; 2],
}

impl GroundRay {
    #[inline(always)]
    fn new(line: Line, inverse: [f64; 3], [low, high]: [f32; 2]) -> Self {
        let start = line.origin[2] as f32;
        let room = ROUNDING * (start.abs() + low.abs() + high.abs()) + LIFT;
        Self {
            line,
            sheared: Sheared::new(&line),
            back: inverse.map(|i| i < 0.0),
            inverse: inverse.map(|i| Vec4::splat(i.clamp(-STEEPEST, STEEPEST) as f32)),
            start: [start + room, start - room].map(Vec4::splat),
        }
    }

    /// Borders of the lower and of the upper half of a block along axis k, which overlap, from the start of the ray.
    #[inline(always)]
    fn borders(&self, k: usize, block: &Block) -> [f32; 4] {
        let low = f64::from(block.at[k] << block.level) - self.line.origin[k];
        let half = f64::from(1_u32 << (block.level - 1));
        let [low, middle, high] = [low, low + half, low + 2.0 * half].map(|x| x as f32);
        let room = ROUNDING * low.abs().max(high.abs()) + OVERLAP as f32;
        [low - room, middle - room, middle + room, high + room]
    }

    /// The parts of a block that the ray can meet before `far`: a bit for each, and where it enters them.
    #[inline(always)]
    fn parts(&self, ground: &Ground, block: &Block, far: f32) -> (u32, [f32; 4]) {
        let quarters = ground.block(block.level, block.at);
        let [x0, left, right, x1] = self.borders(0, block);
        let [y0, front, rear, y1] = self.borders(1, block);
        let sides = [
            [vec4(x0, left, x0, left), vec4(right, x1, right, x1)],
            [vec4(y0, y0, front, front), vec4(rear, rear, y1, y1)],
            [quarters.low - self.start[0], quarters.high - self.start[1]],
        ];
        let (mut near, mut end) = (Vec4::ZERO, Vec4::splat(far));
        for k in 0..3 {
            let [low, high] = sides[k];
            let (first, last) = if self.back[k] { (high, low) } else { (low, high) };
            near = near.max(first * self.inverse[k]);
            end = end.min(last * self.inverse[k]);
        }
        (near.cmple(end).bitmask(), near.to_array())
    }
}

/// Intersection of the ray with the ground.
struct Found {
    t: f64,
    /// Of a surface over cells, of any length.
    normal: [f64; 3],
}

impl Ground {
    /// Distance along a line to the ground if it is below `best`, and the normal there.
    #[inline(always)]
    pub fn cast(&self, line: &Line, best: f64, path: &mut Path) -> Option<(f64, [f64; 3])> {
        let spacing = self.lattice.spacing;
        let o = self.lattice.coordinates(line.origin[0], line.origin[1]);
        let d = line.direction;
        let origin = [o[0], o[1], line.origin[2]];
        let scaled = Line { origin, direction: [d[0] / spacing, d[1] / spacing, d[2]] };
        let inverse = scaled.inverse();
        let [low, high] = self.above.whole();
        let room = ROUNDING * (low.abs() + high.abs()) + LIFT;
        let cells = self.lattice.size.map(|n| f64::from(n.saturating_sub(1)));
        let bounds = Bounds {
            low: [-OVERLAP, -OVERLAP, f64::from(low - room)],
            high: [cells[0] + OVERLAP, cells[1] + OVERLAP, f64::from(high + room)],
        };
        let [start, end] = bounds.clip(scaled.origin, inverse).filter(|_| low <= high)?;
        if start > best {
            return None;
        }
        let way = GroundRay::new(Line { origin: scaled.at(start), ..scaled }, inverse, [low, high]);
        let found = self.descend(&way, [end - start, best - start], path)?;
        // from cells to m
        let [x, y, z] = found.normal;
        Some((start + found.t, [x / spacing, y / spacing, z]))
    }

    /// The first triangle between the ray's start and `end`, before `best`.
    #[inline(always)]
    fn descend(&self, way: &GroundRay, [end, best]: [f64; 2], path: &mut Path) -> Option<Found> {
        let (mut best, mut found) = (best, None);
        let limit = |best: f64| (best.min(end) as f32 * (1.0 + ROUNDING)).next_up() + ROUNDING;
        let mut far = limit(best);
        path.0.clear();
        let mut block = Block { near: 0.0, level: self.top(), at: [0, 0] };
        loop {
            if let Some(hit) = self.leaf(way, &block, best) {
                if let Some(hit) = hit.filter(|hit| hit.t < best) {
                    (best, far) = (hit.t, limit(hit.t));
                    found = Some(hit);
                }
            } else {
                let (mut met, near) = way.parts(self, &block, far);
                let mut nearest: Option<Block> = None;
                while met != 0 {
                    let part = met.trailing_zeros();
                    met &= met - 1;
                    let at = [2 * block.at[0] + (part & 1), 2 * block.at[1] + (part >> 1 & 1)];
                    let new = Block { near: near[part as usize & 3], level: block.level - 1, at };
                    nearest = Some(match nearest {
                        None => new,
                        Some(old) if new.near < old.near => {
                            path.0.push(old);
                            new
                        }
                        Some(old) => {
                            path.0.push(new);
                            old
                        }
                    });
                }
                if let Some(nearest) = nearest {
                    block = nearest;
                    continue;
                }
            }
            block = loop {
                let next = path.0.pop();
                match next {
                    None => return found,
                    Some(next) if next.near <= far => break next,
                    Some(_) => {}
                }
            };
        }
    }

    /// Intersection of the ray with a block that is not divided further, if it is one: a cell, or a level tile.
    #[inline(always)]
    fn leaf(&self, way: &GroundRay, block: &Block, best: f64) -> Option<Option<Found>> {
        if block.level == 0 {
            return Some(self.in_cell(way, block.at, best));
        }
        if block.level != TILE_LEVEL {
            return None;
        }
        let height = self.tile(block.at).level()?;
        let t = (height - way.line.origin[2]) / way.line.direction[2];
        let inside = |k: usize| {
            let from = way.line.at(t)[k] - f64::from(block.at[k] << TILE_LEVEL);
            from >= -OVERLAP && from <= f64::from(1 << TILE_LEVEL) + OVERLAP
        };
        Some((t >= 0.0 && inside(0) && inside(1)).then_some(Found { t, normal: [0.0, 0.0, 1.0] }))
    }

    #[inline(always)]
    fn in_cell(&self, way: &GroundRay, at: [u32; 2], best: f64) -> Option<Found> {
        let [p, q, r, s] = corners(at, &self.cell(at));
        let [a, b] = way.sheared.cast_pair([p, q, r, s]);
        let t = if b < a { b } else { a };
        (t < best).then(|| Found { t, normal: normal(&if b < a { [q, s, r] } else { [p, q, r] }) })
    }
}

/// The corners of a cell, in cells and m.
#[inline(always)]
fn corners([i, j]: [u32; 2], heights: &[f64; 4]) -> [[f64; 3]; 4] {
    let (x, y) = (f64::from(i), f64::from(j));
    [[x, y, heights[0]], [x + 1.0, y, heights[1]], [x, y + 1.0, heights[2]], [x + 1.0, y + 1.0, heights[3]]]
}

/// The two triangles of a cell, in cells and m.
pub(super) fn triangles(cell: [u32; 2], heights: &[f64; 4]) -> [[[f64; 3]; 3]; 2] {
    let [a, b, c, d] = corners(cell, heights);
    [[a, b, c], [b, d, c]]
}
