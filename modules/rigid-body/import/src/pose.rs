//! The robot as a whole: the places of its bodies at given coordinates, its mass, and its lowest point.

use crate::inertia::Inertial;
use crate::model::{Base, Joint, JointKind, Robot, Shape, ShapeGeometry};
use nalgebra::{Isometry3, Matrix3, Point3, Translation3, UnitQuaternion, Vector3};

/// Mass properties of all bodies together, in the frame of the file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TotalMass {
    /// kg.
    pub mass: f64,
    /// Centre of mass, m.
    pub com: Vector3<f64>,
    /// Inertia about it, kg m².
    pub inertia: Matrix3<f64>,
}

impl Joint {
    /// Pose of the child in its parent at a coordinate (rad or m); joints of several freedoms stand as in the file.
    pub fn parent_from_child(&self, coordinate: f64) -> Isometry3<f64> {
        let moved = match self.kind {
            JointKind::Revolute => {
                let turned = UnitQuaternion::from_axis_angle(&self.axis, coordinate);
                Isometry3::from_parts(Translation3::identity(), turned)
            }
            JointKind::Prismatic => Translation3::from(self.axis.into_inner() * coordinate).into(),
            JointKind::Fixed | JointKind::Spherical | JointKind::Planar => Isometry3::identity(),
        };
        self.parent_from_joint * moved * self.child_from_joint.inverse()
    }

    /// Number of its freedoms.
    pub fn freedoms(&self) -> usize {
        match self.kind {
            JointKind::Fixed => 0,
            JointKind::Revolute | JointKind::Prismatic => 1,
            JointKind::Spherical | JointKind::Planar => 3,
        }
    }
}

impl Robot {
    /// Pose of every body in the frame of the file, for a coordinate per joint.
    pub fn poses(&self, coordinates: &[f64]) -> Vec<Isometry3<f64>> {
        let mut poses = vec![Isometry3::identity(); self.bodies.len()];
        if let (Base::Free(root), Some(first)) = (self.base, poses.first_mut()) {
            *first = root;
        }
        self.others.iter().for_each(|(body, pose)| poses[*body] = *pose);
        // Parents come before their children.
        for (joint, coordinate) in self.joints.iter().zip(coordinates) {
            let parent = joint.parent.map_or_else(Isometry3::identity, |p| poses[p]);
            poses[joint.child] = parent * joint.parent_from_child(*coordinate);
        }
        poses
    }

    /// Mass, centre of mass and inertia of all bodies in these poses.
    pub fn whole(&self, poses: &[Isometry3<f64>]) -> TotalMass {
        let placed = self.bodies.iter().zip(poses).map(|(body, pose)| {
            let r = pose.rotation.to_rotation_matrix();
            let com = (pose * Point3::from(body.com)).coords;
            Inertial { mass: body.mass, com, tensor: r * body.inertia * r.transpose() }
        });
        let all = placed.reduce(|a, b| a.with(&b));
        let nothing = TotalMass { mass: 0.0, com: Vector3::zeros(), inertia: Matrix3::zeros() };
        all.map_or(nothing, |i| TotalMass { mass: i.mass, com: i.com, inertia: i.tensor })
    }

    /// Degrees of freedom: of the free bodies, and of the joints that follow no other one.
    pub fn freedoms(&self) -> usize {
        let free = usize::from(matches!(self.base, Base::Free(_))) + self.others.len();
        let joints: usize = self.joints.iter().map(Joint::freedoms).sum();
        (6 * free + joints).saturating_sub(self.couplings.len())
    }
}

impl Shape {
    /// Its extreme corner along a direction, in the frame in which `frame` is the pose of its body; none where it has no corners.
    pub fn farthest(&self, frame: &Isometry3<f64>, direction: &Vector3<f64>) -> Option<Vector3<f64>> {
        let pose = frame * self.body_from_shape;
        let d = pose.rotation.inverse() * direction;
        let across = Vector3::new(d.x, d.y, 0.0);
        let rim = across.try_normalize(1e-12).unwrap_or_else(Vector3::zeros);
        let of_points = |points: &[[f64; 3]]| {
            let points = points.iter().map(|p| Vector3::from(*p));
            points.max_by(|a, b| a.dot(&d).total_cmp(&b.dot(&d)))
        };
        let up = d.z.signum();
        let local = match &self.geometry {
            ShapeGeometry::Sphere { radius } => *radius * d.normalize(),
            ShapeGeometry::Box { half_extents: [x, y, z] } => {
                Vector3::new(x * d.x.signum(), y * d.y.signum(), z * up)
            }
            ShapeGeometry::Cylinder { half_length, radius } => {
                *radius * rim + Vector3::z() * (half_length * up)
            }
            ShapeGeometry::Capsule { half_length, radius } => {
                *radius * d.normalize() + Vector3::z() * (half_length * up)
            }
            ShapeGeometry::Hull(mesh)
            | ShapeGeometry::Concave { mesh, .. }
            | ShapeGeometry::Triangles(mesh) => of_points(&mesh.points)?,
            ShapeGeometry::Heights(_) => return None,
        };
        Some((pose * Point3::from(local)).coords)
    }
}
