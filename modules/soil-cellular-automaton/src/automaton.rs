//! The automaton on the ground of a soil: load, displacement, bounded sweeps over the awake nodes.

use crate::active::ActiveList;
use crate::cell::{Cell, OPEN, QUANTUM};
use crate::displace::Site;
use crate::levels::{EDGE, Levels, MIDDLE};
use crate::rules::{curvature_flux, face_flux};
use crate::values;
use terraglue_ground::{Lattice, TileMap, TileMapSnapshot, UNIT_M};
use terraglue_soil_contact::{Covered, Ground, Material};
use terraglue_soil_law::SoilParameters;
use terraglue_subsystem::{Config, Error, Result, Variable};

/// κ_max where a scenario is silent, 1/m: a ridge rounded at 2.5 cm.
pub const DEFAULT_CURVATURE: f64 = 40.0;
/// Sweeps per second at a spacing of 1 m: 8 per ms at 1 cm.
const SWEEPS_PER_S_AND_M: f64 = 80.0;
/// Tiles of cells that can be touched before memory is asked for again.
const RESERVE_TILES: usize = 256;

/// The four directions of triples; the last two are diagonal.
const TRIPLES: [[i32; 2]; 4] = [[1, 0], [0, 1], [1, 1], [1, -1]];

/// Parameters of the automaton.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// κ_max, 1/m.
    pub curvature_max: f64,
    /// Angle of repose, rad; `None`: the angle of internal friction.
    pub angle_of_repose: Option<f64>,
    /// Sweeps per step at most; `None`: in proportion to the step and the spacing.
    pub sweeps_per_step: Option<f64>,
}

impl Settings {
    /// From a scenario's table. Refused: numbers without sense.
    pub fn from_config(config: &Config) -> Result<Self> {
        let settings = Self {
            curvature_max: config.optional_number("curvature_max_per_m")?.unwrap_or(DEFAULT_CURVATURE),
            angle_of_repose: config.optional_number("angle_of_repose_rad")?,
            sweeps_per_step: config.optional_number("sweeps_per_step")?.filter(|s| *s > 0.0),
        };
        let angle = settings.angle_of_repose.unwrap_or(0.5);
        if !(settings.curvature_max > 0.0 && angle > 0.0 && angle < 1.5) {
            return Err(Error::Refused(
                "`curvature_max_per_m` and `angle_of_repose_rad` must be positive, the angle below 1.5"
                    .into(),
            ));
        }
        Ok(settings)
    }
}

/// What the last step did, and sums since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Counts {
    /// Visits of nodes in the last step.
    pub visited: u64,
    /// Sweeps of the last step.
    pub sweeps: u32,
    /// Units that left a node since the start.
    pub moved: i64,
    /// Sum of all changes since the start, units.
    pub gained: i64,
}

/// The rules in units of height on one lattice.
#[derive(Clone, Copy, Debug, Default)]
struct Limits {
    /// Δ·tan φ_r.
    repose: f64,
    /// κ_max·d² for straight and diagonal triples.
    curvature: [i32; 2],
}

/// The material rule of the soil.
pub struct Automaton {
    settings: Settings,
    friction_angle: f64,
    limits: Limits,
    cells: TileMap<Cell>,
    levels: Levels,
    noted: TileMap<u32>,
    active: ActiveList,
    next: ActiveList,
    changes: Vec<i32>,
    covered: Vec<[i32; 2]>,
    uncovered: Vec<[i32; 2]>,
    lists: u32,
    commits: u32,
    counts: Counts,
    rescan: bool,
    reserve: usize,
}

impl Automaton {
    /// An automaton without ground yet; `nodes` is the largest number of nodes below feet.
    pub fn new(settings: Settings, nodes: u32) -> Self {
        let nowhere = Lattice { origin: [0.0; 2], spacing: 1.0, size: [1, 1] };
        Self {
            settings,
            friction_angle: 0.5,
            limits: Limits::default(),
            cells: TileMap::new(nowhere, Cell::default(), 0),
            levels: Levels::new(nowhere, 0),
            noted: TileMap::new(nowhere, 0, 0),
            active: ActiveList::default(),
            next: ActiveList::default(),
            changes: Vec::new(),
            covered: Vec::new(),
            uncovered: Vec::new(),
            lists: 1,
            commits: 0,
            counts: Counts::default(),
            rescan: false,
            reserve: nodes as usize,
        }
    }

    /// Parameters.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Angle of repose in use, rad.
    pub fn repose(&self) -> f64 {
        self.settings.angle_of_repose.unwrap_or(self.friction_angle)
    }

    /// What was done.
    pub fn counts(&self) -> &Counts {
        &self.counts
    }

    /// Nodes that the next step will visit.
    pub fn active_nodes(&self) -> usize {
        self.active.nodes.len()
    }

    fn set_limits(&mut self, lattice: &Lattice) {
        let d = lattice.spacing;
        let curvature = (self.settings.curvature_max * d * d / UNIT_M).min(5e8) as i32;
        self.limits =
            Limits { repose: d * libm::tan(self.repose()) / UNIT_M, curvature: [curvature, 2 * curvature] };
    }

    /// Wakes every node that one of the rules would move.
    fn scan(&mut self, ground: &Ground) {
        let heights = &ground.heights;
        let [nx, ny] = heights.lattice().tiles();
        for tile in 0..heights.lattice().tile_count() {
            let (a, b) = (tile as u32 % nx, tile as u32 / nx);
            let near = |k: u32, n: u32| k.saturating_sub(1)..=(k + 1).min(n - 1);
            let level = heights.tile(tile).err();
            let flat = level.is_some()
                && near(b, ny)
                    .all(|b| near(a, nx).all(|a| heights.tile((b * nx + a) as usize).err() == level));
            if flat {
                continue;
            }
            let (first, inside) = heights.lattice().tile_nodes(tile);
            for j in first[1]..first[1] + inside[1] {
                for i in first[0]..first[0] + inside[0] {
                    let (i, j) = (i as i32, j as i32);
                    if self.repose_change(ground, i, j) != 0 || self.curvature_change(ground, i, j) != 0 {
                        self.active.wake(&mut self.noted, i, j);
                    }
                }
            }
        }
    }

    /// What the repose rule adds to node (i, j), units: the fluxes over its four faces.
    fn repose_change(&self, ground: &Ground, i: i32, j: i32) -> i32 {
        let block = self.levels.around(i, j, &ground.heights);
        let at = |x: i32, y: i32| block[(MIDDLE as i32 + y * EDGE as i32 + x) as usize];
        let mut change = 0;
        for (a, b) in [(1, 0), (-1, 0), (0, 1), (0, -1)] {
            let across = at(b, a) - at(-b, -a) + at(a + b, b + a) - at(a - b, b - a);
            let flux = face_flux(at(0, 0) - at(a, b), across, self.limits.repose);
            if flux != 0 {
                change -= self.admitted(flux, [i, j], [i + a, j + b]);
            }
        }
        change
    }

    /// A flux from `from` to `to` cut to what the receiver admits.
    fn admitted(&self, flux: i32, from: [i32; 2], to: [i32; 2]) -> i32 {
        if !self.cells.lattice().has(to[0], to[1]) {
            return 0;
        }
        let receiver = if flux > 0 { to } else { from };
        let inlet = self.cells.get(receiver[0], receiver[1]).inlet();
        flux.clamp(-inlet, inlet)
    }

    /// What the curvature rule adds to node (i, j), units: as the middle of four triples and the end of eight.
    fn curvature_change(&self, ground: &Ground, i: i32, j: i32) -> i32 {
        let block = self.levels.around(i, j, &ground.heights);
        let mut change = 0;
        for (k, [a, b]) in TRIPLES.into_iter().enumerate() {
            let limit = self.limits.curvature[k / 2];
            let line: [i32; 5] = std::array::from_fn(|s| {
                block[(MIDDLE as i32 + (s as i32 - 2) * (b * EDGE as i32 + a)) as usize]
            });
            for (middle, share) in [(-1, -1), (0, 2), (1, -1)] {
                let m = (2 + middle) as usize;
                let flux = curvature_flux(line[m - 1] - 2 * line[m] + line[m + 1], limit);
                if flux != 0 {
                    change += share * self.exchanged(flux, [i + middle * a, j + middle * b], [a, b]);
                }
            }
        }
        change
    }

    /// What the middle of a triple receives from each end, cut to what the receivers admit; nothing where a foot
    /// stands or the ground ends.
    fn exchanged(&self, flux: i32, middle: [i32; 2], [a, b]: [i32; 2]) -> i32 {
        let ends = [[middle[0] - a, middle[1] - b], [middle[0] + a, middle[1] + b]];
        let all = [middle, ends[0], ends[1]];
        if all.iter().any(|n| !self.cells.lattice().has(n[0], n[1]) || self.cells.get(n[0], n[1]).loaded()) {
            return 0;
        }
        let inlet = |n: [i32; 2]| self.cells.get(n[0], n[1]).inlet();
        let inlet = if flux > 0 { inlet(middle) } else { inlet(ends[0]).min(inlet(ends[1])) };
        flux.clamp(-inlet, inlet)
    }

    /// One sweep: repose, then curvature, each from its own snapshot. Returns the largest change of a node, units.
    ///
    /// The second rule also visits what the first one set in motion; awake afterwards is what either changed.
    pub fn sweep(&mut self, ground: &mut Ground) -> i32 {
        let mut visit = std::mem::take(&mut self.active);
        let mut woken = std::mem::take(&mut self.next);
        restart(&mut woken, &mut self.lists);
        let first = self.pass(ground, &visit, &mut woken, Self::repose_change);
        let by_first = woken.nodes.len();
        for [i, j] in &visit.nodes {
            woken.note(&mut self.noted, *i, *j);
        }
        restart(&mut visit, &mut self.lists);
        let second = self.pass(ground, &woken, &mut visit, Self::curvature_change);
        for [i, j] in &woken.nodes[..by_first] {
            visit.note(&mut self.noted, *i, *j);
        }
        (self.active, self.next) = (visit, woken);
        self.counts.sweeps += 1;
        first.max(second)
    }

    /// Evaluates a rule on the nodes of `visit`, then applies the changes and wakes what they reach.
    fn pass(
        &mut self,
        ground: &mut Ground,
        visit: &ActiveList,
        woken: &mut ActiveList,
        rule: fn(&Self, &Ground, i32, i32) -> i32,
    ) -> i32 {
        let mut changes = std::mem::take(&mut self.changes);
        changes.clear();
        changes.extend(visit.nodes.iter().map(|[i, j]| rule(self, ground, *i, *j)));
        self.counts.visited += changes.len() as u64;
        let mut largest = 0;
        for ([i, j], change) in visit.nodes.iter().zip(&changes).filter(|(_, change)| **change != 0) {
            self.apply(ground, [*i, *j], *change);
            woken.wake(&mut self.noted, *i, *j);
            largest = largest.max(change.abs());
        }
        self.changes = changes;
        largest
    }

    fn apply(&mut self, ground: &mut Ground, [i, j]: [i32; 2], change: i32) {
        self.levels.ensure([i, j], &ground.heights);
        self.levels.add(i, j, change);
        ground.add_material(i, j, change);
        self.counts.gained += i64::from(change);
        self.counts.moved += i64::from(change.max(0));
        let cell = self.cells.get_mut(i, j);
        if cell.room != OPEN && !cell.loaded() {
            cell.room = (cell.room - change).max(1);
        }
    }

    /// Notes which nodes lie below feet, with load and room; wakes those where it matters.
    fn take_feet(&mut self, ground: &Ground, covered: &[Covered]) {
        std::mem::swap(&mut self.covered, &mut self.uncovered);
        self.covered.clear();
        for node in covered {
            self.levels.ensure([node.i, node.j], &ground.heights);
            let cell = self.cells.get_mut(node.i, node.j);
            let before = *cell;
            cell.load = load_units(node);
            self.levels.add(node.i, node.j, cell.load - before.load);
            cell.room = room_units(node, ground.heights.height(node.i, node.j));
            cell.covered = self.commits;
            let changed = cell.load != before.load || cell.inlet() != before.inlet();
            self.covered.push([node.i, node.j]);
            if changed {
                self.active.wake(&mut self.noted, node.i, node.j);
            }
        }
        for [i, j] in &self.uncovered {
            let cell = self.cells.get_mut(*i, *j);
            if cell.covered != self.commits {
                self.levels.add(*i, *j, -cell.load);
                (cell.room, cell.load) = (OPEN, 0);
                self.active.wake(&mut self.noted, *i, *j);
            }
        }
    }

    /// Moves what the feet have pressed out of their nodes to free ones.
    fn displace(&mut self, ground: &mut Ground, covered: &[Covered]) {
        for node in covered.iter().filter(|n| n.pressure > 0.0) {
            let excess = ground.heights.units(node.i, node.j) - ground.surface_units(node.i, node.j);
            if excess > 0 {
                let before = ground.heights.units(node.i, node.j);
                let mut site = Site {
                    ground,
                    cells: &mut self.cells,
                    levels: &mut self.levels,
                    active: &mut self.active,
                    noted: &mut self.noted,
                };
                let moved = site.displace([node.i, node.j], excess, self.commits);
                let left = before - ground.heights.units(node.i, node.j);
                self.counts.gained += i64::from(moved - left);
                self.counts.moved += i64::from(moved);
            }
        }
    }

    /// Sweeps of a step of h seconds at most.
    fn budget(&self, h: f64) -> u32 {
        let spacing = self.cells.lattice().spacing;
        let sweeps = self.settings.sweeps_per_step.unwrap_or(SWEEPS_PER_S_AND_M * h / spacing);
        // a hair less, so that rounding does not add a sweep
        if h > 0.0 { (sweeps - 1e-9).ceil() as u32 } else { 0 }
    }
}

/// Restarts a list under a fresh number.
fn restart(list: &mut ActiveList, lists: &mut u32) {
    *lists = lists.wrapping_add(1).max(1);
    list.restart(*lists);
}

/// Force-equivalent height p/(N·ρ·g) = z·p/p_law(z) in units, in steps of [`QUANTUM`].
fn load_units(node: &Covered) -> i32 {
    if node.pressure <= 0.0 || node.virgin <= 0.0 {
        return 0;
    }
    let height = node.depth * (node.pressure / node.virgin).min(1.0);
    (height / (UNIT_M * f64::from(QUANTUM))).round() as i32 * QUANTUM
}

/// What fits between the ground and a foot that does not touch it, units.
fn room_units(node: &Covered, height: f64) -> i32 {
    const LARGEST: f64 = 65_536.0;
    if node.pressure > 0.0 { 0 } else { ((node.lower - height) / UNIT_M).clamp(1.0, LARGEST) as i32 }
}

/// Exact copy of the automaton's state.
#[derive(Default)]
pub struct Saved {
    settings: Option<Settings>,
    friction_angle: f64,
    cells: TileMapSnapshot<Cell>,
    levels: TileMapSnapshot<i32>,
    active: ActiveList,
    covered: Vec<[i32; 2]>,
    lists: u32,
    commits: u32,
    counts: Counts,
    rescan: bool,
}

impl Material for Automaton {
    type Saved = Saved;

    fn begin(&mut self, ground: &Ground, parameters: &SoilParameters) {
        self.friction_angle = parameters.phi_rad;
        let lattice = *ground.heights.lattice();
        self.cells = TileMap::new(lattice, Cell::default(), RESERVE_TILES);
        self.levels = Levels::new(lattice, RESERVE_TILES);
        self.noted = TileMap::new(lattice, 0, RESERVE_TILES);
        let nodes = (32 * self.reserve).min(lattice.node_count() + 32);
        self.active.nodes.reserve(nodes);
        self.next.nodes.reserve(nodes);
        self.changes.reserve(nodes);
        self.covered.reserve(self.reserve);
        self.uncovered.reserve(self.reserve);
        self.active.number = self.lists;
        self.set_limits(&lattice);
        self.scan(ground);
    }

    fn variables(&self, first: u32) -> Vec<Variable> {
        values::variables(first)
    }

    fn value(&self, k: u32, ground: &Ground) -> f64 {
        values::value(self, k, ground)
    }

    fn set_value(&mut self, k: u32, value: f64) -> Result {
        match k {
            6 => self.settings.curvature_max = value,
            7 => self.settings.angle_of_repose = Some(value),
            8 => self.settings.sweeps_per_step = Some(value).filter(|v| *v > 0.0),
            _ => return Err(Error::Refused("this value can only be read".into())),
        }
        self.rescan = true;
        Ok(())
    }

    fn parameters_changed(&mut self, parameters: &SoilParameters) {
        self.rescan |= self.friction_angle != parameters.phi_rad;
        self.friction_angle = parameters.phi_rad;
    }

    fn settle(&mut self, ground: &mut Ground, covered: &[Covered], _: &[[i32; 2]], h: f64) {
        self.commits = self.commits.wrapping_add(1);
        (self.counts.visited, self.counts.sweeps) = (0, 0);
        if std::mem::take(&mut self.rescan) {
            let lattice = *ground.heights.lattice();
            self.set_limits(&lattice);
            self.scan(ground);
        }
        self.take_feet(ground, covered);
        self.displace(ground, covered);
        for _ in 0..self.budget(h) {
            if self.active.nodes.is_empty() {
                break;
            }
            self.sweep(ground);
        }
    }

    fn save(&self, out: &mut Saved) {
        out.settings = Some(self.settings);
        out.friction_angle = self.friction_angle;
        self.cells.save(&mut out.cells);
        self.levels.save(&mut out.levels);
        out.active.nodes.clone_from(&self.active.nodes);
        out.active.number = self.active.number;
        out.covered.clone_from(&self.covered);
        (out.lists, out.commits, out.counts) = (self.lists, self.commits, self.counts);
        out.rescan = self.rescan;
    }

    fn restore(&mut self, saved: &Saved) {
        self.settings = saved.settings.unwrap_or(self.settings);
        self.friction_angle = saved.friction_angle;
        self.cells.restore(&saved.cells);
        self.levels.restore(&saved.levels);
        self.active.nodes.clone_from(&saved.active.nodes);
        // the numbers of the nodes are not kept: forget them and note the awake ones again
        self.noted.clear();
        self.active.number = saved.active.number;
        for [i, j] in &self.active.nodes {
            self.noted.set(*i, *j, self.active.number);
        }
        self.covered.clone_from(&saved.covered);
        (self.lists, self.commits, self.counts) = (saved.lists, saved.commits, saved.counts);
        self.rescan = saved.rescan;
        let lattice = *self.cells.lattice();
        self.set_limits(&lattice);
    }
}
