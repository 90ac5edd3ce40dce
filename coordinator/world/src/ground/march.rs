//! A ray over the ground: down the pyramid of blocks from near to far, into those whose heights it can meet, to the two
//! triangles of a cell.
//!
//! Along x and y lengths are counted in cells, so that the borders of blocks are whole numbers. Blocks overlap by more than what
//! rounding can move a ray, and triangles that share an edge agree on which of them is hit: nothing slips through.

use super::Ground;
use crate::bounds::Bounds;
use crate::tree::Line;
use crate::triangle::{Sheared, normal};

/// Blocks overlap by this, cells.
const OVERLAP: f64 = 1e-9;

/// A block that waits.
#[derive(Clone, Copy, Debug, Default)]
struct Block {
    level: u32,
    at: [u32; 2],
    /// Where the ray is in it.
    from: f64,
    to: f64,
}

/// Room for the blocks that wait, used again by every ray.
#[derive(Debug, Default)]
pub(crate) struct Path(Vec<Block>);

/// A ray in cells, m and cells.
struct Way {
    line: Line,
    inverse: [f64; 2],
    /// How far along the ray blocks overlap.
    overlap: [f64; 2],
    sheared: Sheared,
}

impl Way {
    fn new(line: Line) -> Self {
        let inverse =
            [0, 1].map(|k| if line.direction[k] == 0.0 { f64::MAX } else { 1.0 / line.direction[k] });
        let overlap = [0, 1].map(|k| OVERLAP * inverse[k].abs());
        Self { line, inverse, overlap, sheared: Sheared::new(&line) }
    }

    /// Lowest and highest the ray gets between two lengths, with room for rounding.
    #[inline]
    fn heights(&self, from: f64, to: f64) -> [f64; 2] {
        let [a, b] = [from, to].map(|t| self.line.origin[2] + t * self.line.direction[2]);
        let room = 1e-12 * (a.abs() + b.abs());
        [a.min(b) - room, a.max(b) + room]
    }

    /// Parts of a block, cut at the whole number `at` along axis k: of the half that the ray enters first and of the other.
    #[inline]
    fn cut(&self, k: usize, at: u32, block: &Block) -> [[f64; 2]; 2] {
        let t = (f64::from(at) - self.line.origin[k]) * self.inverse[k];
        [[block.from, block.to.min(t + self.overlap[k])], [block.from.max(t - self.overlap[k]), block.to]]
    }
}

impl Ground {
    /// Distance along a line to the ground if it is below `best`, and the normal there.
    pub fn cast(&self, line: &Line, best: f64, path: &mut Path) -> Option<(f64, [f64; 3])> {
        let spacing = self.lattice.spacing;
        let o = self.lattice.coordinates(line.origin[0], line.origin[1]);
        let d = line.direction;
        let scaled =
            Line { origin: [o[0], o[1], line.origin[2]], direction: [d[0] / spacing, d[1] / spacing, d[2]] };
        let whole = self.above.range(self.above.top(), [0, 0]);
        let cells = self.lattice.size.map(|n| f64::from(n.saturating_sub(1)));
        let bounds = Bounds {
            low: [-OVERLAP, -OVERLAP, f64::from(whole.low)],
            high: [cells[0] + OVERLAP, cells[1] + OVERLAP, f64::from(whole.high)],
        };
        if bounds.is_empty() {
            return None;
        }
        let [start, end] = bounds.clip(scaled.origin, scaled.direction)?;
        if start > best {
            return None;
        }
        let way = Way::new(Line { origin: scaled.at(start), ..scaled });
        let (t, cell, upper) = self.descend(&way, [end - start, best - start], path)?;
        let corners = triangles(cell, &self.cell(cell))[usize::from(upper)];
        let world = corners.map(|[x, y, z]| [x * spacing, y * spacing, z]);
        Some((start + t, normal(&world)))
    }

    /// The first triangle between the ray's start and `end`, before `best`: how far it is, its cell, and which of the two.
    fn descend(&self, way: &Way, [end, best]: [f64; 2], path: &mut Path) -> Option<(f64, [u32; 2], bool)> {
        let (mut best, mut found) = (best, None);
        path.0.clear();
        path.0.push(Block { level: self.top(), at: [0, 0], from: 0.0, to: end });
        while let Some(block) = path.0.pop() {
            if block.from > best {
                continue;
            }
            let range = self.range(block.level, block.at);
            let [low, high] = way.heights(block.from, block.to.min(best));
            if !(low <= f64::from(range.high) && high >= f64::from(range.low)) {
                continue;
            }
            if block.level > 0 {
                open(way, &block, path);
                continue;
            }
            let triangles = triangles(block.at, &self.cell(block.at));
            for (upper, corners) in [(false, &triangles[0]), (true, &triangles[1])] {
                let t = way.sheared.cast(corners);
                if t < best {
                    (best, found) = (t, Some((t, block.at, upper)));
                }
            }
        }
        found
    }
}

/// Puts the four parts of a block on the path, the nearest on top.
#[inline]
fn open(way: &Way, block: &Block, path: &mut Path) {
    let level = block.level - 1;
    let middle = block.at.map(|k| (2 * k + 1) << level);
    let [x, y] = [0, 1].map(|k| way.cut(k, middle[k], block));
    // the half of the larger numbers comes first where the ray runs backwards
    let first = [0, 1].map(|k| u32::from(way.inverse[k] < 0.0));
    let part = |a: usize, b: usize| {
        let at = [2 * block.at[0] + (first[0] ^ a as u32), 2 * block.at[1] + (first[1] ^ b as u32)];
        Block { level, at, from: x[a][0].max(y[b][0]), to: x[a][1].min(y[b][1]) }
    };
    let (far, mut beside, near) = (part(1, 1), [part(1, 0), part(0, 1)], part(0, 0));
    if beside[0].from < beside[1].from {
        beside.swap(0, 1);
    }
    for part in [far, beside[0], beside[1], near] {
        if part.from <= part.to {
            path.0.push(part);
        }
    }
}

/// The two triangles of a cell, in cells and m.
#[inline]
pub(super) fn triangles([i, j]: [u32; 2], heights: &[f64; 4]) -> [[[f64; 3]; 3]; 2] {
    let (x, y) = (f64::from(i), f64::from(j));
    let [a, b, c, d] = [
        [x, y, heights[0]],
        [x + 1.0, y, heights[1]],
        [x, y + 1.0, heights[2]],
        [x + 1.0, y + 1.0, heights[3]],
    ];
    [[a, b, c], [b, d, c]]
}
