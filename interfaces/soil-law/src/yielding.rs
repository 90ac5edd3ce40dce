//! The way back to a yield stress that an expression or a module gives, for one node or for many at once.

use crate::expression::is_building_up;
use crate::shear::{ON_YIELD, Plastic, ShearLaw, ShearResponse, ShearState};
use terraglue_subsystem::MOST_LAW_STATE;

/// Nodes whose yield stress is asked together.
const CHUNK: usize = 32;
/// Newton steps until bisection has the last word.
const STEPS: usize = 60;
/// Relative change of a slip at which Newton has arrived: the error left is of the order of its square.
const CONVERGED: f64 = 1e-8;

/// Nodes with pressure and how far each is dragged.
#[derive(Clone, Copy, Debug)]
pub struct Sheared<'a> {
    /// Histories.
    pub states: &'a [ShearState],
    /// What a law with a state remembers of them.
    pub kept: &'a [f64],
    /// Pressures, Pa; larger than zero.
    pub pressure: &'a [f64],
    /// Displacements along t1 and t2, m.
    pub slide: &'a [[f64; 2]],
}

/// A node on its way back to the yield stress.
#[derive(Clone, Copy, Default)]
struct Slip {
    /// Its number in the chunk.
    k: usize,
    u: [f64; 2],
    length: f64,
    weight: f64,
    low: f64,
    high: f64,
    step: f64,
    before: f64,
}

impl Slip {
    /// Slip counted since the contact began, m.
    #[inline]
    fn slip(&self) -> f64 {
        self.before + self.weight * self.step
    }

    /// A step of Newton's method, kept inside the bracket; the yield stress is y with the slope by_j. Returns its size.
    #[inline]
    fn newton(&mut self, stiffness: f64, y: f64, by_j: f64) -> f64 {
        let residual = stiffness * (self.length - self.step) - y;
        if residual > 0.0 {
            self.low = self.step
        } else {
            self.high = self.step
        }
        let mut next = self.step + residual / (stiffness + self.weight * by_j.max(0.0));
        if !(next >= self.low && next <= self.high) {
            next = 0.5 * (self.low + self.high);
        }
        let change = (next - self.step).abs();
        self.step = next;
        change
    }
}

/// The nodes of a chunk that still slip, gathered at the front.
struct Slipping {
    count: usize,
    doubles: usize,
    nodes: [Slip; CHUNK],
    change: [f64; CHUNK],
    pressure: [f64; CHUNK],
    slip: [f64; CHUNK],
    y: [f64; CHUNK],
    by_p: [f64; CHUNK],
    by_j: [f64; CHUNK],
    kept: [f64; CHUNK * MOST_LAW_STATE],
}

impl Default for Slipping {
    fn default() -> Self {
        let zero = [0.0; CHUNK];
        Self {
            count: 0,
            doubles: 0,
            nodes: [Slip::default(); CHUNK],
            change: zero,
            pressure: zero,
            slip: zero,
            y: zero,
            by_p: zero,
            by_j: zero,
            kept: [0.0; CHUNK * MOST_LAW_STATE],
        }
    }
}

impl Slipping {
    fn add(&mut self, node: Slip, pressure: f64, kept: &[f64], [y, by_j]: [f64; 2]) {
        let at = self.count;
        self.count += 1;
        self.doubles = kept.len();
        self.nodes[at] = node;
        (self.pressure[at], self.y[at], self.by_j[at]) = (pressure, y, by_j);
        self.kept[at * kept.len()..(at + 1) * kept.len()].copy_from_slice(kept);
    }

    /// A Newton step of every node, kept inside its bracket.
    fn newton(&mut self, stiffness: f64) {
        for at in 0..self.count {
            self.change[at] = self.nodes[at].newton(stiffness, self.y[at], self.by_j[at]);
            self.slip[at] = self.nodes[at].slip();
        }
    }

    fn take_converged(&mut self, mut take: impl FnMut(&Slip, f64, f64)) {
        let mut left = 0;
        for at in 0..self.count {
            if self.change[at] <= CONVERGED * self.nodes[at].step {
                take(&self.nodes[at], self.by_p[at], self.by_j[at]);
                continue;
            }
            if left < at {
                self.nodes[left] = self.nodes[at];
                (self.pressure[left], self.y[left], self.by_j[left]) =
                    (self.pressure[at], self.y[at], self.by_j[at]);
                let d = self.doubles;
                self.kept.copy_within(at * d..(at + 1) * d, left * d);
            }
            left += 1;
        }
        self.count = left;
    }

    fn take_all(&mut self, mut take: impl FnMut(&Slip, f64, f64)) {
        (0..self.count).for_each(|at| take(&self.nodes[at], self.by_p[at], self.by_j[at]));
        self.count = 0;
    }
}

impl ShearLaw {
    /// The same by an expression or a module, for one node.
    pub(crate) fn respond_by(&self, state: &ShearState, kept: &[f64], p: f64, u: [f64; 2]) -> ShearResponse {
        let length = (u[0] * u[0] + u[1] * u[1]).sqrt();
        let at = |slip| self.own(p, slip, kept).unwrap_or_default();
        let (mut y, mut by) = at(state.slip);
        if self.stiffness * length <= y * ON_YIELD {
            return self.elastic(u, state.slip);
        }
        let weight = self.weight(u, length);
        let mut node =
            Slip { k: 0, u, length, weight, low: 0.0, high: length, step: 0.0, before: state.slip };
        for _ in 0..STEPS {
            let change = node.newton(self.stiffness, y, by[1]);
            (y, by) = at(node.slip());
            if change <= CONVERGED * node.step {
                break;
            }
        }
        self.slipped(&node, by[0], by[1])
    }

    fn slipped(&self, node: &Slip, by_p: f64, by_j: f64) -> ShearResponse {
        let hardening = node.weight * by_j.max(0.0);
        self.plastic(node.u, node.length, &Plastic { step: node.step, slip: node.slip(), hardening, by_p })
    }

    /// Answers of nodes with pressure by an expression or a module: trial − k_t·Δj = Y(p, j + Δj), Newton inside a
    /// bracket, all nodes that slip at once.
    pub fn respond_many(&self, nodes: &Sheared, out: &mut [ShearResponse]) {
        let doubles = nodes.kept.len() / nodes.pressure.len().max(1);
        let mut first = 0;
        while first < nodes.pressure.len() {
            let range = first..(first + CHUNK).min(nodes.pressure.len());
            first = range.end;
            let part = Sheared {
                states: &nodes.states[range.clone()],
                kept: &nodes.kept[range.start * doubles..range.end * doubles],
                pressure: &nodes.pressure[range.clone()],
                slide: &nodes.slide[range.clone()],
            };
            self.respond_chunk(&part, &mut out[range]);
        }
    }

    fn respond_chunk(&self, nodes: &Sheared, out: &mut [ShearResponse]) {
        let doubles = nodes.kept.len() / nodes.pressure.len().max(1);
        let mut slipping = Slipping::default();
        let mut slip = [0.0; CHUNK];
        slip.iter_mut().zip(nodes.states).for_each(|(slip, state)| *slip = state.slip);
        let [mut y, mut by_p, mut by_j] = [[0.0; CHUNK]; 3];
        let n = nodes.pressure.len();
        self.strengths(nodes.pressure, &slip[..n], nodes.kept, [&mut y[..n], &mut by_p[..n], &mut by_j[..n]]);
        for (k, (state, slide)) in nodes.states.iter().zip(nodes.slide).enumerate() {
            let u = [state.elastic[0] + slide[0], state.elastic[1] + slide[1]];
            let length = (u[0] * u[0] + u[1] * u[1]).sqrt();
            if self.stiffness * length <= y[k] * ON_YIELD {
                out[k] = self.elastic(u, state.slip);
            } else {
                let kept = &nodes.kept[k * doubles..(k + 1) * doubles];
                let weight = self.weight(u, length);
                let node =
                    Slip { k, u, length, weight, low: 0.0, high: length, step: 0.0, before: state.slip };
                slipping.add(node, nodes.pressure[k], kept, [y[k], by_j[k]]);
            }
        }
        for _ in 0..STEPS {
            if slipping.count == 0 {
                return;
            }
            slipping.newton(self.stiffness);
            self.strengths_of(&mut slipping);
            slipping.take_converged(|node, by_p, by_j| out[node.k] = self.slipped(node, by_p, by_j));
        }
        slipping.take_all(|node, by_p, by_j| out[node.k] = self.slipped(node, by_p, by_j));
    }

    /// [`ShearLaw::yield_stress_kept`] of nodes of an expression or a module, many at once.
    pub fn yield_stresses(&self, pressure: &[f64], slip: &[f64], kept: &[f64], out: &mut [f64]) {
        let doubles = kept.len() / pressure.len().max(1);
        for (k, part) in out.chunks_mut(CHUNK).enumerate() {
            let at = k * CHUNK..k * CHUNK + part.len();
            let [mut by_p, mut by_j] = [[0.0; CHUNK]; 2];
            let kept = &kept[at.start * doubles..at.end * doubles];
            let n = part.len();
            self.strengths(&pressure[at.clone()], &slip[at], kept, [part, &mut by_p[..n], &mut by_j[..n]]);
        }
    }

    /// Yield stresses of nodes and their derivatives by pressure and slip.
    fn strengths(&self, pressure: &[f64], slip: &[f64], kept: &[f64], out: [&mut [f64]; 3]) {
        let [y, by_p, by_j] = out;
        match (&self.plugin, &self.expression) {
            (Some(law), _) => law.strengths(pressure, slip, kept, [&mut *y, &mut *by_p, &mut *by_j]),
            (None, Some(law)) => law.strengths(pressure, slip, [&mut *y, &mut *by_p, &mut *by_j]),
            (None, None) => {}
        }
        let doubles = kept.len() / pressure.len().max(1);
        for k in (0..pressure.len()).filter(|k| is_building_up(self.cohesion, pressure[*k])) {
            let kept = &kept[k * doubles..(k + 1) * doubles];
            if let Some((value, d)) = self.own(pressure[k], slip[k], kept) {
                (y[k], [by_p[k], by_j[k]]) = (value, d);
            }
        }
    }

    fn strengths_of(&self, slipping: &mut Slipping) {
        let n = slipping.count;
        let Slipping { slip, pressure, y, by_p, by_j, kept, doubles, .. } = slipping;
        let out = [&mut y[..n], &mut by_p[..n], &mut by_j[..n]];
        self.strengths(&pressure[..n], &slip[..n], &kept[..n * *doubles], out);
    }
}
