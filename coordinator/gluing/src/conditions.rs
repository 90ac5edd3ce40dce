//! Conditions at each component of the interface in a step: its kind, the side that answers it, the spring and damper
//! of the glue, and the level at which joints are closed. Written when the step begins; no trial changes it.

use super::glue::{ConstraintKind, Joint};
use terraglue_subsystem::{Level, Port};

/// Conditions of all components, packed over the ports of a group.
#[derive(Debug)]
pub struct Conditions {
    /// The kind of each component.
    pub kinds: Vec<ConstraintKind>,
    /// Which components are answered by a soil.
    pub of_soil: Vec<bool>,
    /// Distance of the points of both sides of a joint at t.
    pub gap: Vec<f64>,
    /// Compliance of the glue, m/N.
    pub compliance: Vec<f64>,
    /// Damper beside it, N s/m.
    pub damping: Vec<f64>,
    /// Level of the condition at joints.
    pub level: Level,
    /// Share of the position error taken out per step at velocity level.
    pub stabilisation: f64,
}

impl Default for Conditions {
    fn default() -> Self {
        Self {
            kinds: Vec::new(),
            of_soil: Vec::new(),
            gap: Vec::new(),
            compliance: Vec::new(),
            damping: Vec::new(),
            level: Level::Position,
            stabilisation: 0.0,
        }
    }
}

impl Conditions {
    /// No components.
    pub(super) fn clear(&mut self) {
        self.kinds.clear();
        self.of_soil.clear();
        self.gap.clear();
        self.compliance.clear();
        self.damping.clear();
    }

    /// Adds the components of a port; `glued` where the glue of the scenario made it, else a contact was found.
    pub(super) fn push(&mut self, port: &Port, glued: Option<&Joint>) {
        for (_, c) in port.components() {
            self.kinds.push(glued.map_or(ConstraintKind::of_contact(c), |j| j.row(c)));
            self.of_soil.push(glued.is_none_or(|j| j.is_on_soil()));
            self.gap.push(glued.map_or(0.0, |j| j.gap(port, c)));
            self.compliance.push(port.law.compliance);
            self.damping.push(glued.map_or(0.0, |j| j.damping()));
        }
    }

    /// Whether subsystems share joints; else all ports are contacts found or declared.
    pub fn has_joints(&self) -> bool {
        self.kinds.contains(&ConstraintKind::Joint)
    }

    /// Whether the condition of a component is on rates or accelerations in a step of length h: a constraint at such a level.
    /// Springs and contacts are laws of the place.
    pub(super) fn is_above_position(&self, i: usize, h: f64) -> bool {
        self.level != Level::Position
            && self.kinds[i] == ConstraintKind::Joint
            && self.compliance[i] == 0.0
            && h > 0.0
    }

    /// Levels of the interface Jacobian with their weights in the condition of a constraint.
    pub(super) fn weights(&self, h: f64) -> [(Level, f64); 3] {
        let share = self.stabilisation / h;
        match self.level {
            Level::Acceleration => {
                [(Level::Acceleration, 1.0), (Level::Velocity, 2.0 * share), (Level::Position, share * share)]
            }
            level => [(level, 1.0), (level, 0.0), (level, 0.0)],
        }
    }
}
