//! Effect of a fault on one number: pure, and the same for the same seed and time in every call.

use std::collections::VecDeque;
use terraglue_gluing::memory::{Recall, Remember};
use terraglue_scenario::FaultKind;
use terraglue_terrain::SplitMix64;

/// A fault on one number.
#[derive(Clone, Debug)]
pub struct Modifier {
    kind: FaultKind,
    seed: u64,
    /// When it began, s.
    since: f64,
    /// The number that is held.
    held: f64,
    /// Times and numbers, as far back as is needed.
    past: VecDeque<(f64, f64)>,
}

/// Fate of a message of a stream.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// It arrives.
    Passes,
    /// It does not.
    Lost,
    /// The message that came last arrives once more in its place.
    Again,
}

impl Modifier {
    /// Makes one; `h` is the step of the run, s.
    pub fn new(kind: FaultKind, seed: u64, h: f64) -> Self {
        let room = match kind {
            FaultKind::Delay(delay) => (2.0 * delay / h).min(1e7) as usize + 8,
            _ => 0,
        };
        Self { kind, seed, since: 0.0, held: 0.0, past: VecDeque::with_capacity(room) }
    }

    /// The sound number of time t, seen whether the fault is there or not. A time may be seen twice.
    pub fn see(&mut self, t: f64, x: f64) {
        let FaultKind::Delay(delay) = self.kind else { return };
        while self.past.back().is_some_and(|(last, _)| *last >= t) {
            self.past.pop_back();
        }
        self.past.push_back((t, x));
        while self.past.get(1).is_some_and(|(next, _)| *next <= t - delay + slack(t)) {
            self.past.pop_front();
        }
    }

    /// The fault begins, at the number x.
    pub fn begin(&mut self, t: f64, x: f64) {
        (self.since, self.held) = (t, x);
    }

    /// The number of time t under the fault.
    pub fn changed(&mut self, t: f64, x: f64) -> f64 {
        match self.kind {
            FaultKind::Override(value) => value,
            FaultKind::Offset(value) => x + value,
            FaultKind::Gain(factor) => x * factor,
            FaultKind::Ramp(rate) => x + rate * (t - self.since),
            FaultKind::Freeze => self.held,
            FaultKind::Delay(delay) => self.past_at(t - delay + slack(t)).unwrap_or(x),
            FaultKind::DropOut(probability) => {
                if self.random(t).unit() >= probability {
                    self.held = x;
                }
                self.held
            }
            FaultKind::Noise(deviation) => x + deviation * gauss(&mut self.random(t)),
        }
    }

    /// Whether it is a fault that messages can have.
    pub fn takes_messages(&self) -> bool {
        matches!(self.kind, FaultKind::Freeze | FaultKind::DropOut(_))
    }

    /// Fate of a message that is on its way at time t under the fault. One that is on its way when a freeze begins
    /// still arrives, as the number of that time does.
    pub fn fate(&self, t: f64) -> Fate {
        match self.kind {
            FaultKind::Freeze if t > self.since => Fate::Again,
            FaultKind::DropOut(probability) if self.random(t).unit() < probability => Fate::Lost,
            _ => Fate::Passes,
        }
    }

    /// The last number at or before t, else the first that was seen.
    fn past_at(&self, t: f64) -> Option<f64> {
        let before = self.past.iter().rev().find(|(time, _)| *time <= t);
        before.or(self.past.front()).map(|(_, x)| *x)
    }

    /// A source of its own for every time, so that a repeated or restored step finds the same.
    fn random(&self, t: f64) -> SplitMix64 {
        let time = if t == 0.0 { 0 } else { t.to_bits() };
        SplitMix64::new(self.seed ^ SplitMix64::new(time).next_u64())
    }

    /// For a snapshot.
    pub fn remember(&self, out: &mut Vec<u64>) {
        out.put(self.since);
        out.put(self.held);
        out.push(self.past.len() as u64);
        self.past.iter().for_each(|(t, x)| {
            out.put(*t);
            out.put(*x);
        });
    }

    /// Back to a snapshot.
    pub fn recall(&mut self, kept: &mut Recall) {
        (self.since, self.held) = (kept.number(), kept.number());
        let count = (kept.word() as usize).min(kept.0.len() / 2);
        self.past.clear();
        self.past.extend((0..count).map(|_| (kept.number(), kept.number())));
    }
}

/// Tolerance within which two times are the same, s.
fn slack(t: f64) -> f64 {
    1e-12 + 8.0 * f64::EPSILON * t.abs()
}

/// Normal with mean 0 and deviation 1 (Box and Muller, 1958).
fn gauss(random: &mut SplitMix64) -> f64 {
    let (a, b) = (1.0 - random.unit(), random.unit());
    (-2.0 * libm::log(a)).sqrt() * libm::cos(std::f64::consts::TAU * b)
}

#[cfg(test)]
mod tests {
    use super::*;

    const H: f64 = 0.01;

    fn run(kind: FaultKind, steps: u32) -> Vec<f64> {
        let mut modifier = Modifier::new(kind, 7, H);
        (0..steps)
            .map(|k| {
                let t = f64::from(k) * H;
                modifier.see(t, t);
                if k == 10 {
                    modifier.begin(t, t);
                }
                if k < 10 { t } else { modifier.changed(t, t) }
            })
            .collect()
    }

    #[test]
    fn a_delayed_number_is_the_one_of_then() {
        let values = run(FaultKind::Delay(0.05), 100);
        for (k, value) in values.iter().enumerate().skip(10) {
            assert_eq!(*value, (k - 5) as f64 * H, "step {k}");
        }
    }

    #[test]
    fn what_drops_out_keeps_its_last_number_and_noise_has_its_deviation() {
        let values = run(FaultKind::DropOut(0.5), 20_010);
        let kept = values.windows(2).skip(10).filter(|pair| pair[0] == pair[1]).count();
        assert!((kept as f64 / 20_000.0 - 0.5).abs() < 0.02, "{kept} of 20000 dropped out");
        let steps = 20_010;
        let noise = run(FaultKind::Noise(2.0), steps);
        let off: Vec<f64> = noise.iter().enumerate().skip(10).map(|(k, x)| x - k as f64 * H).collect();
        let mean = off.iter().sum::<f64>() / off.len() as f64;
        let deviation = (off.iter().map(|x| x * x).sum::<f64>() / off.len() as f64).sqrt();
        assert!(mean.abs() < 0.06 && (deviation - 2.0).abs() < 0.05, "{mean} {deviation}");
        assert_eq!(noise, run(FaultKind::Noise(2.0), steps));
    }

    #[test]
    fn a_time_that_is_seen_again_changes_nothing_and_a_snapshot_goes_on_the_same() {
        let mut modifier = Modifier::new(FaultKind::Delay(0.03), 1, H);
        for k in 0..20 {
            let t = f64::from(k) * H;
            modifier.see(t, -1.0);
            modifier.see(t, t);
        }
        let mut kept = Vec::new();
        modifier.remember(&mut kept);
        let mut other = Modifier::new(FaultKind::Delay(0.03), 1, H);
        other.recall(&mut Recall(&kept));
        assert_eq!(modifier.changed(0.19, 0.0), other.changed(0.19, 0.0));
        assert!((other.changed(0.19, 0.0) - 0.16).abs() < 1e-12);
    }
}
