//! The recorder: one observer that fills the results folder of a run.

use crate::csv::VariablesCsv;
use crate::inputs::fingerprints;
use crate::layout::{FINAL_GROUND, at, remove_earlier_run};
use crate::mcap_writer::{FLUSH_STEPS, McapWriter};
use crate::snapshot::Snapshot;
use crate::space::{Reserve, explain};
use crate::summary::{Status, Summary};
use crate::summary_observer::SummaryObserver;
use crate::tap::Tap;
use crate::{selection, viewer_layout};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use terraglue_diagnostics::error::{Error, Result};
use terraglue_engine::observer::{Event, Observer, View};
use terraglue_scenario::{Connection, RecordingSpec, ReportSpec, Scenario, Source};
use terraglue_terrain::write_esri_ascii;

mod resume;
pub use resume::RecorderState;

/// Files that are written beside the recording.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RecorderOptions {
    /// Also write `variables.csv`.
    pub csv: bool,
    /// Checkpoints are asked for: [`Recorder::state`].
    pub checkpoints: bool,
}

/// Records a run into a folder.
///
/// Variables, poses, energies and gluing are written at the start, every `recording.every_steps` steps and at
/// the end (advised: 5, which at h = 1 ms gives 200 Hz, twice what the legs of a walker can excite, and costs
/// a fifth; the extremes of the steps in between are kept in `/gluing`); events when they happen; changed
/// ground every `recording.ground_every_steps` steps.
pub struct Recorder {
    folder: PathBuf,
    options: RecorderOptions,
    every_steps: u64,
    ground_every_steps: u64,
    mcap: McapWriter,
    csv: Option<VariablesCsv>,
    snapshot: Snapshot,
    summary: SummaryObserver,
    recorded_step: Option<u64>,
    reserve: Reserve,
    spec: RecordingSpec,
    report: ReportSpec,
    connections: Vec<Connection>,
    source: Source,
}

/// Description of the scenario for reports; the header of the recording.
fn about(scenario: &Scenario) -> BTreeMap<String, String> {
    let list = scenario.subsystems.iter().map(|s| format!("{}={}", s.name, s.module)).collect::<Vec<_>>();
    let mut about = BTreeMap::from([
        ("scenario", scenario.name.clone()),
        ("scenario_text", scenario.source.text.clone()),
        ("strategy", scenario.gluing.strategy.name().to_owned()),
        ("form", scenario.gluing.form.name().to_owned()),
        ("step_s", scenario.time.step_s.to_string()),
        ("duration_s", scenario.time.duration_s.to_string()),
        ("gravity_m_s2", format!("{:?}", scenario.world.gravity_m_s2)),
        ("seed", scenario.world.seed.to_string()),
        ("inputs", fingerprints(scenario)),
        ("subsystems", list.join("\n")),
    ]);
    for (key, value) in [("report_body", &scenario.report.body), ("report_joint", &scenario.report.joint)] {
        if let Some(value) = value {
            about.insert(key, value.clone());
        }
    }
    about.into_iter().map(|(k, v)| (k.to_owned(), v)).collect()
}

impl Recorder {
    /// Makes the folder where it is missing, removes the files of an earlier run and opens the recording.
    ///
    /// # Errors
    /// [`Error::File`]: a file cannot be created, or belongs to a run that still goes on.
    pub fn create(folder: &Path, scenario: &Scenario, options: RecorderOptions) -> Result<Self> {
        std::fs::create_dir_all(folder).map_err(at(folder))?;
        remove_earlier_run(folder)?;
        let reserve = Reserve::take(folder);
        let mut mcap = McapWriter::create(folder, about(scenario), scenario)?;
        if options.checkpoints {
            mcap.keep_pending();
        }
        Ok(Self::with(folder, scenario, options, mcap, reserve))
    }

    fn with(
        folder: &Path,
        scenario: &Scenario,
        options: RecorderOptions,
        mcap: McapWriter,
        reserve: Reserve,
    ) -> Self {
        Self {
            folder: folder.to_owned(),
            options,
            every_steps: scenario.recording.every_steps.max(1),
            ground_every_steps: scenario.recording.ground_every_steps.max(1),
            mcap,
            csv: None,
            snapshot: Snapshot::default(),
            summary: SummaryObserver::new(scenario),
            recorded_step: None,
            reserve,
            spec: scenario.recording.clone(),
            report: scenario.report.clone(),
            connections: scenario.connections.clone(),
            source: scenario.source.clone(),
        }
    }

    fn record(&mut self, view: &View) -> Result {
        self.snapshot.read(view)?;
        self.mcap.record(view, &self.snapshot)?;
        if let Some(csv) = &mut self.csv {
            csv.row(view.t_s, &self.snapshot)?;
        }
        self.recorded_step = Some(view.step_index);
        Ok(())
    }

    fn record_end(&mut self, view: &View) -> Result {
        if self.recorded_step != Some(view.step_index) {
            self.record(view)?;
        }
        self.mcap.changed_ground(view)?;
        self.mcap.whole_ground(view)?;
        self.write_final_ground(view)
    }

    fn write_final_ground(&self, view: &View) -> Result {
        let Some(ground) = self.mcap.ground() else { return Ok(()) };
        let soil = &view.subsystems[ground.subsystem];
        let path = self.folder.join(FINAL_GROUND);
        let written = write_esri_ascii(&path, &ground.info, |a, b| ground.height_tile(soil, a, b));
        // a part of it would pass for the ground
        written.inspect_err(|_| drop(std::fs::remove_file(&path)))
    }

    /// Closes all files and writes `summary.json`. `wall_s` and `cpu_s` are the times of the step loop, s.
    ///
    /// # Errors
    /// [`Error::File`] or [`Error::Full`]: a file cannot be written to its end.
    pub fn finish(
        &mut self,
        wall_s: f64,
        cpu_s: f64,
        error: Option<&Error>,
        status: Status,
    ) -> Result<Summary> {
        let closed = self.close();
        self.reserve.release();
        let (error, status) = match (&error, &closed) {
            (None, Err(e)) => (Some(e), Status::Failed),
            _ => (error, status),
        };
        let summary = self.summary.summary(wall_s, cpu_s, error, status);
        summary.write(&self.folder)?;
        Ok(summary)
    }

    fn close(&mut self) -> Result {
        let closed = self.mcap.close();
        let flushed = self.csv.as_mut().map_or(Ok(()), VariablesCsv::flush);
        closed.and(flushed).map_err(|e| self.explained(e))
    }

    /// Says of a full disk up to when the run is kept.
    fn explained(&self, error: Error) -> Error {
        explain(error, self.mcap.kept_s())
    }

    /// Gives all topics, and every message from the open chunk on, to `tap`, too.
    pub fn set_tap(&mut self, tap: Box<dyn Tap>) {
        self.mcap.set_tap(tap);
    }

    /// The figures so far.
    pub fn summary(&self) -> &SummaryObserver {
        &self.summary
    }
}

/// The variables of a view as the scenario wants them recorded.
fn selected(
    view: &View,
    (spec, source): (&RecordingSpec, &Source),
    connections: &[Connection],
) -> Result<Snapshot> {
    let mut snapshot = Snapshot::new(view);
    selection::select(&mut snapshot, spec, source)?;
    selection::hold(&mut snapshot, connections);
    Ok(snapshot)
}

impl Recorder {
    /// Whether what the scenario wants recorded is there; `check` asks without recording anything.
    ///
    /// # Errors
    /// A pattern of `[recording]` that names no variable.
    pub fn check(view: &View, scenario: &Scenario) -> Result {
        selected(view, (&scenario.recording, &scenario.source), &scenario.connections).map(drop)
    }

    fn start(&mut self, view: &View) -> Result {
        self.snapshot = selected(view, (&self.spec, &self.source), &self.connections)?;
        if self.options.csv {
            self.csv = Some(VariablesCsv::create(&self.folder, &self.snapshot)?);
        }
        self.summary.started(view)?;
        self.mcap.started(view, &self.snapshot)?;
        viewer_layout::write(&self.folder, view, self.mcap.ground_points(), &self.report)?;
        self.record(view)?;
        self.mcap.streams(view)?;
        self.mcap.flush(view.t_s)
    }

    fn step(&mut self, view: &View) -> Result {
        self.mcap.count(view.gluing);
        self.summary.stepped(view)?;
        self.mcap.streams(view)?;
        if view.step_index.is_multiple_of(self.every_steps) {
            self.record(view)?;
        }
        if view.step_index.is_multiple_of(self.ground_every_steps) {
            self.mcap.changed_ground(view)?;
        }
        if view.step_index.is_multiple_of(FLUSH_STEPS) {
            self.mcap.flush(view.t_s)?;
        }
        Ok(())
    }
}

impl Observer for Recorder {
    fn started(&mut self, view: &View) -> Result {
        self.start(view).map_err(|e| self.explained(e))
    }

    fn stepped(&mut self, view: &View) -> Result {
        self.step(view).map_err(|e| self.explained(e))
    }

    fn event(&mut self, event: &Event) -> Result {
        self.summary.event(event)?;
        self.mcap.event(event).map_err(|e| self.explained(e))
    }

    fn finished(&mut self, view: &View, error: Option<&Error>) -> Result {
        // After a failure the last state may be unreadable; the recording is closed all the same.
        let end = self.record_end(view);
        let closed = self.close();
        if error.is_some() { Ok(()) } else { end.map_err(|e| self.explained(e)).and(closed) }
    }
}
