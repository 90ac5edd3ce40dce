//! The subsystem: takes messages and odometry, and answers with a pose, how far it may be wrong, and whether to believe it.

use crate::cloud::Cloud;
use crate::look::{Attitude, Looker, Sighting};
use crate::settings::{Settings, schema};
use crate::shown::{Shown, ellipse};
use crate::variables as id;
use std::sync::Arc;
use terraglue_subsystem::bytes::{self, Block};
use terraglue_subsystem::{
    Capabilities, Config, Error, Host, Input, LogLevel, Message, Module, Overlay, Response, Result, Schema,
    Slots, Step, StreamInfo, Subsystem, ValueTable, Values, ValuesMut, Variable, World, persist,
};
use terraglue_tree_localisation::{
    Fix, Located, MapTree, Matcher, Pose2, Reason, TrackState, Tracker, TreeMap, merged, wrapped,
};

/// Form of the serialized state.
const VERSION: u32 = 2;
/// Most bytes of a message of the stream `match`.
const MOST_BYTES: u32 = 1 << 20;

/// Where a machine is among trees.
pub struct TreeLocator {
    settings: Settings,
    host: Arc<dyn Host>,
    table: ValueTable,
    variables: Vec<Variable>,
    streams: Vec<StreamInfo>,
    looker: Looker,
    matcher: Option<Arc<Matcher>>,
    state: State,
    message: Option<(f64, Vec<u8>)>,
    slots: Slots<Saved>,
}

/// Content of a slot: the state, the values of the table, and the map.
type Saved = (State, Vec<f64>, Option<Arc<Matcher>>);

/// State from step to step, apart from the map.
#[derive(Clone, Debug, PartialEq)]
struct State {
    /// Messages as they were set, the map first, and which of them are new.
    messages: Vec<Block>,
    fresh: Vec<bool>,
    track: TrackState,
    /// Odometry up to which the tracker has moved; none: before the first step.
    odometry: Option<Pose2>,
    /// Matches of the last scan, and when the stream reported them last, s.
    shown: Shown,
    told_at: Option<f64>,
}
persist!(State { messages, fresh, track, odometry, shown, told_at });

impl Module for TreeLocator {
    fn schema() -> Schema {
        schema()
    }

    fn instantiate(config: &Config, host: Arc<dyn Host>) -> Result<Box<dyn Subsystem>> {
        Ok(Box::new(Self::new(config, host)?))
    }
}

impl TreeLocator {
    /// With these parameters.
    ///
    /// # Errors
    /// [`Error::Refused`]: parameters that make none, or a map that is none. [`Error::Failed`]: a map that cannot be read.
    pub fn new(config: &Config, host: Arc<dyn Host>) -> Result<Self> {
        let settings = Settings::from_config(config, host.as_ref())?;
        let mut table = ValueTable::new(id::numbers());
        table.show(id::MASK, f64::from(settings.mask));
        table.show(id::STATUS, id::LOST);
        let mut variables = table.variables().to_vec();
        variables.extend(id::messages(settings.scanners));
        let stream = StreamInfo {
            name: "match".into(),
            schema: "terraglue.TreeMatch".into(),
            encoding: "json".into(),
            rate_hz: settings.shown_hz,
            most_bytes: MOST_BYTES,
            help: "Local map on the global one, with the ellipse of one deviation".into(),
        };
        let inputs = settings.scanners as usize + 1;
        let matcher = settings.map.clone().map(|map| Arc::new(Matcher::with(map, settings.model)));
        Ok(Self {
            table,
            variables,
            streams: vec![stream],
            looker: Looker::default(),
            matcher,
            state: State {
                messages: vec![Block::default(); inputs],
                fresh: vec![false; inputs],
                track: TrackState::default(),
                odometry: None,
                shown: Shown::default(),
                told_at: None,
            },
            message: None,
            slots: Slots::new(host.slots()),
            settings,
            host,
        })
    }

    /// Pose of the odometry.
    fn odometry(&self) -> Pose2 {
        let [x, y, yaw] = [id::ODOMETRY_X, id::ODOMETRY_Y, id::ODOMETRY_YAW].map(|k| self.table.value(k));
        Pose2 { x, y, yaw: wrapped(yaw) }
    }

    /// Takes a map that has come, and starts to search in it.
    fn take_map(&mut self) {
        if !std::mem::take(&mut self.state.fresh[0]) {
            return;
        }
        let text = String::from_utf8_lossy(&self.state.messages[0].0).into_owned();
        match TreeMap::from_table(&text) {
            Ok(map) => {
                self.matcher = Some(Arc::new(Matcher::with(map, self.settings.model)));
                self.state.track = TrackState::default();
            }
            Err(why) => self.refuse("map", &why.to_string()),
        }
    }

    fn refuse(&mut self, input: &str, why: &str) {
        self.host.log(LogLevel::Warning, &format!("input `{input}`: {why}; this message is left out"));
        self.table.show(id::REFUSED, self.table.value(id::REFUSED) + 1.0);
    }

    /// Trees of all scans that have come, in the frame of the machine turned level; none: no scan has come.
    fn look(&mut self, world: &dyn World) -> Result<Option<Sighting>> {
        let mut sighting = None;
        for k in 1..self.state.fresh.len() {
            if !std::mem::take(&mut self.state.fresh[k]) {
                continue;
            }
            let values = |ids: [u32; 2]| ids.map(|k| self.table.value(k));
            let attitude = Attitude::new(values([id::SPEED, id::TURN_RATE]), values([id::ROLL, id::PITCH]));
            let mask = self.table.value(id::MASK) as usize;
            match Cloud::read(&self.state.messages[k].0) {
                Ok(cloud) => {
                    let out = sighting.get_or_insert_with(Sighting::default);
                    self.looker.see(&mut self.settings, (k, &cloud), &attitude, mask, world, out)?;
                    self.table.show(id::SCANS, self.table.value(id::SCANS) + 1.0);
                }
                Err(why) => self.refuse(&format!("points_{k}"), &why.to_string()),
            }
        }
        Ok(sighting)
    }

    /// Updates the pose with the trees of a scan.
    fn locate(&mut self, matcher: Arc<Matcher>, sighting: &Sighting, time: f64) {
        let mut tracker = Tracker::new(matcher, self.settings.rules).with_state(self.state.track.clone());
        let now = self.odometry();
        tracker.moved(&self.state.odometry.unwrap_or(now).inverse().then(&now));
        self.state.odometry = Some(now);
        let [x, y, deviation] = [id::GNSS_X, id::GNSS_Y, id::GNSS_DEVIATION].map(|k| self.table.value(k));
        if deviation > 0.0 {
            tracker.gnss([x, y], deviation)
        } else {
            tracker.no_gnss()
        }
        let trees = merged(&sighting.maps);
        let fix = tracker.sighted(&trees);
        self.table.show(id::STEMS, trees.len() as f64);
        self.table.show(id::OWN_STEMS, sighting.own_stems as f64);
        self.table.show(id::HIDDEN, sighting.hidden);
        self.tell(&fix, tracker.estimate().is_some());
        let local = tracker.local_map();
        self.table.show(id::TREES, local.len() as f64);
        let matches = match &fix {
            Fix::Located(found) | Fix::Elsewhere(found) => found.matches.clone(),
            _ => Vec::new(),
        };
        let guess = if let Fix::Ambiguous(_, pose) = &fix { Some(*pose) } else { None };
        let pose = tracker.estimate().map(|e| e.pose).or(guess);
        let axes = tracker.estimate().map_or([0.0; 3], |e| ellipse(&e.covariance));
        self.state.shown =
            Shown { time, pose, local, matches, ellipse: axes, height: self.state.shown.height };
        self.state.track = tracker.state().clone();
    }

    /// Shows how sure a fix is.
    fn tell(&mut self, fix: &Fix, is_known: bool) {
        let (score, runner_up, false_matches, matched) = match fix {
            Fix::Located(found) | Fix::Elsewhere(found) => {
                let Located { found, runner_up, false_matches } = &**found;
                (found.score, *runner_up, *false_matches, found.matched)
            }
            Fix::Ambiguous(reason, _) | Fix::Lost(reason) => match reason {
                Reason::Chance { score, false_matches } => (*score, 0.0, *false_matches, 0),
                Reason::RunnerUp { score, runner_up } => (*score, *runner_up, 0.0, 0),
                Reason::OutsidePrior { score } => (*score, 0.0, 0.0, 0),
                _ => (0.0, 0.0, 0.0, 0),
            },
        };
        self.table.show(id::SCORE, score);
        self.table.show(id::RUNNER_UP, runner_up);
        self.table.show(id::FALSE_MATCHES, false_matches);
        self.table.show(id::MATCHED, matched as f64);
        let status = match fix {
            _ if is_known => id::LOCATED,
            Fix::Ambiguous(..) | Fix::Elsewhere(_) => id::AMBIGUOUS,
            _ => id::LOST,
        };
        self.table.show(id::STATUS, status);
    }

    /// Shows the pose at the end of a step: the last one, moved on by odometry.
    fn show(&mut self) {
        let Some(estimate) = self.state.track.estimate() else {
            self.table.show(id::IS_KNOWN, 0.0);
            self.table.show(id::BOUND, 0.0);
            return;
        };
        let now = self.odometry();
        let since = self.state.odometry.unwrap_or(now).inverse().then(&now);
        let pose = estimate.pose.then(&since);
        let way = libm::sqrt(since.x * since.x + since.y * since.y);
        let [long, short, angle] = ellipse(&estimate.covariance);
        let shown = [
            (id::X, pose.x),
            (id::Y, pose.y),
            (id::YAW, pose.yaw),
            (id::IS_KNOWN, 1.0),
            (id::BOUND, estimate.bound + self.settings.rules.drift * way),
            (id::LONG_AXIS, long),
            (id::SHORT_AXIS, short),
            (id::AXIS_ANGLE, angle),
        ];
        shown.iter().for_each(|(id, value)| self.table.show(*id, *value));
    }

    /// The error of the pose, where the truth is known.
    fn judge(&mut self, world: &dyn World, is_scan: bool) -> Result {
        let true_pose = self.settings.mount.state(world, world.time())?.world_from_body;
        self.state.shown.height = true_pose.position[2];
        if !self.settings.knows_truth || self.table.value(id::IS_KNOWN) < 0.5 {
            self.table.show(id::ERROR, 0.0);
            return Ok(());
        }
        let [x, y] = [id::X, id::Y].map(|k| self.table.value(k));
        let [dx, dy] = [x - true_pose.position[0], y - true_pose.position[1]];
        let error = libm::sqrt(dx * dx + dy * dy);
        self.table.show(id::ERROR, error);
        if is_scan && error > self.table.value(id::BOUND) {
            self.table.show(id::BEYOND, self.table.value(id::BEYOND) + 1.0);
        }
        Ok(())
    }

    /// The message of the stream `match`, if one is due.
    fn send(&mut self, time: f64) {
        let period = 1.0 / self.settings.shown_hz;
        if self.state.told_at.is_some_and(|t| time < t + period - 1e-9) {
            return;
        }
        let status = match self.table.value(id::STATUS) {
            id::LOCATED => "located",
            id::AMBIGUOUS => "ambiguous",
            _ => "lost",
        };
        let map = self.matcher.as_ref().map(|m| m.map());
        self.message = Some((time, self.state.shown.message(map, status, self.table.value(id::BOUND))));
        self.state.told_at = Some(time);
    }

    /// Everything that a state holds, with the map.
    fn whole(&self) -> Whole {
        let tree = |t: &MapTree| (t.place, t.diameter);
        let map = self.matcher.as_ref().map(|m| m.map().trees().iter().map(tree).collect());
        (self.state.clone(), self.table.values().to_vec(), map)
    }
}

/// State, values, and places and diameters of the map.
type Whole = (State, Vec<f64>, Option<Vec<([f64; 2], Option<f64>)>>);

impl Subsystem for TreeLocator {
    fn capabilities(&self) -> Capabilities {
        Capabilities::RETRY | Capabilities::STATE | Capabilities::SERIALIZE | Capabilities::SEES
    }

    fn advance(&mut self, _: &Step, _: &Input, _: &mut Response) -> Result {
        Ok(())
    }

    fn observe(&mut self, step: &Step, world: &dyn World) -> Result {
        self.message = None;
        self.settings.mount.find(world)?;
        self.take_map();
        let time = step.t + step.h;
        let sighting = self.look(world)?;
        if let (Some(sighting), Some(matcher)) = (&sighting, self.matcher.clone()) {
            self.locate(matcher, sighting, time);
        }
        self.show();
        self.judge(world, sighting.is_some())?;
        if sighting.is_some() {
            self.send(time);
        }
        Ok(())
    }

    fn streams(&self) -> &[StreamInfo] {
        &self.streams
    }

    fn stream(&self, k: usize) -> Result<Option<Message<'_>>> {
        if k > 0 {
            return Err(Error::Refused(format!("there is no stream number {k}")));
        }
        Ok(self.message.as_ref().map(|(time, bytes)| Message { time: *time, bytes }))
    }

    fn overlays(&self, out: &mut Vec<Overlay>) {
        if let Some(matcher) = &self.matcher {
            self.state.shown.overlays(matcher.map(), out);
        }
    }

    fn save_state(&mut self, slot: u32) -> Result {
        let now = (self.state.clone(), self.table.values().to_vec(), self.matcher.clone());
        self.slots.save(slot, now)
    }

    fn restore_state(&mut self, slot: u32) -> Result {
        let (state, values, matcher) = self.slots.saved(slot)?;
        self.table.restore(&values)?;
        (self.state, self.matcher) = (state, matcher);
        Ok(())
    }

    fn serialize(&self) -> Result<Vec<u8>> {
        Ok(bytes::seal(VERSION, u64::from(self.settings.scanners), &self.whole()))
    }

    fn deserialize(&mut self, from: &[u8]) -> Result {
        let (state, values, map): Whole = bytes::open(VERSION, u64::from(self.settings.scanners), from)?;
        let inputs = self.settings.scanners as usize + 1;
        if state.messages.len() != inputs || state.fresh.len() != inputs {
            return Err(bytes::wrong("it has another number of scanners"));
        }
        let tree = |(place, diameter): ([f64; 2], Option<f64>)| MapTree { place, diameter };
        let map = map.map(|trees| TreeMap::new(trees.into_iter().map(tree).collect()));
        let map = map.transpose().map_err(|e| bytes::wrong(&e.to_string()))?;
        self.table.restore(&values)?;
        self.state = state;
        self.matcher = map.map(|map| Arc::new(Matcher::with(map, self.settings.model)));
        Ok(())
    }

    fn variables(&self) -> &[Variable] {
        &self.variables
    }

    fn get(&self, ids: &[u32], out: ValuesMut) -> Result {
        let ValuesMut::Binary(out) = out else { return self.table.get(ids, out) };
        for (id, out) in ids.iter().zip(out) {
            out.clone_from(&self.state.messages[self.place(*id)?].0);
        }
        Ok(())
    }

    fn set(&mut self, ids: &[u32], values: Values) -> Result {
        let Values::Binary(values) = values else { return self.table.set(ids, values) };
        let places = ids.iter().map(|id| self.place(*id)).collect::<Result<Vec<_>>>()?;
        if places.len() != values.len() {
            return Err(Error::Refused("one message for each input".into()));
        }
        for (place, value) in places.into_iter().zip(values) {
            self.state.messages[place].0.clone_from(value);
            self.state.fresh[place] = true;
        }
        Ok(())
    }
}

impl TreeLocator {
    /// Place of an input of messages.
    fn place(&self, id: u32) -> Result<usize> {
        let place = id.checked_sub(id::MAP).map(|k| k as usize).filter(|k| *k < self.state.fresh.len());
        place.ok_or_else(|| Error::Refused(format!("there is no input of messages number {id}")))
    }
}
