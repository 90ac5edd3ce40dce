//! A recording through the same socket: played, stopped, and shown at any time.

use crate::clock::Clock;
use crate::command::{Command, REPLAY_SERVICES, Request};
use crate::hub::{Hub, Out};
use crate::live::{ANSWER_WITHIN, STATE_EVERY};
use crate::topics::{ACTIONS, RUN, VARIABLES};
use crate::{catalog, past};
use serde_json::{Value, json};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};
use terraglue_diagnostics::Result;
use terraglue_recording::{Stored, nanoseconds};
use terraglue_scenario::PageSpec;

/// Messages are sent for so much wall time at once.
const BEAT: Duration = Duration::from_millis(20);

/// A recording that is shown.
pub struct Replay {
    hub: Arc<Hub>,
    name: String,
    /// `[page]` of its scenario.
    page: Option<Value>,
    /// First and last time, s.
    times: [f64; 2],
    t_s: f64,
    playing: bool,
    clock: Clock,
    sent: Option<Instant>,
    values: Vec<(String, Value)>,
}

impl Replay {
    /// Of a results folder.
    ///
    /// # Errors
    /// There is no recording, or it cannot be read.
    pub fn open(hub: Arc<Hub>, folder: &Path) -> Result<Self> {
        hub.open(folder, false)?;
        let opened = hub.with_file(|file| {
            let topics: Vec<_> = file.topics().cloned().collect();
            let said = |key| file.header().get(key).cloned();
            Ok((topics, (said("scenario"), said("scenario_text")), file.times_ns()))
        })?;
        let (topics, (name, text), times) = opened.unwrap_or_default();
        let variables = catalog::recorded(&topics);
        topics.into_iter().for_each(|topic| hub.announce(topic));
        hub.publish(VARIABLES, 0, &variables);
        hub.publish(ACTIONS, 0, &json!([]));
        hub.publish_changed(0, &json!([]));
        hub.offer(REPLAY_SERVICES.iter().map(|name| (*name).to_owned()).collect());
        let times = times.unwrap_or_default().map(|ns| ns as f64 / 1e9);
        let name = name.unwrap_or_else(|| folder.display().to_string());
        let page = text.and_then(|text| PageSpec::of_text(&text));
        let clock = Clock::new(Some(1.0), times[0]);
        let mut replay = Self {
            hub,
            name,
            page,
            times,
            t_s: times[0],
            playing: false,
            clock,
            sent: None,
            values: Vec::new(),
        };
        replay.show(times[0])?;
        Ok(replay)
    }

    /// Name of the run.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// How its scenario wants the page to look at first.
    pub fn page(&self) -> Option<Value> {
        self.page.clone()
    }

    /// Shows it until `cancel`.
    ///
    /// # Errors
    /// The recording cannot be read.
    pub fn run(&mut self, todo: &Receiver<Request>, cancel: &AtomicBool) -> Result {
        while !cancel.load(Ordering::Relaxed) {
            let wait = if self.playing { BEAT } else { ANSWER_WITHIN };
            if let Ok(request) = todo.recv_timeout(wait) {
                let answer = self.done(&request.command);
                request.answer(answer);
                self.say(true);
            }
            if self.playing {
                self.play()?;
            }
            self.say(false);
        }
        Ok(())
    }

    fn done(&mut self, command: &Command) -> std::result::Result<Value, String> {
        let failed = |e: terraglue_diagnostics::Error| e.to_string();
        match command {
            Command::Play => {
                if self.t_s >= self.times[1] {
                    self.show(self.times[0]).map_err(failed)?;
                }
                self.playing = true;
                self.clock.set(self.clock.factor(), self.t_s);
            }
            Command::Pause => self.playing = false,
            Command::Pace(factor) => self.clock.set(*factor, self.t_s),
            Command::Step(steps) => {
                self.playing = false;
                self.show(self.t_s + 0.005 * *steps as f64).map_err(failed)?;
            }
            Command::Seek(t_s) => self.show(*t_s).map_err(failed)?,
            Command::Get(names) => {
                let values = past::values(&self.hub, names, self.t_s).map_err(failed)?;
                return Ok(Value::Object(values.into_iter().collect()));
            }
            Command::Set(..) => return Err("a recording cannot be changed".into()),
            _ => return Err("a recording does not offer this".into()),
        }
        Ok(json!({ "t_s": self.t_s }))
    }

    /// Goes on to the time of the clock, and sends all messages in between.
    fn play(&mut self) -> Result {
        let mut to = self.t_s;
        // in pieces, so that a pace that cannot be held is not waited for
        while to < self.times[1] && self.clock.wait(to).is_none() {
            to += self.clock.factor().map_or(0.1, |factor| factor * BEAT.as_secs_f64());
            if self.clock.factor().is_none() {
                break;
            }
        }
        let to = to.min(self.times[1]);
        let channels = self.hub.channels(|_| true);
        let span = [nanoseconds(self.t_s) + 1, nanoseconds(to)];
        let mut between: Vec<Arc<Stored>> = Vec::new();
        self.hub.with_file(|file| file.each(&channels, span, |m| between.push(Arc::new(m.clone()))))?;
        for message in between {
            self.hub.remember(&message);
            self.hub.send(Out::Message(message));
        }
        self.t_s = to;
        self.hub.send(Out::Time(nanoseconds(to)));
        self.playing = to < self.times[1];
        Ok(())
    }

    /// Shows one moment.
    fn show(&mut self, t_s: f64) -> Result {
        self.t_s = t_s.clamp(self.times[0], self.times[1]);
        self.clock.set(self.clock.factor(), self.t_s);
        let channels = self.hub.channels(|_| true);
        let time_ns = nanoseconds(self.t_s);
        let found = self.hub.with_file(|file| file.last(&channels, time_ns))?.unwrap_or_default();
        found.into_iter().map(Arc::new).for_each(|message| self.hub.remember(&message));
        self.hub.send_ground();
        self.hub.send(Out::Again);
        self.hub.send(Out::Time(time_ns));
        Ok(())
    }

    /// Tells the state, now and then.
    fn say(&mut self, at_once: bool) {
        if !at_once && self.sent.is_some_and(|sent| sent.elapsed() < STATE_EVERY) {
            return;
        }
        self.sent = Some(Instant::now());
        let state = if self.playing { "playing" } else { "paused" };
        let rtf = if self.playing { self.clock.rtf(self.t_s) } else { f64::NAN };
        let state = json!({
            "mode": "replay", "state": state, "scenario": self.name, "t_s": self.t_s, "duration_s": self.times[1],
            "pace": self.clock.factor(), "rtf": rtf, "recorded_from_s": self.times[0], "recorded_to_s": self.times[1],
            "branch": 0,
        });
        let time_ns = nanoseconds(self.t_s);
        self.hub.publish(RUN, time_ns, &state);
        let names = self.hub.followed();
        let values = past::values(&self.hub, &names, self.t_s).unwrap_or_default();
        if values != self.values {
            self.values.clone_from(&values);
            self.hub.send(Out::Values(Arc::new(values)));
        }
    }
}
