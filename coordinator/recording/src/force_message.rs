//! The forces that act on the bodies where they touch the ground: arrows for viewers that draw primitives, rows of
//! points for those that do not.

use crate::layout::timestamp;
use crate::point_cloud::Points;
use crate::scene_message::{along, quaternion, vector};
use foxglove::messages::{ArrowPrimitive, Color, Duration, PointCloud, Pose, SceneEntity, SceneUpdate};
use terraglue_engine::observer::View;
use terraglue_gluing::PortReport;
use terraglue_subsystem::{Kind, Pose as OwnPose};

/// Forces are drawn this often; the numbers are in `/gluing` and `/<subsystem>` at every record, s.
pub(crate) const DRAWN_EVERY_S: f64 = 0.02;
/// Length of an arrow as heavy as all robots, m.
const WEIGHT_LENGTH_M: f64 = 0.5;
const COLOUR: [u8; 3] = [0xd6, 0x27, 0x28];
/// Points of a row after its first.
const ROW: u32 = 8;

/// Draws forces to scale.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Forces {
    /// Length of an arrow, m/N.
    pub metres_per_newton: f64,
}

impl Forces {
    /// The scale for the weight of all robots under this gravity; without either, for 10 N.
    pub fn new(view: &View, gravity_m_s2: f64) -> Self {
        let robots = view.subsystems.iter().filter(|s| s.kind == Kind::Robot);
        let mass: f64 = robots.flat_map(|s| &s.scene.bodies).map(|b| b.mass).filter(|m| m.is_finite()).sum();
        let weight = if mass * gravity_m_s2 > 0.0 { mass * gravity_m_s2 } else { 10.0 };
        Self { metres_per_newton: WEIGHT_LENGTH_M / weight }
    }

    /// Tail and vector of every force as it is drawn.
    fn drawn<'a>(&'a self, ports: &'a [PortReport]) -> impl Iterator<Item = ([f64; 3], [f64; 3], f64)> + 'a {
        ports.iter().filter_map(|port| {
            let axis = |k: usize| {
                (0..3).map(|a| port.frame[3 * a + k] * port.wrench[a]).sum::<f64>() * self.metres_per_newton
            };
            let force = [axis(0), axis(1), axis(2)];
            let length = force.iter().map(|f| f * f).sum::<f64>().sqrt();
            (length > 0.0).then_some((port.origin, force, length))
        })
    }

    /// Arrows in the world; they replace those before.
    pub fn arrows(&self, view: &View) -> SceneUpdate {
        let [r, g, b] = COLOUR.map(|c| f64::from(c) / 255.0);
        let arrow = |(tail, force, length): ([f64; 3], [f64; 3], f64)| {
            // Drawings need no more than single precision, and fewer digits take less room.
            let coarse = |x: f64| f64::from(x as f32);
            ArrowPrimitive {
                pose: Some(Pose {
                    position: Some(vector(tail.map(coarse))),
                    orientation: Some(quaternion(along(force, length).map(coarse))),
                }),
                shaft_length: coarse(0.8 * length),
                shaft_diameter: 0.012,
                head_length: coarse(0.2 * length),
                head_diameter: 0.03,
                color: Some(Color { r, g, b, a: 1.0 }),
            }
        };
        let entity = SceneEntity {
            timestamp: Some(timestamp(view.t_s)),
            frame_id: "world".into(),
            id: "contact_forces".into(),
            lifetime: Some(Duration::new(0, 0)),
            arrows: self.drawn(&view.gluing.ports).map(arrow).collect(),
            ..SceneEntity::default()
        };
        SceneUpdate { deletions: Vec::new(), entities: vec![entity] }
    }

    /// Rows of points along the same arrows; each point carries the force, N.
    pub fn points(&self, view: &View) -> PointCloud {
        let mut points = Points::new("force");
        for (tail, force, length) in self.drawn(&view.gluing.ports) {
            for k in 0..=ROW {
                let share = f64::from(k) / f64::from(ROW);
                let at = [0, 1, 2].map(|axis| rounded(tail[axis] + share * force[axis]));
                points.push(at, COLOUR, (length / self.metres_per_newton) as f32);
            }
        }
        points.message(view.t_s, "world", &OwnPose::IDENTITY)
    }
}

/// To an eighth of a millimetre.
fn rounded(x: f64) -> f64 {
    (x * 8192.0).round() / 8192.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_arrow_points_along_its_force() {
        for v in [[0.0, 0.0, 2.0], [0.3, -0.4, 1.2], [-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]] {
            let length = f64::sqrt(v.iter().map(|c| c * c).sum());
            let [w, x, y, z] = along(v, length);
            // First column of the rotation matrix.
            let turned = [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)];
            for (a, b) in turned.iter().zip(v) {
                assert!((a * length - b).abs() < 1e-12, "{v:?} {turned:?}");
            }
        }
    }
}
