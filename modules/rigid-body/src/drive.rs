//! The free axis of a joint: everything that acts along it as one monotone relation between impulse and rate.
//!
//! Implicit PD drive: τ⁺ = kp·(q_des − q − h·u) + kd·(u_des − u) at the rate u of the end of the step is the row
//! u + C·λ = b with λ = h·τ⁺, C = 1/(h·kd + h²·kp), b = C·h·(kp·(q_des − q) + kd·u_des). It adds stiffness and
//! damping to the system matrix and is stable for any gain (Baraff and Witkin 1998; Tan, Liu and Turk 2011). Windings,
//! gears, friction, springs and armature enter in the same way, see [`crate::actuator`]. |λ| ≤ h·max_torque whatever
//! drives the joint: a row at its bound leaves the system and its bound acts as an external impulse.

use crate::actuator::curve::{Curve, Line, Mode, Tag};
use crate::actuator::{Item, friction, winding};
use crate::motor::Motor;
use crate::state::JointState;

/// At and above this, N m, a block gives way to nothing.
pub(crate) const FULL_BLOCK: f64 = 1e12;

/// By how much a rigid motor gives way at its largest torque while bodies touch, rad/s or m/s. Between feet that
/// motors hold apart rigidly, forces are not determined, and whether a motor is at its bound neither.
pub(crate) const YIELDING: f64 = 1e-7;
/// If no consistent state is found it is raised up to this.
pub(crate) const MOST_YIELDING: f64 = 1e-2;

/// The step for which an axis is made.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Span {
    /// Length, s.
    pub h: f64,
    /// Springs and position motors act with the coordinate at this share of the step, and the rate at its end is the
    /// old one plus (mean − old)/`when`.
    pub when: f64,
    /// Voltage that the supply can give, V.
    pub supply_v: f64,
    /// Rate by which a rigid motor gives way at its largest torque, see [`YIELDING`].
    pub yielding: f64,
    /// Whether rates may jump: end stops then throw the joint back.
    pub impacts: bool,
}

/// The axis during one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Axis {
    total: Curve,
    motor: Curve,
    friction: Curve,
    /// Armature, spring and damper.
    passive: [Line; 3],
    /// Rate of the last step.
    rate: f64,
    /// Whether a brake of bounded torque acts.
    slips: bool,
}

/// Shares of the impulse of an axis, N m s.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub(crate) struct Shares {
    pub motor: f64,
    pub friction: f64,
    pub armature: f64,
    pub spring: f64,
    pub damper: f64,
    /// End stops and brake.
    pub stop: f64,
}

impl Axis {
    /// Nothing acts.
    pub fn idle() -> Self {
        let nothing = Curve::line(Line::ZERO, Tag::Law);
        Self {
            total: nothing,
            motor: nothing,
            friction: nothing,
            passive: [Line::ZERO; 3],
            rate: 0.0,
            slips: false,
        }
    }

    /// Makes it the relation for a step; `limits` of the coordinate. In place, because a curve is a kilobyte of which
    /// a plain motor uses a tenth.
    pub fn renew(&mut self, j: &JointState, limits: Option<[f64; 2]>, step: &Span) {
        let Span { h, when, .. } = *step;
        if j.broken {
            return *self = Self::idle();
        }
        let a = &j.actuator;
        let bound = h * j.max_torque;
        match law(j, step).yielding(step.yielding, bound) {
            _ if bound <= 0.0 => self.motor.assign_line(Line::ZERO, Tag::Law),
            law if winding::is_ideal(j) => law.bound_into(bound, &mut self.motor),
            law => self.motor = through_winding(law, j, step),
        }
        self.total.assign(&self.motor);
        match friction::curve(a, h) {
            Some(friction) => {
                self.total.add(&friction);
                self.friction = friction;
            }
            None => self.friction.assign_line(Line::ZERO, Tag::Friction),
        }
        let (inertia, k) = (a.inertia(), a[Item::SpringStiffness]);
        self.passive = [
            Line { at_zero: inertia / when * j.velocity, slope: inertia / when },
            Line { at_zero: h * k * (a[Item::SpringReference] - j.angle), slope: when * h * h * k },
            Line { at_zero: 0.0, slope: h * a[Item::ViscousFriction] },
        ];
        self.passive.iter().filter(|l| **l != Line::ZERO).for_each(|l| self.total.add_line(*l));
        add_stops(&mut self.total, j, limits, step);
        self.slips = j.blocked.is_some() && a[Item::BlockTorque] < FULL_BLOCK;
        self.rate = j.velocity;
    }

    /// The branch to begin with, as near as possible to the last one.
    pub fn start(&self, last: Mode) -> Mode {
        self.total.start(last, self.rate)
    }

    /// (compliance, right-hand side) of the row on a branch; none: no row.
    pub fn row(&self, mode: Mode) -> Option<(f64, f64)> {
        self.total.row(mode)
    }

    /// Impulse that acts from outside on a branch without a row.
    pub fn impulse(&self, mode: Mode) -> f64 {
        self.total.impulse(mode)
    }

    /// The branch on which (u, λ), the solution on `mode`, belongs.
    pub fn next(&self, mode: Mode, u: f64, lambda: f64) -> Mode {
        self.total.next(mode, u, lambda)
    }

    /// Whether the voltage of the supply limits the motor.
    pub fn starved(&self, u: f64) -> bool {
        matches!(self.motor.tag_at(u), Tag::SupplyHigh | Tag::SupplyLow)
    }

    /// Shares of the impulse λ at the rate u.
    pub fn shares(&self, mode: Mode, u: f64, lambda: f64) -> Shares {
        let [armature, spring, damper] = self.passive.map(|l| l.at(u));
        let rest = lambda - armature - spring - damper;
        let all = Shares { armature, spring, damper, ..Shares::default() };
        let within = |curve: &Curve, x: f64| {
            let (high, low) = curve.span(u);
            x.max(low).min(high)
        };
        match mode {
            Mode::Kink { tag: Tag::Friction, .. } => {
                let motor = self.motor.value(u);
                Shares { motor, friction: within(&self.friction, rest - motor), ..all }
            }
            Mode::Kink { tag: Tag::LowerLimit | Tag::UpperLimit | Tag::Brake, .. } => {
                let (motor, friction) = (self.motor.value(u), self.friction.value(u));
                Shares { motor, friction, stop: rest - motor - friction, ..all }
            }
            _ => {
                let friction = self.friction.value(u);
                let motor = within(&self.motor, rest - friction);
                let stop = if self.slips { rest - friction - motor } else { 0.0 };
                Shares { motor, friction, stop, ..all }
            }
        }
    }
}

/// Command of a motor, without any bound.
#[derive(Clone, Copy, Debug, PartialEq)]
enum MotorLaw {
    /// Impulse against rate.
    Line(Line),
    /// A rate, whatever it takes.
    Rate(f64),
}

impl MotorLaw {
    /// A rate becomes a steep line that gives the bound at ± `by`.
    fn yielding(self, by: f64, bound: f64) -> Self {
        match self {
            Self::Rate(rate) if by > 0.0 && bound > 0.0 && bound.is_finite() => {
                let slope = bound / by;
                Self::Line(Line { at_zero: slope * rate, slope })
            }
            _ => self,
        }
    }

    fn curve(self) -> Curve {
        match self {
            Self::Line(line) => Curve::line(line, Tag::Law),
            Self::Rate(rate) => Curve::rigid(rate, Tag::Law),
        }
    }

    /// The curve within ± an impulse.
    fn bound_into(self, bound: f64, out: &mut Curve) {
        match self {
            Self::Line(line) => out.assign_bounded(line, bound),
            Self::Rate(rate) => {
                out.assign_line(Line::level(bound), Tag::High);
                out.push((rate, Tag::Law), Line::level(-bound), Tag::Low);
            }
        }
    }
}

fn law(j: &JointState, step: &Span) -> MotorLaw {
    let Span { h, when, .. } = *step;
    match j.motor {
        Motor::Off | Motor::Voltage => MotorLaw::Line(Line::ZERO),
        Motor::Torque => MotorLaw::Line(Line::level(h * j.torque_target)),
        Motor::ExplicitPosition => {
            let (p, d) = (j.angle_target - j.angle, j.velocity_target - j.velocity);
            MotorLaw::Line(Line::level(h * (j.stiffness * p + j.damping * d)))
        }
        Motor::Velocity => MotorLaw::Rate(j.velocity_target),
        Motor::RigidPosition => {
            let most = j.actuator[Item::ApproachRate];
            let wanted = (j.angle_target - j.angle) / j.actuator[Item::ApproachTime].max(h);
            MotorLaw::Rate(wanted.clamp(-most, most))
        }
        Motor::Position => {
            let wanted = j.stiffness * (j.angle_target - j.angle) + j.damping * j.velocity_target;
            MotorLaw::Line(Line { at_zero: h * wanted, slope: h * j.damping + when * h * h * j.stiffness })
        }
    }
}

/// Law, supply, gear, bound.
fn through_winding(law: MotorLaw, j: &JointState, step: &Span) -> Curve {
    let bound = step.h * j.max_torque;
    winding::through_winding(law.curve(), j, step.supply_v, step.h)
        .at_most(Line::level(bound), Tag::High)
        .at_least(Line::level(-bound), Tag::Low)
}

/// End stops and brake: a block holds the coordinate, a partial one up to its torque.
fn add_stops(total: &mut Curve, j: &JointState, limits: Option<[f64; 2]>, step: &Span) {
    let h = step.h;
    let most = j.actuator[Item::BlockTorque];
    match j.blocked {
        Some(held) if most >= FULL_BLOCK => {
            let rate = (held - j.angle) / h;
            return total.add_step(rate, f64::INFINITY, f64::NEG_INFINITY, Tag::Brake);
        }
        Some(held) => total.add_step((held - j.angle) / h, h * most, -h * most, Tag::Brake),
        None => {}
    }
    if let Some([lower, upper]) = limits {
        let (slowest, fastest) = stop_rates(j, (lower - j.angle) / h, (upper - j.angle) / h, step.impacts);
        total.add_step(slowest, f64::INFINITY, 0.0, Tag::LowerLimit);
        total.add_step(fastest, 0.0, f64::NEG_INFINITY, Tag::UpperLimit);
    }
}

/// Rates between which the end stops leave the axis, from those that lead just to the limits. A joint that would pass
/// a limit at its present rate u⁻ leaves at −e·u⁻ at least (Newton's law of impact), but not beyond the other limit.
fn stop_rates(j: &JointState, to_lower: f64, to_upper: f64, impacts: bool) -> (f64, f64) {
    let e = j.actuator[Item::LimitRestitution];
    if !impacts || e <= 0.0 {
        return (to_lower, to_upper);
    }
    let back = -e * j.velocity;
    if j.velocity < to_lower.min(0.0) {
        (to_lower.max(back.min(to_upper)), to_upper)
    } else if j.velocity > to_upper.max(0.0) {
        (to_lower, to_upper.min(back.max(to_lower)))
    } else {
        (to_lower, to_upper)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounded_at_once_is_bounded_step_by_step() {
        let laws = [0.0, 1.0, 30.0, -70.0].map(|at_zero| MotorLaw::Line(Line { at_zero, slope: 2.5 }));
        let level = [0.0, 0.5, 7.0, -7.0].map(|at_zero| MotorLaw::Line(Line::level(at_zero)));
        for law in laws.into_iter().chain(level).chain([MotorLaw::Rate(0.3)]) {
            let slow = law.curve().at_most(Line::level(4.0), Tag::High).at_least(Line::level(-4.0), Tag::Low);
            let mut fast = Curve::line(Line { at_zero: 9.0, slope: 9.0 }, Tag::Brake);
            law.bound_into(4.0, &mut fast);
            for k in -400..400 {
                let u = 0.1 * f64::from(k) + 0.01;
                assert_eq!(fast.tag_at(u), slow.tag_at(u), "{law:?} {u}");
                assert!((fast.value(u) - slow.value(u)).abs() < 1e-12, "{law:?} {u}");
            }
        }
    }
}
