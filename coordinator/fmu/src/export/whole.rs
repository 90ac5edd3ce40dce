//! A whole scenario as one subsystem: what an exported FMU steps.

use super::super::driven_bodies;
use terraglue_engine::Testbed;
use terraglue_engine::testbed::Snapshot;
use terraglue_fmi::export::JointTerminal;
use terraglue_host::Reply;
use terraglue_subsystem::{
    Capabilities, Causality, Effect, Energy, Error, Input, Motion, Response, Result, Step, Subsystem, Values,
    ValuesMut, Variable,
};

/// Where a variable lives.
#[derive(Clone, Copy, Debug)]
struct VariableSlot {
    slot: usize,
    id: u32,
}

/// A testbed as a subsystem.
pub(super) struct Whole {
    testbed: Testbed,
    variables: Vec<Variable>,
    places: Vec<VariableSlot>,
    /// Instances of `feet`, which receive the length of a step.
    feet: Vec<usize>,
    capabilities: Capabilities,
    snapshots: Vec<Option<Snapshot>>,
    /// Length of the scenario's own steps, s.
    step_s: f64,
    /// The subsystem whose variables are shown without its name in front.
    bare: Option<String>,
}

impl Whole {
    /// `bare` names the subsystem whose variables are shown without its name in front.
    pub fn new(mut testbed: Testbed, bare: Option<&str>, slots: u32) -> Result<Self> {
        let is_feet = |i: &terraglue_host::Instance| i.module() == driven_bodies::NAME;
        let feet: Vec<usize> =
            (0..testbed.instances().len()).filter(|k| is_feet(&testbed.instances()[*k])).collect();
        for slot in &feet {
            tell(&mut testbed, *slot, driven_bodies::id::JUMP, Values::Bool(&[true]))?;
        }
        let (variables, places) = variables(&testbed, bare, &feet);
        let capabilities = capabilities(&testbed);
        let step_s = testbed.step_s();
        let snapshots = (0..slots).map(|_| None).collect();
        let bare = bare.map(str::to_owned);
        Ok(Self { testbed, variables, places, feet, capabilities, snapshots, step_s, bare })
    }

    /// The joints of all subsystems with the shown names of their variables.
    pub fn joints(&self) -> Vec<JointTerminal> {
        let shown = |slot: usize, id: u32| {
            let place = self.places.iter().position(|p| (p.slot, p.id) == (slot, id))?;
            Some(self.variables[place].name.clone())
        };
        let instances = self.testbed.instances().iter().enumerate();
        let all = instances.flat_map(|(slot, i)| i.scene().joints.iter().map(move |j| (slot, i.name(), j)));
        all.map(|(slot, owner, joint)| {
            let v = &joint.variables;
            let members = [
                ("position", v.position),
                ("velocity", v.velocity),
                ("torque", v.torque),
                ("torque_limit", v.torque_limit),
                ("blocked", v.blocked),
            ];
            let members = members.into_iter().filter_map(|(m, id)| Some((m, shown(slot, id)?))).collect();
            let bare = self.bare.as_deref() == Some(owner);
            let name = if bare { joint.name.clone() } else { format!("{owner}.{}", joint.name) };
            JointTerminal { name, members }
        })
        .collect()
    }

    fn place(&self, id: u32) -> Result<VariableSlot> {
        let place = self.places.get(id as usize).copied();
        place.ok_or_else(|| Error::Refused(format!("no variable has the number {id}")))
    }

    /// Steps by h: as steps of the scenario's own length where h is a multiple of it, else in equal parts.
    fn go(&mut self, h: f64) -> Result {
        let ratio = h / self.step_s;
        let whole = ratio.round().max(1.0);
        let fits = (ratio - whole).abs() <= 1e-6 * whole;
        if !fits && !self.testbed.takes_any_step() {
            let text =
                format!("a step of {h} s is no multiple of {} s, and a subsystem needs that", self.step_s);
            return Err(Error::Refused(text));
        }
        let (count, step_s) = if fits { (whole, self.step_s) } else { (ratio.ceil(), h / ratio.ceil()) };
        self.testbed.set_step_s(step_s);
        for slot in &self.feet {
            tell(&mut self.testbed, *slot, driven_bodies::id::DURATION, Values::F64(&[h]))?;
        }
        self.testbed.refresh().map_err(failed)?;
        for _ in 0..count as u64 {
            self.testbed.step().map_err(failed)?;
        }
        self.testbed.refresh().map_err(failed)
    }
}

fn failed(error: terraglue_diagnostics::Error) -> Error {
    Error::Failed(error.to_string())
}

/// Sets a value of an instance.
fn tell(testbed: &mut Testbed, slot: usize, id: u32, values: Values) -> Result {
    match testbed.instance_mut(slot).set(&[id], values).map_err(failed)? {
        Reply::Accepted => Ok(()),
        Reply::Refused(reason) => Err(Error::Refused(reason)),
    }
}

/// The variables of all subsystems under new numbers; inputs that a connection feeds can only be read.
fn variables(testbed: &Testbed, bare: Option<&str>, feet: &[usize]) -> (Vec<Variable>, Vec<VariableSlot>) {
    let (mut all, mut places) = (Vec::new(), Vec::new());
    for (slot, instance) in testbed.instances().iter().enumerate() {
        let own = |v: &&Variable| {
            feet.contains(&slot) && [driven_bodies::id::DURATION, driven_bodies::id::JUMP].contains(&v.id)
        };
        for v in instance.subsystem().variables().iter().filter(|v| !own(v)) {
            let mut shown = Variable { id: all.len() as u32, ..v.clone() };
            if bare != Some(instance.name()) {
                shown.name = format!("{}.{}", instance.name(), v.name);
            }
            if instance
                .elements_of(v.id)
                .iter()
                .any(|id| testbed.signals().is_fed(testbed.instances(), slot, *id))
            {
                (shown.causality, shown.effect) = (Causality::Local, Effect::ReadOnly);
            }
            all.push(shown);
            places.push(VariableSlot { slot, id: v.id });
        }
    }
    (all, places)
}

/// Capabilities that all subsystems have.
fn capabilities(testbed: &Testbed) -> Capabilities {
    let all = |c: Capabilities| testbed.instances().iter().all(|i| i.capabilities().has(c));
    let mut found = Capabilities::default();
    if all(Capabilities::STATE) {
        found = found | Capabilities::STATE;
        if all(Capabilities::SERIALIZE) {
            found = found | Capabilities::SERIALIZE;
        }
    }
    found
}

impl Subsystem for Whole {
    fn capabilities(&self) -> Capabilities {
        self.capabilities
    }

    /// A step of h = 0 ends the initialisation: that of the FMUs within, and the time in which poses are set without a way to them.
    fn advance(&mut self, step: &Step, _: &Input, out: &mut Response) -> Result {
        if step.h == 0.0 {
            for slot in &self.feet {
                tell(&mut self.testbed, *slot, driven_bodies::id::JUMP, Values::Bool(&[false]))?;
            }
            self.testbed.end_initialization().map_err(failed)?;
        } else {
            self.go(step.h)?;
        }
        out.reached = step.t + step.h;
        Ok(())
    }

    fn commit(&mut self, _: &Step, _: &[f64], _: &Motion) -> Result {
        Ok(())
    }

    fn save_state(&mut self, slot: u32) -> Result {
        let place = self.snapshots.get_mut(slot as usize).ok_or(Error::Unsupported)?;
        *place = Some(self.testbed.snapshot(slot).map_err(failed)?);
        Ok(())
    }

    fn restore_state(&mut self, slot: u32) -> Result {
        let saved = self.snapshots.get(slot as usize).and_then(Option::as_ref);
        let saved = saved.ok_or_else(|| Error::Refused(format!("no state was saved in slot {slot}")))?;
        self.testbed.restore(saved).map_err(failed)
    }

    fn serialize(&self) -> Result<Vec<u8>> {
        self.testbed.serialize().map_err(failed)
    }

    fn deserialize(&mut self, bytes: &[u8]) -> Result {
        self.testbed.deserialize(bytes).map_err(failed)
    }

    fn variables(&self) -> &[Variable] {
        &self.variables
    }

    fn get(&self, ids: &[u32], out: ValuesMut) -> Result {
        let &[id] = ids else { return Err(Error::Unsupported) };
        let place = self.place(id)?;
        self.testbed.instances()[place.slot].get(&[place.id], out).map_err(failed)
    }

    fn set(&mut self, ids: &[u32], values: Values) -> Result {
        let &[id] = ids else { return Err(Error::Unsupported) };
        let place = self.place(id)?;
        tell(&mut self.testbed, place.slot, place.id, values)
    }

    fn energy(&self) -> Energy {
        self.testbed.energy()
    }
}
