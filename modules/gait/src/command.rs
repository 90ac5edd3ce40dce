//! Commands of the walker, with its measurements.

use crate::geometry::LEGS;
use crate::pattern::Pattern;

/// Commands and measurements of the walker; may change before every step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Command {
    /// Forward speed, m/s.
    pub speed: f64,
    /// Turn rate, rad/s; the heading to be held turns with it.
    pub turn_rate: f64,
    /// Heading in the world at the start, rad.
    pub heading: f64,
    /// Height of the swing, m.
    pub lift: f64,
    /// Pattern; a change stops the robot first.
    pub pattern: Pattern,
    /// Whether the tilt corrects the feet.
    pub posture_feedback: bool,
    /// Whether the heading error turns the robot.
    pub heading_feedback: bool,
    /// Measured roll, pitch and yaw of the body, rad.
    pub attitude: [f64; 3],
    /// Measured normal force on each foot, N; none where it was never set.
    pub contact: [Option<f64>; LEGS],
}

terraglue_subsystem::persist!(Command {
    speed,
    turn_rate,
    heading,
    lift,
    pattern,
    posture_feedback,
    heading_feedback,
    attitude,
    contact,
});
