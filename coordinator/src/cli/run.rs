//! `terraglue run`: one scenario from file to report.

use super::arguments::{RunArguments, RunCommand};
use super::folder::results_folder;
use super::interrupt::Interrupt;
use super::output::outln;
use super::pace::Pace;
use super::progress::{self, Progress};
use super::recorder::SharedRecorder;
use super::{Exit, exit_of, show, soil_module, strict};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;
use terraglue::host::Surroundings;
use terraglue::observer::Observer;
use terraglue::recording::{
    self, Recorder, RecorderOptions, Status, Summary, TimingRow, write_exchange, write_timing,
};
use terraglue::reload::{ReloadOptions, Reloader};
use terraglue::scenario::{InputError, Scenario};
use terraglue::testbed::{Options, Testbed};
use terraglue::{Error, Result};

/// What a run leaves behind beside its files.
pub struct Outcome {
    /// Figures.
    pub summary: Summary,
    /// What stopped it early.
    pub error: Option<Error>,
    /// Wall time per step of the exchange, of Jacobians, and of all else, s.
    pub parts_s: [f64; 3],
    /// What each subsystem cost, s.
    pub costs: Vec<(String, f64)>,
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
    let scenario = strict::load(&arguments.scenario, &arguments.sets(), command.strict)?;
    soil_module::check(&scenario, &arguments.scenario)?;
    let options = options(arguments, &interrupt.flag());
    let testbed = build(&scenario, &options)?;
    let mut reloader = reloader(command, &scenario, &options)?;
    if command.explain {
        say(arguments, &testbed.explain().text(&scenario));
    }
    interrupt.run();
    let folder = results_folder(arguments.out.as_deref(), &scenario.name)?;
    let steps = (scenario.time.duration_s / scenario.time.step_s).round() as u64;
    let bar = progress::bar(steps, arguments.quiet);
    let mut progress = Progress::new(bar.clone(), scenario.time.duration_s, "");
    let mut paced;
    let mut observer: &mut dyn Observer = &mut progress;
    if command.realtime {
        paced = Pace::new(observer, interrupt.flag());
        observer = &mut paced;
    }
    let outcome = run_testbed(testbed, reloader.as_mut(), &scenario, &folder, arguments.csv, observer)?;
    bar.finish_and_clear();
    let report = recording::report::write(&folder);
    if command.explain {
        say(arguments, &show::costs(&outcome.costs, outcome.summary.steps).to_string());
    }
    print(arguments, &outcome, report.as_deref().ok())?;
    match (report, &outcome.error) {
        (Err(missing), None) => Err(missing),
        (Err(missing), Some(_)) => {
            log::warn!("there is no report: {missing}; `terraglue report {}` makes one", folder.display());
            Ok(outcome.exit())
        }
        (Ok(_), _) => Ok(outcome.exit()),
    }
}

/// To standard output, or beside it where that is JSON.
fn say(arguments: &RunArguments, text: &str) {
    if arguments.json {
        eprintln!("{text}");
    } else {
        outln!("{text}");
    }
}

/// What watches the modules, where that is wanted.
fn reloader(command: &RunCommand, scenario: &Scenario, options: &Options) -> Result<Option<Reloader>> {
    if !command.watch {
        return Ok(None);
    }
    let own = std::env::current_exe().ok().filter(|program| program.is_file());
    let at = |(name, step): &(String, String)| match step.parse() {
        Ok(step) => Ok((name.clone(), step)),
        Err(_) => Err(InputError::plain(format!("--reload-at {name}={step}: that is no step"), None)),
    };
    let wanted = ReloadOptions {
        program: own.unwrap_or_else(|| "/proc/self/exe".into()),
        reset: command.reload_reset,
        at_steps: command.reload_at.iter().map(at).collect::<std::result::Result<_, _>>()?,
    };
    Reloader::new(scenario, options, wanted).map(Some)
}

/// Options of the testbed.
pub fn options(arguments: &RunArguments, cancel: &Arc<AtomicBool>) -> Options {
    Options {
        threads: arguments.threads,
        module_paths: arguments.scenario.module_path.clone(),
        cancel: Arc::clone(cancel),
    }
}

/// Builds a testbed. Whatever stops it, a module that refuses its files among them, is wrong input.
pub fn build(scenario: &Scenario, options: &Options) -> Result<Testbed> {
    let surroundings = Surroundings::now();
    let built = Testbed::build(scenario, options).map_err(|error| match error {
        Error::Input(_) | Error::Module { function: "instantiate", .. } => error,
        other => Error::Input(InputError::plain(other.to_string(), None)),
    });
    set_back(&surroundings);
    built
}

/// Tells what had to be set back.
fn set_back(surroundings: &Surroundings) {
    let changed = surroundings.restore();
    if !changed.is_empty() {
        let changed = changed.join(", ");
        log::warn!(
            "a module or unit changed what all share, {changed}: it is set back; `isolate = true` keeps such a one apart"
        );
    }
}

/// Steps a testbed to the end of its scenario and records it into `folder`.
pub fn run_testbed(
    testbed: Testbed,
    reloader: Option<&mut Reloader>,
    scenario: &Scenario,
    folder: &Path,
    csv: bool,
    progress: &mut dyn Observer,
) -> Result<Outcome> {
    let mut recorder = SharedRecorder::new(Recorder::create(folder, scenario, RecorderOptions { csv })?);
    let will = recorder.will(scenario, folder);
    // an error below drops the testbed, and with it what modules do at their end, before the will
    let mut testbed = testbed;
    let surroundings = Surroundings::now();
    let begun = testbed.begin();
    let begun = begun.and_then(|()| testbed.view(|view| recorder.started(view)));
    let begun = begun.and_then(|()| write_exchange(folder, &testbed.explain()));
    let (wall, cpu) = (Instant::now(), cpu_s());
    let until_s = scenario.time.duration_s;
    let ran = match (begun, reloader) {
        (Err(error), _) => Err(error),
        (_, None) => testbed.run_until(until_s, &mut [&mut recorder, progress]),
        (_, Some(reloader)) => reloader.run_until(&mut testbed, until_s, &mut [&mut recorder, progress]),
    };
    let (wall_s, cpu_s) = (wall.elapsed().as_secs_f64(), cpu_s() - cpu);
    let error = ran.err();
    set_back(&surroundings);
    let finished = testbed.view(|view| recorder.finished(view, error.as_ref()));
    let timed = write_timing(folder, &timing_rows(&testbed, wall_s, cpu_s));
    let error = error.or(finished.err()).or(timed.err());
    let parts_s = parts_s(&testbed, wall_s);
    let costs = testbed.costs().map(|(name, s)| (name.to_owned(), s)).collect();
    let cancelled = testbed.cancelled();
    let closed = testbed.close();
    set_back(&surroundings);
    let error = error.or(closed.err());
    let status = match &error {
        Some(_) => Status::Failed,
        None if cancelled => Status::Stopped,
        None => Status::Done,
    };
    drop(will);
    let summary = recorder.lock().finish(wall_s, cpu_s, error.as_ref(), status)?;
    Ok(Outcome { summary, error, parts_s, costs })
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

/// The parts of a step, and all of them together.
fn timing_rows(testbed: &Testbed, wall_s: f64, cpu_s: f64) -> Vec<TimingRow> {
    let steps = testbed.step_index();
    let timings = testbed.timings();
    let parts = timings.rows().map(|(section, wall_s)| (section, wall_s, None));
    let all = parts.chain([("step loop with recording", wall_s, Some(cpu_s))]);
    let all = all.map(|(section, wall_s, cpu_s)| (section.to_owned(), wall_s, cpu_s));
    let own = testbed.costs().map(|(name, wall_s)| (format!("subsystem {name}"), wall_s, None));
    all.chain(own).map(|(section, wall_s, cpu_s)| TimingRow { section, wall_s, cpu_s, steps }).collect()
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

/// CPU time of this thread, s; 0 where the system does not tell.
pub fn cpu_s() -> f64 {
    let t = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    t.tv_sec as f64 + 1e-9 * t.tv_nsec as f64
}
