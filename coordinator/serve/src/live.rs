//! A run that goes on while clients look at it and change it: commands between steps, pace, changes, and going back.

use crate::catalog;
use crate::changes::{Change, Changes, Kind};
use crate::clock::Clock;
use crate::command::{Command, Request, SERVICES};
use crate::feed::Feed;
use crate::hub::{Hub, Out};
use crate::pick;
use crate::shared_recorder::SharedRecorder;
use crate::snapshots::Snapshots;
use crate::topics::{ACTIONS, RUN, VARIABLES};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};
use terraglue_diagnostics::{Error, Result};
use terraglue_engine::observer::Observer;
use terraglue_engine::testbed::Testbed;
use terraglue_host::exit_guard::ExitHook;
use terraglue_recording::{
    RECORDING, Recorder, RecorderOptions, Status, at, nanoseconds, report, write_exchange,
};
use terraglue_scenario::Scenario;
use terraglue_subsystem::{Capabilities, Effect};

/// Period at which the state of a run is sent.
pub const STATE_EVERY: Duration = Duration::from_millis(200);
/// Period at which values of variables are sent.
const VALUES_EVERY: Duration = Duration::from_millis(100);
/// How long a run that stands still waits for a command before it looks whether it is to end.
pub const ANSWER_WITHIN: Duration = Duration::from_millis(50);
/// Simulated time between states to go back to, s.
const SNAPSHOT_EVERY_S: f64 = 1.0;

/// A run to be made.
pub struct Mission<'a> {
    /// The scenario with its edits.
    pub scenario: &'a Scenario,
    /// Where it is recorded; what goes on from a time in the past is recorded beside it.
    pub folder: PathBuf,
    /// Makes the testbed.
    pub build: &'a dyn Fn() -> Result<Testbed>,
    /// Times real time; none: as fast as it goes.
    pub pace: Option<f64>,
    /// Whether it begins at once.
    pub plays: bool,
    /// Whether the program goes on when the run is over, for looking back.
    pub stays: bool,
    /// Memory for states to go back to, bytes.
    pub budget: usize,
    /// Reports the error when a module or FMU ends the program.
    pub tell: fn(&Error),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Playing,
    Paused,
    Ended,
    Failed,
}

impl State {
    fn name(self) -> &'static str {
        match self {
            Self::Playing => "playing",
            Self::Paused => "paused",
            Self::Ended => "ended",
            Self::Failed => "failed",
        }
    }
}

/// How a run has ended.
pub struct Ended {
    /// The error that stopped it.
    pub error: Option<Error>,
    /// Whether it reached its end.
    pub is_done: bool,
    /// Folders of all recordings, the last one at the end.
    pub folders: Vec<PathBuf>,
}

/// A run.
pub struct Live<'a> {
    mission: Mission<'a>,
    hub: Arc<Hub>,
    testbed: Testbed,
    /// Until the run is over.
    recorder: Option<(SharedRecorder, ExitHook)>,
    folders: Vec<PathBuf>,
    state: State,
    /// Steps until a pause.
    steps_left: Option<u64>,
    clock: Clock,
    changes: Changes,
    /// Values that take effect when the run starts again, by full name.
    pending: BTreeMap<String, Value>,
    snapshots: Snapshots,
    /// Subsystems that cannot go back.
    stuck: Vec<String>,
    error: Option<Error>,
    sent: [Option<Instant>; 2],
    values: Vec<(String, Value)>,
    started: Instant,
}

impl<'a> Live<'a> {
    /// A run at its start.
    ///
    /// # Errors
    /// The testbed cannot be built or begin, the recording not be written.
    pub fn new(hub: Arc<Hub>, mission: Mission<'a>) -> Result<Self> {
        let testbed = (mission.build)()?;
        let folder = mission.folder.clone();
        let clock = Clock::new(mission.pace, 0.0);
        let snapshots = Snapshots::new(SNAPSHOT_EVERY_S, mission.budget);
        let mut live = Self {
            state: if mission.plays { State::Playing } else { State::Paused },
            mission,
            hub,
            stuck: stuck(&testbed),
            testbed,
            recorder: None,
            folders: Vec::new(),
            steps_left: None,
            clock,
            changes: Changes::default(),
            pending: BTreeMap::new(),
            snapshots,
            error: None,
            sent: [None; 2],
            values: Vec::new(),
            started: Instant::now(),
        };
        live.begin(folder)?;
        live.announce();
        Ok(live)
    }

    /// Records the testbed from its start into a folder.
    fn begin(&mut self, folder: PathBuf) -> Result {
        let options = RecorderOptions { csv: false, checkpoints: true };
        let mut recorder = Recorder::create(&folder, self.mission.scenario, options)?;
        self.hub.open(&folder, true)?;
        recorder.set_tap(Box::new(Feed::new(Arc::clone(&self.hub))));
        self.testbed.begin()?;
        self.testbed.view(|view| recorder.started(view))?;
        write_exchange(&folder, &self.testbed.explain())?;
        self.hold(recorder, folder);
        self.keep()
    }

    /// Records with this from now on; the recording is closed, too, where a module ends the program.
    fn hold(&mut self, recorder: Recorder, folder: PathBuf) {
        let shared = SharedRecorder::new(recorder);
        let hook = shared.exit_hook(self.mission.scenario, &folder, self.mission.tell);
        self.recorder = Some((shared, hook));
        self.folders.push(folder);
    }

    fn announce(&self) {
        self.hub.publish(VARIABLES, 0, &catalog::variables(&self.testbed));
        let actions = catalog::actions(&self.testbed);
        let names =
            actions.as_array().into_iter().flatten().filter_map(|a| a["id"].as_str().map(str::to_owned));
        self.hub.offer(SERVICES.iter().map(|name| (*name).to_owned()).chain(names).collect());
        self.hub.publish(ACTIONS, 0, &actions);
        self.tell_changed(0.0);
        self.hub.publish_channels();
    }

    /// Runs until `cancel`, or until the end where the mission does not stay.
    pub fn run(mut self, todo: &Receiver<Request>, cancel: &AtomicBool) -> Ended {
        while !cancel.load(Ordering::Relaxed) {
            self.say(false);
            let over = matches!(self.state, State::Ended | State::Failed);
            if over && !self.mission.stays {
                break;
            }
            let wait = match self.state {
                State::Playing => self.clock.wait(self.testbed.t_s()).map(|left| left.min(ANSWER_WITHIN)),
                _ => Some(ANSWER_WITHIN),
            };
            let request = match wait {
                Some(wait) => todo.recv_timeout(wait).ok(),
                None => todo.try_recv().ok(),
            };
            match request {
                Some(request) => self.answer(request),
                None if wait.is_none() => self.step(),
                None => {}
            }
        }
        let is_done = self.state == State::Ended;
        self.finish(Status::Stopped);
        Ended { error: self.error, is_done, folders: self.folders }
    }

    fn answer(&mut self, request: Request) {
        let quiet = matches!(request.command, Command::Get(_) | Command::CastRay(..));
        let answer = self.done(request.command.clone());
        request.answer(answer);
        if !quiet {
            self.say(true);
        }
    }

    fn done(&mut self, command: Command) -> std::result::Result<Value, String> {
        match command {
            Command::Play | Command::Step(_) if matches!(self.state, State::Ended | State::Failed) => {
                return Err("the run is over; `reset` starts it again, and dragging the time line back shows its past".into());
            }
            Command::Play => self.play(None),
            Command::Step(steps) => self.play(Some(steps)),
            Command::Pause if self.state == State::Playing => self.state = State::Paused,
            Command::Pause => {}
            Command::Pace(factor) => self.clock.set(factor, self.testbed.t_s()),
            Command::Reset => self.reset().map_err(|e| self.fail(e))?,
            Command::Rewind(t_s) => self.rewind(t_s)?,
            Command::Seek(_) => {
                return Err("a live run is looked back at by the time line; `run.rewind` goes back".into());
            }
            Command::Undo(name) => return self.undo(&name),
            Command::Changes => {
                let scenario = self.changes.scenario(self.mission.scenario)?;
                return Ok(json!({ "scenario": scenario }));
            }
            Command::Set(name, value) => return self.set(&name, value),
            Command::Get(names) => return Ok(self.get(&names)),
            Command::Act(name, arguments) => self.act(&name, arguments)?,
            Command::CastRay(origin, direction) => return pick::cast(&self.testbed, origin, direction),
            Command::Push { body, force, moment } => {
                for (part, vector) in [("force", force), ("moment", moment)] {
                    for (axis, value) in ["x", "y", "z"].iter().zip(vector) {
                        self.set(&format!("{body}.{part}_{axis}"), json!(value))?;
                    }
                }
            }
        }
        Ok(json!({ "t_s": self.testbed.t_s() }))
    }

    fn play(&mut self, steps: Option<u64>) {
        self.state = State::Playing;
        self.steps_left = steps;
        self.clock.set(self.clock.factor(), self.testbed.t_s());
    }

    fn get(&self, names: &[String]) -> Value {
        let of = |name: &String| Some((name.clone(), catalog::value(&self.testbed, name)?));
        match names {
            [] => catalog::values(&self.testbed),
            some => some.iter().filter_map(of).collect(),
        }
    }

    fn is_over(&self) -> std::result::Result<(), String> {
        match self.recorder {
            Some(_) => Ok(()),
            None => Err("the run is over: a change would have no effect".into()),
        }
    }

    /// Where a variable can be written before the first step only and that is over: keeps the value for the next start. Gives the value
    /// that the variable has until then.
    fn later(&mut self, name: &str, value: &Value) -> Option<std::result::Result<Value, String>> {
        let instances = self.testbed.instances();
        let of = self.testbed.signals().directory.find(name)?;
        if self.testbed.step_index() == 0 || of.describe(instances).effect != Effect::NeedsReset {
            return None;
        }
        if let Some(reason) = of.objection(instances, value) {
            return Some(Err(format!("cannot set `{name}` = {value}: {reason}")));
        }
        let is = catalog::value(&self.testbed, name).unwrap_or_default();
        self.pending.insert(name.to_owned(), typed(&is, value.clone()));
        self.tell_changed(self.testbed.t_s());
        Some(Ok(is))
    }

    /// Writes a variable: takes effect at this communication point.
    fn set(&mut self, name: &str, value: Value) -> std::result::Result<Value, String> {
        if let Some(answer) = self.later(name, &value) {
            return answer;
        }
        self.is_over()?;
        let was = catalog::value(&self.testbed, name).unwrap_or_default();
        if was == value {
            return Ok(value);
        }
        let value = typed(&was, value);
        self.testbed.set(name, &value).map_err(reason)?;
        let is = catalog::value(&self.testbed, name).unwrap_or_else(|| value.clone());
        self.note(Kind::Set { name: name.to_owned(), value, was });
        Ok(is)
    }

    fn act(&mut self, name: &str, arguments: String) -> std::result::Result<(), String> {
        self.is_over()?;
        self.testbed.act(name, &arguments).map_err(reason)?;
        self.note(Kind::Act { name: name.to_owned(), arguments });
        Ok(())
    }

    fn note(&mut self, kind: Kind) {
        let (step, t_s) = (self.testbed.step_index(), self.testbed.t_s());
        self.changes.push(Change { step, t_s, kind });
        self.tell_changed(t_s);
    }

    /// Tells what was changed, and what waits for the next start.
    fn tell_changed(&self, t_s: f64) {
        let mut list = self.changes.list();
        if let Value::Array(list) = &mut list {
            list.extend(self.pending.iter().map(|(id, value)| {
                let was = catalog::value(&self.testbed, id);
                json!({ "id": id, "value": value, "was": was, "t_s": t_s, "pending": true })
            }));
        }
        self.hub.publish_changed(nanoseconds(t_s), &list);
    }

    fn undo(&mut self, name: &str) -> std::result::Result<Value, String> {
        if self.pending.remove(name).is_some() {
            self.tell_changed(self.testbed.t_s());
            return Ok(catalog::value(&self.testbed, name).unwrap_or_default());
        }
        let was = self.changes.original(name).ok_or_else(|| format!("`{name}` was not changed"))?;
        self.set(name, was)
    }

    /// One step, recorded.
    fn step(&mut self) {
        let stepped = self.stepped();
        if let Err(error) = stepped {
            self.fail(error);
            return;
        }
        if let Some(left) = &mut self.steps_left {
            *left -= 1;
            if *left == 0 {
                self.steps_left = None;
                self.state = State::Paused;
            }
        }
        if self.testbed.t_s() >= self.mission.scenario.time.duration_s * (1.0 - 1e-10) {
            self.state = State::Ended;
            self.finish(Status::Done);
        }
    }

    fn stepped(&mut self) -> Result {
        let Some((recorder, _)) = &mut self.recorder else { return Ok(()) };
        let t_s = self.testbed.t_s();
        self.testbed.run_until(t_s + 0.5 * self.mission.scenario.time.step_s, &mut [recorder])?;
        if self.snapshots.is_due(self.testbed.t_s()) {
            self.keep()?;
        }
        Ok(())
    }

    fn keep(&mut self) -> Result {
        match &mut self.recorder {
            Some((recorder, _)) if self.stuck.is_empty() => {
                self.snapshots.keep(&self.testbed, &mut recorder.lock())
            }
            _ => Ok(()),
        }
    }

    /// The run has failed; the recording up to here is closed.
    fn fail(&mut self, error: Error) -> String {
        let reason = error.to_string();
        log::error!("{reason}");
        self.state = State::Failed;
        self.error = Some(error);
        self.finish(Status::Failed);
        self.say(true);
        reason
    }

    /// Closes the recording and writes its report.
    fn finish(&mut self, status: Status) {
        let Some((shared, hook)) = self.recorder.take() else { return };
        drop(hook);
        let mut recorder = shared.lock();
        let error = self.error.as_ref();
        let finished = self.testbed.view(|view| recorder.finished(view, error));
        let wall_s = self.started.elapsed().as_secs_f64();
        let closed = recorder.finish(wall_s, wall_s, error, status).map(drop);
        let folder = self.folders.last().cloned().unwrap_or_default();
        let written = report::write(&folder).map(drop);
        if let Some(error) = [finished, closed, written].into_iter().find_map(Result::err) {
            log::error!("{}: {error}", folder.display());
            self.error.get_or_insert(error);
        }
    }

    /// The folder of the next recording: that of the run, and a number.
    fn next_folder(&self) -> Result<PathBuf> {
        let name = self.mission.folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let free = |number: &usize| !self.mission.folder.with_file_name(format!("{name}-{number}")).exists();
        let number = (self.folders.len() + 1..).find(free).unwrap_or_default();
        let folder = self.mission.folder.with_file_name(format!("{name}-{number}"));
        std::fs::create_dir_all(&folder).map_err(at(&folder))?;
        Ok(folder)
    }

    /// From the start again, as it was; what needs a reset takes effect.
    fn reset(&mut self) -> Result {
        self.finish(Status::Stopped);
        let testbed = (self.mission.build)()?;
        self.testbed = testbed;
        self.error = None;
        self.changes.forget_from(0);
        self.snapshots = Snapshots::new(SNAPSHOT_EVERY_S, self.mission.budget);
        let folder = self.next_folder()?;
        self.begin(folder)?;
        for (name, value) in std::mem::take(&mut self.pending) {
            let refused = |message| Error::Simulation { time_s: 0.0, message };
            self.set(&name, value).map_err(refused)?;
        }
        self.restarted(State::Paused);
        Ok(())
    }

    /// Makes clients read all data again.
    fn restarted(&mut self, state: State) {
        self.state = state;
        self.steps_left = None;
        self.started = Instant::now();
        self.clock.set(self.clock.factor(), self.testbed.t_s());
        self.values.clear();
        self.announce();
        self.hub.send(Out::Again);
    }

    /// Goes on from a time in the past, into a recording of its own: that of a run that took this way from its start.
    fn rewind(&mut self, t_s: f64) -> std::result::Result<(), String> {
        if !self.stuck.is_empty() {
            return Err(format!(
                "{} cannot go back in time: the past can be looked at only",
                self.stuck.join(", ")
            ));
        }
        let step_s = self.mission.scenario.time.step_s;
        let target = (t_s.max(0.0) / step_s).round() as u64;
        if target > self.testbed.step_index() {
            return Err(format!("t = {t_s} s is not past yet"));
        }
        let Some((from, moment)) = self.snapshots.before(target) else {
            return Err(format!("there is no state at or before t = {t_s} s"));
        };
        self.finish(Status::Stopped);
        let back = self.back_to(moment).and_then(|()| self.again(from, target));
        back.map_err(|e| self.fail(e))?;
        self.snapshots.forget_after(target);
        self.changes.forget_from(target);
        self.restarted(State::Paused);
        Ok(())
    }

    /// Testbed and recorder as they were, into a folder of their own.
    fn back_to(&mut self, moment: crate::snapshots::Moment) -> Result {
        let before = self.folders.last().cloned().unwrap_or_default();
        let folder = self.next_folder()?;
        let (from, to) = (before.join(RECORDING), folder.join(RECORDING));
        std::fs::copy(&from, &to).map_err(at(&from))?;
        self.testbed.deserialize(&moment.testbed.0)?;
        let options = RecorderOptions { csv: false, checkpoints: true };
        let scenario = self.mission.scenario;
        let mut recorder =
            self.testbed.view(|view| Recorder::resume(&folder, scenario, options, view, moment.recorder))?;
        write_exchange(&folder, &self.testbed.explain())?;
        self.hub.open(&folder, true)?;
        recorder.set_tap(Box::new(Feed::new(Arc::clone(&self.hub))));
        self.hold(recorder, folder);
        self.error = None;
        self.remember()
    }

    /// The last messages before now, for whoever subscribes.
    fn remember(&self) -> Result {
        let channels = self.hub.channels(|_| true);
        let now = nanoseconds(self.testbed.t_s());
        let found = self.hub.with_file(|file| file.last(&channels, now))?;
        for message in found.unwrap_or_default() {
            let message = Arc::new(message);
            if self.hub.latest(message.channel).is_none_or(|known| known.sequence < message.sequence) {
                self.hub.remember(&message);
            }
        }
        Ok(())
    }

    /// Steps from a state to the moment that was asked for, with all that was changed in between.
    fn again(&mut self, from: u64, target: u64) -> Result {
        let mut told = Instant::now();
        for step in from..target {
            // clients take a server that is silent for long for gone
            if told.elapsed() >= STATE_EVERY {
                told = Instant::now();
                self.hub.send(Out::Time(nanoseconds(self.testbed.t_s())));
            }
            for change in self.changes.at(step) {
                match &change.kind {
                    Kind::Set { name, value, .. } => self.testbed.set(name, value)?,
                    Kind::Act { name, arguments } => self.testbed.act(name, arguments)?,
                }
            }
            self.stepped()?;
        }
        Ok(())
    }

    /// Tells state and values, now and then.
    fn say(&mut self, at_once: bool) {
        let is_due = |sent: Option<Instant>, every| sent.is_none_or(|sent: Instant| sent.elapsed() >= every);
        let t_s = self.testbed.t_s();
        if at_once || is_due(self.sent[0], STATE_EVERY) {
            self.sent[0] = Some(Instant::now());
            let state = self.described(t_s);
            self.hub.publish(RUN, nanoseconds(t_s), &state);
            self.hub.send(Out::Time(nanoseconds(t_s)));
        }
        if at_once || is_due(self.sent[1], VALUES_EVERY) {
            self.sent[1] = Some(Instant::now());
            let of = |name: String| {
                let value = catalog::value(&self.testbed, &name)?;
                Some((name, value))
            };
            let values: Vec<_> = self.hub.followed().into_iter().filter_map(of).collect();
            if values != self.values {
                self.values.clone_from(&values);
                self.hub.send(Out::Values(Arc::new(values)));
            }
        }
    }

    fn described(&mut self, t_s: f64) -> Value {
        let rtf = if self.state == State::Playing { self.clock.rtf(t_s) } else { f64::NAN };
        json!({
            "mode": "live", "state": self.state.name(), "scenario": self.mission.scenario.name, "t_s": t_s,
            "duration_s": self.mission.scenario.time.duration_s, "pace": self.clock.factor(), "rtf": rtf,
            "recorded_from_s": 0.0, "recorded_to_s": t_s, "snapshots": self.snapshots.times(),
            "cannot_rewind": self.stuck, "branch": self.folders.len().saturating_sub(1),
            "folder": self.folders.last().map(|folder| shown(folder)),
            "error": self.error.as_ref().map(ToString::to_string),
        })
    }
}

/// Why something was refused; the run goes on, so its time is of no interest.
fn reason(error: Error) -> String {
    match error {
        Error::Simulation { message, .. } => message,
        other => other.to_string(),
    }
}

fn shown(folder: &Path) -> String {
    folder.display().to_string()
}

/// A client of JavaScript writes 0 for 0.0: a number stays of the kind that it was.
fn typed(was: &Value, value: Value) -> Value {
    match (was.is_f64(), value.is_f64(), value.as_f64()) {
        (true, false, Some(number)) => json!(number),
        _ => value,
    }
}

/// Subsystems that cannot give their state as bytes.
fn stuck(testbed: &Testbed) -> Vec<String> {
    let cannot = |i: &&terraglue_host::Instance| !i.capabilities().has(Capabilities::SERIALIZE);
    testbed.instances().iter().filter(cannot).map(|i| i.name().to_owned()).collect()
}
