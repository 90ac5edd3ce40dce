//! The module: which rays are due in a step, and the turns that they make.

use crate::beam::{Echo, Light};
use crate::cloud::{HEAD, STRIDE, Told, message};
use crate::errors::RayErrors;
use crate::faults::{COUNT, Faults};
use crate::settings::{self, Settings};
use std::sync::Arc;
use terraglue_numerics::rotation::{product, quaternion, turned};
use terraglue_subsystem::{
    BodyRef, Capabilities, Causality, Config, Error, Figure, Host, Input, Message, Module, Overlay, Pose,
    Ray, RayHit, RayMask, Response, Result, Schema, Slots, Step, StreamInfo, Subsystem, ValueType, Values,
    ValuesMut, Variable, World, bytes, persist,
};

/// Form of the serialized state.
const VERSION: u32 = 1;
/// Outputs: points of the last turn, and turns so far.
const POINTS: u32 = COUNT as u32;
const TURNS: u32 = POINTS + 1;
/// Points that an overlay shows at most.
const SHOWN: usize = 4000;
/// Surfaces that light passes through before a ray ends.
const MOST_PASSED: usize = 16;
/// Distance behind a surface at which a ray goes on, m.
const BEHIND: f64 = 1e-6;

/// A laser scanner.
pub struct LaserScanner {
    settings: Settings,
    seed: u64,
    /// Added to all ranges of each beam, m.
    biases: Vec<f64>,
    variables: Vec<Variable>,
    streams: Vec<StreamInfo>,
    frame: String,
    state: State,
    /// The message of the last step, if it ended a turn.
    message: Option<(f64, Vec<u8>)>,
    slots: Slots<State>,
    rays: Vec<Ray>,
    /// What each of the rays is part of.
    light: Vec<Light>,
    hits: Vec<RayHit>,
    echoes: Vec<Echo>,
}

/// State from step to step.
#[derive(Clone, Debug, PartialEq)]
struct State {
    faults: Faults,
    /// Turn and column of the next firing.
    turn: u64,
    column: u32,
    /// Points of the turn so far, and of the last one.
    points: Vec<Told>,
    last: Vec<Told>,
}
persist!(State { faults, turn, column, points, last });

impl Module for LaserScanner {
    fn schema() -> Schema {
        settings::schema()
    }

    fn instantiate(config: &Config, host: Arc<dyn Host>) -> Result<Box<dyn Subsystem>> {
        Ok(Box::new(Self::new(config, host.as_ref())?))
    }
}

impl LaserScanner {
    /// A scanner with these parameters.
    ///
    /// # Errors
    /// [`Error::Refused`]: parameters that make no scanner.
    pub fn new(config: &Config, host: &dyn Host) -> Result<Self> {
        let settings = Settings::from_config(config)?;
        let mut variables = Faults::variables();
        let output =
            |id, name, help| Variable::real(id, name, "", Causality::Output, help).typed(ValueType::U64);
        variables.push(output(POINTS, "returns", "Points of the last turn"));
        variables.push(output(TURNS, "turns", "Turns that are complete"));
        let stream = StreamInfo {
            name: "points".into(),
            schema: "foxglove.PointCloud".into(),
            encoding: "protobuf".into(),
            rate_hz: settings.rate_hz,
            most_bytes: (HEAD + STRIDE * settings.pattern.rays()) as u32,
            help: "Points of a turn in the frame of the scanner".into(),
        };
        let faults = Faults::of(&settings.errors);
        let beams = 0..settings.pattern.elevations.len() as u32;
        Ok(Self {
            seed: host.seed(),
            biases: beams.map(|ring| settings.errors.of_beam(host.seed(), ring)).collect(),
            variables,
            streams: vec![stream],
            frame: format!("{}/{}", settings.mount.subsystem(), settings.mount.body()),
            settings,
            state: State { faults, turn: 0, column: 0, points: Vec::new(), last: Vec::new() },
            message: None,
            slots: Slots::new(host.slots()),
            rays: Vec::new(),
            light: Vec::new(),
            hits: Vec::new(),
            echoes: Vec::new(),
        })
    }

    /// Points of the last turn.
    pub fn last_turn(&self) -> &[Told] {
        &self.state.last
    }

    /// When a firing is due, s.
    fn due(&self, turn: u64, column: u32) -> f64 {
        let Settings { pattern, rate_hz, phase, .. } = &self.settings;
        (turn as f64 + phase + pattern.share(column)) / rate_hz
    }

    /// Fires all beams of a column: every one from the pose at its time.
    fn fire(&mut self, world: &dyn World, time: f64, column: u32) -> Result {
        let state = self.settings.mount.state(world, time)?;
        let faults = self.state.faults;
        let pattern = &self.settings.pattern;
        let Pose { position, orientation } = state.world_from_body;
        let orientation = product(orientation, quaternion(faults.turn()));
        let is_off = faults.is_blind() || faults.is_frozen() || faults.blocks(pattern.azimuth(column));
        let range = if is_off { 0.0 } else { self.settings.errors.limits_m[1] };
        let beams = pattern.elevations.len() as u32;
        for ring in 0..beams {
            let number = self.state.turn * pattern.rays() as u64 + u64::from(column * beams + ring);
            let aside = self.settings.errors.angles(self.seed, number);
            let direction = turned(orientation, pattern.direction_aside(column, ring, aside));
            let beam = self.light.last().map_or(0, |light| light.beam + 1);
            for (direction, share) in self.settings.beam.samples(direction) {
                self.rays.push(Ray { origin: position, direction, time, range });
                self.light.push(Light { beam, time, from: 0.0, share });
            }
        }
        Ok(())
    }

    /// Casts the rays through all that light passes; the echoes lie beam by beam then.
    fn cast(&mut self, skip: BodyRef, world: &dyn World) {
        self.echoes.clear();
        for _ in 0..=MOST_PASSED {
            self.hits.clear();
            self.hits.resize(self.rays.len(), RayHit::MISS);
            world.cast_rays(&self.rays, &RayMask::without(skip), &mut self.hits);
            let mut passing = 0;
            for (k, hit) in self.hits.iter().enumerate().filter(|(_, hit)| hit.is_hit()) {
                let (ray, light) = (self.rays[k], self.light[k]);
                let cosine: f64 = (0..3).map(|k| hit.normal[k] * ray.direction[k]).sum::<f64>().abs();
                let distance = light.from + hit.distance;
                self.echoes.push(Echo {
                    beam: light.beam,
                    time: light.time,
                    distance,
                    cosine,
                    light: light.share * cosine * f64::from(hit.material.reflectance),
                    hit: *hit,
                });
                let left = ray.range - hit.distance - BEHIND;
                if hit.material.transmittance > 0.0 && left > 0.0 {
                    let way = hit.distance + BEHIND;
                    let origin = [0, 1, 2].map(|k| ray.origin[k] + way * ray.direction[k]);
                    let share = light.share * f64::from(hit.material.transmittance);
                    self.rays[passing] = Ray { origin, range: left, ..ray };
                    self.light[passing] = Light { from: light.from + way, share, ..light };
                    passing += 1;
                }
            }
            self.rays.truncate(passing);
            self.light.truncate(passing);
            if passing == 0 {
                break;
            }
        }
        self.echoes.sort_by_key(|echo| echo.beam);
    }

    /// Casts the rays from a column on, and returns the points that are reported.
    fn tell(&mut self, first: (u64, u32), skip: BodyRef, world: &dyn World) -> Vec<Told> {
        self.cast(skip, world);
        let pattern = &self.settings.pattern;
        let beams = pattern.elevations.len();
        let errors = self.state.faults.errors(&self.settings.errors);
        let start = first.0 * pattern.rays() as u64 + u64::from(first.1) * beams as u64;
        let mut told = Vec::new();
        for echoes in self.echoes.chunk_by_mut(|a, b| a.beam == b.beam) {
            let Some(echo) = self.settings.beam.reported(echoes) else { continue };
            let number = start + echo.beam as u64;
            let place = (number % pattern.rays() as u64) as u32;
            let (column, ring) = (place / beams as u32, place % beams as u32);
            let errors = RayErrors { bias_m: errors.bias_m + self.biases[ring as usize], ..errors };
            let Some(range) = errors.range(self.seed, number, echo.distance, echo.cosine) else { continue };
            told.push(Told {
                position: pattern.direction(column, ring).map(|x| range * x),
                time: echo.time,
                intensity: echo.light,
                ring,
                subsystem: echo.hit.subsystem,
                body: echo.hit.body,
                shape: echo.hit.shape,
            });
        }
        told
    }

    /// Ends a turn at a time.
    fn end_turn(&mut self, time: f64) {
        if !self.state.faults.is_frozen() {
            self.state.last = std::mem::take(&mut self.state.points);
        }
        self.state.points.clear();
        let pose = self.settings.mount.body_from_sensor();
        self.message = Some((time, message(&self.state.last, time, &self.frame, pose)));
    }
}

impl Subsystem for LaserScanner {
    fn capabilities(&self) -> Capabilities {
        Capabilities::RETRY | Capabilities::STATE | Capabilities::SERIALIZE | Capabilities::SEES
    }

    fn advance(&mut self, _: &Step, _: &Input, _: &mut Response) -> Result {
        Ok(())
    }

    fn observe(&mut self, step: &Step, world: &dyn World) -> Result {
        self.message = None;
        let (end, columns) = (step.t + step.h, self.settings.pattern.columns);
        let found = self.settings.mount.find(world)?;
        let skip = if self.settings.sees_own_body { BodyRef::NONE } else { found };
        // several turns may end in a step: the message is that of the last one
        loop {
            self.rays.clear();
            self.light.clear();
            let first = (self.state.turn, self.state.column);
            while self.state.column < columns {
                let time = self.due(self.state.turn, self.state.column);
                if time > end {
                    break;
                }
                self.fire(world, time.max(step.t), self.state.column)?;
                self.state.column += 1;
            }
            if !self.rays.is_empty() {
                let told = self.tell(first, skip, world);
                self.state.points.extend(told);
            }
            if self.state.column < columns {
                return Ok(());
            }
            self.end_turn(self.due(self.state.turn, columns - 1));
            (self.state.turn, self.state.column) = (self.state.turn + 1, 0);
        }
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

    /// Points of the last turn in the frame of its body, thinned out.
    fn overlays(&self, out: &mut Vec<Overlay>) {
        let pose = self.settings.mount.body_from_sensor();
        let every = self.state.last.len() / SHOWN + 1;
        let shown = self.state.last.iter().step_by(every);
        let points: Vec<[f64; 3]> = shown.map(|p| pose.point(p.position)).collect();
        if points.is_empty() {
            return;
        }
        out.push(Overlay {
            layer: "points".into(),
            frame: Overlay::MOUNT,
            colour: [0.1, 0.5, 0.9, 1.0],
            figure: Figure::Points { points, size: 0.03 },
        });
    }

    fn save_state(&mut self, slot: u32) -> Result {
        self.slots.save(slot, self.state.clone())
    }

    fn restore_state(&mut self, slot: u32) -> Result {
        self.state = self.slots.saved(slot)?;
        Ok(())
    }

    fn serialize(&self) -> Result<Vec<u8>> {
        Ok(bytes::seal(VERSION, self.settings.pattern.rays() as u64, &self.state))
    }

    fn deserialize(&mut self, from: &[u8]) -> Result {
        self.state = bytes::open(VERSION, self.settings.pattern.rays() as u64, from)?;
        Ok(())
    }

    fn variables(&self) -> &[Variable] {
        &self.variables
    }

    fn get(&self, ids: &[u32], out: ValuesMut) -> Result {
        let unknown = |id: &u32| Error::Refused(format!("there is no variable number {id} of this type"));
        match out {
            ValuesMut::F64(out) => ids.iter().zip(out).try_for_each(|(id, out)| {
                *out = *self.state.faults.values.get(*id as usize).ok_or_else(|| unknown(id))?;
                Ok(())
            }),
            ValuesMut::U64(out) => ids.iter().zip(out).try_for_each(|(id, out)| {
                *out = match *id {
                    POINTS => self.state.last.len() as u64,
                    TURNS => self.state.turn,
                    _ => return Err(unknown(id)),
                };
                Ok(())
            }),
            _ => Err(Error::Refused("properties are f64, counts u64".into())),
        }
    }

    fn set(&mut self, ids: &[u32], values: Values) -> Result {
        let Values::F64(values) = values else { return Err(Error::Refused("properties are f64".into())) };
        if values.len() != ids.len() {
            return Err(Error::Refused("one number for each property".into()));
        }
        for (id, value) in ids.iter().zip(values) {
            if *id as usize >= COUNT {
                return Err(Error::Refused(format!("variable number {id} cannot be set")));
            }
            let [low, high] = Faults::bounds(*id as usize);
            if !(*value >= low && *value <= high) {
                let name = &self.variables[*id as usize].name;
                return Err(Error::Refused(format!("`{name}` = {value} is not from {low} to {high}")));
            }
        }
        ids.iter().zip(values).for_each(|(id, value)| self.state.faults.values[*id as usize] = *value);
        Ok(())
    }
}
