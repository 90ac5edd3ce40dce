//! Commit: the foot's motion becomes depths, slip and heat; the nodes that it left forget their contact.

use crate::contact_memory::{self, Remembered};
use crate::contacts::Touch;
use crate::ground::{Covered, Ground};
use crate::nodes::NodeState;
use crate::patch::{Patch, Patches};
use crate::patch_nodes::PatchNodes;
use crate::vectors::{displacement, dot};
use crate::wall;
use terraglue_soil_law::{KeptNodes, PressureCurve, ShearLaw, ShearResponse, ShearState};
use terraglue_subsystem::{MOST_LAW_STATE, Port, Result};

/// Sums over the run and results of the last commit. Part of the committed state.
///
/// Heat + elastic energy + gravitational energy of the material = work of the feet: the heat of plastic flow and friction is
/// summed up node by node and not taken from the difference, so that the sum can be held against the work.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EnergyLedger {
    /// Number of commits.
    pub stamp: u64,
    /// Elastic energy of the loaded nodes and of the soil beside the feet, J.
    pub elastic: f64,
    /// Kinetic energy of the soil that moves with the feet, J.
    pub kinetic: f64,
    /// Gravitational energy that the material has gained since the start, J.
    pub lifted: f64,
    /// Heat since the start, J.
    pub dissipated: f64,
    /// Energy that the soil has taken up and that heat has not paid for yet, J; see [`EnergyLedger::pay`].
    pub owed: f64,
    /// Work of the feet on the soil since the start under the forces of its own laws, J.
    pub port_work: f64,
    /// Largest committed depth of a loaded node below the initial surface since the start, m.
    pub max_sinkage: f64,
    /// Loaded nodes.
    pub loaded: u32,
    /// Smallest number of loaded nodes of a patch with any; 0: none is loaded.
    pub fewest: u32,
    /// Whether a loaded patch is narrower than a cell.
    pub narrow: bool,
}

impl EnergyLedger {
    /// Adds the turnover under one foot.
    fn take(&mut self, turnover: &Turnover) {
        self.port_work += turnover.work;
        self.dissipated += turnover.heat;
        self.owed += turnover.entered;
    }

    /// Takes `due` (J) of energy that the soil has taken up apart from the flow of its nodes out of the heat that was made
    /// since it was `before` (J), or of later heat; < 0: it becomes heat. Two things are due: the energy of lifting the
    /// material, and the elastic energy of soil that a foot slides onto, which is loaded a node at a time, while the drive
    /// of the foot works steadily.
    pub fn pay(&mut self, due: f64, before: f64) {
        let (due, made) = (self.owed + due, self.dissipated - before);
        (self.dissipated, self.owed) =
            if due < made { (self.dissipated - due, 0.0) } else { (before, due - made) };
    }
}

/// Turnover of energy under one foot in one commit, J.
#[derive(Clone, Copy, Debug, Default)]
struct Turnover {
    /// Work on the soil.
    work: f64,
    /// Turned into heat.
    heat: f64,
    /// Elastic energy of soil that the foot has come over from the side or that it found compressed as its underside turned;
    /// its drive has paid for it.
    entered: f64,
}

/// Work lists of a commit; reused.
#[derive(Clone, Debug, Default)]
pub struct Lists {
    /// Nodes below the feet.
    pub covered: Vec<Covered>,
    /// Nodes that were loaded at the commit before.
    pub loaded: Vec<[i32; 2]>,
    previous: Vec<[i32; 2]>,
    /// Per loaded node whether the part of the foot there slid in from inside the contact.
    slid_in: Vec<bool>,
    /// Per loaded node how far the foot slipped over the soil there, world x and y, m.
    slid: Vec<[f64; 2]>,
    /// Slip of loaded nodes after it was carried along; scratch.
    carried: Vec<f64>,
    /// Per port whether it touches the soil.
    touching: Vec<bool>,
    /// Pressures and shear of the nodes of a patch, evaluated by its law together; empty: evaluated node by node.
    answers: Vec<(f64, ShearResponse)>,
}

impl Lists {
    /// Room for `count` nodes each.
    pub fn reserve(&mut self, count: usize) {
        self.covered.reserve(count);
        self.loaded.reserve(count);
        self.previous.reserve(count);
        self.carried.reserve(count);
        self.slid_in.reserve(count);
        self.slid.reserve(count);
        self.touching.reserve(count);
        self.answers.reserve(count);
    }
}

/// The patches of a step with the laws that act on them.
pub struct Scene<'a> {
    /// Patches built for the step.
    pub patches: &'a Patches,
    /// Length of the step, s.
    pub h: f64,
    /// Whether [`Covered::virgin`] is asked for.
    pub virgin: bool,
}

/// A node that the foot presses: its number in the arrays, depth and displacement.
struct Pressed<'a> {
    k: usize,
    depth: f64,
    pressure: f64,
    slip: [f64; 2],
    shear: ShearResponse,
    kept: &'a KeptContact,
}

/// Answer of a law with a state for a node, apart from the pressure.
#[derive(Default)]
struct KeptContact {
    permanent: f64,
    state: [f64; MOST_LAW_STATE],
}

impl Scene<'_> {
    /// Takes the committed motion `x` of all feet, under the wrenches `t`, into the node states.
    ///
    /// # Errors
    /// The law, which is a module, has no answer.
    pub fn commit(
        &self,
        ports: &[Port],
        t: &[f64],
        x: &[f64],
        ground: &mut Ground,
        lists: &mut Lists,
        ledger: &mut EnergyLedger,
    ) -> Result {
        ledger.stamp += 1;
        (ledger.elastic, ledger.kinetic, ledger.loaded, ledger.fewest) = (0.0, 0.0, 0, 0);
        ledger.narrow = false;
        std::mem::swap(&mut lists.loaded, &mut lists.previous);
        lists.loaded.clear();
        lists.slid_in.clear();
        lists.slid.clear();
        lists.covered.clear();
        lists.touching.clear();
        ground.contacts.begin();
        for (p, (patch, port)) in self.patches.ports.iter().zip(ports).enumerate() {
            let (x, wrench) = (patch.unpack(x), patch.unpack(t));
            let mut touch = Touch::default();
            self.ask_together(p, &x, &mut lists.answers)?;
            let loaded = self.commit_patch(patch, port, &x, ground, lists, ledger, &mut touch)?;
            lists.touching.push(loaded > 0);
            if loaded > 0 {
                self.carry_cone(p, &x, ground, ledger)?;
            }
            if loaded > 0 && ground.contacts.any() {
                let n = port.direction(0);
                touch.look_between(
                    &self.patches.nodes,
                    patch.nodes.clone(),
                    n,
                    ground.heights.lattice().spacing,
                );
                touch.under(patch.wheel.as_ref(), &wrench, &x, self.h);
                ground.contacts.tell(port.key, &touch);
            }
            if loaded > 0 {
                ledger.fewest = if ledger.fewest == 0 { loaded } else { ledger.fewest.min(loaded) };
                ledger.narrow |= patch.breadth < ground.heights.lattice().spacing;
            }
            ledger.loaded += loaded;
        }
        let stamp = ledger.stamp;
        ledger.dissipated += release(ground, lists, stamp);
        let touching =
            |key| ports.iter().zip(&lists.touching).any(|(port, touches)| *touches && port.key == key);
        ledger.dissipated += contact_memory::release(&mut ground.pushes, touching);
        ledger.dissipated += contact_memory::release(&mut ground.cones, touching);
        Ok(())
    }

    /// Pressures and shear of all nodes of patch `p` where its law answers many nodes at a time.
    fn ask_together(&self, p: usize, x: &[f64; 6], answers: &mut Vec<(f64, ShearResponse)>) -> Result {
        answers.clear();
        if let Some(law) = self.patches.batched(p) {
            let nodes = &self.patches.ports[p].nodes;
            answers.resize(nodes.len(), (0.0, ShearResponse::default()));
            self.patches.each_answered(p, x, law, |k, pressure, _, shear| {
                answers[k - nodes.start] = (pressure, *shear);
                Ok(())
            })?;
        }
        Ok(())
    }

    #[allow(clippy::too_many_arguments)]
    fn commit_patch(
        &self,
        patch: &Patch,
        port: &Port,
        x: &[f64; 6],
        ground: &mut Ground,
        lists: &mut Lists,
        ledger: &mut EnergyLedger,
        touch: &mut Touch,
    ) -> Result<u32> {
        let n = &self.patches.nodes;
        let (first, mut loaded) = (lists.loaded.len(), 0);
        let mut turnover = Turnover::default();
        for k in patch.nodes.clone().filter(|k| n.area[*k] > 0.0) {
            let (moved, facing) = (displacement(n.arm[k], x), &n.facing[k]);
            let depth = n.depth[k] - dot(facing.press, moved);
            let mut kept = KeptContact::default();
            let asked = lists.answers.get(k - patch.nodes.start).copied();
            let (pressure, yields) =
                self.pressure(k, depth, asked.map(|(pressure, _)| pressure), &mut kept)?;
            let [i, j] = n.index[k];
            let (mut covered, deep) = covered(n, k, [depth, pressure], patch.slope);
            if pressure > 0.0 {
                loaded += 1;
                lists.slid_in.push(n.entered[k] && patch.wheel.is_none());
                touch.add(n, k, pressure, deep);
                let slip = facing.slide(moved);
                let shear = asked.map_or_else(|| self.sheared(k, pressure, slip), |(_, shear)| Ok(shear))?;
                let force = n.force(k, pressure, shear.stress);
                turnover.work -= dot(force, moved);
                let node = Pressed { k, depth, pressure, slip, shear, kept: &kept };
                let (slid, surface) = self.press(patch, &node, ground, ledger, &mut turnover);
                let carried = if patch.wheel.is_some() { moved } else { slid };
                lists.slid.push(in_world(port, carried));
                lists.loaded.push([i, j]);
                covered.surface = surface;
                covered.flow = flow_along(port, moved);
                covered.virgin = self.virgin_at(k, depth, pressure, yields)?;
            }
            if n.stamp[k] != 0 && pressure <= 0.0 && self.patches.law(k).adhesion > 0.0 {
                turnover.work -= dot(n.force(k, pressure, [0.0; 2]), moved);
                self.cling(k, pressure, ground, lists, ledger, &mut turnover);
            }
            if n.stamp[k] != 0 && pressure == 0.0 && n.spread[k].reaches(depth, n.top(k)) {
                hold([i, j], ground, lists, ledger.stamp, &mut turnover);
            }
            lists.covered.push(covered);
        }
        if loaded > 0 {
            self.push_aside(patch, port, x, ground, ledger, &mut turnover);
        }
        ledger.take(&turnover);
        if let Some(wheel) = patch.wheel.as_ref().filter(|_| loaded > 0) {
            contact_memory::remember(&mut ground.wheels, wheel.rolled(x));
        }
        let entry = patch.wheel.as_ref().and_then(|wheel| wheel.entry(x));
        let entry = entry.map(|[a, b]| in_world(port, [0.0, a, b]));
        carry_slip(ground, lists, first, entry, ledger.stamp);
        Ok(loaded)
    }

    /// The soil that moves with the foot of patch `p`: its work, heat and kinetic energy.
    fn carry_cone(&self, p: usize, x: &[f64; 6], ground: &mut Ground, ledger: &mut EnergyLedger) -> Result {
        let Some(cone) = &self.patches.ports[p].cone else { return Ok(()) };
        let (work, after) = cone.worked(x, self.patches.law_wrench(p, x)?[0]);
        ledger.port_work += work;
        ledger.dissipated += work - (after.energy() - cone.before.energy());
        ledger.kinetic += after.energy();
        contact_memory::remember(&mut ground.cones, after);
        Ok(())
    }

    /// The soil beside a foot: how far it was pushed, its work, heat and elastic energy.
    fn push_aside(
        &self,
        patch: &Patch,
        port: &Port,
        x: &[f64; 6],
        ground: &mut Ground,
        ledger: &mut EnergyLedger,
        turnover: &mut Turnover,
    ) {
        let (wall, sides) = (&patch.wall, &self.patches.sides);
        let u = wall.way_of(x);
        let answer = wall.answer(sides, u);
        let before = wall.before.mobilised;
        let [from, to] = [before, answer.mobilised].map(|e| wall.energy(sides, e));
        let of = |way: [f64; 3]| -dot(answer.force, way);
        let elastic = [0, 1, 2].map(|k| wall.way * (answer.mobilised[k] - before[k]));
        turnover.work += of(u);
        // plastic flow, the damping of the end-of-step rule, and energy left behind where sides have gone
        turnover.heat += of([0, 1, 2].map(|k| u[k] - elastic[k])) + (of(elastic) - to + from).max(0.0);
        turnover.heat += (wall.before.energy - from).max(0.0);
        turnover.entered += (from - wall.before.energy).max(0.0);
        ledger.elastic += to;
        let new = wall::Push { key: port.key, mobilised: answer.mobilised, energy: to };
        contact_memory::remember(&mut ground.pushes, new);
    }

    /// A node that was in contact and is not pressed any more: it clings under tension, or lets go, and the energy of its
    /// stretched soil becomes heat.
    fn cling(
        &self,
        k: usize,
        pressure: f64,
        ground: &mut Ground,
        lists: &mut Lists,
        ledger: &mut EnergyLedger,
        turnover: &mut Turnover,
    ) {
        let [i, j] = self.patches.nodes.index[k];
        if pressure >= 0.0 {
            return;
        }
        let state = ground.enter(i, j);
        self.take_over(k, state, turnover);
        // the end-of-step rule damps, and shear is not held any more
        let held = self.held(k, pressure);
        turnover.heat += self.held(k, pressure - self.pressure_at_start(k)) + self.sheared_before(k);
        state.area = self.patches.nodes.area[k];
        (state.pressure, state.shear, state.stamp, state.energy) =
            (pressure, ShearState::default(), ledger.stamp, held);
        lists.loaded.push([i, j]);
        lists.slid_in.push(false);
        lists.slid.push([0.0; 2]);
        ledger.elastic += held;
    }

    /// The pressure at node k, evaluated unless `asked`, that at which it yields where that was needed, and the state that a
    /// law keeps.
    fn pressure(
        &self,
        k: usize,
        depth: f64,
        asked: Option<f64>,
        out: &mut KeptContact,
    ) -> Result<(f64, Option<f64>)> {
        match asked {
            _ if kept_by_law(&self.patches.law(k).curve) => Ok((self.kept(k, depth, out)?, None)),
            Some(pressure) => Ok((pressure, None)),
            None => self.patches.pressure_and_yield(k, depth).map(|((p, _), yields)| (p, yields)),
        }
    }

    /// The pressure at which node k yields, if it is asked for; known where `yields`.
    fn virgin_at(&self, k: usize, depth: f64, pressure: f64, yields: Option<f64>) -> Result<f64> {
        match yields {
            _ if !self.virgin => Ok(0.0),
            Some(yields) => Ok(yields),
            None if kept_by_law(&self.patches.law(k).curve) => Ok(pressure),
            None => Ok(self.patches.yields(k, depth)?.0),
        }
    }

    /// The pressure of a law with a state at node k, and the state that it keeps.
    fn kept(&self, k: usize, depth: f64, out: &mut KeptContact) -> Result<f64> {
        let Some((law, b)) = self.patches.law(k).curve.keeper() else { return Ok(0.0) };
        let n = &self.patches.nodes;
        let (permanent, slip) = (&n.permanent[k..=k], &[n.shear[k].slip]);
        let nodes = KeptNodes { depth: &[depth], permanent, slip, state: n.kept(k) };
        let (mut p, mut slope, mut unloaded) = ([0.0], [0.0], [0.0]);
        let state = &mut out.state[..n.doubles];
        law.kept(b, &nodes, [&mut p, &mut slope, &mut unloaded], state)?;
        out.permanent = unloaded[0];
        Ok(if p[0] > 0.0 { n.share[k] * p[0] } else { self.patches.clinging_at(k, depth).0 })
    }

    /// Shear of node k alone.
    fn sheared(&self, k: usize, pressure: f64, slip: [f64; 2]) -> Result<ShearResponse> {
        let n = &self.patches.nodes;
        self.patches.law(k).shear.respond_kept(&n.shear[k], n.kept(k), n.mobilised[k], pressure, slip)
    }

    /// One loaded node: plastic depth, slip, heat and elastic energy. Returns how far the foot slipped over the soil
    /// along n, t1 and t2, and the height of the unloaded surface, m.
    fn press(
        &self,
        patch: &Patch,
        node: &Pressed,
        ground: &mut Ground,
        ledger: &mut EnergyLedger,
        turnover: &mut Turnover,
    ) -> ([f64; 3], f64) {
        let Pressed { k, depth, pressure, slip, shear, .. } = *node;
        let n = &self.patches.nodes;
        let [i, j] = n.index[k];
        let initial = ground.initial(i, j);
        let state = ground.enter(i, j);
        self.take_over(k, state, turnover);
        let (permanent, energy) = match self.patches.law(k).curve.keeper() {
            Some(_) => self.squeeze_kept(node, turnover),
            None => self.squeeze(node, turnover),
        };
        let energy = energy + self.shear_off(node, turnover);
        ledger.elastic += energy;
        state.area = n.area[k];
        let above = n.spread[k].above(depth, n.top(k));
        (state.permanent, state.above) = ((permanent + above) / patch.slope, above / patch.slope);
        let printed = n.spread[k].printed(depth, n.top(k));
        let before = if n.stamp[k] != 0 { state.half } else { 0.0 };
        state.half = printed.max(before).min(n.spread[k].whole);
        (state.pressure, state.shear, state.energy) = (pressure, shear.state, energy);
        let part = n.spread[k].part_below(depth, n.bed[k]);
        state.shear.slip =
            diluted(&self.patches.law(k).shear, n.shear[k].slip, shear.state.slip, [state.part, part]);
        state.part = part;
        state.stamp = ledger.stamp;
        ledger.max_sinkage = ledger
            .max_sinkage
            .max((depth + relief(n, k) + n.spread[k].below) / patch.slope - (state.reference - initial));
        let surface = state.reference - state.permanent;
        if kept_by_law(&self.patches.law(k).curve) {
            ground.law_memory.write([i, j], &node.kept.state);
        }
        let elastic = |c: usize| shear.state.elastic[c] - n.shear[k].elastic[c];
        if shear.state.slip > n.shear[k].slip {
            let [a, b] = [slip[0] - elastic(0), slip[1] - elastic(1)];
            let along = &n.facing[k].along;
            ([0, 1, 2].map(|c| a * along[0][c] + b * along[1][c]), surface)
        } else {
            ([0.0; 3], surface)
        }
    }

    /// Elastic energy of node k between the commits: of area that the foot has come over, of area that it has left, and of
    /// soil that a turning inclined underside has compressed or relieved beyond its way at the node.
    fn take_over(&self, k: usize, state: &NodeState, turnover: &mut Turnover) {
        let n = &self.patches.nodes;
        let now = self.held_at_start(k) + self.sheared_before(k);
        let new = if state.area < n.area[k] { (1.0 - state.area / n.area[k]) * now } else { 0.0 };
        let left = state.energy - (now - new);
        turnover.heat += left.max(0.0);
        turnover.entered += new + (-left).max(0.0);
    }

    /// Elastic energy of node k under the pressure p (Pa), J.
    fn held(&self, k: usize, p: f64) -> f64 {
        0.5 * self.patches.nodes.area[k] * p * p / self.patches.law(k).curve.unloading()
    }

    /// Elastic energy of node k at the start of the step, J. A law that covers unloading itself gives how far the soil would
    /// spring back.
    fn held_at_start(&self, k: usize) -> f64 {
        let n = &self.patches.nodes;
        if !kept_by_law(&self.patches.law(k).curve) {
            return self.held(k, self.pressure_at_start(k));
        }
        0.5 * n.area[k] * n.before[k].max(0.0) * (n.depth[k] - n.permanent[k]).max(0.0)
    }

    /// Pressure at node k at X = 0 before it yields, Pa.
    fn pressure_at_start(&self, k: usize) -> f64 {
        let (n, curve) = (&self.patches.nodes, &self.patches.law(k).curve);
        let p = curve.unloading() * (n.depth[k] - n.permanent[k]);
        if p > 0.0 || n.before[k] < 0.0 { p } else { 0.0 }
    }

    /// Normal part of a node: its new unloaded surface along n (m) and elastic energy (J).
    fn squeeze(&self, node: &Pressed, turnover: &mut Turnover) -> (f64, f64) {
        let Pressed { k, depth, pressure: p, .. } = *node;
        let (n, k_u) = (&self.patches.nodes, self.patches.law(k).curve.unloading());
        let from = n.permanent[k];
        let to = (depth - p / k_u).max(from);
        let start = self.pressure_at_start(k);
        // the end-of-step rule lets the force act over the gap, too, that a foot closes as it touches
        let gap = if start == 0.0 { (from - n.depth[k]).max(0.0) } else { 0.0 };
        turnover.heat += n.area[k] * p * (to - from + gap) + self.held(k, p - start);
        // behind the peak of a wheel the depth of the underside stays, whatever its pressure
        (to.max(depth - p / k_u + relief(n, k)), self.held(k, p))
    }

    /// The same for a law that answers for unloading itself.
    fn squeeze_kept(&self, node: &Pressed, turnover: &mut Turnover) -> (f64, f64) {
        let Pressed { k, depth, pressure, kept, .. } = *node;
        let n = &self.patches.nodes;
        let held = 0.5 * n.area[k] * pressure * (depth - kept.permanent).max(0.0);
        if n.stamp[k] != 0 {
            let before = self.held_at_start(k);
            turnover.heat += (n.area[k] * pressure * (depth - n.depth[k]) - held + before).max(0.0);
            return (kept.permanent.max(0.0), held);
        }
        // the work of the force in this step, over the gap, too; soil that the foot comes over from the side is loaded by
        // the drive of the foot
        let from = n.depth[k].min(depth);
        let left = n.area[k] * pressure * (depth - from) - held;
        turnover.heat += left.max(0.0);
        turnover.entered += (-left).max(0.0);
        (kept.permanent.max(0.0), held)
    }

    /// Elastic energy of the shear of node k at the start of the step, J.
    fn sheared_before(&self, k: usize) -> f64 {
        let n = &self.patches.nodes;
        if n.stamp[k] == 0 {
            return 0.0;
        }
        n.area[k] * n.facing[k].stretch * self.patches.law(k).shear.elastic_energy(&n.shear[k])
    }

    /// Shear of a node: its elastic energy, J. Friction and the damping of the end-of-step rule become heat.
    fn shear_off(&self, node: &Pressed, turnover: &mut Turnover) -> f64 {
        let Pressed { k, shear, .. } = node;
        let (n, law) = (&self.patches.nodes, &self.patches.law(*k).shear);
        let area = n.area[*k] * n.facing[*k].stretch;
        let before = n.shear[*k].elastic;
        let change = [0, 1].map(|c| shear.state.elastic[c] - before[c]);
        let damped = law.elastic_energy(&ShearState { elastic: change, ..ShearState::default() });
        turnover.heat += area * (shear.dissipated + damped);
        area * law.elastic_energy(&shear.state)
    }
}

/// Slip of the part of a cell that reaches into the bed, m, after a step in which it grew from `from` to `to` and that part from `before` to
/// `now`: soil that the foot comes down on has not been sheared, and loose soil on the bed slides along with the foot.
fn diluted(law: &ShearLaw, from: f64, to: f64, [before, now]: [f64; 2]) -> f64 {
    if now <= 0.0 {
        0.0
    } else if now <= before || from == 0.0 {
        to
    } else {
        law.mean_slip(from, before / now) + (to - from)
    }
}

/// A node that carries nothing any more, of which the underside still reaches below the surface that it met: it stays in its print, where
/// it will carry again as deep as before. The energy in the soil becomes heat.
fn hold([i, j]: [i32; 2], ground: &mut Ground, lists: &mut Lists, stamp: u64, turnover: &mut Turnover) {
    let state = ground.enter(i, j);
    turnover.heat += state.energy;
    (state.pressure, state.shear, state.energy, state.stamp) = (0.0, ShearState::default(), 0.0, stamp);
    lists.loaded.push([i, j]);
    lists.slid_in.push(false);
    lists.slid.push([0.0; 2]);
}

/// Whether a law answers for unloading itself.
fn kept_by_law(curve: &PressureCurve) -> bool {
    curve.keeper().is_some()
}

/// Node k at the mean depth `depth` (m) under a pressure (Pa), its soil not yet set, and the vertical depth of the underside there, m.
fn covered(n: &PatchNodes, k: usize, [depth, pressure]: [f64; 2], n_z: f64) -> (Covered, f64) {
    let mean = (depth + relief(n, k)) / n_z;
    let deep = mean + n.spread[k].below / n_z;
    let (lower, [i, j]) = (n.reference[k] - mean, n.index[k]);
    let (virgin, surface, flow) = (0.0, f64::NAN, [0.0; 2]);
    (Covered { i, j, lower, depth: deep.max(0.0), pressure, virgin, surface, flow }, deep)
}

/// Depth of node k beyond the depth that counts, m.
fn relief(nodes: &PatchNodes, k: usize) -> f64 {
    let relief = nodes.relief[k];
    if relief.is_nan() { 0.0 } else { relief }
}

/// Direction in which soil that is pressed out flows under an underside that moves by `moved`, see [`Covered::flow`].
fn flow_along(port: &Port, moved: [f64; 3]) -> [f64; 2] {
    let length = dot(moved, moved).sqrt();
    in_world(port, moved).map(|c| if length > 0.0 { c / length } else { 0.0 })
}

/// Horizontal world components of a vector along n, t1, t2.
fn in_world(port: &Port, v: [f64; 3]) -> [f64; 2] {
    [0, 1].map(|k| (0..3).map(|c| v[c] * port.direction(c)[k]).sum())
}

/// Accumulated slip belongs to the points of the foot (Janosi and Hanamoto 1961 count it from where a point
/// enters the contact): where the foot slides over the lattice, at each node by its own way, the slip of the loaded
/// nodes from `first` on moves with it, ∂j/∂t + v·∇j = 0, first order upwind. A point of a wheel's rim also moves over
/// the lattice as it comes down. A node onto which the foot slid from
/// inside the contact takes the mean slip of the contact, weighted with the pressure; nodes that enter from above or
/// from outside bring nothing. A rolling foot, whose points do not slide, carries nothing along.
fn carry_slip(ground: &mut Ground, lists: &mut Lists, first: usize, entry: Option<[f64; 2]>, stamp: u64) {
    if lists.slid[first..].iter().all(|s| *s == [0.0; 2]) {
        return;
    }
    let nodes = &lists.loaded[first..];
    let slid_in = &lists.slid_in[first..];
    let mean = mean_slip(ground, nodes, slid_in);
    let spacing = ground.heights.lattice().spacing;
    lists.carried.clear();
    lists.carried.extend(nodes.iter().zip(slid_in).zip(&lists.slid[first..]).map(
        |(([i, j], slid_in), slid)| {
            let share = slid.map(|s| s.abs() / spacing);
            let scale = 1.0 / (share[0] + share[1]).max(1.0);
            let behind = slid.map(|s| if s > 0.0 { -1 } else { 1 });
            let own = ground.nodes.get(*i, *j).shear.slip;
            if *slid_in {
                return own.max(mean);
            }
            let gain = |axis: usize| {
                let at = [[i + behind[0], *j], [*i, j + behind[1]]][axis];
                let there = ground.nodes.get(at[0], at[1]);
                let enters = entry.is_some_and(|e| e[axis] * f64::from(behind[axis]) > 0.5);
                // an unloaded node has forgotten its slip and brings none
                let brought = match there.stamp == stamp && there.pressure > 0.0 {
                    true => there.shear.slip,
                    // points of a rim come down in front of the contact and have not slipped yet
                    false if enters => 0.0,
                    false => own,
                };
                share[axis] * scale * (brought - own)
            };
            own + gain(0) + gain(1)
        },
    ));
    for ([i, j], slip) in nodes.iter().zip(&lists.carried) {
        if let Some(state) = ground.nodes.get_mut(*i, *j) {
            state.shear.slip = *slip;
        }
    }
}

/// Mean slip of the nodes that were in contact before, weighted with the pressure, m.
fn mean_slip(ground: &Ground, nodes: &[[i32; 2]], slid_in: &[bool]) -> f64 {
    let before = nodes.iter().zip(slid_in).filter(|(_, slid_in)| !**slid_in);
    let (sum, weights) = before.fold((0.0, 0.0), |(sum, weights), ([i, j], _)| {
        let state = ground.nodes.get(*i, *j);
        (sum + state.pressure * state.shear.slip, weights + state.pressure)
    });
    if weights > 0.0 { sum / weights } else { 0.0 }
}

/// Lift-off: the nodes that were loaded before and are not now forget pressure and shear. Returns the elastic energy that
/// they held, J: nothing takes it up.
fn release(ground: &mut Ground, lists: &mut Lists, stamp: u64) -> f64 {
    let mut heat = 0.0;
    for [i, j] in &lists.previous {
        let state = ground.nodes.get(*i, *j);
        if state.stamp != stamp {
            heat += state.energy;
            ground.leave(*i, *j);
        }
    }
    heat
}

terraglue_subsystem::persist!(EnergyLedger {
    stamp,
    elastic,
    kinetic,
    lifted,
    dissipated,
    owed,
    port_work,
    max_sinkage,
    loaded,
    fewest,
    narrow,
});
