//! Constants of an instance: bodies, joints, shapes.

use crate::closure::Closure;
use crate::contact::plane::Plane;
use crate::joint::{Joint, Kind};
use crate::math::{M3, Q, V3, frame_along};
use nalgebra::Isometry3;
use terraglue_robot_import as import;

/// A body about its centre of mass.
#[derive(Clone, Debug)]
pub(crate) struct Body {
    pub name: String,
    pub mass: f64,
    /// Centre of mass in the body frame, m.
    pub com: V3,
    /// Inertia about the centre of mass in body axes, and its inverse.
    pub inertia: M3,
    pub inverse_inertia: M3,
    pub shapes: Vec<import::Shape>,
    /// Share of the link that this body is, where a cut divides it: in its mass and inertia already.
    pub share: f64,
}

/// The whole robot.
#[derive(Clone, Debug)]
pub(crate) struct Model {
    pub bodies: Vec<Body>,
    pub joints: Vec<Joint>,
    /// Joint above each body.
    pub joint_above: Vec<Option<usize>>,
    /// Connections beyond the tree.
    pub closures: Vec<Closure>,
    pub gravity: V3,
    /// Per body without a joint its pose in the file's frame.
    pub free: Vec<Option<Isometry3<f64>>>,
    /// Shapes and planes that stand still, in the world.
    pub world_shapes: Vec<import::Shape>,
    pub planes: Vec<Plane>,
    /// Pairs of bodies that never touch.
    pub excluded: Vec<[usize; 2]>,
    /// Number of bodies of the robot itself; those of objects come after them.
    pub own: usize,
    /// Whether the first joint fixes a root with mass to the world, which the robot file does not know.
    pub welded: bool,
}

impl Model {
    /// From the checked robot. `base`: pose of the file's root frame in the world, used where something is fixed
    /// to the world. `fixed_base` fixes a root that has mass by a joint called `base`.
    pub fn new(robot: &import::Robot, base: &Isometry3<f64>, fixed_base: bool, gravity: V3) -> Self {
        let bodies: Vec<Body> = robot.bodies.iter().map(body).collect();
        let mut joints: Vec<Joint> = robot.joints.iter().map(|j| joint(j, &bodies, base)).collect();
        let mut free = vec![None; bodies.len()];
        robot.others.iter().for_each(|(b, pose)| free[*b] = Some(*pose));
        match robot.base {
            import::Base::World => {}
            import::Base::Free(root) if fixed_base => joints.insert(0, weld(&bodies[0], &(base * root))),
            import::Base::Free(root) => free[0] = Some(root),
        }
        let moved =
            |s: &import::Shape| import::Shape { body_from_shape: base * s.body_from_shape, ..s.clone() };
        let world_shapes = robot.world_shapes.iter().map(moved).collect();
        let planes = robot.planes.iter().map(|p| plane(p, base)).collect();
        let excluded = robot.excluded.clone();
        let mut joint_above = vec![None; bodies.len()];
        joints.iter().enumerate().for_each(|(i, j)| joint_above[j.child] = Some(i));
        let closures = Vec::new();
        let own = bodies.len();
        let welded = fixed_base && matches!(robot.base, import::Base::Free(_));
        Self {
            bodies,
            joints,
            joint_above,
            closures,
            gravity,
            free,
            world_shapes,
            planes,
            excluded,
            own,
            welded,
        }
    }

    /// Index of the joint with that index in the robot file: a weld of the root comes before them.
    pub fn joint_of_file(&self, joint: usize) -> usize {
        joint + usize::from(self.welded)
    }

    /// Total mass, kg.
    pub fn mass(&self) -> f64 {
        self.bodies.iter().map(|b| b.mass).sum()
    }
}

fn plane(p: &import::Plane, base: &Isometry3<f64>) -> Plane {
    let normal = (base.rotation * p.normal).into_inner();
    Plane { normal, offset: p.offset + normal.dot(&base.translation.vector), friction: p.friction }
}

fn body(b: &import::Body) -> Body {
    Body {
        name: b.name.clone(),
        mass: b.mass,
        com: b.com,
        inertia: b.inertia,
        // The import has checked that the inertia is positive.
        inverse_inertia: b.inertia.try_inverse().unwrap_or_else(M3::zeros),
        shapes: b.shapes.clone(),
        share: 1.0,
    }
}

fn joint(j: &import::Joint, bodies: &[Body], base: &Isometry3<f64>) -> Joint {
    let along = frame_along(&j.axis);
    let (parent, parent_anchor) = match j.parent {
        Some(p) => (j.parent_from_joint, j.parent_from_joint.translation.vector - bodies[p].com),
        None => (base * j.parent_from_joint, (base * j.parent_from_joint).translation.vector),
    };
    Joint {
        name: j.name.clone(),
        kind: match j.kind {
            import::JointKind::Revolute => Kind::Revolute,
            import::JointKind::Prismatic => Kind::Prismatic,
            import::JointKind::Fixed => Kind::Fixed,
            import::JointKind::Spherical => Kind::Spherical,
            import::JointKind::Planar => Kind::Planar,
        },
        parent: j.parent,
        child: j.child,
        parent_anchor,
        child_anchor: j.child_from_joint.translation.vector - bodies[j.child].com,
        parent_frame: parent.rotation * along,
        child_frame: j.child_from_joint.rotation * along,
        limits: j.limits,
        data: j.data,
    }
}

fn weld(body: &Body, pose: &Isometry3<f64>) -> Joint {
    Joint {
        name: "base".into(),
        kind: Kind::Fixed,
        parent: None,
        child: 0,
        parent_anchor: pose * nalgebra::Point3::from(body.com) - nalgebra::Point3::origin(),
        child_anchor: V3::zeros(),
        parent_frame: pose.rotation,
        child_frame: Q::identity(),
        limits: None,
        data: import::AxisData::default(),
    }
}
