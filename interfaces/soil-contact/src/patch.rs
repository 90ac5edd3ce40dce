//! The contact patches of a step: per port the curve of its pressure law, per node depth, area and history.
//!
//! Built once per step from the committed state into flat arrays, so that trials touch neither the lattice nor
//! the allocator.

use crate::assemble::dot;
use crate::ground::Ground;
use crate::normal::Clinging;
use crate::wheel::{self, Shift, Wheel};
use terraglue_soil_law::{PluginLaw, PressureCurve, PressureLaw, Rolling, ShearLaw, ShearState};
use terraglue_subsystem::{Node, Port, Step};

/// One port's share of the arrays and what is constant during the step.
#[derive(Clone, Debug)]
pub struct Patch {
    /// First node in the arrays and one past the last.
    pub nodes: std::ops::Range<usize>,
    /// Place of the components n, t1, t2, mn, mt1, mt2 in packed vectors; `None`: not carried.
    pub place: [Option<usize>; 6],
    /// n_z.
    pub slope: f64,
    /// The laws of the soils under this contact, in [`Patches::laws`].
    pub laws: std::ops::Range<usize>,
    /// Surface along n under the body: 0 in contact, −gap otherwise, m.
    pub surface: f64,
    /// Wrench of the law on the body at X = 0: n, t1, t2, mn, mt1, mt2.
    pub force: [f64; 6],
    /// Largest tangential force at X = 0, N.
    pub strength: f64,
    /// Start for the inverse of the normal law: the last solution in this step.
    pub warm: f64,
    /// What rolls here.
    pub wheel: Option<Wheel>,
    /// Largest friction of the soils here.
    pub friction: f64,
    /// Largest force with which the soil holds the foot back, N.
    pub pull: f64,
}

/// The laws of one soil under one contact.
#[derive(Clone, Debug)]
pub struct Local {
    /// Pressure law for the size of the contact.
    pub curve: PressureCurve,
    /// Shear law in the directions of the contact.
    pub shear: ShearLaw,
    /// Tension up to which soil clings, Pa.
    pub adhesion: f64,
}

impl Patch {
    /// Whether the port carries moments.
    pub fn carries_moments(&self) -> bool {
        self.place[3..].iter().any(Option::is_some)
    }

    /// Components of a packed vector; those not carried are 0.
    pub fn unpack(&self, packed: &[f64]) -> [f64; 6] {
        self.place.map(|p| p.map_or(0.0, |p| packed[p]))
    }

    /// Writes the carried components into a packed vector.
    pub fn pack(&self, values: &[f64; 6], packed: &mut [f64]) {
        for (place, value) in self.place.iter().zip(values) {
            if let Some(p) = place {
                packed[*p] = *value;
            }
        }
    }
}

/// How the underside faces the soil at a node; vectors along n, t1, t2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facing {
    /// ν·n_z/ν_z with the body's inward normal ν: pressure·area acts along it on the body, and a displacement d of
    /// the body changes the depth by −press·d, so that the force does the work that the soil takes up.
    pub press: [f64; 3],
    /// Unit vectors in the underside: t1 and t2 turned with n onto ν.
    pub along: [[f64; 3]; 2],
    /// Area of the underside over that in the tangent plane, |press|.
    pub stretch: f64,
}

/// Smallest part of `press` along n: an underside that looks away from the soil is met edgewise.
const EDGEWISE: f64 = 0.05;

impl Facing {
    fn new(port: &Port, slope: [f64; 2]) -> Self {
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

    /// Displacement along the underside.
    #[inline]
    pub fn slide(&self, moved: [f64; 3]) -> [f64; 2] {
        self.along.map(|e| dot(e, moved))
    }
}

/// The nodes of all patches, one array per quantity.
#[derive(Clone, Debug, Default)]
pub struct PatchNodes {
    /// Lattice indices.
    pub index: Vec<[i32; 2]>,
    /// Depth below the reference level along n at X = 0, m.
    pub depth: Vec<f64>,
    /// Largest depth along n so far, m.
    pub z_max: Vec<f64>,
    /// Pressure at the largest depth, Pa.
    pub p_max: Vec<f64>,
    /// Depth of the unloaded surface along n, m.
    pub permanent: Vec<f64>,
    /// How much deeper than `depth` the underside lies, m: behind the peak of a wheel's stress; NaN elsewhere.
    pub relief: Vec<f64>,
    /// Area in the tangent plane, m²; 0 where another port presses deeper.
    pub area: Vec<f64>,
    /// From the port's origin to the underside at the node along n, t1, t2, m.
    pub arm: Vec<[f64; 3]>,
    /// How the underside faces the soil.
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
    /// Largest depth as the node remembers it, and the curve and normal for which it holds.
    pub(crate) remembered: Vec<(f64, [f64; 3])>,
    /// Reference level, world, m.
    pub reference: Vec<f64>,
    /// Number of the commit at which the node was last loaded; 0: no foot stood here.
    pub stamp: Vec<u64>,
    /// Depth with the rotation of a trial; scratch.
    pub turned: Vec<f64>,
}

impl PatchNodes {
    fn clear(&mut self) {
        self.index.clear();
        self.depth.clear();
        self.z_max.clear();
        self.p_max.clear();
        self.permanent.clear();
        self.relief.clear();
        self.area.clear();
        self.arm.clear();
        self.law.clear();
        self.shear.clear();
        self.memory.clear();
        self.mobilised.clear();
        self.remembered.clear();
        self.reference.clear();
        self.stamp.clear();
        self.facing.clear();
    }

    /// What a law keeps of node k.
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
        self.remembered.reserve(count);
        self.stamp.reserve(count);
        self.facing.reserve(count);
        for v in [
            &mut self.mobilised,
            &mut self.reference,
            &mut self.depth,
            &mut self.z_max,
            &mut self.p_max,
            &mut self.permanent,
            &mut self.relief,
            &mut self.area,
            &mut self.turned,
        ] {
            v.reserve(count);
        }
    }
}

/// The soil's laws.
#[derive(Clone, Debug)]
pub struct Laws {
    /// Pressure.
    pub pressure: PressureLaw,
    /// Shear.
    pub shear: ShearLaw,
    /// Elastic stiffness, Pa/m.
    pub elastic: f64,
    /// Tension up to which soil clings, Pa.
    pub adhesion: f64,
    /// What concerns wheels alone.
    pub rolling: Rolling,
    /// The module behind one or both of them.
    pub plugin: Option<PluginLaw>,
}

/// All patches of a step.
#[derive(Clone, Debug, Default)]
pub struct Patches {
    /// In the order of the step's ports.
    pub ports: Vec<Patch>,
    /// Their nodes, port after port.
    pub nodes: PatchNodes,
    /// The laws of the soils under each of them, port after port.
    pub laws: Vec<Local>,
    /// Clinging nodes; scratch of [`Patches::pull`].
    pub(crate) clinging: Vec<Clinging>,
    built_for: Option<(u64, u64, usize, usize)>,
}

impl Patches {
    /// Makes the next call of [`Patches::build`] work: the committed state has changed.
    pub fn forget(&mut self) {
        self.built_for = None;
    }

    /// The laws at node k.
    #[inline]
    pub fn law(&self, k: usize) -> &Local {
        &self.laws[self.nodes.law[k]]
    }

    /// Reads the committed state below all ports, unless that was done for this step already. `laws`: those of the
    /// scenario's own soil and of the soils of the mask.
    pub fn build(&mut self, step: &Step, ground: &Ground, laws: &[Laws]) {
        let key = (step.t.to_bits(), step.index, step.ports.len(), step.nodes.len());
        if self.built_for == Some(key) {
            return;
        }
        if let Some(plugin) = &laws[0].plugin {
            plugin.forget();
        }
        self.ports.clear();
        self.nodes.clear();
        self.nodes.doubles = ground.law_memory.doubles();
        self.laws.clear();
        for port in step.ports {
            let patch = self.read_port(port, port.nodes(step.nodes), ground, laws);
            self.ports.push(patch);
        }
        self.share_nodes(step);
        for p in 0..self.ports.len() {
            self.evaluate_at_rest(p);
        }
        self.built_for = Some(key);
    }

    fn read_port(&mut self, port: &Port, nodes: &[Node], ground: &Ground, laws: &[Laws]) -> Patch {
        let first = self.nodes.index.len();
        let n_z = port.frame[2];
        for node in nodes {
            self.read_node(port, node, ground, laws);
        }
        let range = first..self.nodes.index.len();
        let spacing = ground.heights.lattice().spacing;
        // a sphere has no extent and does not roll
        let found = || Wheel::find(&self.nodes, range.clone(), spacing, port.key);
        let wheel = (port.extent[0] > 0.0 && port.extent[1] > 0.0)
            .then(found)
            .flatten()
            .map(|w| Wheel { memory: wheel::recall(&ground.wheels, port.key), ..w });
        let b = match &wheel {
            Some(w) => w.width,
            None => contact_size(port, nodes, &self.nodes, range.clone(), spacing),
        };
        let (local, friction) = self.local_laws(laws, wheel.as_ref(), b, range.clone());
        self.recall_depths(range.clone(), n_z);
        if let Some(wheel) = &wheel {
            if let Some(shift) = wheel.shift(&laws[0].rolling, &self.nodes, range.clone()) {
                self.shift_peak(wheel, &shift, range.clone());
            }
        }
        let mut place = [None; 6];
        port.components().for_each(|(i, c)| place[c] = Some(i));
        Patch {
            nodes: range,
            place,
            slope: n_z,
            laws: local,
            surface: 0.0,
            force: [0.0; 6],
            strength: 0.0,
            warm: 0.0,
            wheel,
            friction,
            pull: 0.0,
        }
    }

    /// Makes the laws of the soils under a contact of size `b` (m), and lets its nodes, which know the number of their soil,
    /// refer to them. Returns their range and the largest friction among them.
    fn local_laws(
        &mut self,
        laws: &[Laws],
        wheel: Option<&Wheel>,
        b: f64,
        nodes: std::ops::Range<usize>,
    ) -> (std::ops::Range<usize>, f64) {
        let present = match laws {
            [_] => 1,
            _ => nodes.clone().fold(0_u64, |set, k| set | 1 << self.nodes.law[k]),
        };
        let (first, mut friction) = (self.laws.len(), 0.0_f64);
        for (_, of) in laws.iter().enumerate().filter(|(r, _)| present >> r & 1 == 1) {
            let (curve, shear) = match wheel {
                Some(w) => (
                    of.pressure.curve_in_slip(b, of.elastic, &of.rolling.sinkage, w.memory.slip),
                    of.shear.travelling(w.heading, of.rolling.across),
                ),
                None => (of.pressure.curve(b, of.elastic), of.shear.clone()),
            };
            friction = friction.max(of.shear.friction);
            self.laws.push(Local { curve, shear, adhesion: of.adhesion });
        }
        for number in &mut self.nodes.law[nodes] {
            *number = first + (present & ((1 << *number) - 1)).count_ones() as usize;
        }
        (first..self.laws.len(), friction)
    }

    /// Takes the soil behind the peak of a wheel's stress as if it were less deep, and first loaded there.
    fn shift_peak(&mut self, wheel: &Wheel, shift: &Shift, range: std::ops::Range<usize>) {
        let (n, laws) = (&mut self.nodes, &self.laws);
        for k in range {
            let Some(relief) = wheel.relief(shift, n.arm[k]) else { continue };
            let curve = &laws[n.law[k]].curve;
            let largest = curve.largest_depth(shift.before, shift.before);
            n.relief[k] = relief;
            n.depth[k] -= relief;
            n.z_max[k] = n.depth[k].max(largest);
            n.p_max[k] = curve.virgin(n.z_max[k]);
            n.permanent[k] = curve.permanent(n.z_max[k], n.p_max[k]);
        }
    }

    fn read_node(&mut self, port: &Port, node: &Node, ground: &Ground, laws: &[Laws]) {
        let state = ground.nodes.get(node.i, node.j);
        let number = ground.mask.at(node.i, node.j);
        let n_z = port.frame[2];
        let [x, y] = ground.heights.lattice().position(node.i, node.j);
        let reference = ground.reference(node.i, node.j, &state);
        let offset = [x - port.origin[0], y - port.origin[1], node.lower - port.origin[2]];
        let along = |c: usize| port.direction(c).iter().zip(&offset).map(|(a, b)| a * b).sum::<f64>();
        let nodes = &mut self.nodes;
        nodes.index.push([node.i, node.j]);
        nodes.reference.push(reference);
        nodes.stamp.push(state.stamp);
        nodes.depth.push((reference - node.lower) * n_z);
        nodes.z_max.push(0.0);
        nodes.p_max.push(0.0);
        nodes.permanent.push(state.permanent * n_z);
        nodes.relief.push(f64::NAN);
        nodes.area.push(node.area / n_z);
        nodes.arm.push([along(0), along(1), along(2)]);
        nodes.law.push(number);
        nodes.shear.push(state.shear);
        ground.law_memory.read([node.i, node.j], &mut nodes.memory);
        nodes.mobilised.push(laws[number].shear.mobilised(state.shear.slip));
        nodes.remembered.push((state.largest, state.curve));
        nodes.facing.push(Facing::new(port, node.slope));
    }

    /// Where two ports cover a node, the deeper one presses; the other one's area there becomes 0.
    fn share_nodes(&mut self, step: &Step) {
        for b in 1..self.ports.len() {
            for a in 0..b {
                let (nodes_a, nodes_b) = (step.ports[a].nodes(step.nodes), step.ports[b].nodes(step.nodes));
                if overlap(nodes_a, nodes_b) {
                    self.share_pair(self.ports[a].nodes.clone(), self.ports[b].nodes.clone());
                }
            }
        }
    }

    fn share_pair(&mut self, a: std::ops::Range<usize>, b: std::ops::Range<usize>) {
        for k in a {
            let Some(l) = b.clone().find(|l| self.nodes.index[*l] == self.nodes.index[k]) else { continue };
            let loser = if self.nodes.depth[k] >= self.nodes.depth[l] { l } else { k };
            self.nodes.area[loser] = 0.0;
        }
    }

    fn evaluate_at_rest(&mut self, p: usize) {
        let (force, strength) = self.at_rest(p);
        let pull = self.pull(p);
        let surface = if force[0] != 0.0 { 0.0 } else { self.highest(p).clamp(-FAR, 0.0) };
        let patch = &mut self.ports[p];
        (patch.force, patch.strength, patch.surface, patch.pull) = (force, strength, surface, pull);
    }

    /// How far the foot of patch `p` is below where it just touches, along n, m.
    fn highest(&self, p: usize) -> f64 {
        let n = &self.nodes;
        let loaded = self.ports[p].nodes.clone().filter(|k| n.area[*k] > 0.0);
        loaded.fold(f64::NEG_INFINITY, |h, k| h.max((n.depth[k] - n.permanent[k]) / n.facing[k].press[0]))
    }
}

/// Gap that is reported below a port without nodes, m.
const FAR: f64 = 1.0;

/// Tells for which curve and normal a largest depth holds.
pub fn key(curve: &PressureCurve, n_z: f64) -> [f64; 3] {
    let [a, b] = curve.key();
    [a, b, n_z]
}

/// Whether the index ranges of two node lists meet.
fn overlap(a: &[Node], b: &[Node]) -> bool {
    let bounds = |nodes: &[Node]| {
        nodes.iter().fold([i32::MAX, i32::MIN, i32::MAX, i32::MIN], |r, n| {
            [r[0].min(n.i), r[1].max(n.i), r[2].min(n.j), r[3].max(n.j)]
        })
    };
    let (a, b) = (bounds(a), bounds(b));
    a[0] <= b[1] && b[0] <= a[1] && a[2] <= b[3] && b[2] <= a[3]
}

/// b of the pressure law, m, constant during a step.
///
/// Sphere: radius of the contact circle, from the displaced volume V = ½·π·b²·δ_max of a paraboloid cap, which
/// grows smoothly where the number of touching nodes would jump; at least half a spacing. Otherwise from the
/// half lengths e of the footprint and the covered share f = A/(4·e1·e2): R of a disc (f = π/4), the short
/// side of a rectangle (f = 1), linear between.
fn contact_size(
    port: &Port,
    nodes: &[Node],
    arrays: &PatchNodes,
    range: std::ops::Range<usize>,
    spacing: f64,
) -> f64 {
    let floor = 0.5 * spacing;
    let [e1, e2] = port.extent;
    if e1 > 0.0 && e2 > 0.0 {
        let disc = std::f64::consts::FRAC_PI_4;
        let covered: f64 = nodes.iter().map(|n| n.area).sum::<f64>() / port.frame[2];
        let share = ((covered / (4.0 * e1 * e2) - disc) / (1.0 - disc)).clamp(0.0, 1.0);
        return (e1.min(e2) * (1.0 + share)).max(floor);
    }
    let (mut volume, mut deepest) = (0.0, 0.0_f64);
    for k in range {
        let depth = arrays.depth[k].max(0.0);
        volume += arrays.area[k] * depth;
        deepest = deepest.max(depth);
    }
    if deepest <= 0.0 {
        return floor;
    }
    (2.0 * volume / (std::f64::consts::PI * deepest)).sqrt().max(floor)
}
