//! The automaton as the material rule of a soil: load, displacement, a bounded number of sweeps a step.

use crate::awake::SavedAwake;
use crate::cell::{Cell, QUANTUM};
use crate::displace::Site;
use crate::sweep::{Counts, Sweeper};
use crate::values;
use terraglue_ground::{Lattice, TileMapSnapshot, UNIT_M};
use terraglue_soil_contact::{Covered, Ground, Material};
use terraglue_soil_law::SoilParameters;
use terraglue_subsystem::{Config, Error, Result, Variable};

/// κ_max where a scenario is silent, 1/m: a ridge rounded at 2.5 cm.
pub const DEFAULT_CURVATURE: f64 = 40.0;
/// Sweeps per second at a spacing of 1 m: 8 per ms at 1 cm.
const SWEEPS_PER_S_AND_M: f64 = 80.0;
/// Tiles that can be touched before memory is asked for again.
const RESERVE_TILES: usize = 256;

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

/// The material rule of the soil.
pub struct Automaton {
    settings: Settings,
    friction_angle: f64,
    sweeper: Sweeper,
    covered: Vec<[i32; 2]>,
    uncovered: Vec<[i32; 2]>,
    commits: u32,
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
            sweeper: Sweeper::new(nowhere, 0),
            covered: Vec::new(),
            uncovered: Vec::new(),
            commits: 0,
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
        &self.sweeper.counts
    }

    /// Nodes that the next sweep will visit.
    pub fn active_nodes(&self) -> usize {
        self.sweeper.awake.len()
    }

    fn limit(&mut self) {
        self.sweeper.set_limits(self.repose(), self.settings.curvature_max);
    }

    /// Notes which nodes lie below feet, with load and room; wakes those where it matters.
    fn take_feet(&mut self, ground: &Ground, covered: &[Covered]) {
        std::mem::swap(&mut self.covered, &mut self.uncovered);
        self.covered.clear();
        for node in covered {
            let at = [node.i, node.j];
            let height = ground.heights.height(node.i, node.j);
            let now = Cell { load: load_units(node), room: room_units(node, height), covered: self.commits };
            self.sweeper.put_cell(ground, at, now);
            self.covered.push(at);
        }
        for at in &self.uncovered {
            if self.sweeper.cells.get(at[0], at[1]).covered != self.commits {
                self.sweeper.put_cell(ground, *at, Cell { covered: self.commits, ..Cell::default() });
            }
        }
    }

    /// Moves what the feet have pressed out of their nodes to free ones.
    fn displace(&mut self, ground: &mut Ground, covered: &[Covered]) {
        for node in covered.iter().filter(|n| n.pressure > 0.0) {
            let before = ground.heights.units(node.i, node.j);
            let excess = before - ground.surface_units(node.i, node.j);
            if excess <= 0 {
                continue;
            }
            let sweeper = &mut self.sweeper;
            let mut site = Site {
                ground,
                cells: &mut sweeper.cells,
                levels: &mut sweeper.levels,
                awake: &mut sweeper.awake,
            };
            let moved = site.displace([node.i, node.j], excess, self.commits);
            let left = before - ground.heights.units(node.i, node.j);
            sweeper.counts.gained += i64::from(moved - left);
            sweeper.counts.moved += i64::from(moved);
        }
    }

    /// Sweeps of a step of h seconds at most.
    fn budget(&self, h: f64) -> u32 {
        let spacing = self.sweeper.cells.lattice().spacing;
        let sweeps = self.settings.sweeps_per_step.unwrap_or(SWEEPS_PER_S_AND_M * h / spacing);
        // a hair less, so that rounding does not add a sweep
        if h > 0.0 { (sweeps - 1e-9).ceil() as u32 } else { 0 }
    }
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
    awake: SavedAwake,
    covered: Vec<[i32; 2]>,
    commits: u32,
    counts: Counts,
    rescan: bool,
}

impl Material for Automaton {
    type Saved = Saved;

    fn begin(&mut self, ground: &Ground, parameters: &SoilParameters) {
        self.friction_angle = parameters.phi_rad;
        self.sweeper = Sweeper::new(*ground.heights.lattice(), RESERVE_TILES);
        self.covered.reserve(self.reserve);
        self.uncovered.reserve(self.reserve);
        self.limit();
        self.sweeper.scan(ground);
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
        (self.sweeper.counts.visited, self.sweeper.counts.sweeps) = (0, 0);
        if std::mem::take(&mut self.rescan) {
            self.limit();
            self.sweeper.scan(ground);
        }
        self.take_feet(ground, covered);
        self.displace(ground, covered);
        for _ in 0..self.budget(h) {
            if self.sweeper.awake.is_empty() {
                break;
            }
            self.sweeper.sweep(ground);
        }
    }

    fn save(&self, out: &mut Saved) {
        out.settings = Some(self.settings);
        out.friction_angle = self.friction_angle;
        self.sweeper.cells.save(&mut out.cells);
        self.sweeper.levels.save(&mut out.levels);
        self.sweeper.awake.save(&mut out.awake);
        out.covered.clone_from(&self.covered);
        (out.commits, out.counts) = (self.commits, self.sweeper.counts);
        out.rescan = self.rescan;
    }

    fn restore(&mut self, saved: &Saved) {
        self.settings = saved.settings.unwrap_or(self.settings);
        self.friction_angle = saved.friction_angle;
        self.sweeper.cells.restore(&saved.cells);
        self.sweeper.levels.restore(&saved.levels);
        self.sweeper.awake.restore(&saved.awake);
        self.covered.clone_from(&saved.covered);
        (self.commits, self.sweeper.counts) = (saved.commits, saved.counts);
        self.rescan = saved.rescan;
        self.limit();
    }
}
