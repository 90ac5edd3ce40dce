//! The state as bytes, taken back by a robot of the same model only.

use super::{ClosureState, ContactLedger, JointState, Load, Motion, State};
use crate::math::{Q, V3};
use crate::model::Model;
use nalgebra::{Quaternion, Unit};
use terraglue_subsystem::bytes::{self, Persist, hash};
use terraglue_subsystem::{Result, persist};

/// Version of the bytes.
const VERSION: u32 = 3;

impl Persist for Motion {
    fn write(&self, out: &mut Vec<u8>) {
        let Self { c, q, v, w } = self;
        [*c, *v, *w].map(<[f64; 3]>::from).write(out);
        <[f64; 4]>::from(q.coords).write(out);
    }
    fn read(from: &mut &[u8]) -> Result<Self> {
        let [c, v, w] = <[[f64; 3]; 3]>::read(from)?.map(V3::from);
        let q: Q = Unit::new_unchecked(Quaternion::from(<[f64; 4]>::read(from)?));
        Ok(Self { c, q, v, w })
    }
}

impl Persist for Load {
    fn write(&self, out: &mut Vec<u8>) {
        [self.force, self.moment].map(<[f64; 3]>::from).write(out);
    }
    fn read(from: &mut &[u8]) -> Result<Self> {
        let [force, moment] = <[[f64; 3]; 2]>::read(from)?.map(V3::from);
        Ok(Self { force, moment })
    }
}

persist!(JointState {
    angle,
    velocity,
    torque,
    angle_target,
    velocity_target,
    torque_target,
    max_torque,
    stiffness,
    damping,
    motor,
    blocked,
    broken,
    mode,
    actuator,
});
persist!(ClosureState { broken, force, moment, stored });
persist!(ContactLedger { points, residual, lost, yielding });

impl Persist for State {
    fn write(&self, out: &mut Vec<u8>) {
        let Self { bodies, joints, closures, redundant_rows, loads, contact_normal, energy, contact, .. } =
            self;
        let Self { pressed, supply, start, stagger, reactions, accelerations, accelerated, .. } = self;
        bodies.write(out);
        joints.write(out);
        closures.write(out);
        redundant_rows.write(out);
        loads.write(out);
        contact_normal.write(out);
        energy.write(out);
        contact.write(out);
        pressed.write(out);
        supply.write(out);
        start.map(<[f64; 3]>::from).write(out);
        stagger.write(out);
        reactions.write(out);
        accelerations.write(out);
        accelerated.write(out);
    }
    fn read(from: &mut &[u8]) -> Result<Self> {
        Ok(Self {
            bodies: Persist::read(from)?,
            joints: Persist::read(from)?,
            closures: Persist::read(from)?,
            redundant_rows: Persist::read(from)?,
            loads: Persist::read(from)?,
            contact_normal: Persist::read(from)?,
            energy: Persist::read(from)?,
            contact: Persist::read(from)?,
            pressed: Persist::read(from)?,
            supply: Persist::read(from)?,
            start: Option::<[f64; 3]>::read(from)?.map(V3::from),
            stagger: Persist::read(from)?,
            reactions: Persist::read(from)?,
            accelerations: Persist::read(from)?,
            accelerated: Persist::read(from)?,
        })
    }
}

impl State {
    /// As bytes.
    pub fn to_bytes(&self, model: &Model) -> Vec<u8> {
        bytes::seal(VERSION, mark(model), self)
    }

    /// A state from bytes that fits this one: as many bodies, joints and closures, and finite numbers.
    ///
    /// # Errors
    /// `Refused`, with the reason.
    pub fn restored(&self, model: &Model, from: &[u8]) -> Result<Self> {
        let state: Self = bytes::open(VERSION, mark(model), from)?;
        let same = [
            (state.bodies.len(), self.bodies.len()),
            (state.joints.len(), self.joints.len()),
            (state.closures.len(), self.closures.len()),
            (state.loads.len(), self.loads.len()),
            (state.reactions.len(), self.reactions.len()),
            (state.contact_normal.len(), self.contact_normal.len()),
        ];
        let finite = |m: &Motion| {
            let [c, v, w] = [m.c, m.v, m.w];
            c.iter().chain(&v).chain(&w).chain(&m.q.coords).all(|x| x.is_finite())
        };
        if same.iter().any(|(a, b)| a != b) || !state.bodies.iter().all(finite) {
            return Err(bytes::wrong("they do not fit the bodies of this model"));
        }
        Ok(state)
    }
}

/// Of the model: names, masses and inertias of its bodies, and its joints.
fn mark(model: &Model) -> u64 {
    let mut all = Vec::new();
    for body in &model.bodies {
        body.name.write(&mut all);
        body.mass.write(&mut all);
        <[[f64; 3]; 3]>::from(body.inertia).write(&mut all);
    }
    model.joints.iter().for_each(|j| j.name.write(&mut all));
    model.closures.iter().for_each(|c| c.name.write(&mut all));
    hash(&all)
}
