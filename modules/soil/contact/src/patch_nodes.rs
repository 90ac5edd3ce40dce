//! The nodes below contacts: per node depth, area, history, how the underside faces the soil; one array per quantity.

use crate::spread::Spread;
use crate::vectors::{displacement, dot};
use terraglue_soil_law::ShearState;
use terraglue_subsystem::Port;

/// Orientation of the underside at a node; vectors along n, t1, t2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facing {
    /// ν·n_z/ν_z with the body's inward normal ν: pressure·area acts along it on the body, and a displacement d of
    /// the body changes the depth by −press·d, so that the force does the work that the soil takes up.
    pub press: [f64; 3],
    /// Unit vectors in the underside: t1 and t2 turned with n onto ν.
    pub along: [[f64; 3]; 2],
    /// Area of the underside over that in the tangent plane: |press|, or more where faces meet in the cell.
    pub stretch: f64,
}

/// Smallest part of `press` along n: an underside that looks away from the soil is met edgewise.
const EDGEWISE: f64 = 0.05;

impl Facing {
    /// Of an underside with the slopes ∂z/∂x and ∂z/∂y.
    pub fn new(port: &Port, slope: [f64; 2]) -> Self {
        let n_z = port.frame[2];
        let inward = [-slope[0] * n_z, -slope[1] * n_z, n_z];
        let mut press: [f64; 3] = std::array::from_fn(|c| dot(port.direction(c), inward));
        press[0] = press[0].max(EDGEWISE);
        let stretch = dot(press, press).sqrt();
        let nu = press.map(|c| c / stretch);
        let turned = |c: usize| {
            let s = nu[c] / (1.0 + nu[0]);
            let mut e = [-s * (1.0 + nu[0]), -s * nu[1], -s * nu[2]];
            e[c] += 1.0;
            e
        };
        Self { press, along: [turned(1), turned(2)], stretch }
    }

    /// Inward unit normal along n, t1, t2.
    #[inline]
    pub fn inward(&self) -> [f64; 3] {
        let length = dot(self.press, self.press).sqrt();
        self.press.map(|c| c / length)
    }

    /// Displacement along the underside.
    #[inline]
    pub fn slide(&self, moved: [f64; 3]) -> [f64; 2] {
        self.along.map(|e| dot(e, moved))
    }
}

/// A plane over the cell of a node: height there (world, m) and slopes.
#[derive(Clone, Copy, Debug)]
pub struct Plane {
    /// Height at the node, m.
    pub height: f64,
    /// ∂z/∂x and ∂z/∂y.
    pub slope: [f64; 2],
}

/// Part of `area` (m²) that was loaded where `loaded` (m²) was.
pub fn loaded_part(loaded: f64, area: f64) -> f64 {
    if loaded < area { loaded / area } else { 1.0 }
}

/// The nodes of all patches, one array per quantity.
#[derive(Clone, Debug, Default)]
pub struct PatchNodes {
    /// Lattice indices.
    pub index: Vec<[i32; 2]>,
    /// The underside at the node at X = 0.
    pub plane: Vec<Plane>,
    /// Mean depth of the underside in the cell below the reference level of the bed along n at X = 0, m.
    pub depth: Vec<f64>,
    /// Spread of the depths in the cell about it.
    pub spread: Vec<Spread>,
    /// Mean depth of the underside along n up to which the node carries nothing, m: of the unloaded surface where the cell is in the
    /// soil as a whole.
    pub permanent: Vec<f64>,
    /// Depth of the bed's surface along n when the contact began, m.
    pub bed: Vec<f64>,
    /// Height of the loose soil on it then, along n, m.
    pub loose: Vec<f64>,
    /// Part of the pressure of first loading that the soil bears here.
    pub share: Vec<f64>,
    /// Passive pressure that it bears in addition, a + b·z: Pa and Pa/m.
    pub passive: Vec<[f64; 2]>,
    /// Pressure up to which the node is elastic wherever it is, Pa; −∞: it yields at X = 0.
    pub bound: Vec<f64>,
    /// Pressure at the last commit, Pa.
    pub before: Vec<f64>,
    /// Whether the foot has come over the node from the side, deeper than its surface.
    pub entered: Vec<bool>,
    /// Depth of the underside below `depth`, m: behind the peak of a wheel's stress; NaN elsewhere.
    pub relief: Vec<f64>,
    /// Area in the tangent plane, m²; 0 where another port presses deeper.
    pub area: Vec<f64>,
    /// Part of the area that was loaded at the last commit.
    pub loaded_part: Vec<f64>,
    /// From the port's origin to the underside at the node along n, t1, t2, m.
    pub arm: Vec<[f64; 3]>,
    /// Orientation of the underside.
    pub facing: Vec<Facing>,
    /// Which of [`Patches::laws`] holds at the node.
    pub law: Vec<usize>,
    /// Shear history.
    pub shear: Vec<ShearState>,
    /// Doubles per node that a law keeps, and their values, node after node.
    pub doubles: usize,
    /// See `doubles`.
    pub memory: Vec<f64>,
    /// Share of the shear strength that the slip so far has mobilised.
    pub mobilised: Vec<f64>,
    /// Reference level, world, m.
    pub reference: Vec<f64>,
    /// Number of the commit at which the node was last loaded; 0: no foot stood here.
    pub stamp: Vec<u64>,
    /// Depth with the rotation of a trial; scratch.
    pub turned: Vec<f64>,
}

impl PatchNodes {
    /// Shear stress on the soil at node k at the last commit, Pa, turned from the underside into the plane of t1 and t2;
    /// `stiffness`: of the shear law, Pa/m.
    #[inline]
    pub fn shear_stress(&self, k: usize, stiffness: f64) -> [f64; 2] {
        let (e, along) = (self.shear[k].elastic, &self.facing[k].along);
        let flat = [1, 2].map(|c| e[0] * along[0][c] + e[1] * along[1][c]);
        let (all, in_plane) = (e[0] * e[0] + e[1] * e[1], flat[0] * flat[0] + flat[1] * flat[1]);
        let scale = if in_plane > 0.0 { stiffness * (all / in_plane).sqrt() } else { 0.0 };
        flat.map(|c| scale * c)
    }

    /// Force of a node on the body along n, t1, t2 under a pressure and a shear stress.
    #[inline]
    pub fn force(&self, k: usize, pressure: f64, tau: [f64; 2]) -> [f64; 3] {
        let facing = &self.facing[k];
        let area = self.area[k];
        let inclined = area * facing.stretch;
        std::array::from_fn(|c| {
            area * pressure * facing.press[c]
                - inclined * (tau[0] * facing.along[0][c] + tau[1] * facing.along[1][c])
        })
    }

    /// Of the nodes that two contacts cover, the deeper one presses, with the areas of both, and the other one's area there becomes 0: the
    /// soil of a cell has one height. Where the other underside lies higher, it counts as far as the pressure of elastic soil
    /// that comes back by the difference. `cells`: area of a whole cell in the tangent plane of each, m²; `elastic`: stiffness of the soil of a
    /// number, Pa/m; `loaded`: area of a node that was loaded at the last commit, m².
    pub fn share_between(
        &mut self,
        [a, b]: [std::ops::Range<usize>; 2],
        cells: [f64; 2],
        elastic: impl Fn(usize) -> f64,
        loaded: impl Fn([i32; 2]) -> f64,
    ) {
        for k in a {
            let Some(l) = b.clone().find(|l| self.index[*l] == self.index[k]) else { continue };
            let deeper = self.depth[k] >= self.depth[l];
            let (winner, loser, cell) = if deeper { (k, l, cells[0]) } else { (l, k, cells[1]) };
            let higher = elastic(self.law[winner]) * (self.depth[winner] - self.depth[loser]);
            let before = self.before[winner].max(f64::MIN_POSITIVE);
            let part = (1.0 - higher / before).clamp(0.0, 1.0);
            let (own, area) = (self.area[winner], self.area[loser]);
            let both = (own + part * area).min(cell.max(own));
            self.loaded_part[winner] = loaded_part(loaded(self.index[winner]), both);
            (self.area[winner], self.area[loser]) = (both, 0.0);
        }
    }

    /// Depth of the foot on nodes below the height of first touch, along n, m.
    pub fn highest(&self, range: std::ops::Range<usize>) -> f64 {
        let loaded = range.filter(|k| self.area[*k] > 0.0);
        loaded.fold(f64::NEG_INFINITY, |h, k| {
            h.max((self.depth[k] - self.permanent[k]) / self.facing[k].press[0])
        })
    }

    /// Depths of nodes when their foot has moved by `x` but for X_n, into `turned`.
    pub fn turn(&mut self, range: std::ops::Range<usize>, x: &[f64; 6]) {
        self.turned.resize(self.depth.len(), 0.0);
        let aside = [0.0, x[1], x[2], x[3], x[4], x[5]];
        for k in range {
            self.turned[k] = self.depth[k] - dot(self.facing[k].press, displacement(self.arm[k], &aside));
        }
    }

    /// Gives nodes that were read what begins alike at all of them.
    pub fn begin_rest(&mut self) {
        let count = self.index.len();
        self.share.resize(count, 1.0);
        self.passive.resize(count, [0.0; 2]);
        self.bound.resize(count, f64::NEG_INFINITY);
        self.entered.resize(count, false);
        self.relief.resize(count, f64::NAN);
    }

    /// Forgets all nodes; keeps the room.
    pub fn clear(&mut self) {
        self.index.clear();
        self.plane.clear();
        self.depth.clear();
        self.spread.clear();
        self.permanent.clear();
        self.bed.clear();
        self.loose.clear();
        self.share.clear();
        self.passive.clear();
        self.bound.clear();
        self.before.clear();
        self.entered.clear();
        self.relief.clear();
        self.area.clear();
        self.loaded_part.clear();
        self.arm.clear();
        self.law.clear();
        self.shear.clear();
        self.memory.clear();
        self.mobilised.clear();
        self.reference.clear();
        self.stamp.clear();
        self.facing.clear();
    }

    /// State of a law at node k.
    #[inline]
    pub fn kept(&self, k: usize) -> &[f64] {
        &self.memory[k * self.doubles..(k + 1) * self.doubles]
    }

    /// Room for `count` nodes, so that later steps do not allocate.
    pub fn reserve(&mut self, count: usize) {
        self.memory.reserve(count * self.doubles);
        self.index.reserve(count);
        self.arm.reserve(count);
        self.law.reserve(count);
        self.shear.reserve(count);
        self.passive.reserve(count);
        self.entered.reserve(count);
        self.stamp.reserve(count);
        self.facing.reserve(count);
        self.plane.reserve(count);
        self.spread.reserve(count);
        for v in [
            &mut self.mobilised,
            &mut self.reference,
            &mut self.depth,
            &mut self.permanent,
            &mut self.bed,
            &mut self.loose,
            &mut self.share,
            &mut self.bound,
            &mut self.before,
            &mut self.relief,
            &mut self.area,
            &mut self.loaded_part,
            &mut self.turned,
        ] {
            v.reserve(count);
        }
    }
}
