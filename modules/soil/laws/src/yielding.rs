//! The way back to the yield stress of any law, which an expression or a module gives, for one node or for many at once.

use crate::shear::{ON_YIELD, Plastic, ShearLaw, ShearResponse, ShearState};
use crate::shear_strength::{ShearStrength, YieldAnswer, YieldNodes};
use crate::strength_law::StrengthLaw;
use terraglue_subsystem::{MOST_LAW_STATE, Result};

/// Nodes whose yield stress is evaluated together.
const CHUNK: usize = 64;
/// Newton steps until bisection has the last word.
const STEPS: usize = 60;
/// Relative change of a slip at which Newton has arrived: the error left is of the order of its square, that of the
/// derivatives, which were evaluated before it, of its own.
const CONVERGED: f64 = 1e-10;
/// Change of a slip, relative to the displacement, that is nothing but the rounding of the stress.
const ROUNDING: f64 = 4.0 * f64::EPSILON;
/// A displacement that grows by less, relative, has not grown.
const STANDS: f64 = 1e-9;

/// Nodes with pressure and how far each is dragged.
#[derive(Clone, Copy, Debug)]
pub struct Sheared<'a> {
    /// Histories.
    pub states: &'a [ShearState],
    /// State of a law with a state at them.
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
    /// Bracket of the step; below zero while nothing is known of no slip at all.
    low: f64,
    high: f64,
    step: f64,
    before: f64,
}

/// Regime of a node.
#[derive(Clone, Copy, PartialEq)]
enum Stand {
    Elastic,
    Arrived,
    UnderWay,
}

impl Slip {
    /// A node that is dragged by `slide` from the history `state`. It starts where the elastic displacement would stay as
    /// it is, which for stiff soil that slides on is next to the answer.
    fn start(k: usize, law: &ShearLaw, state: &ShearState, slide: [f64; 2]) -> Self {
        let norm = |u: [f64; 2]| (u[0] * u[0] + u[1] * u[1]).sqrt();
        let u = [state.elastic[0] + slide[0], state.elastic[1] + slide[1]];
        let (length, before) = (norm(u), state.slip);
        let grown = length - norm(state.elastic);
        let step = if grown > STANDS * length { grown } else { 0.0 };
        Self { k, u, length, weight: law.weight(u, length), low: -1.0, high: length, step, before }
    }

    /// Slip counted since the contact began, m.
    #[inline]
    fn slip(&self) -> f64 {
        self.before + self.weight * self.step
    }

    /// A step of Newton's method, kept inside the bracket; the yield stress is y with the slope by_j. The yield stress
    /// does not fall with the slip, so a node that is above it after some slip was above it before.
    #[inline]
    fn newton(&mut self, stiffness: f64, y: f64, by_j: f64) -> Stand {
        if self.step == 0.0 && stiffness * self.length <= y * ON_YIELD {
            return Stand::Elastic;
        }
        let residual = stiffness * (self.length - self.step) - y;
        if residual > 0.0 {
            self.low = self.step
        } else {
            self.high = self.step
        }
        let mut next = self.step + residual / (stiffness + self.weight * by_j.max(0.0));
        if self.low < 0.0 && next <= 0.0 {
            next = 0.0;
        } else if !(next >= self.low && next <= self.high) {
            next = 0.5 * (self.low.max(0.0) + self.high);
        }
        let change = (next - self.step).abs();
        self.step = next;
        let nothing = CONVERGED * next + ROUNDING * self.length;
        if change <= nothing { Stand::Arrived } else { Stand::UnderWay }
    }
}

/// The nodes of a chunk that are still under way, gathered at the front.
struct Slipping {
    count: usize,
    nodes: [Slip; CHUNK],
    pressure: [f64; CHUNK],
    slip: [f64; CHUNK],
    y: [f64; CHUNK],
    by_p: [f64; CHUNK],
    by_j: [f64; CHUNK],
    kept: [f64; CHUNK * MOST_LAW_STATE],
}

impl Slipping {
    fn new(law: &ShearLaw, nodes: &Sheared) -> Self {
        let zero = [0.0; CHUNK];
        let mut all = Self {
            count: nodes.pressure.len(),
            nodes: [Slip::default(); CHUNK],
            pressure: zero,
            slip: zero,
            y: zero,
            by_p: zero,
            by_j: zero,
            kept: [0.0; CHUNK * MOST_LAW_STATE],
        };
        for (k, (state, slide)) in nodes.states.iter().zip(nodes.slide).enumerate() {
            all.nodes[k] = Slip::start(k, law, state, *slide);
            all.slip[k] = all.nodes[k].slip();
        }
        all.pressure[..all.count].copy_from_slice(nodes.pressure);
        all.kept[..nodes.kept.len()].copy_from_slice(nodes.kept);
        all
    }

    /// A Newton step of every node; those that have ended are given away.
    fn newton(&mut self, doubles: usize, stiffness: f64, mut take: impl FnMut(&Slip, Stand, [f64; 2])) {
        let mut left = 0;
        for at in 0..self.count {
            let stand = self.nodes[at].newton(stiffness, self.y[at], self.by_j[at]);
            if stand != Stand::UnderWay {
                take(&self.nodes[at], stand, [self.by_p[at], self.by_j[at]]);
                continue;
            }
            self.slip[left] = self.nodes[at].slip();
            if left < at {
                self.nodes[left] = self.nodes[at];
                self.pressure[left] = self.pressure[at];
                self.kept.copy_within(at * doubles..(at + 1) * doubles, left * doubles);
            }
            left += 1;
        }
        self.count = left;
    }
}

impl ShearLaw {
    /// Answer of one node by any law.
    pub(crate) fn respond_by_any(
        &self,
        law: &StrengthLaw,
        state: &ShearState,
        kept: &[f64],
        p: f64,
        slide: [f64; 2],
    ) -> Result<ShearResponse> {
        let mut node = Slip::start(0, self, state, slide);
        let mut by = [0.0; 2];
        for _ in 0..STEPS {
            let y;
            (y, by) = law.yield_stress(p, node.slip(), kept)?;
            match node.newton(self.stiffness, y, by[1]) {
                Stand::UnderWay => {}
                stand => return Ok(self.ended(&node, stand, by)),
            }
        }
        Ok(self.ended(&node, Stand::Arrived, by))
    }

    fn ended(&self, node: &Slip, stand: Stand, [by_p, by_j]: [f64; 2]) -> ShearResponse {
        if stand == Stand::Elastic {
            return self.elastic(node.u, node.before);
        }
        let hardening = node.weight * by_j.max(0.0);
        self.plastic(node.u, node.length, &Plastic { step: node.step, slip: node.slip(), hardening, by_p })
    }

    /// Answers of nodes with pressure by an expression or a module: trial − k_t·Δj = Y(p, j + Δj), Newton inside a
    /// bracket, all nodes that slip at once.
    ///
    /// # Errors
    /// The law, which is a module, has no answer.
    pub fn respond_many(&self, nodes: &Sheared, out: &mut [ShearResponse]) -> Result {
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
            self.respond_chunk(&part, &mut out[range])?;
        }
        Ok(())
    }

    fn respond_chunk(&self, nodes: &Sheared, out: &mut [ShearResponse]) -> Result {
        let doubles = nodes.kept.len() / nodes.pressure.len().max(1);
        let mut slipping = Slipping::new(self, nodes);
        for _ in 0..=STEPS {
            let n = slipping.count;
            if n == 0 {
                return Ok(());
            }
            let Slipping { slip, pressure, y, by_p, by_j, kept, .. } = &mut slipping;
            let asked = YieldNodes { pressure: &pressure[..n], slip: &slip[..n], kept: &kept[..n * doubles] };
            let mut answer =
                YieldAnswer { stress: &mut y[..n], by_pressure: &mut by_p[..n], by_slip: &mut by_j[..n] };
            self.law.yield_stresses(&asked, &mut answer)?;
            let mut take = |node: &Slip, stand, by| out[node.k] = self.ended(node, stand, by);
            slipping.newton(doubles, self.stiffness, &mut take);
        }
        for at in 0..slipping.count {
            let by = [slipping.by_p[at], slipping.by_j[at]];
            out[slipping.nodes[at].k] = self.ended(&slipping.nodes[at], Stand::Arrived, by);
        }
        Ok(())
    }

    /// [`ShearLaw::yield_stress`] of nodes of an expression or a module, many at once, Pa.
    ///
    /// # Errors
    /// The law, which is a module, has no answer.
    pub fn yield_stresses(&self, nodes: &YieldNodes, out: &mut [f64]) -> Result {
        let doubles = nodes.kept.len() / nodes.pressure.len().max(1);
        for (k, part) in out.chunks_mut(CHUNK).enumerate() {
            let at = k * CHUNK..k * CHUNK + part.len();
            let [mut by_p, mut by_j] = [[0.0; CHUNK]; 2];
            let n = part.len();
            let mut answer =
                YieldAnswer { stress: part, by_pressure: &mut by_p[..n], by_slip: &mut by_j[..n] };
            let kept = &nodes.kept[at.start * doubles..at.end * doubles];
            let asked = YieldNodes { pressure: &nodes.pressure[at.clone()], slip: &nodes.slip[at], kept };
            self.law.yield_stresses(&asked, &mut answer)?;
        }
        Ok(())
    }
}
