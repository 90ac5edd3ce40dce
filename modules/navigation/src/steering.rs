//! The geometry of a machine that bends in the middle.

/// Lengths of a machine with a steering joint between two frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Steering {
    /// From the middle of the front wheels to the joint, m.
    pub front_m: f64,
    /// From the joint to the middle of the rear wheels, m.
    pub rear_m: f64,
    /// Largest angle of the joint, rad.
    pub most_rad: f64,
}

impl Steering {
    /// Curvature of the way of the front frame at an angle that stays, 1/m: sin γ/(l1 cos γ + l2) (P. I. Corke and P. Ridley, "Steering
    /// kinematics for a center-articulated mobile robot", 2001, with the rate of γ left out).
    pub fn curvature(&self, angle: f64) -> f64 {
        let length = self.front_m * libm::cos(angle) + self.rear_m;
        if length > 0.0 { libm::sin(angle) / length } else { 0.0 }
    }

    /// Angle that makes a curvature, within the limits of the joint: sin γ − κ l1 cos γ = κ l2, solved for γ.
    pub fn angle(&self, curvature: f64) -> f64 {
        let (a, b) = (curvature * self.front_m, curvature * self.rear_m);
        let length = libm::sqrt(1.0 + a * a);
        let angle = libm::asin((b / length).clamp(-1.0, 1.0)) + libm::atan(a);
        angle.clamp(-self.most_rad, self.most_rad)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_angle_makes_the_curvature_that_was_asked_for() {
        let steering = Steering { front_m: 1.6, rear_m: 2.0, most_rad: 0.75 };
        for curvature in [-0.15, -0.02, 0.0, 0.05, 0.15] {
            assert!((steering.curvature(steering.angle(curvature)) - curvature).abs() < 1e-12);
        }
        assert_eq!(steering.angle(9.0), 0.75);
    }
}
