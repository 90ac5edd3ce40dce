//! Equality: constraints beyond the tree.

use super::MjcfReader;
use crate::error::Error;
use crate::model::{Coupling, JointKind, Loop};
use nalgebra::{Isometry3, Point3, Quaternion, Translation3, UnitQuaternion};
use roxmltree::Node;

/// A weld may start open by this, m or rad.
const OPEN: f64 = 1e-6;

impl MjcfReader<'_, '_> {
    /// Reads `<connect>`, `<weld>` and `<joint>`; others are named in a warning.
    pub(super) fn equality(&mut self, node: Node) -> Result<(), Error> {
        let e = self.d.element(node, None);
        if self.d.text(&e, "active") == Some("false") {
            self.warn(node, "is not active and is left out");
            return Ok(());
        }
        for soft in ["solref", "solimp"] {
            if self.d.text(&e, soft).is_some() {
                self.warn(node, &format!("holds rigidly: `{soft}` is not used"));
            }
        }
        match node.tag_name().name() {
            "joint" => self.coupling(node),
            "connect" | "weld" if node.attribute("site1").is_some() => {
                self.warn(
                    node,
                    "between sites is not supported and does nothing; name body1, body2 and anchor",
                );
                Ok(())
            }
            "connect" => self.closing(node, false),
            "weld" => self.closing(node, true),
            _ => {
                self.warn(node, "is not supported and does nothing");
                Ok(())
            }
        }
    }

    fn coupling(&mut self, node: Node) -> Result<(), Error> {
        let d = self.d;
        let e = d.element(node, None);
        let joint = |name: &str| {
            let wanted = node.attribute(name).unwrap_or_default();
            let moves = |k: JointKind| matches!(k, JointKind::Revolute | JointKind::Prismatic);
            let found = self.robot.joints.iter().position(|j| j.name == wanted && moves(j.kind));
            found.ok_or_else(|| {
                d.wrong(&e, format!("{name}: there is no joint `{wanted}` with one coordinate"))
            })
        };
        let (follower, leader) = (joint("joint1")?, joint("joint2")?);
        let polynomial = d.numbers(&e, "polycoef")?.unwrap_or_else(|| vec![0.0, 1.0]);
        let (offset, ratio) = (polynomial[0], polynomial.get(1).copied().unwrap_or(1.0));
        if follower == leader || polynomial.iter().skip(2).any(|c| *c != 0.0) {
            let problem =
                "couples two different joints by polycoef = \"a0 a1 0 0 0\"; others cannot be simulated";
            return Err(d.wrong(&e, problem.into()));
        }
        let name = self.coupling_name(node, "coupling");
        self.robot.couplings.push(Coupling { name, follower, leader, ratio, offset });
        Ok(())
    }

    fn closing(&mut self, node: Node, rigid: bool) -> Result<(), Error> {
        let d = self.d;
        let e = d.element(node, None);
        let end = |name: &str| match node.attribute(name) {
            None | Some("world") => Ok((None, Isometry3::identity())),
            Some(wanted) => {
                let found = self.frames.get(wanted).copied();
                found.ok_or_else(|| d.wrong(&e, format!("{name}: there is no body `{wanted}`")))
            }
        };
        let (first, second) = (end("body1")?, end("body2")?);
        if first.0 == second.0 {
            return Err(d.wrong(&e, "body1 and body2 do not move against each other".into()));
        }
        let anchor = d.vector(&e, "anchor")?;
        if !rigid && anchor.is_none() {
            return Err(d.wrong(&e, "needs an anchor".into()));
        }
        if rigid {
            self.starts_closed(node, [first, second])?;
        }
        // The anchor of <connect> is in the frame of body1, that of <weld> in body2's; a weld may be held anywhere.
        let anchor = anchor.filter(|_| !rigid).unwrap_or_default();
        let origin = (first.1 * Point3::from(anchor)).coords;
        let name = self.coupling_name(node, "equality");
        self.robot.loops.push(Loop { name, bodies: [first.0, second.0], origin, rigid });
        Ok(())
    }

    /// A relative pose that is given must be that of the file: the bodies are welded as they stand.
    fn starts_closed(&self, node: Node, ends: [(Option<usize>, Isometry3<f64>); 2]) -> Result<(), Error> {
        let d = self.d;
        let e = d.element(node, None);
        let Some(given) = d.numbers(&e, "relpose")? else { return Ok(()) };
        let [x, y, z, w, i, j, k] = given[..] else {
            return Err(d.wrong(&e, format!("relpose has {} numbers; seven are needed", given.len())));
        };
        // A quaternion of 0 means: as they stand.
        let Some(turn) = UnitQuaternion::try_new(Quaternion::new(w, i, j, k), 1e-12) else { return Ok(()) };
        let wanted = Isometry3::from_parts(Translation3::new(x, y, z), turn);
        let [first, second] = ends.map(|(body, frame)| self.in_file(body) * frame);
        let apart = wanted.inverse() * (first.inverse() * second);
        let open = apart.translation.vector.norm().max(apart.rotation.angle());
        if open <= OPEN {
            return Ok(());
        }
        let problem = format!(
            "starts open by {open:.3e} (m or rad): bodies are welded as they stand in the file; place them as relpose \
             says or leave it out"
        );
        Err(d.wrong(&e, problem))
    }

    /// Pose of a body's frame in the pose of the file.
    fn in_file(&self, body: Option<usize>) -> Isometry3<f64> {
        let Some(body) = body else { return Isometry3::identity() };
        if let Some(joint) = self.robot.joints.iter().find(|j| j.child == body) {
            return self.in_file(joint.parent) * joint.parent_from_joint * joint.child_from_joint.inverse();
        }
        let free = self.robot.others.iter().find(|(b, _)| *b == body);
        free.map_or_else(Isometry3::identity, |(_, pose)| *pose)
    }

    fn coupling_name(&self, node: Node, what: &str) -> String {
        let count = self.robot.couplings.len() + self.robot.loops.len() + 1;
        node.attribute("name").map_or_else(|| format!("{what}{count}"), str::to_owned)
    }
}
