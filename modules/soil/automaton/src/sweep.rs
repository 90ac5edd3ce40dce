//! Sweeps: the two rules on the active nodes, in rounds of a few sweeps over windows of the ground.

use crate::active::{Marks, TileBits};
use crate::feet::Feet;
use crate::regions::rectangles;
use crate::still::Still;
use crate::window::{Limits, Rectangle, Window};
use crate::{curvature, repose};
use std::sync::{Arc, Mutex, PoisonError};
use terraglue_ground::{Lattice, TILE_EDGE, UNIT_M};
use terraglue_soil_contact::Ground;
use terraglue_subsystem::Host;

/// Sweeps of a round at most: windows are filled again after so many.
pub const ROUND: u32 = 8;
/// Nodes of a window beyond which it pays to give windows to several threads.
const PARALLEL_NODES: i64 = 4096;
/// Edge of the blocks in which the ground is scanned, in tiles.
const BLOCK_TILES: u32 = 4;

/// Counts of the last step, and sums since the start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Counts {
    /// Visits of nodes in the last step.
    pub visited: u64,
    /// Sweeps of the last step.
    pub sweeps: u32,
    /// Units that left a node since the start, net in every round.
    pub moved: i64,
    /// Sum of all changes since the start, units.
    pub gained: i64,
    /// Number of sweeps since the start: curvature acts in every second one.
    pub parity: u32,
    /// By how much the sum of the squares of the heights (units) has grown in the last step.
    pub lifted: f64,
    /// Difference of the heights around the nodes that were active last, units: the height of the sliding material.
    pub tallest: i32,
    /// Lowest and highest level that was ever seen where something slid, units.
    pub range: [i32; 2],
}

impl Default for Counts {
    fn default() -> Self {
        let (visited, sweeps, moved, gained, parity) = (0, 0, 0, 0, 0);
        Self { visited, sweeps, moved, gained, parity, lifted: 0.0, tallest: 0, range: [i32::MAX, i32::MIN] }
    }
}

/// Feet and active nodes of a ground, and the rules that act on them.
pub struct Sweeper {
    /// Nodes below feet.
    pub feet: Feet,
    /// Nodes that have changed outside sweeps; they wake their surroundings.
    pub changed: Marks,
    /// Nodes whose loose soil moves: material came to them since the last sweep, or they changed in the last round of sweeps.
    pub moving: Marks,
    /// Active nodes for the rule of repose.
    pub repose: Marks,
    /// Active nodes for the rule of curvature.
    pub curvature: Marks,
    /// Counts of the work done.
    pub counts: Counts,
    limits: Limits,
    /// Δ·tan φ_r by the number of the mask; empty: one holds everywhere.
    by_soil: Vec<f32>,
    host: Arc<dyn Host>,
    areas: Vec<Rectangle>,
    windows: Vec<Mutex<Window>>,
}

/// Exact copy of the active set.
#[derive(Clone, Debug, Default)]
pub struct SavedActiveSet {
    moving: Vec<(u32, TileBits)>,
    repose: Vec<(u32, TileBits)>,
    curvature: Vec<(u32, TileBits)>,
    counts: Counts,
}

/// The passes of a round in one window; with the widest vectors that the processor has.
struct Passes<'a> {
    window: &'a mut Window,
    limits: &'a Limits,
    sweeps: u32,
    parity: u32,
}

impl pulp::NullaryFnOnce for Passes<'_> {
    type Output = i32;
    #[inline(always)]
    fn call(self) -> i32 {
        let mut last = 0;
        for k in 0..self.sweeps {
            last = self.window.repose_pass(self.limits, true);
            if (self.parity + k).is_multiple_of(2) {
                last = last.max(self.window.curvature_pass(self.limits, true));
            }
            if self.window.sleeps() {
                return 0;
            }
        }
        last
    }
}

/// Both rules once without changing anything, to find the nodes that would move.
struct Look<'a> {
    window: &'a mut Window,
    limits: &'a Limits,
}

impl pulp::NullaryFnOnce for Look<'_> {
    type Output = ();
    #[inline(always)]
    fn call(self) {
        self.window.repose_pass(self.limits, false);
        self.window.curvature_pass(self.limits, false);
    }
}

/// Distance beyond the active nodes at which sweeps wake others: a change wakes nodes one away for repose and two away
/// for curvature, which acts in every second sweep.
fn reach(sweeps: u32, parity: u32) -> usize {
    let (mut repose, mut curvature) = (0, 0);
    for k in 0..sweeps {
        (repose, curvature) = (repose + 1, curvature.max(repose + 2));
        if (parity + k).is_multiple_of(2) {
            (repose, curvature) = (curvature + 1, curvature + 2);
        }
    }
    repose.max(curvature)
}

/// Windows that stand ready, and the side (nodes) up to which using one allocates nothing.
const WINDOWS: usize = 16;
const WINDOW_SIDE: usize = 128;

impl Sweeper {
    /// A sweeper for ground where nothing has happened.
    pub fn new(lattice: Lattice, host: Arc<dyn Host>, nodes: usize) -> Self {
        Self {
            feet: Feet::new(lattice, nodes),
            changed: Marks::new(lattice),
            moving: Marks::new(lattice),
            repose: Marks::new(lattice),
            curvature: Marks::new(lattice),
            counts: Counts::default(),
            limits: Limits::default(),
            by_soil: Vec::new(),
            host,
            areas: Vec::with_capacity(64),
            windows: (0..WINDOWS).map(|_| Mutex::new(Window::with_room(WINDOW_SIDE))).collect(),
        }
    }

    /// Sets the angle of repose (rad) and the largest curvature (1/m) on nodes `spacing` (m) apart; `others` has the
    /// angles of the soils of the mask from number 1 on.
    /// `critical`: height (m) of steep slopes that stand by cohesion, and of those on which loose soil at rest does; ridges and
    /// notches as high as the first stand, too.
    pub fn set_limits(
        &mut self,
        repose: f64,
        others: &[f64],
        curvature_max: f64,
        critical: [f64; 2],
        spacing: f64,
    ) {
        // heights beyond any ground, and infinity, become the largest number
        let critical = critical.map(|height| (height / UNIT_M) as i32);
        let curvature = curvature::limits(curvature_max, critical[0], spacing);
        let threshold = |angle: f64| repose::threshold(angle, spacing);
        self.by_soil.clear();
        if others.iter().any(|angle| *angle != repose) {
            self.by_soil.extend(std::iter::once(&repose).chain(others).map(|angle| threshold(*angle)));
        }
        let repose = threshold(repose);
        let least_repose = self.by_soil.iter().fold(repose, |least, thr| least.min(*thr));
        self.limits = Limits { repose, least_repose, curvature, critical };
    }

    /// A sweeper with the largest angle of repose of this one, times `steeper`, on a lattice of blocks: no feet, and no
    /// rule of curvature, which is one of single nodes.
    pub(crate) fn of_blocks(&self, lattice: Lattice, steeper: f32) -> Self {
        let largest = self.by_soil.iter().fold(self.limits.repose, |most, thr| most.max(*thr));
        let repose = 2.0 * largest * steeper;
        let limits = Limits { repose, least_repose: repose, curvature: None, critical: self.limits.critical };
        Self { limits, ..Self::new(lattice, self.host.clone(), 0) }
    }

    /// Whether all sleep.
    pub fn sleeps(&self) -> bool {
        self.repose.is_empty() && self.curvature.is_empty()
    }

    /// Number of nodes that the next sweep visits, one that both rules visit counted twice.
    pub fn active(&self) -> usize {
        self.repose.len() + self.curvature.len()
    }

    /// Wakes the nodes that changes outside sweeps reach.
    pub fn wake_changed(&mut self) {
        if self.changed.is_empty() {
            return;
        }
        self.repose.mark_around(&self.changed, 1);
        self.curvature.mark_around(&self.changed, 2);
        self.changed.clear();
    }

    /// Wakes every node that one of the rules would move: looks where bounds leave it open.
    pub fn scan(&mut self, ground: &Ground) {
        let [nx, ny] = ground.heights.lattice().tiles();
        let still = Still::new(ground, &self.feet.list);
        let mut window = Window::default();
        self.counts.range = ground.heights.bounds().into();
        for b in (0..ny).step_by(BLOCK_TILES as usize) {
            for a in (0..nx).step_by(BLOCK_TILES as usize) {
                let end = [(a + BLOCK_TILES).min(nx), (b + BLOCK_TILES).min(ny)];
                let Some(area) = still.unstable([a, b], end, &self.limits) else { continue };
                window.fill(ground, &self.by_soil, &self.feet.list, area, 2);
                window.look_for_standing(ground, &self.limits, &self.moving, self.counts.range);
                window.wake_all();
                pulp::Arch::new().dispatch(Look { window: &mut window, limits: &self.limits });
                let (repose, curvature) = (&mut self.repose, &mut self.curvature);
                window.active(|bent, [i, j], end| {
                    if bent { &mut *curvature } else { &mut *repose }.mark_row(i, end, j);
                });
            }
        }
    }

    /// Sweeps `most` times, less when all sleep before. Returns the largest change of the last sweep, units.
    pub fn sweep(&mut self, ground: &mut Ground, most: u32) -> i32 {
        self.wake_changed();
        let mut left = most;
        let mut largest = 0;
        while left > 0 && !self.sleeps() {
            let sweeps = left.min(ROUND);
            largest = self.round(ground, sweeps);
            left -= sweeps;
            self.counts.sweeps += sweeps;
            self.counts.parity = self.counts.parity.wrapping_add(sweeps);
        }
        if self.sleeps() {
            // all is at rest
            self.moving.clear();
        }
        largest
    }

    fn round(&mut self, ground: &mut Ground, sweeps: u32) -> i32 {
        let parity = self.counts.parity;
        let reach = reach(sweeps, parity);
        let sets = [&self.repose, &self.curvature];
        rectangles(ground.heights.lattice(), sets, 2 * reach as i32 + 4, &mut self.areas);
        while self.windows.len() < self.areas.len() {
            self.windows.push(Mutex::default());
        }
        self.counts.tallest = 0;
        for k in 0..self.areas.len() {
            self.fill(ground, k, reach);
            let [low, high] = self.windows[k].get_mut().unwrap_or_else(PoisonError::into_inner).range();
            self.counts.tallest = self.counts.tallest.max(high.saturating_sub(low));
            let range = &mut self.counts.range;
            *range = [range[0].min(low), range[1].max(high)];
        }
        for window in &mut self.windows[..self.areas.len()] {
            let window = window.get_mut().unwrap_or_else(PoisonError::into_inner);
            window.look_for_standing(ground, &self.limits, &self.moving, self.counts.range);
        }
        self.moving.clear();
        self.repose.clear();
        self.curvature.clear();
        let limits = self.limits;
        let windows = &self.windows[..self.areas.len()];
        let job = |k: usize| {
            let mut window = windows[k].lock().unwrap_or_else(PoisonError::into_inner);
            let passes = Passes { window: &mut window, limits: &limits, sweeps, parity };
            window.largest = pulp::Arch::new().dispatch(passes);
        };
        let size = |r: &Rectangle| i64::from(r.last[0] - r.first[0]) * i64::from(r.last[1] - r.first[1]);
        if windows.len() > 1 && self.areas.iter().map(size).sum::<i64>() > PARALLEL_NODES {
            self.host.parallel_for(windows.len(), &job);
        } else {
            (0..windows.len()).for_each(job);
        }
        (0..self.areas.len()).map(|k| self.empty(ground, k)).max().unwrap_or(0)
    }

    /// Fills window k and wakes its nodes.
    fn fill(&mut self, ground: &Ground, k: usize, reach: usize) {
        let window = self.windows[k].get_mut().unwrap_or_else(PoisonError::into_inner);
        let area = self.areas[k];
        window.fill(ground, &self.by_soil, &self.feet.list, area, reach);
        let nx = ground.heights.lattice().tiles()[0];
        for (bent, set) in [(false, &self.repose), (true, &self.curvature)] {
            for tile in &set.tiles {
                let corner = [(tile % nx * TILE_EDGE) as i32, (tile / nx * TILE_EDGE) as i32];
                let edge = TILE_EDGE as i32;
                let outside = |c: usize| corner[c] > area.last[c] || corner[c] + edge <= area.first[c];
                if outside(0) || outside(1) {
                    continue;
                }
                let bits = set.tile(*tile);
                for y in 0..TILE_EDGE {
                    let j = corner[1] + y as i32;
                    if j >= area.first[1] && j <= area.last[1] {
                        let row = inside(bits.rows[y as usize], corner[0], &area);
                        window.wake(bent, [corner[0], j], row);
                    }
                }
            }
        }
    }

    /// Takes the result of window k back.
    fn empty(&mut self, ground: &mut Ground, k: usize) -> i32 {
        let window = self.windows[k].get_mut().unwrap_or_else(PoisonError::into_inner);
        let (counts, moving) = (&mut self.counts, &mut self.moving);
        counts.visited += window.visited;
        window.empty(&mut self.feet.list, |[i, j], heights| {
            let [gained, moved, lifted] = ground.put_row(i, j, heights, |i| moving.mark([i, j]));
            counts.gained += gained;
            counts.moved += moved;
            counts.lifted += lifted as f64;
        });
        let (repose, curvature) = (&mut self.repose, &mut self.curvature);
        window.active(|bent, [i, j], end| {
            if bent { &mut *curvature } else { &mut *repose }.mark_row(i, end, j);
        });
        window.largest
    }

    /// Copies the active set.
    pub fn save(&self, out: &mut SavedActiveSet) {
        self.moving.save(&mut out.moving);
        self.repose.save(&mut out.repose);
        self.curvature.save(&mut out.curvature);
        out.counts = self.counts;
    }

    /// Whether a saved state lies in this ground.
    pub fn fits(&self, saved: &SavedActiveSet) -> bool {
        self.moving.fits(&saved.moving)
            && self.repose.fits(&saved.repose)
            && self.curvature.fits(&saved.curvature)
    }

    /// Back to a saved state.
    pub fn restore(&mut self, saved: &SavedActiveSet) {
        self.changed.clear();
        self.moving.restore(&saved.moving);
        self.repose.restore(&saved.repose);
        self.curvature.restore(&saved.curvature);
        self.counts = saved.counts;
    }
}

/// The bits of a row of a tile, whose first column is `first`, that lie in `area`: a tile may belong to two areas.
fn inside(bits: u32, first: i32, area: &Rectangle) -> u32 {
    let low = (area.first[0] - first).clamp(0, 31) as u32;
    let high = (area.last[0] - first).clamp(0, 31) as u32;
    bits & (u32::MAX << low) & (u32::MAX >> (31 - high))
}

terraglue_subsystem::persist!(Counts { visited, sweeps, moved, gained, parity, lifted, tallest, range });
terraglue_subsystem::persist!(SavedActiveSet { moving, repose, curvature, counts });
