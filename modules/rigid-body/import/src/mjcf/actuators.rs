//! Actuators: how the joints of the file are driven.

use super::MjcfReader;
use super::defaults::Element;
use crate::error::Error;
use crate::model::{Drive, DriveKind};
use roxmltree::Node;

/// Law of an actuator, along the coordinate of its transmission.
struct Law {
    kind: DriveKind,
    /// N m/rad and N m s/rad of a servo on the coordinate.
    stiffness: f64,
    damping: f64,
    /// Torque per control of a plain motor.
    gain: f64,
}

impl MjcfReader<'_, '_> {
    /// Reads a `<position>`, `<velocity>`, `<motor>` or a `<general>` that is one of them, which acts on a joint.
    pub(super) fn actuator(&mut self, node: Node) -> Result<(), Error> {
        let d = self.d;
        let e = d.element(node, None);
        let plain = |kind| Ok(Law { kind, stiffness: 0.0, damping: 0.0, gain: 1.0 });
        let law: Result<Law, String> = match node.tag_name().name() {
            "position" => Ok(Law {
                kind: DriveKind::Position,
                stiffness: d.not_negative(&e, "kp", "it would drive the joint away")?.unwrap_or(1.0),
                damping: d.not_negative(&e, "kv", "it would drive the joint on")?.unwrap_or(0.0),
                gain: 1.0,
            }),
            "velocity" => plain(DriveKind::Velocity),
            "motor" => plain(DriveKind::Torque),
            "general" => self.general(&e)?,
            _ => Err("is not supported and drives nothing".into()),
        };
        let law = match law {
            Ok(law) => law,
            Err(why) => {
                self.warn(node, &why);
                return Ok(());
            }
        };
        let Some(wanted) = d.text(&e, "joint") else {
            self.warn(node, "acts on no joint and drives nothing");
            return Ok(());
        };
        // MuJoCo's servo on a rate is a damper; ours hold the rate within the torque.
        if law.kind == DriveKind::Velocity {
            self.warn(node, "holds its rate rigidly within the largest torque; its gain is not used");
        }
        // Along the joint instead of the transmission, whose coordinate is gear times the joint's.
        let gear = d.first(&e, "gear")?.unwrap_or(1.0);
        let max_torque = self.bound(&e, &law)?.map(|force| gear.abs() * force);
        let (stiffness, damping) = (gear * gear * law.stiffness, gear * gear * law.damping);
        let joint = self.robot.joints.iter_mut().find(|j| j.name == wanted);
        let Some(joint) = joint else {
            return Err(d.wrong(&e, format!("there is no joint `{wanted}`")));
        };
        joint.data.drive = Some(Drive { kind: law.kind, stiffness, damping, max_torque });
        Ok(())
    }

    /// force = gain·control + b0 + b1·coordinate + b2·rate: a motor, or a servo on coordinate or rate.
    fn general(&self, e: &Element) -> Result<Result<Law, String>, Error> {
        let d = self.d;
        for (name, usual) in [("dyntype", "none"), ("gaintype", "fixed")] {
            if let Some(other) = d.text(e, name).filter(|t| *t != usual) {
                return Ok(Err(format!("with {name} = \"{other}\" is not supported and drives nothing")));
            }
        }
        let numbers = |name: &str| d.numbers(e, name).map(Option::unwrap_or_default);
        let at = |list: &[f64], k: usize| list.get(k).copied().unwrap_or(0.0);
        let gain = numbers("gainprm")?.first().copied().unwrap_or(1.0);
        let biased = match d.text(e, "biastype") {
            None | Some("none") => false,
            Some("affine") => true,
            Some(other) => {
                return Ok(Err(format!("with biastype = \"{other}\" is not supported and drives nothing")));
            }
        };
        let bias = numbers("biasprm")?;
        let bias: [f64; 3] = std::array::from_fn(|k| if biased { at(&bias, k) } else { 0.0 });
        Ok(match bias {
            [0.0, 0.0, 0.0] => Ok(Law { kind: DriveKind::Torque, stiffness: 0.0, damping: 0.0, gain }),
            [0.0, b1, b2] if b1 < 0.0 && b1 == -gain && b2 <= 0.0 => {
                Ok(Law { kind: DriveKind::Position, stiffness: gain, damping: -b2, gain })
            }
            [0.0, 0.0, b2] if b2 < 0.0 && b2 == -gain => {
                Ok(Law { kind: DriveKind::Velocity, stiffness: 0.0, damping: 0.0, gain })
            }
            _ => Err(format!(
                "with gain {gain} and bias {bias:?} is neither a motor nor a servo on coordinate or rate; it drives nothing"
            )),
        })
    }

    /// Largest magnitude of the force along the transmission: of the force itself, for a motor also by the control.
    fn bound(&self, e: &Element, law: &Law) -> Result<Option<f64>, Error> {
        let largest = |name: &str, switch: &str| -> Result<Option<f64>, Error> {
            let off = self.d.choice(e, switch, &["true", "false", "auto"])? == Some("false");
            let range = self.d.numbers(e, name)?.filter(|_| !off);
            if let Some(bad) = range.as_ref().filter(|r| r.len() != 2 || r[0] > r[1]) {
                return Err(self
                    .d
                    .wrong(e, format!("{name} = {bad:?} is not a smallest and a largest number")));
            }
            Ok(range.map(|r| r.iter().fold(0.0_f64, |m, x| m.max(x.abs()))))
        };
        let force = largest("forcerange", "forcelimited")?;
        if law.kind != DriveKind::Torque {
            return Ok(force);
        }
        let control = largest("ctrlrange", "ctrllimited")?.map(|c| law.gain.abs() * c);
        Ok(match (force, control) {
            (Some(f), Some(c)) => Some(f.min(c)),
            (f, c) => f.or(c),
        })
    }
}
