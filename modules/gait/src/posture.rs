//! The loop that is closed through the robot: measured tilt and heading correct the feet.
//!
//! Tilt: roll and pitch are smoothed, and a proportional and an integral part tilt the plane of the feet in the body
//! frame against them: the low side is pushed out, the high side drawn in. Heading: the error turns the body.

/// Gains and limits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gains {
    /// Time constant of the smoothing of roll and pitch, s.
    pub smoothing_s: f64,
    /// Proportional gain of the tilt, dimensionless.
    pub tilt: f64,
    /// Integral gain of the tilt, 1/s.
    pub tilt_integral: f64,
    /// Largest tilt of the plane of the feet, rad.
    pub tilt_limit: f64,
    /// Turn rate per heading error, 1/s.
    pub heading: f64,
    /// Largest turn rate of the heading correction, rad/s.
    pub turn_limit: f64,
}

/// Smoothed tilt and its integral.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Posture {
    smooth: [f64; 2],
    integral: [f64; 2],
    /// Tilt of the plane of the feet about x and y in the body frame that is in force, rad.
    pub correction: [f64; 2],
}

impl Posture {
    /// Moves on by `dt` s with the measured roll and pitch (rad). Switched off, the correction fades out with the
    /// time constant of the smoothing.
    pub fn advance(&mut self, gains: &Gains, enabled: bool, tilt: [f64; 2], dt: f64) {
        let share = dt / (gains.smoothing_s + dt);
        let mut wanted = [0.0; 2];
        for axis in 0..2 {
            self.smooth[axis] += share * (tilt[axis] - self.smooth[axis]);
            if enabled {
                self.integral[axis] += gains.tilt_integral * self.smooth[axis] * dt;
                wanted[axis] = self.integral[axis] + gains.tilt * self.smooth[axis];
            } else {
                self.integral[axis] -= share * self.integral[axis];
            }
        }
        self.integral = within(self.integral, gains.tilt_limit);
        let wanted = within(wanted, gains.tilt_limit);
        for (correction, wanted) in self.correction.iter_mut().zip(wanted) {
            *correction += share * (wanted - *correction);
        }
    }

    /// By how much the foot at `p` (body frame, m) is raised, m. Positive roll lifts the left side (y > 0): its feet
    /// are drawn in. Positive pitch lowers the nose (x > 0): its feet are pushed out.
    pub fn raise(&self, p: [f64; 2]) -> f64 {
        self.correction[0] * p[1] - self.correction[1] * p[0]
    }
}

/// The vector, shortened to the limit.
fn within(tilt: [f64; 2], limit: f64) -> [f64; 2] {
    let size = libm::hypot(tilt[0], tilt[1]);
    if size > limit { tilt.map(|t| t * (limit / size)) } else { tilt }
}

/// Turn rate that corrects a heading error, rad/s; the error is taken the short way round.
pub fn turn_towards(gains: &Gains, heading: f64, yaw: f64) -> f64 {
    (gains.heading * wrap(heading - yaw)).clamp(-gains.turn_limit, gains.turn_limit)
}

/// An angle as −π … π, rad.
pub fn wrap(angle: f64) -> f64 {
    libm::atan2(libm::sin(angle), libm::cos(angle))
}

terraglue_subsystem::persist!(Posture { smooth, integral, correction });
