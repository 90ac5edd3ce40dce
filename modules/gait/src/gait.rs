//! The subsystem: trials, commits, snapshots and variables around the walker.

use crate::command::Command;
use crate::overlays;
use crate::parameters::{Settings, schema, settings};
use crate::variables;
use crate::walker::Walker;
use std::sync::Arc;
use terraglue_subsystem::bytes;
use terraglue_subsystem::{
    Capabilities, Config, Error, Host, Input, Module, Motion, Overlay, Response, Result, Schema, Step,
    Subsystem, Values, ValuesMut, Variable,
};

/// Version of its states as bytes.
const VERSION: u32 = 2;

/// Walks a robot with six legs of four joints. Outputs are the targets at the committed time: those that the joints
/// shall follow during the next step. Inputs are taken at the start of a step.
pub struct Gait {
    settings: Settings,
    command: Command,
    committed: Walker,
    trial: Walker,
    slots: Vec<Option<(Walker, Command)>>,
    table: Vec<Variable>,
}

impl Gait {
    /// From parameters; missing ones take their defaults.
    ///
    /// # Errors
    /// `Refused` when a parameter is wrong or the standing feet are out of reach.
    pub fn new(config: &Config, slots: u32) -> Result<Self> {
        let (settings, command) = settings(config)?;
        let walker = Walker::new(&settings, &command);
        Ok(Self {
            settings,
            command,
            committed: walker,
            trial: walker,
            slots: vec![None; slots as usize],
            table: variables::table(),
        })
    }

    /// The committed state of the walking machine.
    pub fn walker(&self) -> &Walker {
        &self.committed
    }

    fn slot(&mut self, slot: u32) -> Result<&mut Option<(Walker, Command)>> {
        let count = self.slots.len();
        self.slots
            .get_mut(slot as usize)
            .ok_or_else(|| Error::Refused(format!("no slot {slot}: the host asked for {count}")))
    }
}

impl Module for Gait {
    fn schema() -> Schema {
        schema()
    }

    fn instantiate(config: &Config, host: Arc<dyn Host>) -> Result<Box<dyn Subsystem>> {
        Ok(Box::new(Self::new(config, host.slots())?))
    }
}

impl Subsystem for Gait {
    fn capabilities(&self) -> Capabilities {
        Capabilities::RETRY | Capabilities::STATE | Capabilities::SERIALIZE
    }

    fn advance(&mut self, step: &Step, _input: &Input, out: &mut Response) -> Result {
        if !step.ports.is_empty() {
            return Err(Error::Unsupported);
        }
        let cycle = self.settings.cycle_s(self.committed.pattern);
        if step.h > cycle {
            return Err(Error::Discard { reached: step.t + 0.5 * cycle });
        }
        self.trial = self.committed;
        self.trial.advance(&self.settings, &self.command, step.h);
        out.reached = step.t + step.h;
        out.flags = 0;
        Ok(())
    }

    fn commit(&mut self, _step: &Step, _t: &[f64], _partner: &Motion) -> Result {
        self.committed = self.trial;
        Ok(())
    }

    fn save_state(&mut self, slot: u32) -> Result {
        let now = (self.committed, self.command);
        *self.slot(slot)? = Some(now);
        Ok(())
    }

    fn restore_state(&mut self, slot: u32) -> Result {
        let (walker, command) =
            (*self.slot(slot)?).ok_or_else(|| Error::Refused(format!("nothing was saved in slot {slot}")))?;
        (self.committed, self.trial, self.command) = (walker, walker, command);
        Ok(())
    }

    fn serialize(&self) -> Result<Vec<u8>> {
        Ok(bytes::seal(VERSION, 0, &(self.committed, self.command)))
    }

    fn deserialize(&mut self, from: &[u8]) -> Result {
        let (walker, command) = bytes::open(VERSION, 0, from)?;
        (self.committed, self.trial, self.command) = (walker, walker, command);
        Ok(())
    }

    fn overlays(&self, out: &mut Vec<Overlay>) {
        if self.settings.mounted {
            overlays::of(&self.committed, &self.settings, out);
        }
    }

    fn variables(&self) -> &[Variable] {
        &self.table
    }

    fn get(&self, ids: &[u32], out: ValuesMut) -> Result {
        let (walker, command) = (&self.committed, &self.command);
        match out {
            ValuesMut::F64(out) => read(ids, out, |id| variables::number(id, walker, command)),
            ValuesMut::Bool(out) => read(ids, out, |id| variables::flag(id, walker, command)),
            ValuesMut::Enumeration(out) => read(ids, out, |id| variables::choice(id, command)),
            _ => Err(Error::Refused("the gait has numbers, flags and enumerations only".into())),
        }
    }

    fn set(&mut self, ids: &[u32], values: Values) -> Result {
        let mut command = self.command;
        match values {
            Values::F64(values) => {
                write(ids, values, |id, v| variables::set_number(id, v, &mut command, &self.table))
            }
            Values::Bool(values) => write(ids, values, |id, v| variables::set_flag(id, v, &mut command)),
            Values::Enumeration(values) => {
                write(ids, values, |id, v| variables::set_choice(id, v, &mut command))
            }
            _ => Err(Error::Refused("the gait has numbers, flags and enumerations only".into())),
        }?;
        self.command = command;
        Ok(())
    }
}

fn read<T>(ids: &[u32], out: &mut [T], mut value: impl FnMut(u32) -> Result<T>) -> Result {
    same_length(ids.len(), out.len())?;
    for (place, id) in out.iter_mut().zip(ids) {
        *place = value(*id)?;
    }
    Ok(())
}

fn write<T: Copy>(ids: &[u32], values: &[T], mut put: impl FnMut(u32, T) -> Result) -> Result {
    same_length(ids.len(), values.len())?;
    ids.iter().zip(values).try_for_each(|(id, value)| put(*id, *value))
}

fn same_length(ids: usize, values: usize) -> Result {
    if ids == values { Ok(()) } else { Err(Error::Refused(format!("{ids} variables but {values} values"))) }
}
