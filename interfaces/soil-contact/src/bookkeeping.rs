//! Commit: the foot's motion becomes depths, slip and heat; the nodes that it left forget their contact.

use crate::assemble::{displacement, dot};
use crate::contacts::Touch;
use crate::ground::{Covered, Ground};
use crate::patch::{Patch, PatchNodes, Patches, key};
use crate::wheel;
use terraglue_soil_law::{KeptNodes, ShearResponse, ShearState};
use terraglue_subsystem::{MOST_LAW_STATE, Port};

/// Sums over the run and what the last commit found. Part of the committed state.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Book {
    /// Number of commits.
    pub stamp: u64,
    /// Elastic energy of the loaded nodes, J.
    pub elastic: f64,
    /// Heat since the start, J.
    pub dissipated: f64,
    /// Work of the feet on the soil since the start, J.
    pub port_work: f64,
    /// Largest committed depth of a loaded node below the initial surface since the start, m.
    pub max_sinkage: f64,
    /// Loaded nodes.
    pub loaded: u32,
    /// Smallest number of loaded nodes of a patch with any; 0: none is loaded.
    pub fewest: u32,
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
    /// Nodes that were loaded before and are not any more.
    pub released: Vec<[i32; 2]>,
    /// Pressures and shear of the nodes of a patch, asked of its law together; empty: it is asked node by node.
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
        self.released.reserve(count);
        self.answers.reserve(count);
    }
}

/// The patches of a step with the laws that act on them.
pub struct Scene<'a> {
    /// Patches built for the step.
    pub patches: &'a Patches,
    /// Length of the step, s.
    pub h: f64,
}

/// A node that the foot presses: its number in the arrays, depth and displacement.
struct Pressed<'a> {
    k: usize,
    depth: f64,
    pressure: f64,
    slip: [f64; 2],
    shear: ShearResponse,
    kept: &'a Kept,
}

/// What a law with a state answers for a node beside the pressure.
#[derive(Default)]
struct Kept {
    permanent: f64,
    state: [f64; MOST_LAW_STATE],
}

impl Scene<'_> {
    /// Takes the committed motion `x` of all feet, under the wrenches `t`, into the node states.
    pub fn commit(
        &self,
        ports: &[Port],
        t: &[f64],
        x: &[f64],
        ground: &mut Ground,
        lists: &mut Lists,
        book: &mut Book,
    ) {
        book.stamp += 1;
        (book.elastic, book.loaded, book.fewest) = (0.0, 0, 0);
        std::mem::swap(&mut lists.loaded, &mut lists.previous);
        lists.loaded.clear();
        lists.slid_in.clear();
        lists.slid.clear();
        lists.covered.clear();
        ground.contacts.begin();
        for (p, (patch, port)) in self.patches.ports.iter().zip(ports).enumerate() {
            book.port_work -= port.range().map(|k| t[k] * x[k]).sum::<f64>();
            let (x, wrench) = (patch.unpack(x), patch.unpack(t));
            let mut touch = Touch::default();
            self.ask_together(p, &x, &mut lists.answers);
            let loaded = self.commit_patch(patch, port, &x, ground, lists, book, &mut touch);
            if loaded > 0 && ground.contacts.any() {
                touch.under(patch, &wrench, &x, self.h);
                ground.contacts.tell(port.key, &touch);
            }
            if loaded > 0 {
                book.fewest = if book.fewest == 0 { loaded } else { book.fewest.min(loaded) };
            }
            book.loaded += loaded;
        }
        release(ground, lists, book.stamp);
    }

    /// Pressures and shear of all nodes of patch `p` where its law answers many nodes at a time.
    fn ask_together(&self, p: usize, x: &[f64; 6], answers: &mut Vec<(f64, ShearResponse)>) {
        answers.clear();
        if let Some(law) = self.patches.batched(p) {
            let nodes = &self.patches.ports[p].nodes;
            answers.resize(nodes.len(), (0.0, ShearResponse::default()));
            self.patches.each_answered(p, x, law, |k, pressure, _, shear| {
                answers[k - nodes.start] = (pressure, *shear);
            });
        }
    }

    #[allow(clippy::too_many_arguments)]
    fn commit_patch(
        &self,
        patch: &Patch,
        port: &Port,
        x: &[f64; 6],
        ground: &mut Ground,
        lists: &mut Lists,
        book: &mut Book,
        touch: &mut Touch,
    ) -> u32 {
        let n = &self.patches.nodes;
        let first = lists.loaded.len();
        let mut loaded = 0;
        for k in patch.nodes.clone().filter(|k| n.area[*k] > 0.0) {
            let (moved, facing) = (displacement(n.arm[k], x), &n.facing[k]);
            let rise = dot(facing.press, moved);
            let depth = n.depth[k] - rise;
            let curve = &self.patches.law(k).curve;
            let mut kept = Kept::default();
            let asked = lists.answers.get(k - patch.nodes.start).copied();
            let pressure = match (curve.keeper(), asked) {
                (Some(_), _) => self.patches.or_clinging(k, depth, (self.kept(k, depth, &mut kept), 0.0)).0,
                (None, Some((pressure, _))) => pressure,
                (None, None) => self.patches.pressure(k, depth).0,
            };
            let [i, j] = n.index[k];
            let deep = (depth + relief(n, k)) / patch.slope;
            let lower = n.reference[k] - deep;
            let mut covered = Covered { i, j, lower, depth: deep, pressure, virgin: 0.0, surface: f64::NAN };
            if pressure > 0.0 {
                loaded += 1;
                let fresh = n.stamp[k] == 0 || n.stamp[k] + 1 != book.stamp;
                // a point that has just come down from above is no deeper in the soil than its own descent; those of
                // a rim all come from above
                let slid_in = fresh && patch.wheel.is_none() && depth - n.permanent[k] > -2.0 * rise;
                lists.slid_in.push(slid_in);
                touch.add(n, k, pressure, deep);
                let slip = facing.slide(moved);
                let shear = asked.map_or_else(|| self.sheared(k, pressure, slip), |(_, shear)| shear);
                let node = Pressed { k, depth, pressure, slip, shear, kept: &kept };
                let (slid, surface) = self.press(patch, &node, ground, book);
                let carried = if patch.wheel.is_some() { moved } else { slid };
                lists.slid.push(in_world(port, carried));
                lists.loaded.push([i, j]);
                covered.surface = surface;
                let first = depth > n.z_max[k] || curve.keeper().is_some();
                covered.virgin = if first { pressure } else { curve.virgin(depth) };
            }
            if n.stamp[k] != 0 && pressure <= 0.0 && self.patches.law(k).adhesion > 0.0 {
                self.cling(k, pressure, ground, lists, book);
            }
            lists.covered.push(covered);
        }
        if let Some(wheel) = patch.wheel.as_ref().filter(|_| loaded > 0) {
            wheel::remember(&mut ground.wheels, wheel, x);
        }
        let entry = patch.wheel.as_ref().map(|wheel| {
            let [a, b] = wheel.heading.map(|c| if wheel.rolled(x).forward { c } else { -c });
            in_world(port, [0.0, a, b])
        });
        carry_slip(ground, lists, first, entry, book.stamp);
        loaded
    }

    /// A node that was in contact and is not pressed any more: it clings under tension, or lets go, and what its stretched
    /// soil held becomes heat.
    fn cling(&self, k: usize, pressure: f64, ground: &mut Ground, lists: &mut Lists, book: &mut Book) {
        let [i, j] = self.patches.nodes.index[k];
        let held = |p: f64| 0.5 * self.patches.nodes.area[k] * p * p / self.patches.law(k).curve.unloading();
        let before = ground.nodes.get(i, j).pressure;
        if pressure < 0.0 {
            let state = ground.enter(i, j);
            (state.pressure, state.shear, state.stamp) = (pressure, ShearState::default(), book.stamp);
            lists.loaded.push([i, j]);
            lists.slid_in.push(false);
            lists.slid.push([0.0; 2]);
            book.elastic += held(pressure);
        } else if before < 0.0 {
            book.dissipated += held(before);
        }
    }

    /// The pressure of a law with a state at node k, and what it keeps.
    fn kept(&self, k: usize, depth: f64, out: &mut Kept) -> f64 {
        let Some((law, b)) = self.patches.law(k).curve.keeper() else { return 0.0 };
        let n = &self.patches.nodes;
        let (permanent, slip) = (&n.permanent[k..=k], &[n.shear[k].slip]);
        let nodes = KeptNodes { depth: &[depth], permanent, slip, state: n.kept(k) };
        let (mut p, mut slope, mut unloaded) = ([0.0], [0.0], [0.0]);
        let state = &mut out.state[..n.doubles];
        law.kept(b, &nodes, [&mut p, &mut slope, &mut unloaded], state);
        out.permanent = unloaded[0];
        p[0]
    }

    /// Shear of node k alone.
    fn sheared(&self, k: usize, pressure: f64, slip: [f64; 2]) -> ShearResponse {
        let n = &self.patches.nodes;
        self.patches.law(k).shear.respond_kept(&n.shear[k], n.kept(k), n.mobilised[k], pressure, slip)
    }

    /// One loaded node: plastic depth, slip, heat and elastic energy. Returns how far the foot slipped over the soil
    /// along n, t1 and t2, and the height of the unloaded surface, m.
    fn press(&self, patch: &Patch, node: &Pressed, ground: &mut Ground, book: &mut Book) -> ([f64; 3], f64) {
        let Pressed { k, depth, pressure, slip, shear, .. } = *node;
        let (n, law) = (&self.patches.nodes, self.patches.law(k));
        let curve = &law.curve;
        let area = n.area[k];
        let inclined = area * n.facing[k].stretch;
        let kept = curve.keeper().is_some();
        let squeezed = match kept {
            true => 0.5 * pressure * (depth - node.kept.permanent).max(0.0),
            false => 0.5 * pressure * pressure / curve.unloading(),
        };
        book.dissipated += inclined * shear.dissipated;
        book.elastic += inclined * law.shear.elastic_energy(&shear.state) + area * squeezed;
        let [i, j] = n.index[k];
        let initial = ground.initial(i, j);
        let state = ground.enter(i, j);
        state.largest = n.z_max[k];
        if kept {
            let fresh = state.stamp + 1 != book.stamp;
            let (p, from) = if fresh { (0.0, n.permanent[k]) } else { (state.pressure, n.depth[k]) };
            let work = 0.5 * (p + pressure) * (depth - from);
            let elastic = 0.5 * p * (from - n.permanent[k]).max(0.0);
            book.dissipated += area * (work - squeezed + elastic).max(0.0);
            (state.largest, state.permanent) = (depth, node.kept.permanent.max(0.0) / patch.slope);
        } else if depth > n.z_max[k] {
            let (before, p) = (n.z_max[k], n.p_max[k]);
            book.dissipated += area * curve.plastic_work(before, p, depth, pressure);
            state.permanent = curve.permanent(depth, pressure) / patch.slope;
            state.largest = depth;
        }
        state.curve = if kept { [0.0; 3] } else { key(curve, patch.slope) };
        if !n.relief[k].is_nan() {
            // what stays behind the peak is the depth of the underside, whatever its pressure
            let stays = depth - pressure / curve.unloading() + n.relief[k];
            state.permanent = state.permanent.max(stays / patch.slope);
            state.curve = [0.0; 3];
        }
        (state.pressure, state.shear, state.stamp) = (pressure, shear.state, book.stamp);
        book.max_sinkage =
            book.max_sinkage.max((depth + relief(n, k)) / patch.slope - (state.reference - initial));
        let surface = state.reference - state.permanent.max(0.0);
        if kept {
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
}

/// How much deeper than it counts node k lies, m.
fn relief(nodes: &PatchNodes, k: usize) -> f64 {
    let relief = nodes.relief[k];
    if relief.is_nan() { 0.0 } else { relief }
}

/// Horizontal world components of a vector along n, t1, t2.
fn in_world(port: &Port, v: [f64; 3]) -> [f64; 2] {
    [0, 1].map(|k| (0..3).map(|c| v[c] * port.direction(c)[k]).sum())
}

/// Accumulated slip belongs to the points of the foot (Janosi and Hanamoto 1961 count it from where a point
/// enters the contact): where the foot slides over the lattice, at each node by its own way, the slip of the loaded
/// nodes from `first` on moves with it, ∂j/∂t + v·∇j = 0, first order upwind. A point of a wheel's rim also moves over
/// the lattice as it comes down. A node onto which the foot slid from
/// inside the contact takes the mean slip of the contact, weighted with the pressure; what enters from above or
/// from outside brings nothing. A rolling foot, whose points do not slide, carries nothing along.
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
                let brought = match there.stamp == stamp {
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

/// Lift-off: the nodes that were loaded before and are not now forget pressure and shear.
fn release(ground: &mut Ground, lists: &mut Lists, stamp: u64) {
    lists.released.clear();
    for [i, j] in &lists.previous {
        if ground.nodes.get(*i, *j).stamp != stamp {
            ground.leave(*i, *j);
            lists.released.push([*i, *j]);
        }
    }
}

terraglue_subsystem::persist!(Book { stamp, elastic, dissipated, port_work, max_sinkage, loaded, fewest });
