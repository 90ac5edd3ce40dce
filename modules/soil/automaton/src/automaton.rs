//! The automaton as the material rule of a soil: load, displacement, a bounded number of sweeps a step.

use crate::coarse::{as_found, relax};
use crate::compaction::{Compaction, SavedCompaction};
use crate::displacement::Site;
use crate::feet::Foot;
use crate::sweep::{Counts, ROUND, SavedActiveSet, Sweeper};
use crate::values::variables;
use std::sync::Arc;
use terraglue_ground::{Lattice, UNIT_M};
use terraglue_soil_contact::{Covered, Ground, Material};
use terraglue_soil_law::SoilParameters;
use terraglue_subsystem::{Config, Error, Host, Result, Variable};

/// Default of κ_max, 1/m: a ridge rounded at 2.5 cm.
pub const DEFAULT_CURVATURE: f64 = 40.0;
/// Default share of the pressed volume that becomes denser: 1 − D_r. Loose soil (D_r = 0) gives way by compaction alone, dense
/// soil (D_r = 1) is pushed aside whole (Vesić 1973, general and punching shear failure). The relative density of the upper 15
/// cm of lunar soil is 65 % (Carrier, Olhoeft and Mendell 1991, Lunar Sourcebook, table 9.5).
pub const DEFAULT_COMPACTION: f64 = 0.35;
/// Height of a slide of which nothing is known yet, m.
const FIRST_SLIDE: f64 = 0.1;

/// Sweeps before the first step at most; material not at rest then goes on in the run.
const MOST_SWEEPS: u32 = 100_000;

/// Parameters of the automaton.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// κ_max, 1/m.
    pub curvature_max: f64,
    /// Angle of repose, rad; `None`: the angle of internal friction.
    pub angle_of_repose: Option<f64>,
    /// Sweeps per step at most; `None`: as many as a front with the speed of shallow water, √(g·h), passes nodes.
    pub sweeps_per_step: Option<f64>,
    /// Height of steep slopes that stand, m; `None`: that of the cohesion.
    pub critical_height: Option<f64>,
    /// Share of the pressed volume that becomes denser, 0 … 1.
    pub compacted_fraction: f64,
    /// Whether steep ground comes to rest before the first step.
    pub settle_at_start: bool,
}

impl Settings {
    /// From a scenario's table. Refused: numbers without sense.
    ///
    /// # Errors
    /// [`Error::Refused`]: a number without sense.
    pub fn from_config(config: &Config) -> Result<Self> {
        let settings = Self {
            curvature_max: config.optional_number("curvature_max_per_m")?.unwrap_or(DEFAULT_CURVATURE),
            angle_of_repose: config.optional_number("angle_of_repose_rad")?,
            sweeps_per_step: config.optional_number("sweeps_per_step")?.filter(|s| *s > 0.0),
            compacted_fraction: config.optional_number("compacted_fraction")?.unwrap_or(DEFAULT_COMPACTION),
            settle_at_start: config.flag("settle_at_start")?,
            critical_height: config.optional_number("critical_height_m")?,
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
    /// Angles of internal friction of the soils of the mask, rad.
    others: Vec<f64>,
    /// Smallest height of a steep slope that stands in any of the soils, m, and smallest share of it up to which loose soil at rest does.
    critical_height: f64,
    loose_share: f64,
    gravity: f64,
    /// ½·ρ·g·Δ²·unit²: energy of a unit of the sum of the squares of the heights, J.
    weight: f64,
    spacing: f64,
    sweeper: Sweeper,
    compaction: Compaction,
    /// Time that was not swept yet, s; with `sweeps_per_step` sweeps that were not used.
    credit: f64,
    commits: u32,
    rescan: bool,
    reserve: usize,
    host: Arc<dyn Host>,
}

impl Automaton {
    /// An automaton without ground yet.
    pub fn new(settings: Settings, host: Arc<dyn Host>) -> Self {
        let nowhere = Lattice { origin: [0.0; 2], spacing: 1.0, size: [1, 1] };
        Self {
            settings,
            friction_angle: 0.5,
            others: Vec::new(),
            critical_height: 0.0,
            loose_share: 0.0,
            gravity: 0.0,
            weight: 0.0,
            spacing: 1.0,
            sweeper: Sweeper::new(nowhere, host.clone(), 0),
            compaction: Compaction::new(nowhere, 0.0),
            credit: 0.0,
            commits: 0,
            rescan: false,
            reserve: host.max_nodes() as usize,
            host,
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

    /// Counts of the work done.
    pub fn counts(&self) -> &Counts {
        &self.sweeper.counts
    }

    /// Material that became denser.
    pub fn compaction(&self) -> &Compaction {
        &self.compaction
    }

    /// Nodes that the next sweep will visit.
    pub fn active_nodes(&self) -> usize {
        self.sweeper.active()
    }

    fn limit(&mut self) {
        // one that the scenario gives holds everywhere
        let others = if self.settings.angle_of_repose.is_some() { &[][..] } else { &self.others };
        let critical = self.settings.critical_height.unwrap_or(self.critical_height);
        let critical = [critical, critical * self.loose_share];
        let Settings { curvature_max, .. } = self.settings;
        self.sweeper.set_limits(self.repose(), others, curvature_max, critical, self.spacing);
        self.compaction.set_fraction(self.settings.compacted_fraction);
    }

    fn take(&mut self, ground: &Ground, parameters: &SoilParameters) {
        let soils = || std::iter::once(parameters).chain(&ground.mask.soils).map(SoilParameters::wall);
        self.critical_height = soils().map(|wall| wall.critical_height()).fold(f64::INFINITY, f64::min);
        self.loose_share = soils().map(|wall| wall.loose_wall_share()).fold(1.0, f64::min);
        let cell = self.spacing * UNIT_M;
        self.weight = 0.5 * parameters.weight() * cell * cell;
    }

    /// Moves the material pressed out by feet to free nodes, as far as the sum of the squares of the heights may grow by `most`:
    /// the rest waits in its node. Returns by how much it has grown.
    fn displace(&mut self, ground: &mut Ground, covered: &[Covered], most: f64) -> f64 {
        let mut lifted = 0.0;
        for node in covered.iter().filter(|n| n.pressure > 0.0) {
            let before = ground.heights.units(node.i, node.j);
            let excess = before - nearest_unit(node.surface);
            if excess <= 0 {
                continue;
            }
            let sweeper = &mut self.sweeper;
            let mut site = Site {
                ground,
                feet: &sweeper.feet,
                compaction: &mut self.compaction,
                changed: &mut sweeper.changed,
                moving: &mut sweeper.moving,
                most: most - lifted,
                lifted: 0,
            };
            let dense = site.compaction.total();
            let moved = site.displace([node.i, node.j], excess, node.flow, self.commits);
            lifted += site.lifted as f64;
            let dense = self.compaction.total() - dense;
            let left = before - ground.heights.units(node.i, node.j);
            sweeper.counts.gained += i64::from(moved - left) + dense;
            sweeper.counts.moved += i64::from(moved);
        }
        lifted
    }

    /// Slides for h seconds. Returns by how much the sum of the squares of the heights has grown.
    fn slide(&mut self, ground: &mut Ground, h: f64) -> f64 {
        self.sweeper.counts.lifted = 0.0;
        if h <= 0.0 {
            return 0.0;
        }
        match self.settings.sweeps_per_step {
            Some(sweeps) => {
                self.credit += sweeps;
                let whole = whole(self.credit);
                self.credit -= f64::from(whole);
                self.sweeper.sweep(ground, whole);
            }
            None => self.slide_freely(ground, h),
        }
        self.sweeper.counts.lifted
    }

    /// A front passes a node in Δ/√(g·h'), h' the height of the sliding material: no slide is faster than a wave on
    /// shallow water (Savage and Hutter 1989). Time that a step leaves counts for the next, so that halving the
    /// step does not double the slides.
    fn slide_freely(&mut self, ground: &mut Ground, h: f64) {
        self.credit += h;
        self.sweeper.wake_changed();
        while !self.sweeper.sleeps() {
            let tallest = f64::from(self.sweeper.counts.tallest) * UNIT_M;
            let height = if tallest > 0.0 { tallest } else { FIRST_SLIDE };
            let speed = (self.gravity * height).sqrt();
            // a hair more, so that rounding does not drop a sweep
            let most = whole((self.credit * speed / self.spacing).min(f64::from(MOST_SWEEPS)));
            if most == 0 {
                return;
            }
            let before = self.sweeper.counts.sweeps;
            self.sweeper.sweep(ground, most.min(ROUND));
            let swept = f64::from(self.sweeper.counts.sweeps - before);
            self.credit = (self.credit - swept * self.spacing / speed).max(0.0);
        }
        (self.credit, self.sweeper.counts.tallest) = (0.0, 0);
    }
}

fn whole(number: f64) -> u32 {
    (number + 1e-9).floor() as u32
}

/// A height (m, within the range of units) in units, halves upwards.
fn nearest_unit(height: f64) -> i32 {
    let raised = height / UNIT_M + 0.5;
    let towards_zero = raised as i32;
    towards_zero - i32::from(f64::from(towards_zero) > raised)
}

/// Exact copy of the automaton's state.
#[derive(Default)]
pub struct Saved {
    settings: Option<Settings>,
    friction_angle: f64,
    critical_height: f64,
    loose_share: f64,
    active: SavedActiveSet,
    feet: Vec<Foot>,
    compaction: SavedCompaction,
    credit: f64,
    commits: u32,
    rescan: bool,
}

impl Material for Automaton {
    type Saved = Saved;

    fn begin(&mut self, ground: &mut Ground, parameters: &SoilParameters) -> Result {
        let lattice = *ground.heights.lattice();
        self.friction_angle = parameters.phi_rad;
        self.others = ground.mask.soils.iter().map(|soil| soil.phi_rad).collect();
        self.spacing = lattice.spacing;
        self.gravity = parameters.gravity;
        self.take(ground, parameters);
        self.sweeper = Sweeper::new(lattice, self.host.clone(), self.reserve);
        self.compaction = Compaction::new(lattice, self.settings.compacted_fraction);
        self.limit();
        self.sweeper.scan(ground);
        if self.settings.settle_at_start {
            relax(&mut self.sweeper, ground, MOST_SWEEPS)?;
            as_found(ground)?;
            self.sweeper.counts = Counts { parity: self.sweeper.counts.parity, ..Counts::default() };
        }
        Ok(())
    }

    fn variables(&self, first: u32) -> Vec<Variable> {
        variables(first)
    }

    fn value(&self, k: u32, ground: &Ground) -> f64 {
        let counts = self.counts();
        let spacing = ground.heights.lattice().spacing;
        match k {
            0 => self.active_nodes() as f64,
            1 => counts.visited as f64,
            2 => f64::from(counts.sweeps),
            3 => counts.gained as f64,
            4 => counts.gained as f64 / (counts.moved.max(1)) as f64,
            5 => counts.moved as f64 * UNIT_M * spacing * spacing,
            6 => self.settings.curvature_max,
            7 => self.repose(),
            8 => self.settings.sweeps_per_step.unwrap_or(0.0),
            9 => self.settings.compacted_fraction,
            10 => self.compaction.total() as f64 * UNIT_M * spacing * spacing,
            _ => f64::NAN,
        }
    }

    fn set_value(&mut self, k: u32, value: f64) -> Result {
        match k {
            6 => self.settings.curvature_max = value,
            7 => self.settings.angle_of_repose = Some(value),
            8 => self.settings.sweeps_per_step = Some(value).filter(|v| *v > 0.0),
            9 => self.settings.compacted_fraction = value,
            _ => return Err(Error::Refused("this value can only be read".into())),
        }
        self.rescan = true;
        Ok(())
    }

    fn parameters_changed(&mut self, ground: &Ground, parameters: &SoilParameters) {
        let before = (self.friction_angle, self.critical_height, self.loose_share);
        self.friction_angle = parameters.phi_rad;
        self.take(ground, parameters);
        self.rescan |= before != (self.friction_angle, self.critical_height, self.loose_share);
    }

    fn redistribute(&mut self, ground: &mut Ground, covered: &[Covered], most: f64, h: f64) -> f64 {
        self.commits = self.commits.wrapping_add(1);
        (self.sweeper.counts.visited, self.sweeper.counts.sweeps) = (0, 0);
        if std::mem::take(&mut self.rescan) {
            self.limit();
            self.sweeper.scan(ground);
        }
        let sweeper = &mut self.sweeper;
        sweeper.feet.take(ground, covered, &mut sweeper.changed);
        // soil without weight is lifted for nothing
        let most = if self.weight > 0.0 { most / self.weight } else { f64::INFINITY };
        let lifted = self.displace(ground, covered, most);
        self.weight * (lifted + self.slide(ground, h))
    }

    fn save(&self, out: &mut Saved) {
        out.settings = Some(self.settings);
        (out.friction_angle, out.critical_height) = (self.friction_angle, self.critical_height);
        out.loose_share = self.loose_share;
        self.sweeper.save(&mut out.active);
        self.sweeper.feet.save(&mut out.feet);
        self.compaction.save(&mut out.compaction);
        (out.credit, out.commits, out.rescan) = (self.credit, self.commits, self.rescan);
    }

    fn fits(&self, saved: &Saved, ground: &Ground) -> bool {
        let lattice = ground.heights.lattice();
        self.sweeper.fits(&saved.active) && saved.feet.iter().all(|f| lattice.has(f.node[0], f.node[1]))
    }

    fn restore(&mut self, saved: &Saved) {
        self.settings = saved.settings.unwrap_or(self.settings);
        (self.friction_angle, self.critical_height) = (saved.friction_angle, saved.critical_height);
        self.loose_share = saved.loose_share;
        self.sweeper.restore(&saved.active);
        self.sweeper.feet.restore(&saved.feet);
        self.compaction.restore(&saved.compaction);
        (self.credit, self.commits, self.rescan) = (saved.credit, saved.commits, saved.rescan);
        self.limit();
    }
}

terraglue_subsystem::persist!(Settings {
    curvature_max,
    angle_of_repose,
    sweeps_per_step,
    compacted_fraction,
    settle_at_start,
    critical_height,
});
terraglue_subsystem::persist!(Saved {
    settings,
    friction_angle,
    critical_height,
    loose_share,
    active,
    feet,
    compaction,
    credit,
    commits,
    rescan,
});
