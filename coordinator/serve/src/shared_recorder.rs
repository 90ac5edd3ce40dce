//! The recorder of a run, also within reach when foreign code ends the process: it is closed with the error then.

use std::path::Path;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use terraglue_diagnostics::{Error, Result};
use terraglue_engine::observer::{Event, Observer, View};
use terraglue_host::exit_guard::{ExitHook, add_exit_hook};
use terraglue_recording as recording;
use terraglue_recording::{Recorder, Status};
use terraglue_scenario::Scenario;

/// A recorder with two holders: the run, and what is done at its end by others.
pub struct SharedRecorder(Arc<Mutex<Recorder>>);

impl SharedRecorder {
    /// Shares a recorder.
    pub fn new(recorder: Recorder) -> Self {
        Self(Arc::new(Mutex::new(recorder)))
    }

    /// For figures and the end.
    pub fn lock(&self) -> MutexGuard<'_, Recorder> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Closes the recording with an error, reports it, and writes the report in `folder` when a module or FMU ends the process.
    #[must_use]
    pub fn exit_hook(&self, scenario: &Scenario, folder: &Path, tell: fn(&Error)) -> ExitHook {
        let recorder = Arc::clone(&self.0);
        let suspects = suspects(scenario);
        let folder = std::path::absolute(folder).unwrap_or_else(|_| folder.to_owned());
        add_exit_hook(move || close(&recorder, suspects, &folder, tell))
    }
}

fn close(recorder: &Mutex<Recorder>, suspects: String, folder: &Path, tell: fn(&Error)) {
    let message = format!("{suspects} ended the program by exit()");
    // held where that happened while values were read for the recorder: what was written before is kept
    let Ok(mut recorder) = recorder.try_lock() else {
        eprintln!("error: {message}");
        return;
    };
    let time_s = recorder.summary().t_s();
    let error = Error::Simulation { time_s, message };
    tell(&error);
    if recorder.finish(0.0, 0.0, Some(&error), Status::Failed).is_ok() {
        // the recording is there without it
        drop(recording::report::write(folder));
    }
}

/// Who can have done it: what lives in this process.
fn suspects(scenario: &Scenario) -> String {
    let here = scenario.subsystems.iter().filter(|s| !s.isolate);
    let names: Vec<String> = here.map(|s| format!("`{}`", s.name)).collect();
    match &names[..] {
        [one] => one.clone(),
        several => format!("one of {} (`isolate = true` shows which)", several.join(", ")),
    }
}

impl Observer for SharedRecorder {
    fn started(&mut self, view: &View) -> Result {
        self.lock().started(view)
    }

    fn stepped(&mut self, view: &View) -> Result {
        self.lock().stepped(view)
    }

    fn event(&mut self, event: &Event) -> Result {
        self.lock().event(event)
    }

    fn finished(&mut self, view: &View, error: Option<&Error>) -> Result {
        self.lock().finished(view, error)
    }
}
