//! The loop that is closed through the robot: measured tilt and heading correct the feet.
//!
//! Tilt: roll and pitch are smoothed, and a proportional and an integral part tilt the plane of the feet in the body
//! frame against them: the low side is pushed out, the high side drawn in. Heading: the smoothed error turns the body; taken
//! as it is measured, it feeds the vibration of legs and ground about the vertical.

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
    /// Time constant of the smoothing of the heading error, s.
    pub heading_smoothing_s: f64,
    /// Turn rate per heading error, 1/s.
    pub heading: f64,
    /// Largest turn rate of the heading correction, rad/s.
    pub turn_limit: f64,
}

/// Smoothed tilt and its integral, smoothed heading error.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Posture {
    smooth: [f64; 2],
    integral: [f64; 2],
    heading_error: f64,
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

    /// Turn rate that corrects the error of the heading (rad, wanted less measured, the short way round), rad/s; moves on by
    /// `dt` s.
    pub fn turn(&mut self, gains: &Gains, error: f64, dt: f64) -> f64 {
        let share = dt / (gains.heading_smoothing_s + dt);
        self.heading_error = wrap(self.heading_error + share * wrap(error - self.heading_error));
        (gains.heading * self.heading_error).clamp(-gains.turn_limit, gains.turn_limit)
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

/// An angle as −π … π, rad.
pub fn wrap(angle: f64) -> f64 {
    libm::atan2(libm::sin(angle), libm::cos(angle))
}

terraglue_subsystem::persist!(Posture { smooth, integral, heading_error, correction });
