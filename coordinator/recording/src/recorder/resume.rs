//! A recorder that goes on in another process.

use super::{Recorder, RecorderOptions, about, selected};
use crate::csv::VariablesCsv;
use crate::keep::Keep;
use crate::layout::other_at;
use crate::mcap_writer::{McapState, McapWriter};
use crate::space::Reserve;
use std::io::ErrorKind::{InvalidData, NotFound, Other, UnexpectedEof};
use std::path::Path;
use terraglue_diagnostics::InputError;
use terraglue_diagnostics::error::{Error, Result};
use terraglue_engine::observer::{Observer, View};
use terraglue_scenario::Scenario;
use terraglue_subsystem::bytes::Block;
use terraglue_subsystem::persist;

/// State from which a recorder resumes.
pub struct RecorderState {
    mcap: McapState,
    /// Length of `variables.csv`, bytes.
    csv: Option<u64>,
    summary: Block,
    recorded_step: Option<u64>,
}
persist!(RecorderState { mcap, csv, summary, recorded_step });

/// A file that is gone or not as the checkpoint counts on is wrong input.
fn changed(error: Error) -> Error {
    match error {
        Error::File { path, source }
            if matches!(source.kind(), InvalidData | NotFound | Other | UnexpectedEof) =>
        {
            let help =
                "a checkpoint goes on with the files as they were: put them back, or start the run anew";
            InputError::plain(format!("{path}: {source}"), Some(help.into())).into()
        }
        other => other,
    }
}

impl Recorder {
    /// State with which another process resumes here: everything up to now is with the operating system or in the state.
    ///
    /// # Errors
    /// A file that cannot be written, a soil that does not provide its tiles.
    pub fn state(&mut self, view: &View) -> Result<RecorderState> {
        let mut summary = Block::default();
        self.summary.keep(&mut summary.0);
        let mcap = self.mcap.state(view).map_err(|e| self.explained(e))?;
        let csv = self.csv.as_mut().map(VariablesCsv::length).transpose().map_err(|e| self.explained(e))?;
        Ok(RecorderState { mcap, csv, summary, recorded_step: self.recorded_step })
    }

    /// Goes on in a folder that another process has recorded into; `view` is the moment of the state. All that was written
    /// after it is cut off.
    ///
    /// # Errors
    /// Files that are not as they were, or cannot be read and written.
    pub fn resume(
        folder: &Path,
        scenario: &Scenario,
        options: RecorderOptions,
        view: &View,
        state: RecorderState,
    ) -> Result<Self> {
        let snapshot = selected(view, (&scenario.recording, &scenario.source), &scenario.connections)?;
        let at = (view, &snapshot);
        let mcap = McapWriter::resume(folder, about(scenario), scenario, at, state.mcap).map_err(changed)?;
        let mut recorder = Self::with(folder, scenario, options, mcap, Reserve::take(folder));
        recorder.snapshot = snapshot;
        recorder.csv =
            state.csv.map(|length| VariablesCsv::go_on(folder, length)).transpose().map_err(changed)?;
        recorder.recorded_step = state.recorded_step;
        recorder.summary.started(view)?;
        recorder.summary.recall(&mut state.summary.0.as_slice()).map_err(other_at(folder))?;
        Ok(recorder)
    }
}
