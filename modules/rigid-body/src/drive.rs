//! The free axis of a joint: motor, limits and brake as one monotone relation between its impulse and its rate.
//!
//! Implicit PD drive: τ⁺ = kp·(q_des − q − h·u) − kd·(u − u_des) at the rate u of the end of the step is the row
//! u + C·λ = b with λ = h·τ⁺, C = 1/(h·kd + h²·kp), b = C·h·(kp·(q_des − q) + kd·u_des). It adds stiffness and
//! damping to the system matrix and is stable for any gain (Baraff and Witkin 1998; Tan, Liu and Turk 2011).
//! |λ| ≤ h·max_torque: a row at its bound leaves the system and its bound acts as an external impulse.

use crate::state::JointState;

/// How the motor of a joint is driven. The numbers are the values of the variable `motor`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Motor {
    Off,
    Position,
    Velocity,
    Torque,
}

impl Motor {
    pub const NAMES: [&'static str; 4] = ["off", "position", "velocity", "torque"];
    const ALL: [Self; 4] = [Self::Off, Self::Position, Self::Velocity, Self::Torque];

    pub fn from_index(i: i64) -> Option<Self> {
        usize::try_from(i).ok().and_then(|i| Self::ALL.get(i).copied())
    }

    pub fn from_name(name: &str) -> Option<Self> {
        Self::NAMES.iter().position(|n| *n == name).map(|i| Self::ALL[i])
    }

    pub fn index(self) -> i64 {
        self as i64
    }
}

/// Branch of the relation on which an axis is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mode {
    /// The motor's impulse is given; no row.
    Free,
    /// The motor follows its law: a row.
    Drive,
    /// At −h·max_torque; no row.
    Low,
    /// At +h·max_torque; no row.
    High,
    /// At the lower limit: a rigid row.
    LowerLimit,
    /// At the upper limit: a rigid row.
    UpperLimit,
    /// Held by the brake: a rigid row.
    Blocked,
}

/// What the motor wants.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Law {
    /// A given impulse, N m s.
    Impulse(f64),
    /// u + c·λ = b; c = 0 for a velocity motor.
    Row { c: f64, b: f64 },
}

/// The axis during one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Axis {
    pub law: Law,
    /// Largest impulse of the motor, N m s.
    pub bound: f64,
    /// Rates that lead exactly to the limits at the end of the step.
    pub limits: [f64; 2],
    /// Rate that leads back to where the brake holds.
    pub brake: Option<f64>,
}

/// Rates nearer than this to a limit count as at it, rad/s or m/s.
const RATE_TOLERANCE: f64 = 1e-10;

impl Axis {
    /// The relation for a step of length h; `limits` of the coordinate.
    pub fn new(j: &JointState, limits: Option<[f64; 2]>, h: f64) -> Self {
        let bound = h * j.max_torque;
        let gain = h * j.damping + h * h * j.stiffness;
        let law = match j.motor {
            _ if bound <= 0.0 || j.broken => Law::Impulse(0.0),
            Motor::Off => Law::Impulse(0.0),
            Motor::Torque => Law::Impulse((h * j.torque_target).clamp(-bound, bound)),
            Motor::Velocity => Law::Row { c: 0.0, b: j.velocity_target },
            Motor::Position if gain <= 0.0 => Law::Impulse(0.0),
            Motor::Position => {
                let wanted = j.stiffness * (j.angle_target - j.angle) + j.damping * j.velocity_target;
                Law::Row { c: 1.0 / gain, b: h * wanted / gain }
            }
        };
        let [lower, upper] = limits.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
        let limits = [(lower - j.angle) / h, (upper - j.angle) / h];
        Self { law, bound, limits, brake: j.blocked.map(|held| (held - j.angle) / h) }
    }

    /// The branch to begin with, as near as possible to the last one.
    pub fn start(&self, last: Mode) -> Mode {
        match (self.brake, self.law, last) {
            (Some(_), _, _) => Mode::Blocked,
            (None, _, Mode::LowerLimit | Mode::UpperLimit) => last,
            (None, Law::Impulse(_), _) => Mode::Free,
            (None, Law::Row { .. }, Mode::Low | Mode::High) => last,
            (None, Law::Row { .. }, _) => Mode::Drive,
        }
    }

    /// (compliance, right-hand side) of the row on a branch; none: no row.
    pub fn row(&self, mode: Mode) -> Option<(f64, f64)> {
        match (mode, self.law) {
            (Mode::Drive, Law::Row { c, b }) => Some((c, b)),
            (Mode::LowerLimit, _) => Some((0.0, self.limits[0])),
            (Mode::UpperLimit, _) => Some((0.0, self.limits[1])),
            (Mode::Blocked, _) => Some((0.0, self.brake.unwrap_or(0.0))),
            _ => None,
        }
    }

    /// Impulse that acts from outside on a branch without a row.
    pub fn impulse(&self, mode: Mode) -> f64 {
        match (mode, self.law) {
            (Mode::Low, _) => -self.bound,
            (Mode::High, _) => self.bound,
            (Mode::Free, Law::Impulse(impulse)) => impulse,
            _ => 0.0,
        }
    }

    /// Impulse of the motor alone at the rate u where the axis has the total impulse λ.
    pub fn motor_impulse(&self, mode: Mode, u: f64, lambda: f64) -> f64 {
        match (mode, self.law) {
            (Mode::Drive, _) => lambda.clamp(-self.bound, self.bound),
            (Mode::Free | Mode::Low | Mode::High, _) => self.impulse(mode),
            (_, Law::Impulse(impulse)) => impulse,
            (_, Law::Row { c, b }) if c > 0.0 => ((b - u) / c).clamp(-self.bound, self.bound),
            // A velocity motor against a stop pushes with all it has.
            (_, Law::Row { b, .. }) if (b - u).abs() > RATE_TOLERANCE => self.bound.copysign(b - u),
            _ => 0.0,
        }
    }

    /// The branch on which (u, λ), the solution on `mode`, belongs.
    pub fn next(&self, mode: Mode, u: f64, lambda: f64) -> Mode {
        match mode {
            Mode::Blocked => mode,
            Mode::LowerLimit if lambda - self.motor_impulse(mode, u, lambda) >= -self.slack() => mode,
            Mode::UpperLimit if lambda - self.motor_impulse(mode, u, lambda) <= self.slack() => mode,
            Mode::LowerLimit | Mode::UpperLimit => self.branch_of_motor(u),
            _ if u < self.limits[0] - RATE_TOLERANCE => Mode::LowerLimit,
            _ if u > self.limits[1] + RATE_TOLERANCE => Mode::UpperLimit,
            Mode::Drive if lambda > self.bound + self.slack() => Mode::High,
            Mode::Drive if lambda < -self.bound - self.slack() => Mode::Low,
            Mode::High if self.wants(u) < self.bound => Mode::Drive,
            Mode::Low if self.wants(u) > -self.bound => Mode::Drive,
            _ => mode,
        }
    }

    /// Impulse of the law at the rate u without the bound; ±∞ for a velocity motor off its target.
    fn wants(&self, u: f64) -> f64 {
        match self.law {
            Law::Impulse(impulse) => impulse,
            Law::Row { c, b } if c > 0.0 => (b - u) / c,
            Law::Row { b, .. } if b == u => 0.0,
            Law::Row { b, .. } => f64::INFINITY.copysign(b - u),
        }
    }

    fn branch_of_motor(&self, u: f64) -> Mode {
        match self.law {
            Law::Impulse(_) => Mode::Free,
            Law::Row { .. } if self.wants(u) >= self.bound => Mode::High,
            Law::Row { .. } if self.wants(u) <= -self.bound => Mode::Low,
            Law::Row { .. } => Mode::Drive,
        }
    }

    fn slack(&self) -> f64 {
        1e-13 * self.bound
    }
}
