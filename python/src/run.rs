//! A testbed with its scenario, its recording, and the states that it keeps.

use crate::errors::{Refusal, Refused};
use crate::observe::Follower;
use crate::snapshot::{Place, Places, Snapshot};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};
use terraglue::checkpoint::States;
use terraglue::host::HostServices;
use terraglue::observer::Observer;
use terraglue::recording::{Recorder, RecorderOptions, Status, Summary, write_exchange};
use terraglue::scenario::Scenario;
use terraglue::testbed::{Options, Testbed};
use terraglue::{Error, Result};

/// States that a testbed can keep at a time.
pub const MOST_SNAPSHOTS: u32 = 64;

/// Steps between two looks at the clock.
const TOGETHER: u32 = 8;

/// See above.
pub struct Run {
    pub testbed: Testbed,
    pub scenario: Scenario,
    pub places: Arc<Places>,
    pub followers: Vec<Follower>,
    recorder: Option<Recorder>,
    failed: Option<String>,
    options: Options,
    states: Option<States>,
}

impl Run {
    /// Builds a scenario; with `out` it is recorded there as `terraglue run` does.
    ///
    /// # Errors
    /// Wrong input, or a folder that cannot be written.
    pub fn new(scenario: Scenario, threads: usize, modules: &[PathBuf], out: Option<&Path>) -> Result<Self> {
        let options = Options { threads, module_paths: modules.to_vec(), ..Options::default() };
        let slots = |services: HostServices| HostServices { slots: MOST_SNAPSHOTS, ..services };
        let mut testbed = Testbed::build_hosted(&scenario, &options, &terraglue::library(), slots)?;
        let mut recorder = None;
        if let Some(folder) = out {
            std::fs::create_dir_all(folder)
                .map_err(|source| Error::File { path: folder.display().to_string(), source })?;
            recorder = Some(Recorder::create(folder, &scenario, RecorderOptions::default())?);
        }
        testbed.begin()?;
        if let Some(recorder) = &mut recorder {
            testbed.view(|view| recorder.started(view))?;
        }
        if let Some(folder) = out {
            write_exchange(folder, &testbed.explain())?;
        }
        let (places, followers) = (Places::new(MOST_SNAPSHOTS), Vec::new());
        Ok(Self { testbed, scenario, places, followers, recorder, failed: None, options, states: None })
    }

    /// Makes steps, for `slice` of wall time at most; how many are left.
    ///
    /// # Errors
    /// The simulation stops, now or before.
    pub fn make_steps(&mut self, count: u32, slice: Duration) -> Result<u32> {
        let (step_s, begin) = (self.scenario.time.step_s, Instant::now());
        let mut left = count;
        while left > 0 && begin.elapsed() < slice {
            let some = left.min(TOGETHER);
            self.run_until(self.testbed.t_s() + f64::from(some) * step_s, Duration::MAX)?;
            left -= some;
        }
        Ok(left)
    }

    /// Steps up to a time, for `slice` of wall time at most; whether it is there.
    ///
    /// # Errors
    /// The simulation stops, now or before.
    pub fn run_until(&mut self, until_s: f64, slice: Duration) -> Result<bool> {
        if let Some(message) = &self.failed {
            let message = format!("it stopped before: {message}");
            return Err(Error::Simulation { time_s: self.testbed.t_s(), message });
        }
        let step_s = self.scenario.time.step_s;
        let begin = Instant::now();
        while self.testbed.t_s() < until_s - 1e-9 * step_s.max(until_s.abs() * 1e-3) {
            if begin.elapsed() >= slice {
                return Ok(false);
            }
            self.followers.retain(Follower::is_wanted);
            // half a step ahead lies within the next one
            let ahead = if self.followers.is_empty() { f64::from(TOGETHER) } else { 0.5 };
            let next = (self.testbed.t_s() + ahead * step_s).min(until_s);
            let stepped = match &mut self.recorder {
                Some(recorder) => self.testbed.run_until(next, &mut [recorder]),
                None => self.testbed.run_until(next, &mut []),
            };
            if let Err(error) = stepped {
                self.failed = Some(error.to_string());
                return Err(error);
            }
            self.followers.iter_mut().for_each(|follower| follower.look(&self.testbed));
        }
        Ok(true)
    }

    /// Keeps the whole state while the answer lives.
    ///
    /// # Errors
    /// Too many are kept, or a module that cannot keep its state.
    pub fn snapshot(&mut self) -> Refused<Snapshot> {
        let Some(place) = self.places.take() else {
            let message = format!("a testbed keeps at most {MOST_SNAPSHOTS} snapshots: drop some of them");
            return Err(Refusal::Input(message));
        };
        let place = Place { place, places: self.places.clone() };
        Ok(Snapshot { state: self.testbed.snapshot(place.place)?, place })
    }

    /// Back to a state that was kept, also after a failure.
    ///
    /// # Errors
    /// The state is one of another testbed, or this one is recorded.
    pub fn restore(&mut self, snapshot: &Snapshot) -> Refused {
        if !Arc::ptr_eq(&self.places, &snapshot.place.places) {
            return Err(Refusal::Input("the snapshot is one of another testbed".into()));
        }
        self.may_go_back()?;
        self.testbed.restore(&snapshot.state)?;
        self.failed = None;
        Ok(())
    }

    /// The whole state as bytes.
    ///
    /// # Errors
    /// A module that does not give its state as bytes.
    pub fn serialize(&mut self) -> Refused<Vec<u8>> {
        if self.states.is_none() {
            self.states = Some(States::of(&self.scenario, &self.options)?);
        }
        Ok(self.states.as_ref().map(|states| states.bytes(&self.testbed)).transpose()?.unwrap_or_default())
    }

    /// Into the state of such bytes.
    ///
    /// # Errors
    /// The bytes are damaged or of another scenario, or this testbed is recorded.
    pub fn deserialize(&mut self, bytes: &[u8]) -> Refused {
        self.may_go_back()?;
        if self.states.is_none() {
            self.states = Some(States::of(&self.scenario, &self.options)?);
        }
        self.states.as_ref().map_or(Ok(()), |states| states.restore(&mut self.testbed, bytes))?;
        self.failed = None;
        Ok(())
    }

    fn may_go_back(&self) -> Refused {
        match self.recorder {
            Some(_) => {
                Err(Refusal::Input("a testbed that is recorded cannot go back: leave `out` away".into()))
            }
            None => Ok(()),
        }
    }

    /// Closes recording and subsystems; the summary where it was recorded.
    ///
    /// # Errors
    /// A file that cannot be written, or a subsystem that fails at its end.
    pub fn finish(self) -> Result<Option<Summary>> {
        let Self { testbed, recorder, failed, .. } = self;
        let time_s = testbed.t_s();
        let error = failed.map(|message| Error::Simulation { time_s, message });
        let summary = match recorder {
            Some(mut recorder) => {
                testbed.view(|view| recorder.finished(view, error.as_ref()))?;
                let status = if error.is_some() { Status::Failed } else { Status::Done };
                Some(recorder.finish(0.0, 0.0, error.as_ref(), status)?)
            }
            None => None,
        };
        testbed.close()?;
        Ok(summary)
    }
}
