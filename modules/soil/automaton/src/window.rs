//! A rectangle of the ground in one piece of memory, in which sweeps run without looking anywhere else.
//!
//! It holds the active nodes and as many around them as the sweeps of a round can reach, so that windows of one round
//! neither see nor disturb each other and their number and shape cannot be seen in the result.

mod walls;

use crate::curvature::{admit_triples, sum_triples, triples};
use crate::feet::{Foot, OPEN_INLET, inlet};
use crate::lanes::LANES;
use crate::repose::{admit, faces_across, faces_along, sum_faces};
use crate::span::Span;
use crate::standing::{Standing, hold};
use terraglue_ground::{Lattice, TILE_EDGE};
use terraglue_soil_contact::Ground;

/// Nodes around the evaluated ones that are read.
const HALO: usize = 2;
/// Columns before the first node, so that groups of lanes never leave the row.
const LEFT: usize = 16;
const RIGHT: usize = 2 * LANES;
/// Three times four directions of triples and the changes.
const WORK_ROWS: usize = 13;

/// The rules in units of height on one lattice.
#[derive(Clone, Copy, Debug, Default)]
pub struct Limits {
    /// Δ·tan φ_r of the scenario's own soil.
    pub repose: f32,
    /// The smallest Δ·tan φ_r of all soils.
    pub least_repose: f32,
    /// κ_max·d² for straight and diagonal triples; `None`: nothing is too sharp.
    pub curvature: Option<[i32; 2]>,
    /// Height of a steep slope that stands by cohesion, and of one on which loose soil at rest does, units.
    pub critical: [i32; 2],
}

/// Nodes first … last of the lattice along x and y.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rectangle {
    /// Smallest indices.
    pub first: [i32; 2],
    /// Largest indices.
    pub last: [i32; 2],
}

impl Rectangle {
    /// Smallest rectangle around both.
    pub fn hull(&self, other: &Self) -> Self {
        Self {
            first: [0, 1].map(|k| self.first[k].min(other.first[k])),
            last: [0, 1].map(|k| self.last[k].max(other.last[k])),
        }
    }
}

/// A foot's node inside the window.
#[derive(Clone, Copy, Debug)]
struct Below {
    at: usize,
    foot: usize,
    load: i32,
    room: i32,
    level: i32,
    filled: bool,
}

/// The rectangle with its working memory.
#[derive(Clone, Debug, Default)]
pub struct Window {
    /// Lattice node of column [`LEFT`] of row 0.
    origin: [i32; 2],
    width: usize,
    height: usize,
    stride: usize,
    levels: Vec<i32>,
    /// Δ·tan φ_r per node; empty where one holds everywhere.
    repose_of: Vec<f32>,
    inlets: Vec<i32>,
    /// Rows with nodes that do not admit everything.
    limited: Vec<bool>,
    below: Vec<Below>,
    /// Columns and rows that lie on the lattice and have a full halo.
    columns: Option<Span>,
    rows: Option<Span>,
    /// Sides where the lattice ends inside the window: left, right, lower, upper.
    borders: [bool; 4],
    /// Spans that the rules have to visit, per row.
    pub repose: Vec<Span>,
    /// See `repose`.
    pub curvature: Vec<Span>,
    next: Vec<Span>,
    dirty: Vec<Span>,
    /// Spans that the last pass has changed, per row.
    changed: Vec<Span>,
    /// Rows of fluxes and changes.
    work: Vec<Vec<i32>>,
    /// Nodes visited since the window was filled.
    pub visited: u64,
    /// Largest change of the last sweep, units.
    pub largest: i32,
    /// Whether every slope stands by cohesion, and nothing lies loose on them.
    all_stands: bool,
    /// Level of the bed below loose soil, row after row, where slopes can stand.
    beds: Vec<i32>,
    /// Level of the soil at rest below moving soil, in the same way.
    resting: Vec<i32>,
    /// Which slopes stand, where not all do.
    standing: Standing,
}

impl Window {
    /// An empty window with room for `side` × `side` nodes, so that filling one up to that size does not allocate.
    pub fn with_room(side: usize) -> Self {
        let stride = LEFT + side.next_multiple_of(LANES) + RIGHT;
        let spans = || Vec::with_capacity(side);
        Self {
            levels: Vec::with_capacity(side * stride),
            beds: Vec::with_capacity(side * stride),
            resting: Vec::with_capacity(side * stride),
            inlets: Vec::with_capacity(side * stride),
            limited: Vec::with_capacity(side),
            below: Vec::with_capacity(side * side),
            repose: spans(),
            curvature: spans(),
            next: spans(),
            dirty: spans(),
            changed: spans(),
            work: (0..WORK_ROWS).map(|_| Vec::with_capacity(stride)).collect(),
            standing: Standing::with_capacity(side, stride),
            ..Self::default()
        }
    }

    /// Copies the ground around `area`, `reach` nodes farther on every side, with the load of the feet. `by_soil` has
    /// Δ·tan φ_r by the number of the mask; empty: one holds everywhere.
    pub fn fill(&mut self, ground: &Ground, by_soil: &[f32], feet: &[Foot], area: Rectangle, reach: usize) {
        let lattice = *ground.heights.lattice();
        let around = (reach + HALO) as i32;
        self.origin = area.first.map(|k| k - around);
        let side = |k: usize| (area.last[k] - area.first[k] + 1 + 2 * around) as usize;
        (self.width, self.height) = (side(0), side(1));
        self.stride = LEFT + self.width.next_multiple_of(LANES) + RIGHT;
        self.reset();
        self.find_borders(&lattice);
        self.copy_heights(ground);
        self.copy_thresholds(ground, by_soil);
        self.put_feet(feet);
        // with the load of feet at the edge
        self.repeat_borders();
    }

    fn reset(&mut self) {
        let (rows, nodes) = (self.height, self.stride * self.height);
        self.levels.resize(nodes.max(self.levels.len()), 0);
        let passes = [&mut self.repose, &mut self.curvature, &mut self.next, &mut self.changed];
        for spans in passes.into_iter().chain([&mut self.dirty]) {
            spans.clear();
            spans.resize(rows, Span::NONE);
        }
        self.limited.clear();
        self.limited.resize(rows, false);
        self.below.clear();
        self.work.resize(WORK_ROWS, Vec::new());
        for row in &mut self.work {
            row.resize(self.stride.max(row.len()), 0);
        }
        self.visited = 0;
        self.all_stands = false;
        self.standing.clear();
    }

    fn find_borders(&mut self, lattice: &Lattice) {
        let inside = |k: usize, n: usize| {
            let first = (-self.origin[k]).max(HALO as i32) as usize;
            let end = (lattice.size[k] as i32 - self.origin[k]).min((n - HALO) as i32).max(0) as usize;
            Span { lo: first, hi: end }
        };
        let (x, y) = (inside(0, self.width), inside(1, self.height));
        self.columns = Some(Span { lo: x.lo + LEFT, hi: x.hi + LEFT });
        self.rows = Some(y);
        let beyond = |k: usize, n: usize| self.origin[k] + n as i32 > lattice.size[k] as i32;
        self.borders =
            [self.origin[0] < 0, beyond(0, self.width), self.origin[1] < 0, beyond(1, self.height)];
        if self.borders.contains(&true) {
            self.limit_everything();
            self.close_outside(lattice);
        }
    }

    fn limit_everything(&mut self) {
        self.inlets.resize(self.levels.len(), 0);
        self.inlets[..self.stride * self.height].fill(OPEN_INLET);
    }

    /// Nothing flows to where there is no lattice.
    fn close_outside(&mut self, lattice: &Lattice) {
        self.limited.fill(true);
        for y in 0..self.height {
            let j = self.origin[1] + y as i32;
            let row = &mut self.inlets[y * self.stride..(y + 1) * self.stride];
            if j < 0 || j >= lattice.size[1] as i32 {
                row.fill(0);
                continue;
            }
            let first = LEFT as i32 - self.origin[0];
            row[..first.max(0) as usize].fill(0);
            let end = first + lattice.size[0] as i32;
            if (end as usize) < self.stride {
                row[end.max(0) as usize..].fill(0);
            }
        }
    }

    fn copy_heights(&mut self, ground: &Ground) {
        let lattice = ground.heights.lattice();
        let edge = TILE_EDGE as i32;
        let [nx, _] = lattice.tiles();
        let bound = |k: usize, n: usize| {
            (self.origin[k].max(0), (self.origin[k] + n as i32).min(lattice.size[k] as i32))
        };
        let ((i0, i1), (j0, j1)) = (bound(0, self.width), bound(1, self.height));
        if i0 >= i1 || j0 >= j1 {
            return;
        }
        for b in j0 / edge..=(j1 - 1) / edge {
            for a in i0 / edge..=(i1 - 1) / edge {
                let tile = ground.heights.tile((b * nx as i32 + a) as usize);
                let (x0, x1) = (i0.max(a * edge), i1.min((a + 1) * edge));
                let n = (x1 - x0) as usize;
                for j in j0.max(b * edge)..j1.min((b + 1) * edge) {
                    let at = self.at(x0, j);
                    let from = ((j - b * edge) * edge + x0 - a * edge) as usize;
                    match tile {
                        Ok(units) => self.levels[at..at + n].copy_from_slice(&units[from..from + n]),
                        Err(units) => self.levels[at..at + n].fill(units),
                    }
                }
            }
        }
    }

    fn copy_thresholds(&mut self, ground: &Ground, by_soil: &[f32]) {
        self.repose_of.clear();
        let Some(own) = by_soil.first() else { return };
        self.repose_of.resize(self.stride * self.height, *own);
        for (j, row) in (self.origin[1]..).zip(self.repose_of.chunks_exact_mut(self.stride)) {
            for (i, thr) in (self.origin[0]..).zip(&mut row[LEFT..LEFT + self.width]) {
                *thr = by_soil[ground.mask.at(i, j)];
            }
        }
    }

    /// Place of a lattice node.
    #[inline]
    fn at(&self, i: i32, j: i32) -> usize {
        (j - self.origin[1]) as usize * self.stride + (i - self.origin[0]) as usize + LEFT
    }

    /// Beyond the lattice the nearest node repeats itself.
    fn repeat_borders(&mut self) {
        if !self.borders.contains(&true) {
            return;
        }
        let (Some(x), Some(y)) = (self.columns, self.rows) else { return };
        if x.is_empty() || y.is_empty() {
            return;
        }
        for row in self.levels.chunks_exact_mut(self.stride).take(self.height) {
            if self.borders[0] {
                let edge = row[x.lo];
                row[x.lo - HALO..x.lo].fill(edge);
            }
            if self.borders[1] {
                let edge = row[x.hi - 1];
                row[x.hi..x.hi + HALO].fill(edge);
            }
        }
        let (s, n) = (self.stride, HALO);
        for k in 1..=n {
            if self.borders[2] {
                self.levels.copy_within(y.lo * s..(y.lo + 1) * s, (y.lo - k) * s);
            }
            if self.borders[3] {
                self.levels.copy_within((y.hi - 1) * s..y.hi * s, (y.hi - 1 + k) * s);
            }
        }
    }

    fn put_feet(&mut self, feet: &[Foot]) {
        let last_row = self.origin[1] + self.height as i32;
        let first = feet.partition_point(|f| f.node[1] < self.origin[1]);
        for (k, foot) in feet.iter().enumerate().skip(first) {
            let [i, j] = foot.node;
            if j >= last_row {
                break;
            }
            let x = i - self.origin[0];
            if x < 0 || x >= self.width as i32 {
                continue;
            }
            if self.below.is_empty() && !self.borders.contains(&true) {
                self.limit_everything();
            }
            let at = self.at(i, j);
            self.levels[at] = self.levels[at].wrapping_add(foot.load);
            self.inlets[at] = inlet(foot.room);
            self.limited[(j - self.origin[1]) as usize] = true;
            let level = self.levels[at];
            self.below.push(Below { at, foot: k, load: foot.load, room: foot.room, level, filled: false });
        }
    }

    /// Lowest and highest level.
    pub fn range(&self) -> [i32; 2] {
        let (Some(x), Some(y)) = (self.columns, self.rows) else { return [0, 0] };
        let rows = (y.lo..y.hi).map(|r| &self.levels[r * self.stride..][x.lo..x.hi]);
        rows.flatten().fold([i32::MAX, i32::MIN], |[low, high], h| [low.min(*h), high.max(*h)])
    }

    /// Wakes the columns of a row of the lattice (first node and a bit per node) for one of the rules.
    pub fn wake(&mut self, curvature: bool, [i, j]: [i32; 2], bits: u32) {
        if bits == 0 {
            return;
        }
        // the tile may begin to the left of the window, its bits do not
        let column = |bit: u32| (i - self.origin[0] + LEFT as i32 + bit as i32) as usize;
        let span = Span { lo: column(bits.trailing_zeros()), hi: column(32 - bits.leading_zeros()) };
        let rows = if curvature { &mut self.curvature } else { &mut self.repose };
        let row = &mut rows[(j - self.origin[1]) as usize];
        *row = row.hull(span);
    }

    /// Wakes everything.
    pub fn wake_all(&mut self) {
        let (Some(columns), Some(rows)) = (self.columns, self.rows) else { return };
        self.repose[rows.lo..rows.hi].fill(columns);
        self.curvature[rows.lo..rows.hi].fill(columns);
    }

    /// Applies the rule of repose once; without `apply` only notes the changes. Returns the largest change.
    #[inline(always)]
    pub fn repose_pass(&mut self, limits: &Limits, apply: bool) -> i32 {
        let rows = self.rows.unwrap_or(Span::NONE);
        if self.all_stands {
            self.repose.fill(Span::NONE);
            return 0;
        }
        if limits.critical[0] > 0 {
            self.find_standing(limits);
        }
        let mut work = std::mem::take(&mut self.work);
        let [along, lower, upper, change, waiting] = &mut work[..5] else { return 0 };
        let (mut lower, mut upper) = (lower.as_mut_slice(), upper.as_mut_slice());
        let (mut change, mut waiting) = (change.as_mut_slice(), waiting.as_mut_slice());
        self.next.fill(Span::NONE);
        self.changed.fill(Span::NONE);
        let (mut before, mut pending, mut largest) = (Span::NONE, Span::NONE, 0);
        for y in rows.lo..rows.hi {
            let span = self.repose[y];
            if !span.is_empty() {
                if before.lo > span.lo || before.hi < span.hi {
                    // the row below did not need all of these faces
                    self.across(y - 1, span, limits.repose, lower);
                }
                self.visited += span.len() as u64;
            }
            let next = if y + 1 < rows.hi { self.repose[y + 1] } else { Span::NONE };
            let faces = span.hull(next);
            if !faces.is_empty() {
                self.across(y, faces, limits.repose, upper);
            }
            if !span.is_empty() {
                self.along(y, span, limits.repose, along);
                sum_faces(span, along, [lower, upper], change);
            }
            // the row below is not read any more
            largest = largest.max(self.finish(y.wrapping_sub(1), pending, waiting, apply));
            pending = span;
            before = faces;
            std::mem::swap(&mut change, &mut waiting);
            std::mem::swap(&mut lower, &mut upper);
        }
        largest = largest.max(self.finish(rows.hi.wrapping_sub(1), pending, waiting, apply));
        self.work = work;
        self.after_pass(apply);
        std::mem::swap(&mut self.repose, &mut self.next);
        largest
    }

    #[inline(always)]
    fn row(&self, y: usize) -> &[i32] {
        &self.levels[y * self.stride..(y + 1) * self.stride]
    }

    #[inline(always)]
    fn row_thresholds(&self, y: usize) -> &[f32] {
        &self.repose_of[y * self.stride..(y + 1) * self.stride]
    }

    #[inline(always)]
    fn row_inlets(&self, y: usize) -> &[i32] {
        &self.inlets[y * self.stride..(y + 1) * self.stride]
    }

    /// Fluxes from row y to row y + 1.
    #[inline(always)]
    fn across(&self, y: usize, span: Span, thr: f32, out: &mut [i32]) {
        let Span { lo, hi } = span.whole_groups();
        let rows = [self.row(y), self.row(y + 1)];
        if self.repose_of.is_empty() {
            faces_across(rows, [lo, hi], [thr; 2], out);
        } else {
            faces_across(rows, [lo, hi], [y, y + 1].map(|y| self.row_thresholds(y)), out);
        }
        if self.limited[y] || self.limited[y + 1] {
            admit(&mut out[lo..hi], &self.row_inlets(y)[lo..hi], &self.row_inlets(y + 1)[lo..hi]);
        }
        if let Some(stands) = self.standing.across(y * self.stride + lo, hi - lo) {
            let at = y * self.stride + lo;
            hold(&mut out[lo..hi], stands, |k, face| {
                [at + k, at + k + self.stride].map(|at| self.free(at, face))
            });
        }
    }

    /// Fluxes along row y over the faces on either side of the nodes of `span`.
    #[inline(always)]
    fn along(&self, y: usize, span: Span, thr: f32, out: &mut [i32]) {
        let Span { lo, hi } = Span { lo: span.lo - 1, hi: span.hi }.whole_groups();
        let rows = [self.row(y - 1), self.row(y), self.row(y + 1)];
        if self.repose_of.is_empty() {
            faces_along(rows, [lo, hi], thr, out);
        } else {
            faces_along(rows, [lo, hi], self.row_thresholds(y), out);
        }
        if self.limited[y] {
            let inlets = self.row_inlets(y);
            admit(&mut out[lo..hi], &inlets[lo..hi], &inlets[lo + 1..=hi]);
        }
        if let Some(stands) = self.standing.along(y * self.stride + lo, hi - lo) {
            let at = y * self.stride + lo;
            hold(&mut out[lo..hi], stands, |k, face| [at + k, at + k + 1].map(|at| self.free(at, face)));
        }
    }

    /// Adds the changes of row y and notes where they are. Returns the largest.
    #[inline(always)]
    fn finish(&mut self, y: usize, span: Span, change: &[i32], apply: bool) -> i32 {
        if span.is_empty() {
            return 0;
        }
        let change = &change[span.lo..span.hi];
        let largest = change.iter().fold(0, |most, change| most.max(change.wrapping_abs()));
        if largest == 0 {
            return 0;
        }
        if apply {
            let row = &mut self.levels[y * self.stride..(y + 1) * self.stride];
            for (level, change) in row[span.lo..span.hi].iter_mut().zip(change) {
                *level = level.wrapping_add(*change);
            }
        }
        let first = change.iter().position(|c| *c != 0).unwrap_or(0);
        let last = change.iter().rposition(|c| *c != 0).unwrap_or(0);
        self.changed[y] = Span { lo: span.lo + first, hi: span.lo + last + 1 };
        largest
    }

    /// Wakes the nodes that the changes of the pass reach.
    #[inline(always)]
    fn wake_around(&mut self) {
        let (columns, rows) = (self.columns.unwrap_or(Span::NONE), self.rows.unwrap_or(Span::NONE));
        for y in rows.lo..rows.hi {
            let near = self.changed[y - 1].hull(self.changed[y]).hull(self.changed[y + 1]);
            let far = near.hull(self.changed[y - 2]).hull(self.changed[y + 2]);
            if far.is_empty() {
                continue;
            }
            self.dirty[y] = self.dirty[y].hull(self.changed[y]);
            self.next[y] = self.next[y].hull(near.grown(1, columns));
            self.curvature[y] = self.curvature[y].hull(far.grown(2, columns));
        }
    }

    #[inline(always)]
    fn after_pass(&mut self, apply: bool) {
        self.wake_around();
        for (next, wake) in self.next.iter_mut().zip(&self.standing.wake) {
            *next = next.hull(*wake);
        }
        self.standing.wake.clear();
        if apply {
            self.repeat_borders();
            for node in &mut self.below {
                let change = self.levels[node.at].wrapping_sub(node.level);
                if change != 0 && node.room != 0 {
                    node.level += change;
                    node.filled = true;
                    node.room = node.room.saturating_sub(change).max(1);
                    self.inlets[node.at] = inlet(node.room);
                }
            }
        }
    }

    /// Applies the rule of curvature once; otherwise as [`Window::repose_pass`].
    #[inline(always)]
    pub fn curvature_pass(&mut self, limits: &Limits, apply: bool) -> i32 {
        let Some(limits) = limits.curvature else {
            self.curvature.fill(Span::NONE);
            return 0;
        };
        let rows = self.rows.unwrap_or(Span::NONE);
        let mut work = std::mem::take(&mut self.work);
        let mut visit = std::mem::take(&mut self.next);
        std::mem::swap(&mut visit, &mut self.curvature);
        self.curvature.resize(visit.len(), Span::NONE);
        self.curvature.fill(Span::NONE);
        self.changed.fill(Span::NONE);
        // nodes active for the rule of repose stay so
        self.next = std::mem::take(&mut self.repose);
        let mut largest = 0;
        let mut any = [false; 3];
        let span_of = |y: usize| if y >= rows.lo && y < rows.hi { visit[y] } else { Span::NONE };
        for y in rows.lo - 1..rows.hi + 1 {
            // the triples with their middle in row y, needed by the rows y − 1, y and y + 1
            let needed = span_of(y.wrapping_sub(1)).hull(span_of(y)).hull(span_of(y + 1));
            let place = y % 3;
            any[place] = false;
            let inside = y + 1 < self.height;
            if !needed.is_empty() && inside {
                any[place] = self.middles(y, needed, limits, &mut work[4 * place..4 * place + 4]);
            }
            self.visited += span_of(y).len() as u64;
            let done = y.wrapping_sub(1);
            let span = span_of(done);
            if span.is_empty() {
                continue;
            }
            if any.iter().any(|a| *a) {
                let (fluxes, others) = work.split_at_mut(12);
                let change = &mut others[0];
                sum_triples(span, done, any, fluxes, change);
                // no triple of the rows that follow reads this row
                largest = largest.max(self.finish(done, span, change, apply));
            }
        }
        self.work = work;
        self.after_pass(apply);
        std::mem::swap(&mut self.repose, &mut self.next);
        self.next = visit;
        largest
    }

    /// The four directions of triples with their middle in row y. Returns whether any gives or takes.
    #[inline(always)]
    fn middles(&self, y: usize, span: Span, [straight, diagonal]: [i32; 2], out: &mut [Vec<i32>]) -> bool {
        let [below, here, above] = [self.row(y - 1), self.row(y), self.row(y + 1)];
        let range = [span.lo - 1, span.hi + 1];
        let cases = [
            ([here, here, here], [-1, 1], straight, [0, 0]),
            ([below, here, above], [0, 0], straight, [-1, 1]),
            ([below, here, above], [-1, 1], diagonal, [-1, 1]),
            ([above, here, below], [-1, 1], diagonal, [1, -1]),
        ];
        let limited = self.limited[y - 1] || self.limited[y] || self.limited[y + 1];
        let mut any = false;
        for ((rows, shift, limit, step), out) in cases.into_iter().zip(out) {
            let moves = triples(rows, shift, range, limit, out);
            any |= moves;
            if moves && limited {
                let place = |dy: isize, dx: isize| {
                    (y.wrapping_add_signed(dy) * self.stride + range[0]).wrapping_add_signed(dx)
                };
                let n = range[1] - range[0];
                let inlets = |at: usize| &self.inlets[at..at + n];
                let ends = [inlets(place(step[0], shift[0])), inlets(place(step[1], shift[1]))];
                admit_triples(&mut out[range[0]..range[1]], inlets(place(0, 0)), ends);
            }
        }
        any
    }

    /// Calls `row(first node, heights)` for every row that has changed, and gives the feet's rooms back.
    pub fn empty(&mut self, feet: &mut [Foot], mut row: impl FnMut([i32; 2], &[i32])) {
        for node in &self.below {
            self.levels[node.at] = self.levels[node.at].wrapping_sub(node.load);
            if node.filled {
                feet[node.foot].room = node.room;
            }
        }
        for (y, span) in self.dirty.iter().enumerate().filter(|(_, span)| !span.is_empty()) {
            let first = [self.origin[0] + (span.lo - LEFT) as i32, self.origin[1] + y as i32];
            row(first, &self.levels[y * self.stride + span.lo..y * self.stride + span.hi]);
        }
    }

    /// Calls `span(for curvature, first node, end)` for every row that is active.
    pub fn active(&self, mut span: impl FnMut(bool, [i32; 2], i32)) {
        for (curvature, rows) in [(false, &self.repose), (true, &self.curvature)] {
            for (y, s) in rows.iter().enumerate().filter(|(_, s)| !s.is_empty()) {
                let column = |x: usize| self.origin[0] + x as i32 - LEFT as i32;
                span(curvature, [column(s.lo), self.origin[1] + y as i32], column(s.hi));
            }
        }
    }

    /// Whether no node is active.
    pub fn sleeps(&self) -> bool {
        self.repose.iter().chain(&self.curvature).all(|s| s.is_empty())
    }
}
