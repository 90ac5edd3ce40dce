//! The automaton as the material rule of a soil: load, displacement, a bounded number of sweeps a step.

use crate::coarse::{as_found, settle};
use crate::compaction::{Compaction, SavedCompaction};
use crate::displace::Site;
use crate::feet::Foot;
use crate::sweep::{Counts, SavedAwake, Sweeper};
use crate::values;
use std::sync::Arc;
use terraglue_ground::{Lattice, UNIT_M};
use terraglue_soil_contact::{Covered, Ground, Material};
use terraglue_soil_law::SoilParameters;
use terraglue_subsystem::{Config, Error, Host, Result, Variable};

/// κ_max where a scenario is silent, 1/m: a ridge rounded at 2.5 cm.
pub const DEFAULT_CURVATURE: f64 = 40.0;
/// Share of the pressed volume that becomes denser where a scenario is silent.
pub const DEFAULT_COMPACTION: f64 = 0.25;
/// Speed of the front of a slide where a scenario is silent, m/s: two sweeps per ms at 1 cm.
const FRONT_SPEED: f64 = 20.0;

/// Sweeps before the first step at most; what is not at rest then goes on in the run.
const MOST_SWEEPS: u32 = 100_000;

/// Parameters of the automaton.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// κ_max, 1/m.
    pub curvature_max: f64,
    /// Angle of repose, rad; `None`: the angle of internal friction.
    pub angle_of_repose: Option<f64>,
    /// Sweeps per step at most; `None`: in proportion to the step and the spacing.
    pub sweeps_per_step: Option<f64>,
    /// Share of the pressed volume that becomes denser, 0 … 1.
    pub compacted_fraction: f64,
    /// Whether steep ground comes to rest before the first step.
    pub settle_at_start: bool,
}

impl Settings {
    /// From a scenario's table. Refused: numbers without sense.
    pub fn from_config(config: &Config) -> Result<Self> {
        let settings = Self {
            curvature_max: config.optional_number("curvature_max_per_m")?.unwrap_or(DEFAULT_CURVATURE),
            angle_of_repose: config.optional_number("angle_of_repose_rad")?,
            sweeps_per_step: config.optional_number("sweeps_per_step")?.filter(|s| *s > 0.0),
            compacted_fraction: config.optional_number("compacted_fraction")?.unwrap_or(DEFAULT_COMPACTION),
            settle_at_start: config.flag("settle_at_start")?,
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
    spacing: f64,
    sweeper: Sweeper,
    compaction: Compaction,
    /// Sweeps that the steps so far have earned and not used.
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

    /// What was done.
    pub fn counts(&self) -> &Counts {
        &self.sweeper.counts
    }

    /// Material that became denser.
    pub fn compaction(&self) -> &Compaction {
        &self.compaction
    }

    /// Nodes that the next sweep will visit.
    pub fn active_nodes(&self) -> usize {
        self.sweeper.awake()
    }

    fn limit(&mut self) {
        // one that the scenario gives holds everywhere
        let others = if self.settings.angle_of_repose.is_some() { &[][..] } else { &self.others };
        self.sweeper.set_limits(self.repose(), others, self.settings.curvature_max, self.spacing);
        self.compaction.set_fraction(self.settings.compacted_fraction);
    }

    /// Moves what the feet have pressed out of their nodes to free ones.
    fn displace(&mut self, ground: &mut Ground, covered: &[Covered]) {
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
            };
            let dense = site.compaction.total();
            let moved = site.displace([node.i, node.j], excess, self.commits);
            let dense = self.compaction.total() - dense;
            let left = before - ground.heights.units(node.i, node.j);
            sweeper.counts.gained += i64::from(moved - left) + dense;
            sweeper.counts.moved += i64::from(moved);
        }
    }

    /// Sweeps of a step of h seconds at most: what the steps have earned, so that halving h does not double them.
    fn budget(&mut self, h: f64) -> u32 {
        let earned = self.settings.sweeps_per_step.unwrap_or(FRONT_SPEED * h / self.spacing);
        self.credit += if h > 0.0 { earned } else { 0.0 };
        // a hair more, so that rounding does not drop a sweep
        let whole = (self.credit + 1e-9).floor();
        self.credit = (self.credit - whole).max(0.0);
        whole as u32
    }
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
    awake: SavedAwake,
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
        self.sweeper = Sweeper::new(lattice, self.host.clone(), self.reserve);
        self.compaction = Compaction::new(lattice, self.settings.compacted_fraction);
        self.limit();
        self.sweeper.scan(ground);
        if self.settings.settle_at_start {
            settle(&mut self.sweeper, ground, MOST_SWEEPS)?;
            as_found(ground)?;
            self.sweeper.counts = Counts { parity: self.sweeper.counts.parity, ..Counts::default() };
        }
        Ok(())
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
            9 => self.settings.compacted_fraction = value,
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
        let sweeper = &mut self.sweeper;
        sweeper.feet.take(ground, covered, &mut sweeper.changed);
        self.displace(ground, covered);
        let most = self.budget(h);
        self.sweeper.sweep(ground, most);
    }

    fn save(&self, out: &mut Saved) {
        out.settings = Some(self.settings);
        out.friction_angle = self.friction_angle;
        self.sweeper.save(&mut out.awake);
        self.sweeper.feet.save(&mut out.feet);
        self.compaction.save(&mut out.compaction);
        (out.credit, out.commits, out.rescan) = (self.credit, self.commits, self.rescan);
    }

    fn fits(&self, saved: &Saved, ground: &Ground) -> bool {
        let lattice = ground.heights.lattice();
        self.sweeper.fits(&saved.awake) && saved.feet.iter().all(|f| lattice.has(f.node[0], f.node[1]))
    }

    fn restore(&mut self, saved: &Saved) {
        self.settings = saved.settings.unwrap_or(self.settings);
        self.friction_angle = saved.friction_angle;
        self.sweeper.restore(&saved.awake);
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
});
terraglue_subsystem::persist!(Saved {
    settings,
    friction_angle,
    awake,
    feet,
    compaction,
    credit,
    commits,
    rescan,
});
