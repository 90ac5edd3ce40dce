//! dX, dV and dA/d(wrench on itself) of a trial at ports of glued joints, as exact as its Newton iteration needs them.
//!
//! Contacts alone take [`Ports::compliance`] instead: their soils deflect far more than the terms left out.

use super::ports::{Ports, response};
use crate::dynamics::Dynamics;
use crate::dynamics::sensitivity::Sensitivity;
use terraglue_subsystem::{Level, Port, Response};

/// Bodies that end this near to where they ended before have the same derivatives, m or rad.
const NEAR: f64 = 1e-5;

/// The derivatives and the factorisation they belong to.
#[derive(Default)]
pub(crate) struct PortJacobian {
    matrices: [Vec<f64>; 3],
    /// Factorisation they belong to; 0: none.
    of: u64,
    base: [Vec<f64>; 3],
    moved: [Vec<f64>; 3],
    t: Vec<f64>,
    sensitivity: Sensitivity,
}

impl PortJacobian {
    /// The derivatives at a level, n × n, column-major, at the last trial.
    pub fn at(&mut self, level: Level, list: &[Port], ports: &Ports, dynamics: &mut Dynamics) -> &[f64] {
        let n = ports.len();
        let near = self.sensitivity.is_near(dynamics, NEAR);
        if !(near && self.of == dynamics.kkt.factor_count && self.matrices[0].len() == n * n) {
            self.take(list, ports, dynamics);
            self.of = dynamics.kkt.factor_count;
        }
        &self.matrices[level as usize]
    }

    /// Discards results of another step or of other ports.
    pub fn forget(&mut self) {
        self.of = 0;
    }

    fn take(&mut self, list: &[Port], ports: &Ports, dynamics: &mut Dynamics) {
        let n = ports.len();
        self.sensitivity.begin(dynamics);
        read(list, dynamics, &mut self.base, &mut self.t, n);
        self.matrices.iter_mut().for_each(Vec::clear);
        for c in 0..n {
            ports.load_unit(dynamics, c, self.sensitivity.load());
            let epsilon = self.sensitivity.answer(dynamics);
            if epsilon.is_some() {
                read(list, dynamics, &mut self.moved, &mut self.t, n);
            }
            for ((matrix, base), moved) in self.matrices.iter_mut().zip(&self.base).zip(&self.moved) {
                let column = moved.iter().zip(base).map(|(m, b)| epsilon.map_or(0.0, |e| (m - b) / e));
                matrix.extend(column.take(n));
                matrix.resize((c + 1) * n, 0.0);
            }
        }
        self.sensitivity.end(dynamics);
    }
}

/// X, V and A of the trial in hand.
fn read(list: &[Port], dynamics: &Dynamics, out: &mut [Vec<f64>; 3], t: &mut Vec<f64>, n: usize) {
    out.iter_mut().for_each(|v| v.resize(n, 0.0));
    t.resize(n, 0.0);
    let [x, v, a] = out;
    response(list, dynamics, &mut Response { x, v, a, t, reached: 0.0, flags: 0 });
}
