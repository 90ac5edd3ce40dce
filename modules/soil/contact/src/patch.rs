//! The contact patches of a step: per port its pressure curve, per node depth, area, history and bearing capacity.
//!
//! Built once per step from the committed state into flat arrays, so that trials touch neither the lattice nor
//! the allocator.

use crate::clinging::ClingingNodes;
use crate::cone::{self, Cone};
use crate::contact_memory::recall;
use crate::ground::Ground;
use crate::patch_nodes::{Facing, PatchNodes, Plane, loaded_part};
use crate::rows::Rows;
use crate::size::Size;
use crate::spread::Spread;
use crate::wall::{self, Beside, Side, Wall};
use crate::wheel::{Shift, Wheel};
use terraglue_soil_law::strength::{Inclination, slope_factor};
use terraglue_soil_law::{Direction, PluginLaw, PressureCurve, PressureLaw, Rolling, ShearLaw};
use terraglue_subsystem::{Node, Port, Result, Step};

/// One port's share of the arrays and its constants during the step.
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
    /// The wheel that rolls here.
    pub wheel: Option<Wheel>,
    /// Largest friction of the soils here.
    pub friction: f64,
    /// Largest force with which the soil holds the foot back, N.
    pub pull: f64,
    /// Breadth of the contact, m.
    pub breadth: f64,
    /// Its sides in the soil.
    pub wall: Wall,
    /// The soil that moves with it.
    pub cone: Option<Cone>,
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
    /// a and b of the passive stress a + b·z, Pa and Pa/m.
    pub passive: [f64; 2],
    /// c·cot φ of the soil itself, Pa.
    pub cohesive: f64,
    /// Effect of an inclined load on the bearing capacity.
    pub inclination: Inclination,
    /// Modulus of loose soil over that of the bed.
    pub loose: f64,
    /// Length over height of the wedge that a wall pushes up.
    pub wedge: f64,
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
    /// Parameters of wheels alone.
    pub rolling: Rolling,
    /// Effect of the direction of motion and of the slope of the underside.
    pub direction: Direction,
    /// a and b of the passive stress a + b·z, Pa and Pa/m.
    pub passive: [f64; 2],
    /// c·cot φ of the soil itself, Pa.
    pub cohesive: f64,
    /// Effect of an inclined load on the bearing capacity.
    pub inclination: Inclination,
    /// The soil that moves with a foot.
    pub cone: cone::ConeMaterial,
    /// Modulus of loose soil over that of the bed.
    pub loose: f64,
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
    /// Sides in the soil, port after port.
    pub sides: Vec<Side>,
    /// Clinging nodes; scratch of [`Patches::pull`].
    pub(crate) clinging: ClingingNodes,
    /// Whether energy is owed for soil that feet came over, see [`crate::bookkeeping::EnergyLedger::pay`].
    pub in_debt: bool,
    /// Whether this is the first step of all: bodies inside the ground then stand in their own print.
    pub begins: bool,
    /// Whether something is.
    pub prints: bool,
    rows: Rows,
    /// Nodes of each port.
    ranges: Vec<std::ops::Range<usize>>,
    built_for: Option<(u64, u64, usize, usize)>,
}

impl Patches {
    /// Room for `nodes` nodes of all contacts.
    pub fn reserve(&mut self, nodes: usize) {
        self.nodes.reserve(nodes);
        self.sides.reserve(nodes);
        self.rows.reserve(nodes);
    }

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
    ///
    /// # Errors
    /// The law, which is a module, has no answer.
    pub fn build(&mut self, step: &Step, ground: &Ground, laws: &[Laws]) -> Result {
        let key = (step.t.to_bits(), step.index, step.ports.len(), step.nodes.len());
        if self.built_for == Some(key) {
            return Ok(());
        }
        self.built_for = None;
        if let Some(plugin) = &laws[0].plugin {
            plugin.forget();
        }
        self.ports.clear();
        self.nodes.clear();
        self.nodes.doubles = ground.law_memory.doubles();
        self.laws.clear();
        self.sides.clear();
        self.prints = false;
        self.ranges.clear();
        for port in step.ports {
            let range = read_nodes(&mut self.nodes, port, step, ground, laws);
            self.ranges.push(range);
        }
        share_nodes(&mut self.nodes, &self.ranges, step, ground, laws);
        for (number, port) in step.ports.iter().enumerate() {
            let patch = self.read_port(port, self.ranges[number].clone(), step, ground, laws)?;
            self.ports.push(patch);
        }
        for p in 0..self.ports.len() {
            self.evaluate_at_rest(p)?;
        }
        self.built_for = Some(key);
        Ok(())
    }

    fn read_port(
        &mut self,
        port: &Port,
        range: std::ops::Range<usize>,
        step: &Step,
        ground: &Ground,
        laws: &[Laws],
    ) -> Result<Patch> {
        self.rows.list(&self.nodes, range.clone());
        let n_z = port.frame[2];
        let spacing = ground.heights.lattice().spacing;
        let wheel = rolling(&mut self.nodes, port, range.clone(), ground);
        if !laws.iter().any(|law| law.pressure.keeps()) {
            self.nodes.fill_cells(port, range.clone(), spacing, &mut self.rows);
        }
        let size = Size::of(&self.nodes, range.clone(), spacing);
        let b = size.b(spacing);
        let (local, friction) = self.local_laws(laws, wheel.as_ref(), b, range.clone())?;
        let mut wall = Wall::none(port, recall(&ground.pushes, port.key));
        self.bear(&laws[0].direction, &wall, b, range.clone());
        self.start(range.clone())?;
        if laws[0].direction.passive_pressure {
            gather_wall(self, (range.clone(), local.start), ground, n_z, &mut wall)?;
            if let Some(wheel) = &wheel {
                // a rim pushes with its axle, however it turns
                wall.arm = wheel.axle();
            }
        }
        if let Some(wheel) = &wheel
            && let Some(shift) = wheel.shift(&laws[0].rolling, &self.nodes, range.clone())
        {
            self.shift_peak(wheel, &shift, range.clone())?;
        }
        // under a rim the soil flows by
        let cone = wheel.is_none().then(|| {
            let before = recall(&ground.cones, port.key);
            Cone::under(&laws[0].cone, &self.nodes, range.clone(), before, step.h)
        });
        let mut place = [None; 6];
        port.components().for_each(|(i, c)| place[c] = Some(i));
        Ok(Patch {
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
            breadth: size.breadth(),
            wall,
            cone: cone.flatten(),
        })
    }

    /// Bearing capacity of the nodes in `range` relative to the pressure of first loading, and passive pressure of their
    /// sides: less on inclined faces, less under shear, more on faces that are pushed sideways.
    fn bear(&mut self, direction: &Direction, wall: &Wall, b: f64, range: std::ops::Range<usize>) {
        let inclination = direction.load_inclination.then(|| self.inclination(range.clone())).flatten();
        for k in range {
            let (n, law) = (&self.nodes, &self.laws[self.nodes.law[k]]);
            let facing = &n.facing[k];
            let mut share = if direction.slope_factor { slope_factor(1.0 / facing.stretch) } else { 1.0 };
            if let Some(e) = inclination.filter(|_| n.before[k] > 0.0) {
                let tau = n.shear_stress(k, law.shear.stiffness);
                let along = (tau[0] * e[0] + tau[1] * e[1]).max(0.0);
                let tan = along / (n.before[k] + law.cohesive);
                share *= law.inclination.factor(tan, n.depth[k], b);
            }
            let part = if direction.passive_pressure { wall.share(facing.inward()) } else { 0.0 };
            let passive = law.passive.map(|p| part * p);
            (self.nodes.share[k], self.nodes.passive[k]) = (share, passive);
        }
    }

    /// Resultant of the shear along t1 and t2 over the sum of the magnitudes: shear that balances within the contact, as under a
    /// sphere that is pressed straight down, does not incline its load.
    fn inclination(&self, range: std::ops::Range<usize>) -> Option<[f64; 2]> {
        let n = &self.nodes;
        let (mut sum, mut all) = ([0.0; 2], 0.0);
        for k in range.filter(|k| n.before[*k] > 0.0) {
            let tau = n.shear_stress(k, self.laws[n.law[k]].shear.stiffness);
            let area = n.area[k] * n.facing[k].stretch;
            sum = [sum[0] + area * tau[0], sum[1] + area * tau[1]];
            all += area * (tau[0] * tau[0] + tau[1] * tau[1]).sqrt();
        }
        (all > 0.0).then(|| sum.map(|s| s / all))
    }

    /// Starts the nodes in `range` where the last commit left them, and finds up to which pressure they are elastic.
    ///
    /// Within a step the underside moves along its slope; the deviation of the exact one afterwards (its curvature, an edge that
    /// passes) moves the unloaded surface and not the pressure, so that no energy comes of it. Where the underside has gone up
    /// by more than half of the elastic rebound of the soil, the foot is leaving the node. Soil that the foot has come over
    /// from the side carries the load of its depth at once, as far as [`Patches::affordable`] goes, and the drive of the foot
    /// pays for it; the rest is loaded by further sinkage from there. A body that is inside the ground at the very start stands
    /// in its own print: it was pressed there before, and is loaded by further sinkage.
    fn start(&mut self, range: std::ops::Range<usize>) -> Result {
        let share = self.affordable(range.clone())?;
        for k in range {
            let (n, law) = (&self.nodes, self.law(k));
            if law.curve.keeper().is_some() {
                continue;
            }
            let k_u = law.curve.unloading();
            let part = n.loaded_part[k];
            if part < 1.0 && n.stamp[k] != 0 {
                let scale = (part + share * (1.0 - part)).sqrt();
                self.nodes.before[k] *= scale;
                self.nodes.shear[k].elastic = self.nodes.shear[k].elastic.map(|e| scale * e);
            }
            let n = &self.nodes;
            let (depth, before) = (n.depth[k], n.before[k]);
            let touched = n.stamp[k] != 0 && before >= 0.0;
            let follows = touched && depth - n.permanent[k] > 0.5 * before / k_u;
            let permanent = if follows { depth - before / k_u } else { n.permanent[k] };
            self.nodes.permanent[k] = permanent;
            if depth <= permanent {
                continue;
            }
            let (elastic, yields) = (k_u * (depth - permanent), self.yields(k, depth)?.0);
            let begins = self.begins;
            let n = &mut self.nodes;
            n.bound[k] = if elastic <= yields { yields } else { f64::NEG_INFINITY };
            if n.stamp[k] != 0 {
                continue;
            }
            n.bound[k] = yields;
            if begins {
                n.permanent[k] = depth - GRAZE;
                self.prints |= depth - permanent > GRAZE;
                continue;
            }
            n.entered[k] = true;
            n.permanent[k] = depth - share.sqrt() * elastic.min(yields) / k_u;
        }
        Ok(())
    }

    /// Part of the elastic energy that nodes and areas in `range` bring which the foot has come over from the side: no more than
    /// this contact holds already, and nothing while the soil owes energy. (A face of a corner that turns through the
    /// vertical covers whole cells at once.)
    fn affordable(&self, range: std::ops::Range<usize>) -> Result<f64> {
        if self.in_debt {
            return Ok(0.0);
        }
        let (mut held, mut brought) = (0.0, 0.0);
        for k in range {
            let (n, curve) = (&self.nodes, &self.law(k).curve);
            if curve.keeper().is_some() {
                continue;
            }
            let energy = |p: f64| n.area[k] * p * p / curve.unloading();
            if n.stamp[k] != 0 {
                let now = energy(n.before[k]);
                held += n.loaded_part[k] * now;
                brought += (1.0 - n.loaded_part[k]) * now;
            } else if n.depth[k] > n.permanent[k] {
                let elastic = curve.unloading() * (n.depth[k] - n.permanent[k]);
                brought += energy(elastic.min(self.yields(k, n.depth[k])?.0));
            }
        }
        Ok(if brought > held { held / brought } else { 1.0 })
    }

    /// Makes the laws of the soils under a contact of size `b` (m), and lets its nodes, which know the number of their soil,
    /// refer to them. Returns their range and the largest friction among them.
    fn local_laws(
        &mut self,
        laws: &[Laws],
        wheel: Option<&Wheel>,
        b: f64,
        nodes: std::ops::Range<usize>,
    ) -> Result<(std::ops::Range<usize>, f64)> {
        let present = match laws {
            [_] => 1,
            _ => nodes.clone().fold(0_u64, |set, k| set | 1 << self.nodes.law[k]),
        };
        let (first, mut friction) = (self.laws.len(), 0.0_f64);
        for (_, of) in laws.iter().enumerate().filter(|(r, _)| present >> r & 1 == 1) {
            let (curve, shear) = match wheel {
                Some(w) => (
                    of.pressure.curve_in_slip(b, of.elastic, &of.rolling.sinkage, w.memory.slip)?,
                    of.shear.travelling(w.heading, of.rolling.across),
                ),
                None => (of.pressure.curve(b, of.elastic)?, of.shear.clone()),
            };
            friction = friction.max(of.shear.friction());
            let Laws { adhesion, passive, cohesive, inclination, loose, cone, .. } = *of;
            let wedge = cone.slope;
            self.laws.push(Local { curve, shear, adhesion, passive, cohesive, inclination, loose, wedge });
        }
        for number in &mut self.nodes.law[nodes] {
            *number = first + (present & ((1 << *number) - 1)).count_ones() as usize;
        }
        Ok((first..self.laws.len(), friction))
    }

    /// Takes the soil behind the peak of a wheel's stress as if it were less deep, and first loaded there. The underside does not
    /// determine how its stress changes over a cell.
    fn shift_peak(&mut self, wheel: &Wheel, shift: &Shift, range: std::ops::Range<usize>) -> Result {
        for k in range {
            let Some(relief) = wheel.relief(shift, self.nodes.arm[k]) else { continue };
            let depth = self.nodes.depth[k] - relief;
            self.nodes.spread[k].range = 0.0;
            let (p, k_u) = (self.yields(k, depth)?.0, self.law(k).curve.unloading());
            let n = &mut self.nodes;
            n.relief[k] = relief;
            n.depth[k] = depth;
            n.permanent[k] = shift.before.max(depth - p / k_u);
            (n.bound[k], n.entered[k]) = (f64::NEG_INFINITY, false);
        }
        Ok(())
    }

    fn evaluate_at_rest(&mut self, p: usize) -> Result {
        let (force, strength) = self.at_rest(p)?;
        let pull = self.pull(p);
        let surface = if force[0] != 0.0 {
            0.0
        } else {
            self.nodes.highest(self.ports[p].nodes.clone()).clamp(-FAR, 0.0)
        };
        let patch = &mut self.ports[p];
        (patch.force, patch.strength, patch.surface, patch.pull) = (force, strength, surface, pull);
        Ok(())
    }
}

/// Of a node that two ports cover, the deeper one takes the area of both, see [`PatchNodes::share_between`].
fn share_nodes(
    nodes: &mut PatchNodes,
    ranges: &[std::ops::Range<usize>],
    step: &Step,
    ground: &Ground,
    laws: &[Laws],
) {
    let spacing = ground.heights.lattice().spacing;
    let loaded = |[i, j]: [i32; 2]| ground.nodes.get(i, j).area;
    for b in 1..ranges.len() {
        for a in 0..b {
            let ports = [&step.ports[a], &step.ports[b]];
            if overlap(ports[0].nodes(step.nodes), ports[1].nodes(step.nodes)) {
                let cells = ports.map(|port| spacing * spacing / port.frame[2]);
                let (a, b) = (ranges[a].clone(), ranges[b].clone());
                nodes.share_between([a, b], cells, |law| laws[law].elastic, loaded);
            }
        }
    }
}

/// The wheel whose underside the nodes in `range` below `port` are, with the soil that turns with it.
fn rolling(
    nodes: &mut PatchNodes,
    port: &Port,
    range: std::ops::Range<usize>,
    ground: &Ground,
) -> Option<Wheel> {
    if port.extent[0] <= 0.0 || port.extent[1] <= 0.0 {
        return None;
    }
    let (spacing, memory) = (ground.heights.lattice().spacing, recall(&ground.wheels, port.key));
    let wheel = Wheel::find(nodes, range.clone(), spacing, memory)?;
    wheel.fill_gaps(nodes, port, range.clone());
    wheel.loaded(nodes, range, spacing)
}

/// Reads the nodes of a port; row by row.
fn read_nodes(
    nodes: &mut PatchNodes,
    port: &Port,
    step: &Step,
    ground: &Ground,
    laws: &[Laws],
) -> std::ops::Range<usize> {
    let first = nodes.index.len();
    for node in port.nodes(step.nodes) {
        read_node(nodes, port, node, ground, laws);
    }
    nodes.begin_rest();
    first..nodes.index.len()
}

fn read_node(nodes: &mut PatchNodes, port: &Port, node: &Node, ground: &Ground, laws: &[Laws]) {
    let state = ground.nodes.get(node.i, node.j);
    let number = ground.mask.at(node.i, node.j);
    let n_z = port.frame[2];
    let [x, y] = ground.heights.lattice().position(node.i, node.j);
    let reference = ground.reference(node.i, node.j, &state);
    let offset = [x - port.origin[0], y - port.origin[1], node.lower - port.origin[2]];
    let along = |c: usize| port.direction(c).iter().zip(&offset).map(|(a, b)| a * b).sum::<f64>();
    let area = node.area / n_z;
    nodes.index.push([node.i, node.j]);
    nodes.reference.push(reference);
    nodes.stamp.push(state.stamp);
    nodes.plane.push(Plane { height: node.lower, slope: node.slope });
    nodes.depth.push((reference - node.lower) * n_z);
    nodes.spread.push(Spread::over(state.print * n_z));
    nodes.permanent.push((state.permanent - state.above) * n_z);
    nodes.bed.push(state.bed * n_z);
    nodes.loose.push(state.loose * n_z);
    nodes.before.push(state.pressure);
    nodes.area.push(area);
    nodes.loaded_part.push(loaded_part(state.area, area));
    nodes.arm.push([along(0), along(1), along(2)]);
    nodes.law.push(number);
    nodes.shear.push(state.shear);
    ground.law_memory.read([node.i, node.j], &mut nodes.memory);
    nodes.mobilised.push(laws[number].shear.mobilised(state.shear.slip));
    nodes.facing.push(Facing::new(port, node.slope));
}

/// Gathers the sides of the contact whose nodes are `range` and whose first law is number `law`.
fn gather_wall(
    patches: &mut Patches,
    (range, law): (std::ops::Range<usize>, usize),
    ground: &Ground,
    n_z: f64,
    wall: &mut Wall,
) -> Result {
    let mut rows = std::mem::take(&mut patches.rows);
    let mut sides = std::mem::take(&mut patches.sides);
    let law = &patches.laws[law];
    let beside = Beside {
        lattice: ground.heights.lattice(),
        levels: &|i, j| ground.levels(i, j),
        passive: law.passive,
        stiffness: law.curve.unloading(),
        n_z,
        wedge: law.wedge,
    };
    let pressed = |k: usize| yielded(patches, k);
    let gathered = wall::gather(&patches.nodes, range, &beside, pressed, &mut rows, &mut sides, wall);
    (patches.rows, patches.sides) = (rows, sides);
    gathered
}

/// Pressure at node k over that at which it yields.
fn yielded(patches: &Patches, k: usize) -> Result<f64> {
    if patches.law(k).curve.keeper().is_some() {
        // a law with a state determines its own yield
        return Ok(if patches.nodes.before[k] > 0.0 { 1.0 } else { 0.0 });
    }
    let (p, yields) = (patches.pressure(k, patches.nodes.depth[k])?.0, patches.nodes.bound[k]);
    Ok(if p <= 0.0 {
        0.0
    } else if yields > p {
        p / yields
    } else {
        1.0
    })
}

/// By how much a body that stands in its own print at the start presses it, m: just so that it touches.
const GRAZE: f64 = 1e-9;

/// Gap that is reported below a port without nodes, m.
const FAR: f64 = 1.0;

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
