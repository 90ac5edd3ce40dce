//! The two rules on the whole field, node by node, face by face, without windows, sleep or vectors.

use terraglue_ground::UNIT_M;
use terraglue_soil_contact::Ground;

/// Largest flux of a sweep, units.
const LARGEST: f32 = 4e6;
/// Admitted over one path into a node with open sky, units.
const OPEN: i32 = i32::MAX / 16;

/// Heights, load and room of every node.
pub struct Plain {
    size: [i32; 2],
    heights: Vec<i32>,
    load: Vec<i32>,
    /// `None`: open sky.
    room: Vec<Option<i32>>,
    /// Δ·tan φ_r of every node.
    threshold: Vec<f32>,
    curvature: i32,
    /// Height of steep slopes that stand, units.
    critical: i32,
}

/// |flux| rounded down to whole units, with the sign of `direction`: a whole flux loses at most one unit more, since half
/// a unit is taken away and the rest rounded to the nearest even number.
fn whole(magnitude: f32, direction: i32) -> i32 {
    (magnitude.min(LARGEST) - 0.5).max(0.0).round_ties_even() as i32 * direction.signum()
}

impl Plain {
    /// A copy of the ground without feet; `repose` has the angle of every soil of its mask, `critical` (m) is the height of
    /// steep slopes that stand.
    pub fn new(ground: &Ground, repose: &[f64], curvature: f64, critical: f64) -> Self {
        let lattice = ground.heights.lattice();
        let size = lattice.size.map(|n| n as i32);
        let nodes = (0..size[1]).flat_map(|j| (0..size[0]).map(move |i| (i, j)));
        let heights: Vec<i32> = nodes.clone().map(|(i, j)| ground.heights.units(i, j)).collect();
        let of = |(i, j)| (lattice.spacing * libm::tan(repose[ground.mask.at(i, j)]) / UNIT_M) as f32;
        let n = heights.len();
        Self {
            size,
            heights,
            load: vec![0; n],
            room: vec![None; n],
            threshold: nodes.map(of).collect(),
            curvature: (curvature * lattice.spacing * lattice.spacing / UNIT_M).max(critical / UNIT_M) as i32,
            critical: (critical / UNIT_M) as i32,
        }
    }

    /// Feet: (node, force-equivalent height, room).
    pub fn stand(&mut self, feet: impl Iterator<Item = ([i32; 2], i32, i32)>) {
        self.load.fill(0);
        self.room.fill(None);
        for ([i, j], load, room) in feet {
            let k = (j * self.size[0] + i) as usize;
            (self.load[k], self.room[k]) = (load, Some(room));
        }
    }

    /// Height in units.
    pub fn height(&self, i: i32, j: i32) -> i32 {
        self.heights[self.place(i, j)]
    }

    fn place(&self, i: i32, j: i32) -> usize {
        (j.clamp(0, self.size[1] - 1) * self.size[0] + i.clamp(0, self.size[0] - 1)) as usize
    }

    fn level(&self, i: i32, j: i32) -> i32 {
        let k = self.place(i, j);
        self.heights[k] + self.load[k]
    }

    /// Largest amount that one path may bring into a node.
    fn inlet(&self, i: i32, j: i32) -> i32 {
        if i < 0 || j < 0 || i >= self.size[0] || j >= self.size[1] {
            return 0;
        }
        self.room[self.place(i, j)].map_or(OPEN, |room| (room - room % 256) / 16)
    }

    /// Sweep number `number`: repose, and curvature when the number is even.
    pub fn sweep(&mut self, number: u32) {
        self.apply(Self::repose);
        if number.is_multiple_of(2) {
            self.apply(Self::curvature);
        }
    }

    fn apply(&mut self, rule: fn(&Self, &mut [i32])) {
        let mut change = vec![0; self.heights.len()];
        rule(self, &mut change);
        for k in 0..change.len() {
            self.heights[k] += change[k];
            // material that comes below a foot takes its room; a foot that stands keeps none
            if let Some(room) = self.room[k].filter(|room| *room != 0 && change[k] != 0) {
                self.room[k] = Some(room.saturating_sub(change[k]).max(1));
            }
        }
    }

    fn repose(&self, change: &mut [i32]) {
        for j in 0..self.size[1] {
            for i in 0..self.size[0] {
                for [a, b] in [[1, 0], [0, 1]] {
                    let m = [i + a, j + b];
                    let Some((along, share)) = self.steep([i, j], [a, b]) else { continue };
                    let inlets = [self.inlet(i, j), self.inlet(m[0], m[1])];
                    // a node without inlet is closed; a low steep slope stands
                    if inlets.contains(&0)
                        || self.critical > 0 && self.run([i, j], [a, b]) <= i64::from(self.critical)
                    {
                        continue;
                    }
                    let flux = whole(0.25 * (along as f32).abs() * share, along);
                    let flux = flux.clamp(-inlets[0], inlets[1]);
                    change[self.place(i, j)] -= flux;
                    change[self.place(m[0], m[1])] += flux;
                }
            }
        }
    }

    /// The fall over the face from a node in the direction [a, b] where it is steeper than the angle of repose, and (g −
    /// threshold)/g.
    fn steep(&self, [i, j]: [i32; 2], [a, b]: [i32; 2]) -> Option<(i32, f32)> {
        let (n, m) = ([i, j], [i + a, j + b]);
        let along = self.level(i, j) - self.level(m[0], m[1]);
        let across = |[i, j]: [i32; 2]| self.level(i + b, j + a) - self.level(i - b, j - a);
        let (along_f, across_f) = (along as f32, (across(n) + across(m)) as f32 * 0.25);
        let squared = along_f * along_f + across_f * across_f;
        // the upper node's material slides
        let upper = if along > 0 { n } else { m };
        let threshold = self.threshold[self.place(upper[0], upper[1])];
        (squared > threshold * threshold).then(|| (along, 1.0 - threshold / squared.sqrt()))
    }

    /// Height of the steep run through the face from a node in the direction [a, b].
    fn run(&self, [i, j]: [i32; 2], [a, b]: [i32; 2]) -> i64 {
        let Some((own, _)) = self.steep([i, j], [a, b]) else { return 0 };
        let inside = |[i, j]: [i32; 2]| i >= 0 && j >= 0 && i < self.size[0] && j < self.size[1];
        let mut height = i64::from(own);
        for way in [-1, 1] {
            let mut at = [i + way * a, j + way * b];
            while inside(at) && inside([at[0] + a, at[1] + b]) {
                match self.steep(at, [a, b]) {
                    Some((next, _)) if next != 0 && (next > 0) == (own > 0) => height += i64::from(next),
                    _ => break,
                }
                at = [at[0] + way * a, at[1] + way * b];
            }
        }
        height.abs()
    }

    fn curvature(&self, change: &mut [i32]) {
        for j in 0..self.size[1] {
            for i in 0..self.size[0] {
                for ([a, b], limit) in [([1, 0], 1), ([0, 1], 1), ([1, 1], 2), ([1, -1], 2)] {
                    let ends = [[i - a, j - b], [i + a, j + b]];
                    let [low, high] = ends.map(|[i, j]| self.level(i, j));
                    let bent = low + high - 2 * self.level(i, j);
                    let excess = (bent.abs() - limit * self.curvature).max(0);
                    let inlets = ends.map(|[i, j]| self.inlet(i, j));
                    let least = self.inlet(i, j).min(inlets[0]).min(inlets[1]);
                    let flux = whole(excess as f32 / 24.0, bent).clamp(-least, least);
                    change[self.place(i, j)] += 2 * flux;
                    ends.iter().for_each(|[i, j]| change[self.place(*i, *j)] -= flux);
                }
            }
        }
    }
}
