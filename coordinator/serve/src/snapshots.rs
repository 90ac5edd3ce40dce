//! States of a run to go back to: bytes of the testbed and of the recorder, within a budget of memory.

use terraglue_diagnostics::Result;
use terraglue_engine::testbed::Testbed;
use terraglue_recording::{Recorder, RecorderState};
use terraglue_subsystem::bytes::{self, Block};
use terraglue_subsystem::persist;

const FORM: u32 = 1;
const MARK: u64 = 0x7365_7276_6500;

/// Where a run was.
pub struct Moment {
    /// Of the testbed.
    pub testbed: Block,
    /// Of the recorder.
    pub recorder: RecorderState,
}
persist!(Moment { testbed, recorder });

struct Kept {
    step: u64,
    t_s: f64,
    bytes: Vec<u8>,
}

/// All states that are kept.
pub struct Snapshots {
    kept: Vec<Kept>,
    every_s: f64,
    /// Bytes that they may take.
    budget: usize,
}

impl Snapshots {
    /// One every so many seconds of simulation, within a budget (bytes): where it is used up, every second one goes.
    pub fn new(every_s: f64, budget: usize) -> Self {
        Self { kept: Vec::new(), every_s, budget }
    }

    /// Whether it is time for one.
    pub fn is_due(&self, t_s: f64) -> bool {
        self.kept.last().is_none_or(|last| t_s >= last.t_s + self.every_s * (1.0 - 1e-9))
    }

    /// Keeps the state of now.
    ///
    /// # Errors
    /// A module that does not give its state.
    pub fn keep(&mut self, testbed: &Testbed, recorder: &mut Recorder) -> Result {
        let moment = Moment {
            testbed: Block(testbed.serialize()?),
            recorder: testbed.view(|view| recorder.state(view))?,
        };
        let bytes = bytes::seal(FORM, MARK, &moment);
        self.kept.push(Kept { step: testbed.step_index(), t_s: testbed.t_s(), bytes });
        while self.kept.len() > 2 && self.kept.iter().map(|k| k.bytes.len()).sum::<usize>() > self.budget {
            self.every_s *= 2.0;
            let mut place = 0_usize;
            let last = self.kept.len() - 1;
            self.kept.retain(|_| {
                place += 1;
                (place - 1).is_multiple_of(2) || place - 1 == last
            });
        }
        Ok(())
    }

    /// Times of all, s.
    pub fn times(&self) -> Vec<f64> {
        self.kept.iter().map(|kept| kept.t_s).collect()
    }

    /// The last one at or before a step: its step and state.
    pub fn before(&self, step: u64) -> Option<(u64, Moment)> {
        let found = self.kept.iter().rev().find(|kept| kept.step <= step)?;
        Some((found.step, bytes::open(FORM, MARK, &found.bytes).ok()?))
    }

    /// Forgets those behind a step.
    pub fn forget_after(&mut self, step: u64) {
        self.kept.retain(|kept| kept.step <= step);
    }
}
