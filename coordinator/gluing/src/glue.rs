//! Glue that a scenario declares: where its two points are, and what each of its components is to a strategy.
//!
//! Each side keeps its own material point. At t the points of a joint may lie apart by what earlier steps left;
//! the condition at t + h closes that gap too, so nothing drifts.

use super::participant::End;
use crate::contact::PortOwner;
use terraglue_numerics::rotation::{IDENTITY, conjugate, minus, plus, product, turned};
use terraglue_subsystem::{BodyState, Law, Port, PortKind};

/// Kind of one packed component.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ConstraintKind {
    /// Normal force of a contact: complementary to the gap within the bounds of the law.
    Normal,
    /// Shear or moment that a soil's law answers.
    Law,
    /// Bilateral.
    Joint,
    /// Tangential force bounded by Coulomb's law on the normal force of its port.
    Coulomb,
}

impl ConstraintKind {
    /// Of component c of a contact.
    pub(crate) fn of_contact(c: usize) -> Self {
        if c == 0 { Self::Normal } else { Self::Law }
    }
}

/// One end in its subsystem; `slot` none: the world.
#[derive(Clone, Copy, Debug)]
struct Terminal {
    slot: Option<usize>,
    body: u32,
    /// The material point in the frame of the body; of the world, the point itself.
    local: [f64; 3],
    /// Orientation of the body at the start.
    start: [f64; 4],
    place: [f64; 3],
    turn: [f64; 4],
}

/// One declared glue.
#[derive(Clone, Debug)]
pub struct Joint {
    /// Number in the scenario.
    number: usize,
    port: Port,
    ends: [Terminal; 2],
    soil: bool,
    turning: bool,
    damping: f64,
    axes: [f64; 9],
    ramp: Ramp,
}

/// How a joint closes the gap between its points at the start.
#[derive(Clone, Copy, Debug, Default)]
struct Ramp {
    /// Duration, s; 0: the gap is closed at once.
    duration_s: f64,
    /// Place of side 1 minus that of side 2 at the start, m.
    gap_m: [f64; 3],
    /// Share of it that is left at the end of the step.
    left: f64,
}

impl Ramp {
    /// Takes the time at the end of the step, s. The share falls with rates and accelerations of zero at both ends.
    fn advance(&mut self, end_s: f64) {
        if self.duration_s > 0.0 {
            let s = (end_s / self.duration_s).clamp(0.0, 1.0);
            self.left = 1.0 - s * s * s * (10.0 + s * (6.0 * s - 15.0));
        }
    }
}

/// All declared glue.
#[derive(Clone, Debug, Default)]
pub struct Glue {
    joints: Vec<Joint>,
}

/// Ports of declared glue come after those of detected contact.
const FIRST_KEY: u64 = 1 << 63;

/// Parameters of one glue.
pub struct Recipe {
    /// Number in the scenario, from 0.
    pub number: usize,
    /// Index of the subsystem and body of both sides; none: the world.
    pub ends: [Option<(usize, u32)>; 2],
    /// World point at the start; absent: the origins of both bodies.
    pub at: Option<[f64; 3]>,
    /// Components.
    pub mask: u32,
    /// n, t1, t2 at the start.
    pub axes: [f64; 9],
    /// The axes turn with side 1.
    pub turning: bool,
    /// Bounds and compliance.
    pub law: Law,
    /// Damper beside the compliance, N s/m.
    pub damping: f64,
    /// Time in which a joint closes the gap at the start, s; 0: at once.
    pub ramp_s: f64,
    /// Unilateral.
    pub contact: bool,
    /// Side 2 is a soil, whose law answers all but the normal force.
    pub soil: bool,
}

impl Glue {
    /// Adds a glue between bodies in these states.
    pub fn add(&mut self, recipe: &Recipe, states: impl Fn(usize, u32) -> BodyState) {
        let end = |end: Option<(usize, u32)>| {
            let state = end.map_or(BodyState::REST, |(slot, body)| states(slot, body));
            let pose = state.world_from_body;
            let place = recipe.at.unwrap_or(pose.position);
            let local = turned(conjugate(pose.orientation), minus(place, pose.position));
            let (slot, body) = (end.map(|e| e.0), end.map_or(0, |e| e.1));
            Terminal { slot, body, local, start: pose.orientation, place, turn: IDENTITY }
        };
        let kind = if recipe.contact { PortKind::Contact } else { PortKind::Joint };
        let port = Port {
            key: FIRST_KEY | recipe.number as u64,
            kind: kind as u32,
            side: 1,
            mask: recipe.mask,
            first: 0,
            body: recipe.ends[0].map_or(0, |e| e.1),
            shape: u32::MAX,
            first_node: 0,
            node_count: 0,
            origin: [0.0; 3],
            frame: recipe.axes,
            extent: [0.0; 2],
            law: recipe.law,
        };
        let ends = recipe.ends.map(end);
        let gap_m = minus(ends[0].place, ends[1].place);
        let left = f64::from(u8::from(recipe.ramp_s > 0.0));
        let ramp = Ramp { duration_s: recipe.ramp_s, gap_m, left };
        self.joints.push(Joint {
            number: recipe.number,
            port,
            ends,
            soil: recipe.soil,
            turning: recipe.turning,
            damping: recipe.damping,
            axes: recipe.axes,
            ramp,
        });
    }

    /// Number of glues.
    pub fn len(&self) -> usize {
        self.joints.len()
    }

    /// Whether the scenario declares none.
    pub fn is_empty(&self) -> bool {
        self.joints.is_empty()
    }

    /// Whether any glue is a joint.
    pub fn has_joints(&self) -> bool {
        self.joints.iter().any(|j| !j.is_contact())
    }

    /// Number in the scenario of the first that is so.
    fn number(&self, so: impl Fn(&Joint) -> bool) -> Option<usize> {
        self.joints.iter().find(|j| so(j)).map(|j| j.number)
    }

    /// A joint without compliance, by number.
    pub fn rigid_joint(&self) -> Option<usize> {
        self.number(|j| !j.is_contact() && j.port.law.compliance == 0.0)
    }

    /// Whether a subsystem is side 2 of all its glue.
    pub fn is_second(&self, slot: usize) -> bool {
        let side = |e: usize| self.joints.iter().any(|j| j.ends[e].slot == Some(slot));
        side(1) && !side(0)
    }

    /// A joint whose side 2 is the world or is side 1 elsewhere, by number: nobody could take its motion.
    pub fn joint_without_second(&self) -> Option<usize> {
        self.number(|j| !j.soil && !j.ends[1].slot.is_some_and(|s| self.is_second(s)))
    }

    /// A glue with a damper, by number.
    pub fn damped(&self) -> Option<usize> {
        self.number(|j| j.damping > 0.0)
    }

    /// A contact between bodies, by number.
    pub fn contact(&self) -> Option<usize> {
        self.number(Joint::is_contact)
    }

    /// A contact with friction between bodies, or with the world, by number.
    pub fn body_contact(&self) -> Option<usize> {
        self.number(|j| j.is_contact() && !j.soil)
    }

    /// A joint with compliance, by number.
    pub fn spring(&self) -> Option<usize> {
        self.number(|j| !j.is_contact() && j.port.law.compliance > 0.0)
    }

    /// Owners of glue k.
    pub fn owner(&self, k: usize) -> PortOwner {
        let slot = |e: usize| self.joints.get(k).and_then(|j| j.ends[e].slot).map_or(u32::MAX, |s| s as u32);
        let body = self.joints.get(k).map_or(0, |j| j.port.body);
        PortOwner { subsystem: slot(0), ground: slot(1), body, shape: u32::MAX }
    }

    /// Takes the committed poses of all bodies, for a step that ends at `end_s`, s.
    pub fn place(&mut self, end_s: f64, states: impl Fn(usize, u32) -> BodyState) {
        for joint in &mut self.joints {
            joint.ramp.advance(end_s);
            for end in &mut joint.ends {
                if let Some(slot) = end.slot {
                    let pose = states(slot, end.body).world_from_body;
                    end.place = plus(pose.position, turned(pose.orientation, end.local));
                    end.turn = product(pose.orientation, conjugate(end.start));
                }
            }
            if joint.turning {
                let axes = joint.axes;
                for k in 0..3 {
                    let axis = turned(joint.ends[0].turn, [axes[3 * k], axes[3 * k + 1], axes[3 * k + 2]]);
                    joint.port.frame[3 * k..][..3].copy_from_slice(&axis);
                }
            }
            joint.port.origin = joint.ends[0].place;
        }
    }

    /// Puts the ports behind those of detected contact.
    pub fn append(&self, ports: &mut Vec<Port>) {
        let mut first = ports.iter().map(|p| p.len() as u32).sum();
        for joint in &self.joints {
            ports.push(Port { first, ..joint.port });
            first += joint.port.len() as u32;
        }
    }

    /// Glue number k.
    pub fn joint(&self, k: usize) -> Option<&Joint> {
        self.joints.get(k)
    }

    /// The end of glue k in a subsystem.
    pub fn end_of(&self, k: usize, slot: usize) -> Option<End> {
        let joint = self.joints.get(k)?;
        let side = joint.ends.iter().position(|e| e.slot == Some(slot))?;
        let end = joint.ends[side];
        // a contact has one origin, from which both sides count
        let place = if joint.is_contact() { joint.ends[0].place } else { end.place };
        Some(End { side: if side == 0 { 1 } else { -1 }, body: end.body, origin: place })
    }
}

impl Joint {
    fn is_contact(&self) -> bool {
        self.port.kind == PortKind::Contact as u32
    }

    /// Whether side 2 is a soil.
    pub fn is_on_soil(&self) -> bool {
        self.soil
    }

    /// Kind of a component.
    pub fn row(&self, component: usize) -> ConstraintKind {
        match (self.is_contact(), component, self.soil) {
            (false, ..) => ConstraintKind::Joint,
            (true, 0, _) => ConstraintKind::Normal,
            (true, _, true) => ConstraintKind::Law,
            (true, _, false) => ConstraintKind::Coulomb,
        }
    }

    /// Damper beside the compliance, N s/m.
    pub fn damping(&self) -> f64 {
        self.damping
    }

    /// Gap of the points at t along a component, m or rad, beyond what the ramp of the joint leaves at the end of the
    /// step.
    pub fn gap(&self, port: &Port, component: usize) -> f64 {
        let [a, b] = &self.ends;
        if self.is_contact() {
            // a soil speaks from the body's origin; another body stands where it is
            return if !self.soil && component == 0 { self.along(port, component, a, b) } else { 0.0 };
        }
        if component < 3 {
            let d = port.direction(component);
            let left: f64 = (0..3).map(|k| self.ramp.left * self.ramp.gap_m[k] * d[k]).sum();
            return self.along(port, component, a, b) - left;
        }
        let q = product(a.turn, conjugate(b.turn));
        let sign = if q[0] < 0.0 { -2.0 } else { 2.0 };
        let d = port.direction(component);
        (0..3).map(|k| sign * q[k + 1] * d[k]).sum()
    }

    fn along(&self, port: &Port, component: usize, a: &Terminal, b: &Terminal) -> f64 {
        let d = port.direction(component);
        (0..3).map(|k| (a.place[k] - b.place[k]) * d[k]).sum()
    }
}
