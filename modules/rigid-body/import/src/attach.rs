//! A second robot or object next to the first one: its bodies, joints and shapes are appended to the same lists.

use crate::model::{AxisData, Base, Body, Coupling, Joint, JointKind, Loop, Plane, Robot, Shape};
use nalgebra::{Isometry3, Point3, Vector3};

impl Robot {
    /// Adds another robot under a name, `NAME/LINK` and so on. `pose`: of its file's frame in this one's; `fixed` holds a
    /// root that has mass there.
    pub fn attach(&mut self, other: Robot, name: &str, pose: &Isometry3<f64>, fixed: bool) {
        let (bodies, joints) = (self.bodies.len(), self.joints.len());
        let named = |n: &str| format!("{name}/{n}");
        self.bodies.extend(other.bodies.into_iter().map(|b| Body { name: named(&b.name), ..b }));
        self.joints.extend(other.joints.into_iter().map(|j| Joint {
            name: named(&j.name),
            parent: j.parent.map(|p| p + bodies),
            child: j.child + bodies,
            parent_from_joint: if j.parent.is_some() {
                j.parent_from_joint
            } else {
                pose * j.parent_from_joint
            },
            ..j
        }));
        match other.base {
            Base::World => {}
            Base::Free(root) if fixed => self.joints.push(held(named("base"), bodies, pose * root)),
            Base::Free(root) => self.others.push((bodies, pose * root)),
        }
        self.others.extend(other.others.into_iter().map(|(b, at)| (b + bodies, pose * at)));
        let moved = |s: Shape| Shape { body_from_shape: pose * s.body_from_shape, ..s };
        self.world_shapes.extend(other.world_shapes.into_iter().map(moved));
        self.planes.extend(other.planes.iter().map(|p| {
            let normal = pose.rotation * p.normal;
            Plane { normal, offset: p.offset + normal.dot(&pose.translation.vector), ..*p }
        }));
        self.excluded.extend(other.excluded.iter().map(|pair| pair.map(|b| b + bodies)));
        self.couplings.extend(other.couplings.into_iter().map(|c| Coupling {
            name: named(&c.name),
            follower: c.follower + joints,
            leader: c.leader + joints,
            ..c
        }));
        self.loops.extend(other.loops.into_iter().map(|l| {
            let origin =
                if l.bodies[0].is_some() { l.origin } else { (pose * Point3::from(l.origin)).coords };
            Loop { name: named(&l.name), bodies: l.bodies.map(|b| b.map(|b| b + bodies)), origin, ..l }
        }));
        self.warnings.extend(other.warnings);
        self.notices.extend(other.notices);
    }
}

fn held(name: String, child: usize, pose: Isometry3<f64>) -> Joint {
    Joint {
        name,
        kind: JointKind::Fixed,
        parent: None,
        child,
        parent_from_joint: pose,
        child_from_joint: Isometry3::identity(),
        axis: Vector3::x_axis(),
        limits: None,
        data: AxisData::default(),
    }
}
