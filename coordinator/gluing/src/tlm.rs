//! Springs as transmission lines (Krus et al. 1990; Fritzson et al. 2007): a wave takes one step from end to end.
//!
//! A line of delay h and characteristic impedance Zc = k_c·h has the stiffness k_c of the spring; its own mass k_c·h²
//! is the error. End 1 sees T1 = c1 − Zc·v1, end 2 T2 = c2 + Zc·v2, with c1 = T2 + Zc·v2 and c2 = T1 − Zc·v1 of one
//! step before, so both sides step at once and the coupling cannot make energy. With v = X/h both are impedances
//! k_c on the motion X in the step.

use super::exchange::Exchange;
use super::memory::{Recall, Remember};
use super::{Needs, Outcome, Strategy};
use terraglue_diagnostics::Result;
use terraglue_host::Instance;
use terraglue_subsystem::Capabilities;

/// Name in the scenario.
pub const NAME: &str = terraglue_scenario::StrategyKind::Tlm.name();

/// Key of a port and what arrives at its two ends.
type Wave = (u64, [f64; 6], [f64; 6]);

/// The waves that arrive in the next step, by port.
#[derive(Debug, Default)]
pub struct Tlm {
    waves: Vec<Wave>,
    next: Vec<Wave>,
    c1: Vec<f64>,
    c2: Vec<f64>,
    z1: Vec<f64>,
    z2: Vec<f64>,
}

impl Tlm {
    /// The waves of t; at the start those of a line at rest under the spring's force.
    fn arrive(&mut self, exchange: &Exchange) {
        for list in [&mut self.c1, &mut self.c2, &mut self.z1, &mut self.z2] {
            list.clear();
        }
        let h = exchange.at.h;
        for port in &exchange.ports {
            let kept = self.waves.iter().find(|w| w.0 == port.key);
            for (k, i) in port.range().enumerate() {
                let stiffness = 1.0 / port.law.compliance;
                let force = exchange.t[i];
                self.c1.push(kept.map_or(force + stiffness * h * exchange.v2[i], |w| w.1[k]));
                self.c2.push(kept.map_or(force - stiffness * h * exchange.v1[i], |w| w.2[k]));
                self.z1.push(stiffness);
                self.z2.push(-stiffness);
            }
        }
    }

    /// The waves that leave both ends; the difference of the forces at the ends.
    fn leave(&mut self, exchange: &Exchange) -> f64 {
        self.next.clear();
        let mut largest: f64 = 0.0;
        for port in &exchange.ports {
            let mut wave = (port.key, [0.0; 6], [0.0; 6]);
            for (k, i) in port.range().enumerate() {
                let t1 = self.c1[i] - self.z1[i] * exchange.x1[i];
                let t2 = self.c2[i] - self.z2[i] * exchange.x2[i];
                wave.1[k] = t2 + self.z1[i] * exchange.x2[i];
                wave.2[k] = t1 - self.z1[i] * exchange.x1[i];
                largest = largest.max((t1 - t2).abs());
            }
            self.next.push(wave);
        }
        std::mem::swap(&mut self.waves, &mut self.next);
        largest
    }
}

impl Strategy for Tlm {
    fn name(&self) -> &'static str {
        NAME
    }

    fn is_single_pass(&self) -> bool {
        true
    }

    fn needs(&self) -> Needs {
        let both = Capabilities::IMPEDANCE;
        Needs { first: both, second: both, grounds: both }
    }

    fn refuses(&self, exchange: &Exchange) -> Option<String> {
        let rigid = exchange.glue.rigid_joint().map(|k| {
            format!(
                "`{NAME}` carries forces through springs: glue {} has no compliance_m_n, and a rigid joint has no \
                 travelling time",
                k + 1
            )
        });
        let damped = exchange.glue.damped().map(|k| {
            format!("`{NAME}` carries forces through springs: glue {} has a damper, which no line has", k + 1)
        });
        super::contacts_refused(NAME, exchange).or(rigid).or(damped)
    }

    fn remember(&self, out: &mut Vec<u64>) {
        for end in [|w: &Wave| (w.0, w.1), |w: &Wave| (w.0, w.2)] {
            out.put_wrenches(&self.waves.iter().map(end).collect::<Vec<_>>());
        }
    }

    fn recall(&mut self, kept: &mut Recall) {
        let (mut first, mut second) = (Vec::new(), Vec::new());
        kept.wrenches(&mut first);
        kept.wrenches(&mut second);
        self.waves = first.iter().zip(&second).map(|(a, b)| (a.0, a.1, b.1)).collect();
    }

    fn solve(&mut self, exchange: &mut Exchange, instances: &mut [Instance]) -> Result<Outcome> {
        exchange.explicit_forces();
        exchange.start_at_constant_velocity();
        self.arrive(exchange);
        exchange.advance_half_under_impedance(true, (&self.c2, &self.z2), instances)?;
        exchange.advance_half_under_impedance(false, (&self.c1, &self.z1), instances)?;
        exchange.report.max_action_reaction_gap_n = self.leave(exchange);
        Ok(super::single_pass(exchange))
    }
}
