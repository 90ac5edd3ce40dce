//! `terraglue run`: one scenario from file to report, from its start or from a checkpoint.

use super::arguments::{RunArguments, RunCommand};
use super::folder::{free, results_folder};
use super::interrupt::Interrupt;
use super::output::outln;
use super::pace::Pace;
use super::progress::{self, Progress, Waiting};
use super::testbed::{build, options, set_back};
use super::{Exit, apart, exit_of, points, serve, show, soil_module, strict};
use indicatif::ProgressBar;
use std::path::{Path, PathBuf};
use std::time::Instant;
use terraglue_checkpoint::{Checkpoint, Keeper, Resumed, require_states};
use terraglue_diagnostics::{Error, Result};
use terraglue_engine::observer::Observer;
use terraglue_engine::testbed::{Options, Testbed};
use terraglue_host::ProcessState;
use terraglue_recording::{
    self, Recorder, RecorderOptions, Status, Summary, TimingRow, write_exchange, write_timing,
};
use terraglue_reload::{ReloadOptions, Reloader};
use terraglue_scenario::{InputError, Scenario};
use terraglue_serve::SharedRecorder;

/// Outcome of a run beside its files.
pub struct Outcome {
    /// Figures.
    pub summary: Summary,
    /// The error that stopped it early.
    pub error: Option<Error>,
    /// Wall time per step of the exchange, of Jacobians, and of all else, s.
    pub parts_s: [f64; 3],
    /// Wall time of each subsystem, s.
    pub costs: Vec<(String, f64)>,
    /// Values at the end of the variables that were asked for; those that are no numbers are left out.
    pub asked: Vec<(String, f64)>,
}

impl Outcome {
    /// How the program ends after it.
    pub fn exit(&self) -> Exit {
        match (&self.error, self.summary.status) {
            (Some(error), _) => exit_of(error),
            (None, Status::Stopped) => Exit::Interrupted,
            (None, _) => Exit::Done,
        }
    }
}

/// Runs a scenario as the arguments say.
pub fn run(command: &RunCommand) -> Result<Exit> {
    let arguments = &command.run;
    let interrupt = Interrupt::listen();
    let mut options = options(arguments, &interrupt.flag());
    let checkpoint = command.resume.as_deref().map(|folder| resumable(folder, &mut options)).transpose()?;
    command.points.as_deref().map(points::check).transpose()?;
    let scenario = scenario(command, checkpoint.as_ref(), &options)?;
    if command.serve {
        return serve::run(command, &scenario, &interrupt);
    }
    let loading = Waiting::loading(arguments.quiet);
    let mut testbed = build(&scenario, &options)?;
    drop(loading);
    let mut reloader = reloader(command, &scenario, &options)?;
    if command.explain {
        say(arguments, &testbed.explain().text(&scenario));
    }
    let kept = checkpoint.as_ref().map(Checkpoint::kept);
    let (every_s, csv) =
        (command.checkpoint_every.or(kept.map(|k| k.0)), kept.map_or(arguments.csv, |k| k.1));
    if every_s.is_some() {
        require_states(&testbed)?;
    }
    interrupt.run();
    let folder = match &command.resume {
        Some(folder) => folder.clone(),
        None => results_folder(arguments.out.as_deref(), &scenario.name)?,
    };
    let keeper =
        every_s.map(|every_s| Keeper::new(&folder, &scenario, &options, (every_s, csv))).transpose()?;
    let resumed = checkpoint.map(|checkpoint| checkpoint.restore(&mut testbed)).transpose()?;
    let bar = progress::bar(scenario.time.steps(), arguments.quiet);
    bar.inc(testbed.step_index());
    let waiting = Waiting::standing(arguments.quiet, &bar, options.standing.clone(), "");
    let mut progress = Progress::new(bar.clone(), scenario.time.duration_s, "").after(waiting);
    let mut paced;
    let mut observer: &mut dyn Observer = &mut progress;
    if command.realtime {
        paced = Pace::new(observer, interrupt.flag());
        observer = &mut paced;
    }
    let records = Records { scenario: &scenario, folder: &folder, csv, keeper, resumed, asked: &[] };
    let outcome = run_testbed(testbed, reloader.as_mut(), records, observer)?;
    drop(progress);
    bar.finish_and_clear();
    let report = match command.no_report {
        true => Ok(None),
        false => terraglue_recording::report::write(&folder).map(Some),
    };
    if command.explain {
        say(arguments, &show::costs(&outcome.costs, outcome.summary.steps).to_string());
    }
    print(arguments, &outcome, report.as_ref().ok().and_then(Option::as_deref))?;
    command.points.as_deref().map(|path| write_points(arguments, &bar, &folder, path)).transpose()?;
    if every_s.is_some() && outcome.summary.status == Status::Stopped && !arguments.quiet {
        eprintln!("`terraglue run --resume {}` goes on from here", folder.display());
    }
    ended(report, &outcome, &folder)
}

/// Writes what the scanners of a run have seen.
fn write_points(arguments: &RunArguments, bar: &ProgressBar, folder: &Path, path: &Path) -> Result {
    let waiting = Waiting::new(arguments.quiet, bar.clone(), || "points are written".into());
    let count = points::write(folder, path)?;
    drop(waiting);
    say(arguments, &format!("points: {} ({count} points)", path.display()));
    Ok(())
}

/// The scenario of a run, or of the one that goes on.
fn scenario(command: &RunCommand, checkpoint: Option<&Checkpoint>, options: &Options) -> Result<Scenario> {
    if let Some(checkpoint) = checkpoint {
        let scenario = checkpoint.scenario()?;
        checkpoint.check(&scenario, options)?;
        return Ok(scenario);
    }
    let arguments = &command.run;
    let scenario = strict::load(&arguments.scenario, &arguments.sets(), command.strict)?;
    soil_module::check(&scenario, &arguments.scenario)?;
    Ok(scenario)
}

/// How the program ends where the report was made, or not, or not wanted.
fn ended(report: Result<Option<PathBuf>>, outcome: &Outcome, folder: &Path) -> Result<Exit> {
    match (report, &outcome.error) {
        (Err(missing), None) => Err(missing),
        (Err(_), Some(_)) if outcome.summary.steps == 0 => {
            log::warn!("the run failed before its first step: {} holds no recording", folder.display());
            Ok(outcome.exit())
        }
        (Err(missing), Some(_)) => {
            log::warn!("there is no report: {missing}; `terraglue report {}` makes one", folder.display());
            Ok(outcome.exit())
        }
        (Ok(_), _) => Ok(outcome.exit()),
    }
}

/// The checkpoint of a folder in which no run goes on; its modules are searched where they were.
fn resumable(folder: &Path, options: &mut Options) -> Result<Checkpoint> {
    free(folder)?;
    let checkpoint = Checkpoint::read(folder)?;
    options.module_paths.extend(checkpoint.module_paths());
    Ok(checkpoint)
}

/// To standard output, or beside it where that is JSON.
fn say(arguments: &RunArguments, text: &str) {
    if arguments.json {
        eprintln!("{text}");
    } else {
        outln!("{text}");
    }
}

/// The reloader that watches the modules, where that is wanted.
fn reloader(command: &RunCommand, scenario: &Scenario, options: &Options) -> Result<Option<Reloader>> {
    if !command.watch {
        return Ok(None);
    }
    let at = |(name, step): &(String, String)| match step.parse() {
        Ok(step) => Ok((name.clone(), step)),
        Err(_) => Err(InputError::plain(format!("--reload-at {name}={step}: that is no step"), None)),
    };
    let wanted = ReloadOptions {
        program: apart::own_program(),
        reset: command.reload_reset,
        at_steps: command.reload_at.iter().map(at).collect::<std::result::Result<_, _>>()?,
    };
    Reloader::new(scenario, options, wanted).map(Some)
}

/// Targets of the recording of a run, and where it resumes.
pub struct Records<'a> {
    /// The scenario.
    pub scenario: &'a Scenario,
    /// Folder for the results.
    pub folder: &'a Path,
    /// Whether `variables.csv` is written.
    pub csv: bool,
    /// Writer of checkpoints, where they are asked for.
    pub keeper: Option<Keeper>,
    /// State of a run that is resumed; the testbed is there already.
    pub resumed: Option<Resumed>,
    /// Variables whose values at the end are asked for.
    pub asked: &'a [String],
}

/// The first row of a record: outputs of FMUs are those at the end of their initialisation.
fn record_start(testbed: &mut Testbed, recorder: &mut SharedRecorder) -> Result<()> {
    testbed.end_initialization()?;
    testbed.view(|view| recorder.started(view))
}

/// Steps a testbed to the end of its scenario and records it.
pub fn run_testbed(
    testbed: Testbed,
    reloader: Option<&mut Reloader>,
    records: Records,
    progress: &mut dyn Observer,
) -> Result<Outcome> {
    let Records { scenario, folder, csv, mut keeper, resumed, asked } = records;
    let goes_on = resumed.is_some();
    let mut clock = RunClock::default();
    let recorder = match resumed {
        None => Recorder::create(folder, scenario, RecorderOptions { csv, checkpoints: keeper.is_some() })?,
        Some(mut resumed) => {
            clock.before = std::mem::take(&mut resumed.timing);
            resumed.recorder(folder, scenario, &testbed)?
        }
    };
    let mut recorder = SharedRecorder::new(recorder);
    let exit_hook = recorder.exit_hook(scenario, folder, show::error);
    // an error below drops the testbed, and with it what modules do at their end, before the exit hook
    let mut testbed = testbed;
    let process_state = ProcessState::now();
    let begun = testbed.begin();
    let begun = match goes_on {
        true => begun,
        false => begun.and_then(|()| record_start(&mut testbed, &mut recorder)),
    };
    let begun = begun.and_then(|()| write_exchange(folder, &testbed.explain()));
    clock.start();
    let until_s = scenario.time.duration_s;
    let ran = match (begun, reloader) {
        (Err(error), _) => Err(error),
        (_, None) => {
            let keeping = (keeper.as_mut(), &clock);
            step_and_keep(&mut testbed, until_s, (&mut recorder, progress), keeping)
        }
        (_, Some(reloader)) => reloader.run_until(&mut testbed, until_s, &mut [&mut recorder, progress]),
    };
    let timing = clock.rows(&testbed);
    let (wall_s, cpu_s) = whole(&timing);
    let error = ran.err();
    set_back(&process_state);
    let finished = testbed.view(|view| recorder.finished(view, error.as_ref()));
    let timed = write_timing(folder, &timing);
    let error = error.or(finished.err()).or(timed.err());
    let parts_s = parts_s(&testbed, wall_s);
    let costs = testbed.costs().map(|(name, s)| (name.to_owned(), s)).collect();
    let value = |name: &String| Some((name.clone(), testbed.read(name)?));
    let asked = asked.iter().filter_map(value).collect();
    let cancelled = testbed.cancelled();
    let closed = testbed.close();
    set_back(&process_state);
    let error = error.or(closed.err());
    drop(exit_hook);
    let status = status(error.as_ref(), cancelled);
    let summary = recorder.lock().finish(wall_s, cpu_s, error.as_ref(), status)?;
    if summary.status == Status::Done {
        keeper.iter().for_each(Keeper::remove);
    }
    Ok(Outcome { summary, error, parts_s, costs, asked })
}

/// How a run has ended.
fn status(error: Option<&Error>, cancelled: bool) -> Status {
    match error {
        Some(_) => Status::Failed,
        None if cancelled => Status::Stopped,
        None => Status::Done,
    }
}

/// Wall time per step of the exchange with the subsystems, of Jacobians, and of all else, recording included, s.
fn parts_s(testbed: &Testbed, wall_s: f64) -> [f64; 3] {
    let steps = testbed.step_index().max(1) as f64;
    let timings = testbed.timings();
    let sum = |names: &[&str]| timings.rows().filter(|r| names.contains(&r.0)).map(|r| r.1).sum::<f64>();
    let exchange =
        sum(&["set_ports", "estimate_forces", "grounds", "bodies", "commit_bodies", "commit_grounds"]);
    let jacobian = sum(&["jacobian"]);
    [exchange, jacobian, (wall_s - exchange - jacobian).max(0.0)].map(|s| s / steps)
}

/// Steps up to a time; where checkpoints are wanted, with one at each of their times and one where a run is stopped.
fn step_and_keep(
    testbed: &mut Testbed,
    until_s: f64,
    (recorder, progress): (&mut SharedRecorder, &mut dyn Observer),
    (keeper, clock): (Option<&mut Keeper>, &RunClock),
) -> Result {
    let Some(keeper) = keeper else { return testbed.run_until(until_s, &mut [recorder, progress]) };
    loop {
        let pause_s = keeper.next_s(testbed.t_s()).min(until_s);
        testbed.run_until(pause_s, &mut [recorder, progress])?;
        // nothing is left to go on with; a run has at most 1e9 steps
        if testbed.t_s() >= until_s * (1.0 - 1e-10) {
            return Ok(());
        }
        keeper.keep(testbed, &mut recorder.lock(), clock.rows(testbed))?;
        if testbed.cancelled() {
            return Ok(());
        }
    }
}

/// Section of the whole loop in `timing.csv`.
const LOOP: &str = "step loop with recording";

/// Times the step loop of a run, with what earlier processes have spent on it.
#[derive(Default)]
struct RunClock {
    started: Option<(Instant, f64)>,
    before: Vec<TimingRow>,
}

impl RunClock {
    fn start(&mut self) {
        self.started = Some((Instant::now(), cpu_s()));
    }

    /// The parts of a step, and all of them together.
    fn rows(&self, testbed: &Testbed) -> Vec<TimingRow> {
        let steps = testbed.step_index();
        let timings = testbed.timings();
        let (wall_s, cpu_s) =
            self.started.map_or((0.0, 0.0), |(wall, cpu)| (wall.elapsed().as_secs_f64(), cpu_s() - cpu));
        let parts = timings.rows().map(|(section, wall_s)| (section, wall_s, None));
        let all = parts.chain([(LOOP, wall_s, Some(cpu_s))]);
        let all = all.map(|(section, wall_s, cpu_s)| (section.to_owned(), wall_s, cpu_s));
        let own = testbed.costs().map(|(name, wall_s)| (format!("subsystem {name}"), wall_s, None));
        let row = |(section, wall_s, cpu_s): (String, f64, Option<f64>)| {
            let before = self.before.iter().find(|row| row.section == section);
            let [more, more_cpu] = before.map_or([0.0; 2], |row| [row.wall_s, row.cpu_s.unwrap_or_default()]);
            TimingRow { section, wall_s: wall_s + more, cpu_s: cpu_s.map(|own| own + more_cpu), steps }
        };
        all.chain(own).map(row).collect()
    }
}

/// Wall and CPU time of the whole loop, s.
fn whole(timing: &[TimingRow]) -> (f64, f64) {
    let row = timing.iter().find(|row| row.section == LOOP);
    row.map_or((0.0, 0.0), |row| (row.wall_s, row.cpu_s.unwrap_or_default()))
}

fn print(arguments: &RunArguments, outcome: &Outcome, report: Option<&Path>) -> Result {
    if arguments.json {
        let text = serde_json::to_string_pretty(&outcome.summary)
            .map_err(|e| Error::File { path: "standard output".into(), source: e.into() })?;
        outln!("{text}");
    } else if !arguments.quiet {
        outln!("{}", show::summary(&outcome.summary));
        report.iter().for_each(|report| outln!("report: {}", report.display()));
    }
    if let Some(error) = &outcome.error {
        show::error(error);
    }
    Ok(())
}

/// CPU time of all threads of this process, s: that of the recording counts, too.
pub fn cpu_s() -> f64 {
    let t = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    t.tv_sec as f64 + 1e-9 * t.tv_nsec as f64
}
