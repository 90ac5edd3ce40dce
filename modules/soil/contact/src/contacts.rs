//! Variables of wheels and feet: numbers of the last commit, one set per contact.

use crate::patch_nodes::PatchNodes;
use crate::wheel::Wheel;
use terraglue_subsystem::{Causality, Variable};

/// Name, unit and meaning of the variables.
const QUANTITIES: [(&str, &str, &str); 9] = [
    ("slip", "", "slip of a wheel: 0 rolls, 1 spins on the spot, below 0 is braked; 0 for a foot"),
    ("sinkage", "m", "depth of the deepest point below the reference level of the soil there"),
    ("area", "m^2", "area that carries pressure, in the tangent plane"),
    ("mean_pressure", "Pa", "mean of the pressure over that area"),
    ("largest_pressure", "Pa", "largest pressure of a node"),
    ("normal_force", "N", "force of the soil along the normal of the ground"),
    (
        "pull",
        "N",
        "drawbar pull: force of the soil along the way that a wheel is driven, or along t1 for a foot",
    ),
    ("torque", "N m", "torque that drives a wheel against the soil; 0 for a foot"),
    ("power", "W", "torque times rate of turning"),
];

/// One contact's numbers, in the order of the variables.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    key: u64,
    values: [f64; QUANTITIES.len()],
}

/// Contacts numbered in the order of their first touch; those of one step by their keys.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Contacts {
    shown: usize,
    all: Vec<Contact>,
}

impl Contacts {
    /// Variables for at most `shown` contacts.
    pub fn new(shown: usize) -> Self {
        Self { shown, all: Vec::with_capacity(shown) }
    }

    /// The variables, numbered from `first`.
    pub fn variables(&self, first: u32) -> Vec<Variable> {
        let numbers = (first..).zip((0..self.shown).flat_map(|c| QUANTITIES.iter().map(move |q| (c, q))));
        numbers
            .map(|(id, (c, (name, unit, help)))| {
                Variable::real(id, format!("contact{}.{name}", c + 1), unit, Causality::Output, help)
            })
            .collect()
    }

    /// Value of variable number k.
    pub fn value(&self, k: usize) -> f64 {
        let count = QUANTITIES.len();
        self.all.get(k / count).map_or(0.0, |c| c.values[k % count])
    }

    /// A commit begins: nothing touches yet.
    pub fn begin(&mut self) {
        self.all.iter_mut().for_each(|c| c.values.fill(0.0));
    }

    /// Puts the numbers of a contact where they belong.
    pub fn tell(&mut self, key: u64, touch: &Touch) {
        let known = self.all.iter().position(|c| c.key == key);
        if known.is_none() && self.all.len() < self.shown {
            self.all.push(Contact { key, values: [0.0; QUANTITIES.len()] });
        }
        if let Some(c) = known.or(self.all.len().checked_sub(1)).and_then(|k| self.all.get_mut(k))
            && c.key == key
        {
            c.values = touch.values();
        }
    }

    /// Whether there are any.
    pub fn any(&self) -> bool {
        self.shown > 0
    }
}

/// A wheel whose rim and axle are slower stands, m/s: soil under load creeps on the last nanometres of its balance.
const STANDS: f64 = 1e-4;

/// Result of a commit below a contact.
#[derive(Clone, Copy, Debug, Default)]
pub struct Touch {
    /// Sum of the areas with pressure, m².
    pub area: f64,
    /// Σ pressure·area, N.
    pub carried: f64,
    /// Largest pressure, Pa.
    pub largest: f64,
    /// Largest depth, m.
    pub sinkage: f64,
    /// The node where it is.
    deepest: usize,
    slip: f64,
    normal: f64,
    pull: f64,
    torque: f64,
    power: f64,
}

impl Touch {
    /// Takes a node with pressure.
    pub fn add(&mut self, nodes: &PatchNodes, k: usize, pressure: f64, depth: f64) {
        self.area += nodes.area[k];
        self.carried += nodes.area[k] * pressure;
        self.largest = self.largest.max(pressure);
        if depth > self.sinkage {
            (self.sinkage, self.deepest) = (depth, k);
        }
    }

    /// Takes the lowest point of the underside, which lies between the nodes in `range` of a lattice of `spacing` (m) over ground with
    /// the normal `n`.
    pub fn look_between(
        &mut self,
        nodes: &PatchNodes,
        range: std::ops::Range<usize>,
        n: [f64; 3],
        spacing: f64,
    ) {
        if self.sinkage > 0.0 {
            self.sinkage += nodes.dip(self.deepest, range, n, spacing);
        }
    }

    /// Takes the wheel there, if any, the wrench on the body and its motion `x` over `h` seconds.
    pub fn under(&mut self, wheel: Option<&Wheel>, wrench: &[f64; 6], x: &[f64; 6], h: f64) {
        self.normal = wrench[0];
        self.pull = wrench[1];
        if let Some(wheel) = wheel {
            self.roll(wheel, wrench, x, h);
        }
    }

    fn roll(&mut self, wheel: &Wheel, wrench: &[f64; 6], x: &[f64; 6], h: f64) {
        let [a, b] = wheel.driven(x);
        let fastest = wheel.ways(x).into_iter().fold(0.0, |m: f64, way| m.max(way.abs()));
        self.slip = if fastest > STANDS * h { wheel.rolled(x).slip } else { 0.0 };
        self.pull = a * wrench[1] + b * wrench[2];
        // about the axle
        let [up, along] = wheel.above();
        let ahead = along * (a * wheel.heading[0] + b * wheel.heading[1]);
        self.torque = up * self.pull - ahead * self.normal - (a * wrench[5] - b * wrench[4]);
        self.power = self.torque * (a * x[5] - b * x[4]) / h;
    }

    fn values(&self) -> [f64; QUANTITIES.len()] {
        let mean = if self.area > 0.0 { self.carried / self.area } else { 0.0 };
        let Self { slip, sinkage, area, largest, normal, pull, torque, power, .. } = *self;
        [slip, sinkage, area, mean, largest, normal, pull, torque, power]
    }
}

terraglue_subsystem::persist!(Contact { key, values });
terraglue_subsystem::persist!(Contacts { shown, all });
