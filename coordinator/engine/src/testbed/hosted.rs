//! A testbed inside another program: its time, its state as bytes, its instances by number.

use super::run_clock::RunClock;
use super::{Snapshot, Testbed};
use serde_json::{Value, json};
use terraglue_diagnostics::{Error, Result};
use terraglue_host::Instance;
use terraglue_subsystem::{Energy, bytes};

impl Testbed {
    /// Length of a nominal step, s.
    pub fn step_s(&self) -> f64 {
        self.clock.step_s
    }

    /// Steps have this length from now on, s. Steps of the scenario's own length stay on its grid of times.
    pub fn set_step_s(&mut self, step_s: f64) {
        self.clock.set_step_s(step_s);
    }

    /// Whether all subsystems make every step, so that its length may change.
    pub fn takes_any_step(&self) -> bool {
        self.subsystems.schedules.iter().all(|turn| turn.step_multiple == 1)
    }

    /// An instance by its number, to set its values.
    pub fn instance_mut(&mut self, slot: usize) -> &mut Instance {
        &mut self.subsystems.instances[slot]
    }

    /// Reads the motion of all bodies again after values were set from outside.
    ///
    /// # Errors
    /// [`Error::Module`]: a module that cannot give the states of its bodies.
    pub fn refresh(&mut self) -> Result {
        self.events.clear();
        self.subsystems.read_states()
    }

    /// The committed state of everything as bytes: a line of JSON, those of every instance, a hash.
    ///
    /// # Errors
    /// [`Error::Module`]: a module that cannot give its state as bytes.
    pub fn serialize(&self) -> Result<Vec<u8>> {
        let parts = self.instances().iter().map(Instance::serialize).collect::<Result<Vec<_>>>()?;
        let kept = self.clock;
        let bits = [kept.step_s, kept.origin_s, kept.t].map(f64::to_bits);
        let head = json!({
            "bits": bits,
            "counts": [kept.nominal, kept.index],
            "started": kept.started,
            "initialised": kept.initialised,
            "before": before_bits(&kept.before),
            "fired": self.signals.time_line.fired(),
            "memory": self.glued.memory(self.signals.remember(), self.streams.remember()),
            "lengths": parts.iter().map(Vec::len).collect::<Vec<_>>(),
        });
        let mut out = head.to_string().into_bytes();
        out.push(b'\n');
        parts.iter().for_each(|part| out.extend(part));
        let sum = bytes::hash(&out);
        out.extend(sum.to_le_bytes());
        Ok(out)
    }

    /// Back to a state made by [`Testbed::serialize`] of the same scenario. After an error everything is as before.
    ///
    /// # Errors
    /// [`Error::Simulation`]: the bytes are no state of this scenario. [`Error::Module`]: a module that does not take its part.
    pub fn deserialize(&mut self, bytes: &[u8]) -> Result {
        let time_s = self.clock.t;
        let wrong = || Error::Simulation { time_s, message: "these bytes are no state of this run".into() };
        let content = unsealed(bytes).ok_or_else(wrong)?;
        let (head, lengths, mut rest) = split(content, self.instances().len()).ok_or_else(wrong)?;
        let (kept, fired, memory) = read_head(&head).ok_or_else(wrong)?;
        let before = self.instances().iter().map(Instance::serialize).collect::<Result<Vec<_>>>()?;
        for (k, length) in lengths.into_iter().enumerate() {
            let (part, after) = rest.split_at(length);
            let instances = &mut self.subsystems.instances;
            if let Err(refused) = instances[k].deserialize(part) {
                instances.iter_mut().zip(&before).take(k).try_for_each(|(i, b)| i.deserialize(b))?;
                return Err(refused);
            }
            rest = after;
        }
        super::restore_rest(self, &Snapshot { slot: 0, clock: kept, fired, memory })
    }
}

/// Counted parts of an energy ledger, bit by bit.
fn before_bits(e: &Energy) -> [u64; 4] {
    [e.dissipated, e.port_work, e.actuator_work, e.electrical].map(f64::to_bits)
}

/// The bytes before their hash, where it is theirs.
fn unsealed(all: &[u8]) -> Option<&[u8]> {
    let (content, sum) = all.split_last_chunk::<8>()?;
    (bytes::hash(content) == u64::from_le_bytes(*sum)).then_some(content)
}

/// Head, lengths of the parts, and the parts, where they fit together.
fn split(bytes: &[u8], count: usize) -> Option<(Value, Vec<usize>, &[u8])> {
    let end = bytes.iter().position(|b| *b == b'\n')?;
    let head: Value = serde_json::from_slice(&bytes[..end]).ok()?;
    let lengths: Option<Vec<usize>> =
        head["lengths"].as_array()?.iter().map(|x| x.as_u64().map(|x| x as usize)).collect();
    let (lengths, rest) = (lengths?, &bytes[end + 1..]);
    let sum = lengths.iter().try_fold(0_usize, |sum, x| sum.checked_add(*x))?;
    (lengths.len() == count && sum == rest.len()).then_some((head, lengths, rest))
}

type Head = (RunClock, Vec<bool>, Vec<Vec<u64>>);

fn read_head(head: &Value) -> Option<Head> {
    let numbers =
        |key: &str| -> Option<Vec<u64>> { head[key].as_array()?.iter().map(Value::as_u64).collect() };
    let (bits, counts) = (numbers("bits")?, numbers("counts")?);
    let (&[step, origin, t], &[nominal, index]) = (bits.as_slice(), counts.as_slice()) else { return None };
    let counted: [u64; 4] = numbers("before")?.try_into().ok()?;
    let [dissipated, port_work, actuator_work, electrical] = counted.map(f64::from_bits);
    let before = Energy { dissipated, port_work, actuator_work, electrical, ..Energy::default() };
    let fired: Option<Vec<bool>> = head["fired"].as_array()?.iter().map(Value::as_bool).collect();
    let memory: Option<Vec<Vec<u64>>> = head["memory"]
        .as_array()?
        .iter()
        .map(|list| list.as_array()?.iter().map(Value::as_u64).collect())
        .collect();
    let [step_s, origin_s, t] = [step, origin, t].map(f64::from_bits);
    let good = [step_s, origin_s, t].iter().all(|x| x.is_finite()) && step_s > 0.0;
    let started = head["started"].as_bool()?;
    let initialised = head["initialised"].as_bool()?;
    let kept = RunClock { step_s, origin_s, nominal, index, t, started, initialised, before };
    good.then_some((kept, fired?, memory?))
}
