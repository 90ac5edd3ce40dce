//! Mounts of sensors: `mount = "robot.body"` and an offset, instead of connections for seven numbers of a pose.

use crate::config::Config;
use crate::error::{Error, Result};
use crate::pose::{BodyState, Pose};
use crate::schema::{Parameter, ParameterType};
use crate::world::{BodyRef, World};

/// A place on a body of another subsystem.
///
/// ```
/// use terraglue_subsystem::{Config, Mount};
/// let config = Config::parse(r#"{"mount": "robot.mast", "mount_offset": [0, 0, 0.3]}"#)?;
/// let mount = Mount::from_config(&config)?;
/// assert_eq!((mount.subsystem(), mount.body()), ("robot", "mast"));
/// assert_eq!(mount.body_from_sensor().position, [0.0, 0.0, 0.3]);
/// # Ok::<(), terraglue_subsystem::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Mount {
    subsystem: String,
    body: String,
    body_from_sensor: Pose,
    found: Option<BodyRef>,
}

impl Mount {
    /// The parameter that names the body; the host refuses one that there is not.
    pub const KEY: &'static str = "mount";
    /// The parameter of the offset.
    pub const OFFSET: &'static str = "mount_offset";

    /// The parameters that [`Mount::from_config`] reads, for a schema.
    pub fn parameters() -> [Parameter; 2] {
        let help = "Body that it sits on: SUBSYSTEM.BODY";
        let offset =
            "Place on the body (m), and behind it the orientation as quaternion w, x, y, z; 3 or 7 numbers";
        [
            Parameter::of(Self::KEY, ParameterType::Text, help),
            Parameter::of(Self::OFFSET, ParameterType::Numbers, offset)
                .or(serde_json::json!([0.0, 0.0, 0.0])),
        ]
    }

    /// From the parameters of an instance.
    ///
    /// # Errors
    /// [`Error::Refused`]: no subsystem and body, or an offset of neither three nor seven numbers.
    pub fn from_config(config: &Config) -> Result<Self> {
        let name = config.text(Self::KEY)?;
        let parts =
            name.split_once('.').filter(|(subsystem, body)| !subsystem.is_empty() && !body.is_empty());
        let (subsystem, body) = parts.ok_or_else(|| {
            Error::Refused(format!("parameter `{}` = \"{name}\" is not SUBSYSTEM.BODY", Self::KEY))
        })?;
        let offset = config.numbers(Self::OFFSET)?;
        Ok(Self {
            subsystem: subsystem.to_owned(),
            body: body.to_owned(),
            body_from_sensor: pose_of(&offset)?,
            found: None,
        })
    }

    /// Name of the subsystem.
    pub fn subsystem(&self) -> &str {
        &self.subsystem
    }

    /// Name of the body.
    pub fn body(&self) -> &str {
        &self.body
    }

    /// Pose of the sensor in the frame of the body.
    pub fn body_from_sensor(&self) -> &Pose {
        &self.body_from_sensor
    }

    /// The body in a world; looked up once.
    ///
    /// # Errors
    /// [`Error::Failed`]: there is no such body.
    pub fn find(&mut self, world: &dyn World) -> Result<BodyRef> {
        if let Some(found) = self.found {
            return Ok(found);
        }
        let found = world.body(&self.subsystem, &self.body);
        let missing = || Error::Failed(format!("there is no body `{}.{}`", self.subsystem, self.body));
        self.found = Some(found.ok_or_else(missing)?);
        self.found.ok_or_else(missing)
    }

    /// Pose and twist of the sensor at a time.
    ///
    /// # Errors
    /// [`Error::Failed`]: there is no such body.
    pub fn state(&mut self, world: &dyn World, time: f64) -> Result<BodyState> {
        let body = self.find(world)?;
        let gone = || Error::Failed(format!("the body `{}.{}` has no pose", self.subsystem, self.body));
        Ok(carried(&world.pose(body, time).ok_or_else(gone)?, &self.body_from_sensor))
    }
}

fn pose_of(offset: &[f64]) -> Result<Pose> {
    let wrong = |why: &str| Error::Refused(format!("parameter `{}`: {why}", Mount::OFFSET));
    if offset.iter().any(|x| !x.is_finite()) {
        return Err(wrong("a number is not finite"));
    }
    let (position, turn) = match *offset {
        [] => ([0.0; 3], Pose::IDENTITY.orientation),
        [x, y, z] => ([x, y, z], Pose::IDENTITY.orientation),
        [x, y, z, w, i, j, k] => ([x, y, z], [w, i, j, k]),
        _ => return Err(wrong("3 numbers for the place, or 7 with the orientation")),
    };
    let length = turn.iter().map(|q| q * q).sum::<f64>().sqrt();
    if length < 1e-6 {
        return Err(wrong("the quaternion has no length"));
    }
    Ok(Pose { position, orientation: turn.map(|q| q / length) })
}

/// State of a frame that sits on a body.
fn carried(body: &BodyState, from: &Pose) -> BodyState {
    let arm = turned(body.world_from_body.orientation, from.position);
    let swing = cross(body.angular_velocity, arm);
    let plus = |a: [f64; 3], b: [f64; 3]| [0, 1, 2].map(|k| a[k] + b[k]);
    BodyState {
        world_from_body: Pose {
            position: plus(body.world_from_body.position, arm),
            orientation: product(body.world_from_body.orientation, from.orientation),
        },
        linear_velocity: plus(body.linear_velocity, swing),
        angular_velocity: body.angular_velocity,
    }
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// First b, then a.
fn product([aw, ax, ay, az]: [f64; 4], [bw, bx, by, bz]: [f64; 4]) -> [f64; 4] {
    [
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    ]
}

impl Pose {
    /// A direction of this frame in the frame that it lies in.
    pub fn turned(&self, v: [f64; 3]) -> [f64; 3] {
        turned(self.orientation, v)
    }

    /// A point of this frame in the frame that it lies in, m.
    pub fn point(&self, at: [f64; 3]) -> [f64; 3] {
        let aside = self.turned(at);
        [0, 1, 2].map(|k| self.position[k] + aside[k])
    }

    /// A direction of the outer frame in this one.
    pub fn turned_back(&self, v: [f64; 3]) -> [f64; 3] {
        let [w, x, y, z] = self.orientation;
        turned([w, -x, -y, -z], v)
    }
}

fn turned([w, x, y, z]: [f64; 4], v: [f64; 3]) -> [f64; 3] {
    let u = [x, y, z];
    let twice = cross(u, v).map(|c| 2.0 * c);
    let again = cross(u, twice);
    [0, 1, 2].map(|k| v[k] + w * twice[k] + again[k])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mount(json: &str) -> Result<Mount> {
        Mount::from_config(&Config::parse(json)?)
    }

    #[test]
    fn a_place_on_a_turning_body_moves_with_it() {
        let quarter = std::f64::consts::FRAC_1_SQRT_2;
        let world_from_body = Pose { position: [1.0, 2.0, 3.0], orientation: [quarter, 0.0, 0.0, quarter] };
        let body = BodyState {
            world_from_body,
            linear_velocity: [0.5, 0.0, 0.0],
            angular_velocity: [0.0, 0.0, 2.0],
        };
        let sensor = carried(&body, &Pose { position: [0.1, 0.0, 0.2], ..Pose::IDENTITY });
        let near =
            |a: [f64; 3], b: [f64; 3]| assert!((0..3).all(|k| (a[k] - b[k]).abs() < 1e-15), "{a:?} {b:?}");
        near(sensor.world_from_body.position, [1.0, 2.1, 3.2]);
        near(sensor.linear_velocity, [0.5 - 0.2, 0.0, 0.0]);
        near(sensor.world_from_body.turned([1.0, 0.0, 0.0]), [0.0, 1.0, 0.0]);
        near(sensor.world_from_body.turned_back([0.0, 1.0, 0.0]), [1.0, 0.0, 0.0]);
    }

    #[test]
    fn names_and_offsets_that_make_no_sense_are_refused() {
        for bad in [
            r#"{"mount": "robot"}"#,
            r#"{"mount": ".mast"}"#,
            r#"{"mount": "robot.mast", "mount_offset": [1, 2]}"#,
            r#"{"mount": "robot.mast", "mount_offset": [0, 0, 0, 0, 0, 0, 0]}"#,
            r"{}",
        ] {
            assert!(matches!(mount(bad), Err(Error::Refused(_))), "{bad}");
        }
        let turned =
            mount(r#"{"mount": "robot.mast", "mount_offset": [0, 0, 0, 2, 0, 0, 0]}"#).expect("a turn");
        assert_eq!(turned.body_from_sensor(), &Pose::IDENTITY);
    }
}
