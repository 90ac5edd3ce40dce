//! The module: when samples are taken, and when they are shown.

use crate::errors::Errors;
use crate::kind::{MOST, OUTPUT, SensorKind};
use crate::measure::{self, Before, Truth};
use crate::settings::{self, Settings};
use std::sync::Arc;
use terraglue_subsystem::{
    Capabilities, Config, Error, Figure, Host, Input, Module, Motion, Overlay, Pose, Response, Result,
    Schema, Slots, Step, Subsystem, ValueType, Values, ValuesMut, Variable, World, bytes, persist,
};

/// Form of the serialized state.
const VERSION: u32 = 2;
/// Part of a period by which rounding may bring a sample forward.
const EARLY: f64 = 1e-6;

/// One of the sensors.
pub struct Sensor {
    settings: Settings,
    errors: Errors,
    gravity: [f64; 3],
    variables: Vec<Variable>,
    state: State,
    slots: Slots<State>,
}

/// A sample on its way.
#[derive(Clone, Debug, PartialEq)]
struct Sample {
    /// When it is shown, s.
    due: f64,
    values: [f64; MOST],
    switch: bool,
}
persist!(Sample { due, values, switch });

/// State from step to step.
#[derive(Clone, Debug, PartialEq)]
struct State {
    inputs: [f64; MOST],
    /// Number of the next sample.
    next: u64,
    /// The sample before, of an IMU.
    before: Option<Before>,
    /// The switch without delay.
    closed: bool,
    shown: [f64; MOST],
    shown_switch: bool,
    waiting: Vec<Sample>,
}
persist!(State { inputs, next, before, closed, shown, shown_switch, waiting });

impl Module for Sensor {
    fn schema() -> Schema {
        settings::schema()
    }

    fn instantiate(config: &Config, host: Arc<dyn Host>) -> Result<Box<dyn Subsystem>> {
        let settings = Settings::from_config(config)?;
        if settings.kind == SensorKind::Inclinometer && host.gravity() == [0.0; 3] {
            return Err(Error::Refused("an inclinometer shows nothing where there is no gravity".into()));
        }
        let state = State {
            inputs: [0.0; MOST],
            next: 0,
            before: None,
            closed: false,
            shown: [0.0; MOST],
            shown_switch: false,
            waiting: Vec::new(),
        };
        Ok(Box::new(Self {
            errors: Errors::new(host.seed(), settings.models),
            gravity: host.gravity(),
            variables: settings.kind.variables(),
            settings,
            state,
            slots: Slots::new(host.slots()),
        }))
    }
}

impl Sensor {
    /// Number and time of the last sample that is due in a step, if any.
    fn due(&self, step: &Step) -> Option<(u64, f64)> {
        let (rate, end) = (self.settings.rate_hz, step.t + step.h);
        if rate == 0.0 {
            return Some((self.state.next, end));
        }
        let last = (end * rate + EARLY).floor();
        (last >= self.state.next as f64).then(|| (last as u64, (last / rate).min(end)))
    }

    /// Takes a sample with its errors, and shows the output due at the end of the step.
    fn take(&mut self, (number, time): (u64, f64), truth: &Truth) {
        let channels = self.settings.kind.channels().len();
        let mut values = truth.values;
        for (k, value) in values.iter_mut().take(channels).enumerate() {
            *value = self.errors.shown(k, number, *value);
        }
        if self.settings.kind == SensorKind::RangeFinder {
            // a ray that met nothing has no errors, and no error leads out of the range
            let range = self.settings.range_m;
            values[0] = if truth.switch { values[0].clamp(0.0, range) } else { range };
        }
        self.state.next = number + 1;
        self.state.closed = truth.switch;
        let due = time + self.settings.delay_s;
        self.state.waiting.push(Sample { due, values, switch: truth.switch });
    }

    fn show(&mut self, end: f64, h: f64) {
        let due = self.state.waiting.iter().take_while(|s| s.due <= end + EARLY * h).count();
        if let Some(sample) = self.state.waiting.drain(..due).next_back() {
            (self.state.shown, self.state.shown_switch) = (sample.values, sample.switch);
        }
    }

    /// Measurement of a sensor on a body.
    fn look(&mut self, time: f64, world: &dyn World) -> Result<Truth> {
        let Self { settings, state, gravity, .. } = self;
        let Settings { kind, mount, range_m, .. } = settings;
        let mount = mount.as_mut().ok_or(Error::Unsupported)?;
        match kind {
            SensorKind::RangeFinder => measure::range(mount, world, time, *range_m),
            SensorKind::Inclinometer => measure::inclination(mount, world, time, *gravity),
            _ => measure::imu(mount, world, time, *gravity, &mut state.before),
        }
    }
}

impl Subsystem for Sensor {
    fn capabilities(&self) -> Capabilities {
        let blind = Capabilities::RETRY | Capabilities::STATE | Capabilities::SERIALIZE;
        if self.settings.kind.is_mounted() { blind | Capabilities::SEES } else { blind }
    }

    fn advance(&mut self, _: &Step, _: &Input, _: &mut Response) -> Result {
        Ok(())
    }

    fn commit(&mut self, step: &Step, _: &[f64], _: &Motion) -> Result {
        if self.settings.kind.is_mounted() {
            return Ok(());
        }
        if let Some(due) = self.due(step) {
            let (kind, threshold) = (self.settings.kind, self.settings.threshold_n);
            let truth = measure::inputs(kind, self.state.inputs, threshold, self.state.closed);
            self.take(due, &truth);
        }
        self.show(step.t + step.h, step.h);
        Ok(())
    }

    fn observe(&mut self, step: &Step, world: &dyn World) -> Result {
        if let Some(due) = self.due(step) {
            let truth = self.look(due.1, world)?;
            self.take(due, &truth);
        }
        self.show(step.t + step.h, step.h);
        Ok(())
    }

    /// The ray of a range finder, up to its reading, in the frame of its body.
    fn overlays(&self, out: &mut Vec<Overlay>) {
        let Some(mount) = self.settings.mount.as_ref() else { return };
        if self.settings.kind != SensorKind::RangeFinder {
            return;
        }
        let (Pose { position, .. }, reach) = (mount.body_from_sensor(), self.state.shown[0]);
        let along = mount.body_from_sensor().turned([reach, 0.0, 0.0]);
        let points = vec![*position, [0, 1, 2].map(|k| position[k] + along[k])];
        out.push(Overlay {
            layer: "ray".into(),
            frame: Overlay::MOUNT,
            colour: [0.9, 0.1, 0.2, 1.0],
            figure: Figure::Lines { points, width: 0.004 },
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
        Ok(bytes::seal(VERSION, self.settings.kind as u64, &self.state))
    }

    fn deserialize(&mut self, from: &[u8]) -> Result {
        self.state = bytes::open(VERSION, self.settings.kind as u64, from)?;
        Ok(())
    }

    fn variables(&self) -> &[Variable] {
        &self.variables
    }

    fn get(&self, ids: &[u32], out: ValuesMut) -> Result {
        let wanted = match out {
            ValuesMut::Bool(_) => ValueType::Bool,
            _ => ValueType::F64,
        };
        let unknown = |id: &u32| Error::Refused(format!("there is no variable number {id} of this type"));
        let known = |id: &u32| self.variables.iter().any(|v| v.id == *id && v.value_type == wanted);
        if let Some(id) = ids.iter().find(|id| !known(id)) {
            return Err(unknown(id));
        }
        match out {
            ValuesMut::F64(out) => {
                for (id, out) in ids.iter().zip(out) {
                    let (list, k) = if *id < OUTPUT {
                        (&self.state.inputs, *id)
                    } else {
                        (&self.state.shown, *id - OUTPUT)
                    };
                    *out = *list.get(k as usize).ok_or_else(|| unknown(id))?;
                }
                Ok(())
            }
            ValuesMut::Bool(out) => {
                out.fill(self.state.shown_switch);
                Ok(())
            }
            _ => Err(Error::Refused("numbers are f64, switches bool".into())),
        }
    }

    fn set(&mut self, ids: &[u32], values: Values) -> Result {
        let Values::F64(values) = values else { return Err(Error::Refused("inputs are f64".into())) };
        let inputs = if self.settings.kind.is_mounted() { 0 } else { self.settings.kind.channels().len() };
        if let Some(id) = ids.iter().find(|id| **id as usize >= inputs) {
            return Err(Error::Refused(format!("variable number {id} cannot be set")));
        }
        if values.len() != ids.len() || values.iter().any(|v| v.is_nan()) {
            return Err(Error::Refused("one number for each input".into()));
        }
        ids.iter().zip(values).for_each(|(id, value)| self.state.inputs[*id as usize] = *value);
        Ok(())
    }
}
