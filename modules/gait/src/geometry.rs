//! Kinematics of a leg: a yaw joint at the hip, then three pitch joints; forward and inverse.
//!
//! The three pitch joints leave one freedom in the plane of the leg. It is spent on the last link, which stays
//! vertical in the body frame: the foot then stands upright in the soil whatever the stride.

/// Names of the legs: left and right, front, middle and rear. The order of all arrays over legs.
pub const LEG_NAMES: [&str; LEGS] = ["LF", "LM", "LR", "RF", "RM", "RR"];
/// Number of legs.
pub const LEGS: usize = 6;
/// Joints of a leg.
pub const JOINTS: usize = 4;

/// Part of the full reach that is left unused, so that the knee never straightens or folds completely:
/// near that the joint rates grow without bound.
const REACH_MARGIN: f64 = 0.03;

/// Lengths and mounting of one leg.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leg {
    /// Hip joint in the body frame, m.
    pub hip: [f64; 3],
    /// Direction of the stretched leg about the body's z axis at j1 = 0, rad.
    pub yaw: f64,
    /// Lengths of the four links, m.
    pub links: [f64; 4],
}

/// Joint angles of a leg and whether the foot position had to be pulled into reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solution {
    /// Angles of joints 1 to 4, rad; the pitch joints turn about −y, so positive angles lift the foot.
    pub angles: [f64; JOINTS],
    /// Whether the position was out of reach and the nearest reachable one along the same ray was taken.
    pub clipped: bool,
}

impl Leg {
    /// Foot centre in the body frame (m) at the given joint angles (rad).
    pub fn forward(&self, angles: &[f64; JOINTS]) -> [f64; 3] {
        let [l1, l2, l3, l4] = self.links;
        let a2 = angles[1];
        let a3 = a2 + angles[2];
        let a4 = a3 + angles[3];
        let radius = l1 + l2 * libm::cos(a2) + l3 * libm::cos(a3) + l4 * libm::cos(a4);
        let height = l2 * libm::sin(a2) + l3 * libm::sin(a3) + l4 * libm::sin(a4);
        let direction = self.yaw + angles[0];
        [
            self.hip[0] + radius * libm::cos(direction),
            self.hip[1] + radius * libm::sin(direction),
            self.hip[2] + height,
        ]
    }

    /// Joint angles that bring the foot centre to `foot` (body frame, m) with the last link vertical and the knee up.
    pub fn inverse(&self, foot: [f64; 3]) -> Solution {
        let [l1, l2, l3, l4] = self.links;
        let (sin, cos) = (libm::sin(self.yaw), libm::cos(self.yaw));
        let (dx, dy) = (foot[0] - self.hip[0], foot[1] - self.hip[1]);
        let (outward, sideways) = (cos * dx + sin * dy, cos * dy - sin * dx);
        let radius = libm::hypot(outward, sideways);
        let (wrist, clipped) = self.pulled_into_reach([radius - l1, foot[2] - self.hip[2] + l4]);
        let square = wrist[0] * wrist[0] + wrist[1] * wrist[1];
        let knee = -libm::acos(((square - l2 * l2 - l3 * l3) / (2.0 * l2 * l3)).clamp(-1.0, 1.0));
        let lead = libm::atan2(l3 * libm::sin(knee), l2 + l3 * libm::cos(knee));
        let shoulder = libm::atan2(wrist[1], wrist[0]) - lead;
        let ankle = -std::f64::consts::FRAC_PI_2 - shoulder - knee;
        Solution { angles: [libm::atan2(sideways, outward), shoulder, knee, ankle], clipped }
    }

    /// Smallest and largest distance of joint 4 from joint 2 that is used, m.
    pub fn reach(&self) -> [f64; 2] {
        let [_, l2, l3, _] = self.links;
        [(l2 - l3).abs() + REACH_MARGIN * (l2 + l3), (1.0 - REACH_MARGIN) * (l2 + l3)]
    }

    /// Largest distance of the foot forward of the hip (m) when it is `outward` m outward of and `below` m under it;
    /// None: it cannot stand there.
    pub fn stride_reach(&self, outward: f64, below: f64) -> Option<f64> {
        let [_, largest] = self.reach();
        let drop = self.links[3] - below;
        let radius = self.links[0] + root(largest * largest - drop * drop)?;
        root(radius * radius - outward * outward)
    }

    fn pulled_into_reach(&self, wrist: [f64; 2]) -> ([f64; 2], bool) {
        let [least, largest] = self.reach();
        let distance = libm::hypot(wrist[0], wrist[1]);
        if distance >= least && distance <= largest {
            return (wrist, false);
        }
        if distance < 1e-9 {
            return ([least, 0.0], true);
        }
        let scale = distance.clamp(least, largest) / distance;
        ([wrist[0] * scale, wrist[1] * scale], true)
    }
}

fn root(square: f64) -> Option<f64> {
    (square >= 0.0).then(|| square.sqrt())
}
