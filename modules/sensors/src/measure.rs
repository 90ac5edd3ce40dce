//! Measurements of the sensors that sit on a body, without any error.

use crate::kind::{MOST, SensorKind};
use terraglue_subsystem::{Mount, Pose, Ray, RayHit, RayMask, Result, World, persist};

/// The sensor at its last sample: an accelerometer reports the mean between two samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Before {
    pub time: f64,
    pub velocity: [f64; 3],
    pub orientation: [f64; 4],
}
persist!(Before { time, velocity, orientation });

impl Before {
    /// The orientation half way from there to another, which is less than half a turn away.
    fn half_way(&self, to: [f64; 4]) -> [f64; 4] {
        let along: f64 = (0..4).map(|k| self.orientation[k] * to[k]).sum();
        let sum: [f64; 4] = std::array::from_fn(|k| self.orientation[k] * along.signum() + to[k]);
        let length = sum.iter().map(|c| c * c).sum::<f64>().sqrt();
        sum.map(|c| c / length)
    }
}

/// True values of all channels at a time, and the switch.
pub(crate) struct Truth {
    pub values: [f64; MOST],
    pub switch: bool,
}

/// Specific force, the mean since the sample before in the axes half way, and angular rate, both in the axes of the sensor. Without a
/// sample before, or at its time, the sensor counts as not accelerated.
pub(crate) fn imu(
    mount: &mut Mount,
    world: &dyn World,
    time: f64,
    gravity: [f64; 3],
    before: &mut Option<Before>,
) -> Result<Truth> {
    let state = mount.state(world, time)?;
    let velocity = state.linear_velocity;
    let orientation = state.world_from_body.orientation;
    let (acceleration, axes) = match before {
        Some(b) if time > b.time => {
            ([0, 1, 2].map(|k| (velocity[k] - b.velocity[k]) / (time - b.time)), b.half_way(orientation))
        }
        _ => ([0.0; 3], orientation),
    };
    *before = Some(Before { time, velocity, orientation });
    let felt = [0, 1, 2].map(|k| acceleration[k] - gravity[k]);
    let [x, y, z] = Pose { orientation: axes, ..Pose::IDENTITY }.turned_back(felt);
    let [p, q, r] = state.world_from_body.turned_back(state.angular_velocity);
    Ok(Truth { values: [x, y, z, p, q, r], switch: false })
}

/// Roll and pitch of the sensor: turned by pitch about its y and then by roll about its new x, a level sensor has these axes. Both follow
/// from the direction of gravity, as an accelerometer at rest or a vertical gyroscope shows it; a turn about it does not matter.
pub(crate) fn inclination(
    mount: &mut Mount,
    world: &dyn World,
    time: f64,
    gravity: [f64; 3],
) -> Result<Truth> {
    let [x, y, z] = mount.state(world, time)?.world_from_body.turned_back(gravity.map(|g| -g));
    let mut values = [0.0; MOST];
    values[0] = libm::atan2(y, z);
    values[1] = libm::atan2(-x, libm::hypot(y, z));
    Ok(Truth { values, switch: false })
}

/// Distance along x of the sensor; `range_m` where nothing is met. The body that it sits on is not met.
pub(crate) fn range(mount: &mut Mount, world: &dyn World, time: f64, range_m: f64) -> Result<Truth> {
    let (body, pose) = (mount.find(world)?, mount.state(world, time)?.world_from_body);
    let ray = Ray { origin: pose.position, direction: pose.turned([1.0, 0.0, 0.0]), time, range: range_m };
    let mut hits = [RayHit::MISS];
    world.cast_rays(&[ray], &RayMask::without(body), &mut hits);
    let mut values = [0.0; MOST];
    values[0] = hits[0].distance.min(range_m);
    Ok(Truth { values, switch: hits[0].is_hit() })
}

/// Measurement of a sensor from its inputs.
pub(crate) fn inputs(kind: SensorKind, values: [f64; MOST], threshold_n: f64, was: bool) -> Truth {
    let limit = if was { 0.5 * threshold_n } else { threshold_n };
    let pressed = values[0] > 0.0 && values[0] >= limit;
    Truth { values, switch: kind == SensorKind::ContactSwitch && pressed }
}
