//! Lowest and highest heights of square blocks, level by level.

/// Lowest and highest height, m, rounded outwards; empty where there is no ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Range {
    pub low: f32,
    pub high: f32,
}

impl Range {
    pub const EMPTY: Self = Self { low: f32::INFINITY, high: f32::NEG_INFINITY };

    /// Of the corners of a cell; a cell without one of them is no ground.
    #[inline]
    pub fn of(corners: &[f64; 4]) -> Self {
        if corners.iter().any(|h| !h.is_finite()) {
            return Self::EMPTY;
        }
        let low = corners.iter().fold(f64::INFINITY, |m, h| m.min(*h));
        let high = corners.iter().fold(f64::NEG_INFINITY, |m, h| m.max(*h));
        Self { low: (low as f32).next_down(), high: (high as f32).next_up() }
    }

    /// Of 2 × 2 cells between three rows of three nodes.
    pub fn of_rows(a: &[f64], b: &[f64], c: &[f64]) -> Self {
        let cell =
            |low: &[f64], high: &[f64], i: usize| Self::of(&[low[i], low[i + 1], high[i], high[i + 1]]);
        cell(a, b, 0).joined(cell(a, b, 1)).joined(cell(b, c, 0)).joined(cell(b, c, 1))
    }

    #[inline]
    pub fn joined(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }
}

/// Ranges of equal blocks, x fastest.
#[derive(Clone, Debug, Default)]
pub(crate) struct Level {
    size: [u32; 2],
    ranges: Vec<Range>,
}

impl Level {
    fn new(size: [u32; 2]) -> Self {
        Self { size, ranges: vec![Range::EMPTY; size[0] as usize * size[1] as usize] }
    }

    /// Empty where there is no such block.
    #[inline]
    pub fn range(&self, [i, j]: [u32; 2]) -> Range {
        if i >= self.size[0] || j >= self.size[1] {
            return Range::EMPTY;
        }
        self.ranges[(j * self.size[0] + i) as usize]
    }

    /// A square of `edge` × `edge` blocks.
    pub fn fill(&mut self, edge: u32, of: impl Fn([u32; 2]) -> Range) {
        self.size = [edge; 2];
        self.ranges.clear();
        self.ranges.extend((0..edge * edge).map(|k| of([k % edge * 2, k / edge * 2])));
    }

    /// Each block holds four of the level below.
    pub fn join(&mut self, below: &Self) {
        self.size = below.size.map(|n| n.div_ceil(2));
        self.ranges.clear();
        let [nx, ny] = self.size;
        self.ranges.extend((0..nx * ny).map(|k| {
            let [i, j] = [k % nx * 2, k / nx * 2];
            let low = below.range([i, j]).joined(below.range([i + 1, j]));
            low.joined(below.range([i, j + 1])).joined(below.range([i + 1, j + 1]))
        }));
    }
}

/// From tiles up to one block that holds all.
#[derive(Clone, Debug)]
pub(crate) struct Pyramid {
    levels: Vec<Level>,
    changed: bool,
}

impl Pyramid {
    pub fn new(tiles: [u32; 2]) -> Self {
        let mut levels = vec![Level::new(tiles)];
        while let Some(last) = levels.last().map(|l| l.size).filter(|s| s[0].max(s[1]) > 1) {
            levels.push(Level::new(last.map(|n| n.div_ceil(2))));
        }
        Self { levels, changed: false }
    }

    pub fn set(&mut self, [a, b]: [u32; 2], range: Range) {
        let lowest = &mut self.levels[0];
        let place = (b * lowest.size[0] + a) as usize;
        self.changed |= lowest.ranges[place] != range;
        lowest.ranges[place] = range;
    }

    /// Carries what was set up to the top.
    pub fn join(&mut self) {
        if std::mem::take(&mut self.changed) {
            for k in 1..self.levels.len() {
                let (below, own) = self.levels.split_at_mut(k);
                own[0].join(&below[k - 1]);
            }
        }
    }

    #[inline]
    pub fn range(&self, level: u32, at: [u32; 2]) -> Range {
        self.levels[level as usize].range(at)
    }

    pub fn top(&self) -> u32 {
        self.levels.len() as u32 - 1
    }
}
