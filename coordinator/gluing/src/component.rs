//! One component of the interface at the last trials of both sides: how far its condition is missed, and what energy passes it.

use super::conditions::Conditions;
use super::glue::ConstraintKind;
use super::trials::SideMotion;
use terraglue_subsystem::Level;

/// A component with the wrench on it and the motion of both sides.
#[derive(Clone, Copy, Debug)]
pub struct Component<'a> {
    /// Conditions at all components.
    pub(super) conditions: &'a Conditions,
    /// Number of this one.
    pub(super) i: usize,
    /// Length of the step, s.
    pub(super) h: f64,
    /// Wrench on side 1.
    pub(super) t: f64,
    /// Wrench on side 2 where it is another one.
    pub(super) t_second: Option<f64>,
    /// Motion of side 1.
    pub(super) first: &'a SideMotion,
    /// Motion of side 2, or the surface of a soil.
    pub(super) second: &'a SideMotion,
    /// Whether a soil is among the members.
    pub(super) has_grounds: bool,
}

/// Energy that passes a component of the interface in a step, J.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PassedEnergy {
    /// Work on both sides together, beyond what springs stored and what became heat; at a contact with soil the work on the
    /// body alone.
    pub gained: f64,
    /// Stored by a spring.
    pub stored: f64,
    /// Turned into heat by a damper, or by friction between bodies.
    pub heat: f64,
    /// Magnitude of the work on side 1.
    pub through: f64,
}

impl Component<'_> {
    fn kind(&self) -> ConstraintKind {
        self.conditions.kinds[self.i]
    }

    fn gap(&self) -> f64 {
        self.conditions.gap[self.i]
    }

    fn compliance(&self) -> f64 {
        self.conditions.compliance[self.i]
    }

    fn damping(&self) -> f64 {
        self.conditions.damping[self.i]
    }

    /// Whether a soil's surface is what side 1 is held against.
    fn is_on_surface(&self) -> bool {
        self.has_grounds && self.kind() != ConstraintKind::Joint
    }

    /// x1 − x2.
    fn moved_apart(&self) -> f64 {
        self.first.x[self.i] - self.second.x[self.i]
    }

    /// v1 − v2.
    fn rate(&self) -> f64 {
        self.first.v[self.i] - self.second.v[self.i]
    }

    /// a1 − a2.
    fn acceleration(&self) -> f64 {
        self.first.a[self.i] - self.second.a[self.i]
    }

    /// Whether the wrench is known: that of a soil at t, where a step of no length moves nothing.
    pub fn is_given(&self) -> bool {
        self.h == 0.0 && self.conditions.of_soil[self.i]
    }

    /// x1 − x2 with the distance of the points at t, of components that are not a soil's law; at h = 0 and at the
    /// velocity level the derivative that the condition is on. The stretch of a compliant glue is added.
    pub fn mismatch(&self) -> f64 {
        let surface = if self.is_on_surface() && self.h > 0.0 { -self.second.x[self.i] } else { 0.0 };
        self.bodies_part() + surface + self.compliance() * self.t
    }

    /// Contribution of the bodies' motion to the mismatch: without the force of the glue's spring and the soil's
    /// surface.
    pub fn bodies_part(&self) -> f64 {
        let (i, rate) = (self.i, self.rate());
        let damper = self.compliance() * self.damping() * rate;
        if self.h == 0.0 && self.compliance() == 0.0 {
            return self.acceleration();
        }
        if self.conditions.is_above_position(i, self.h) {
            let share = self.conditions.stabilisation / self.h;
            if self.conditions.level == Level::Velocity {
                return rate + share * self.gap();
            }
            // Baumgarte (1972)
            let apart = self.moved_apart() + self.gap();
            return self.acceleration() + 2.0 * share * rate + share * share * apart;
        }
        self.first.x[i] + self.gap() + damper - if self.is_on_surface() { 0.0 } else { self.second.x[i] }
    }

    /// Gap of a closed joint at t + h beyond the share of its spring and damper, m or rad.
    pub fn joint_gap(&self) -> f64 {
        let force = self.t + self.damping() * self.rate();
        (self.moved_apart() + self.gap() + self.compliance() * force).abs()
    }

    /// Energy that passes in the step, with the wrench of the step before if there was one.
    pub fn passed(&self, t_before: Option<f64>) -> PassedEnergy {
        let (i, t) = (self.i, self.t);
        let through = (t * self.first.x[i]).abs();
        if self.conditions.of_soil[i] && self.has_grounds {
            // the soil's side is booked at its commit
            return PassedEnergy { gained: t * self.first.x[i], through, ..PassedEnergy::default() };
        }
        let moved = self.moved_apart();
        let apart = self.t_second.map_or(0.0, |t2| (t - t2) * self.second.x[i]);
        let stretched = moved + self.gap();
        if self.kind() == ConstraintKind::Coulomb {
            return PassedEnergy { gained: apart, heat: -t * moved, through, stored: 0.0 };
        }
        if self.kind() != ConstraintKind::Joint || self.compliance() == 0.0 {
            return PassedEnergy { gained: t * stretched + apart, through, ..PassedEnergy::default() };
        }
        let mean = 0.5 * (t_before.unwrap_or(t) + t);
        let stored = 0.5 * (stretched * stretched - self.gap() * self.gap()) / self.compliance();
        let rate = if self.h > 0.0 { moved / self.h } else { 0.0 };
        let heat = self.damping() * rate * moved;
        PassedEnergy { gained: mean * moved + stored + heat + apart, stored, heat, through }
    }
}
