//! Actuators: how the joints of the file are driven.

use super::Reader;
use super::defaults::Element;
use crate::error::Error;
use crate::model::{Drive, DriveKind};
use roxmltree::Node;

impl Reader<'_, '_> {
    /// Reads a `<position>`, `<velocity>` or `<motor>` that acts on a joint.
    pub(super) fn actuator(&mut self, node: Node) -> Result<(), Error> {
        let d = self.d;
        let e = d.element(node, None);
        let kind = match node.tag_name().name() {
            "position" => DriveKind::Position,
            "velocity" => DriveKind::Velocity,
            "motor" => DriveKind::Torque,
            _ => {
                self.warn(node, "is not supported and drives nothing");
                return Ok(());
            }
        };
        let Some(wanted) = d.text(&e, "joint") else {
            self.warn(node, "acts on no joint and drives nothing");
            return Ok(());
        };
        let gear = d.number(&e, "gear")?.unwrap_or(1.0);
        if gear != 1.0 && kind != DriveKind::Torque {
            self.warn(node, "has a gear, which is supported for <motor> only: it is taken as 1");
        }
        // MuJoCo's servo on a rate is a damper; ours hold the rate within the torque.
        let (stiffness, damping) = match kind {
            DriveKind::Position => (d.number(&e, "kp")?.unwrap_or(1.0), d.number(&e, "kv")?.unwrap_or(0.0)),
            _ => (0.0, 0.0),
        };
        if kind == DriveKind::Velocity {
            self.warn(node, "holds its rate rigidly within the largest torque; its gain `kv` is not used");
        }
        let max_torque = self.bound(&e, kind, gear)?;
        let joint = self.robot.joints.iter_mut().find(|j| j.name == wanted);
        let Some(joint) = joint else {
            return Err(d.wrong(&e, format!("there is no joint `{wanted}`")));
        };
        joint.data.drive = Some(Drive { kind, stiffness, damping, max_torque });
        Ok(())
    }

    /// Largest magnitude of the torque: of the force, for a motor also of the control.
    fn bound(&self, e: &Element, kind: DriveKind, gear: f64) -> Result<Option<f64>, Error> {
        let largest = |name: &str| -> Result<Option<f64>, Error> {
            Ok(self.d.numbers(e, name)?.map(|r| r.iter().fold(0.0_f64, |m, x| m.max(x.abs()))))
        };
        let gear = if kind == DriveKind::Torque { gear.abs() } else { 1.0 };
        let force = largest("forcerange")?;
        let control = if kind == DriveKind::Torque { largest("ctrlrange")? } else { None };
        Ok(force.or(control).map(|f| gear * f))
    }
}
