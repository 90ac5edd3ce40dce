//! The time of a run: the grid of nominal steps, and where on it the run stands. It is copied whole into snapshots.

use terraglue_gluing::StepContext;
use terraglue_subsystem::Energy;

/// The least part of a step that counts as time left.
const SPLINTER: f64 = 1e-6;

/// Time of a testbed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RunClock {
    /// Length of a nominal step, s.
    pub step_s: f64,
    /// Time of nominal step 0, s: 0 unless the length of the steps has been changed on the way.
    pub origin_s: f64,
    /// Nominal steps done.
    pub nominal: u64,
    /// Communication steps done, halves counted.
    pub index: u64,
    /// Now, s.
    pub t: f64,
    /// Whether the time before t = 0 is over.
    pub started: bool,
    /// Whether the connected start values have been passed on and the initialisation of FMUs has ended.
    pub initialised: bool,
    /// Energies that were counted before t = 0.
    pub before: Energy,
}

impl RunClock {
    /// At t = 0, before anything has been done.
    pub fn new(step_s: f64) -> Self {
        let before = Energy::default();
        Self {
            step_s,
            origin_s: 0.0,
            nominal: 0,
            index: 0,
            t: 0.0,
            started: false,
            initialised: false,
            before,
        }
    }

    /// End of the present nominal step, s.
    pub fn end(&self) -> f64 {
        self.origin_s + (self.nominal + 1) as f64 * self.step_s
    }

    /// Whether `until` is later than now by more than rounding.
    pub fn is_before(&self, until: f64) -> bool {
        until - self.t > SPLINTER * self.step_s
    }

    /// The time `next` where it cuts the way to `end` into two parts worth a step, else `end`.
    pub fn stop(&self, next: f64, end: f64) -> f64 {
        let apart = SPLINTER * self.step_s;
        if next - self.t > apart && end - next > apart { next } else { end }
    }

    /// A communication step of length h was done.
    pub fn advance(&mut self, h: f64) {
        self.index += 1;
        self.t += h;
    }

    /// Steps have this length from now on. Steps of the scenario's own length stay on its grid of times.
    pub fn set_step_s(&mut self, step_s: f64) {
        let on_grid = self.nominal as f64 * step_s;
        let off = (self.t - on_grid).abs() > 1e-12 * self.t.abs().max(step_s);
        self.origin_s = if off { self.t - on_grid } else { 0.0 };
        self.step_s = step_s;
    }

    /// The next communication step, of length h.
    pub fn step_of(&self, h: f64) -> StepContext {
        StepContext { t: self.t, h, index: self.index, ..StepContext::default() }
    }
}
