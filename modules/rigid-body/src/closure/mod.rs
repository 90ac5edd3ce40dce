//! Connections of bodies beyond the tree of joints: loop closures, rods, springs and dampers, couplings of two joints.
//!
//! Each of them is one or more rows on up to four bodies. A row has a value (how far it is open, m or rad; for a
//! spring its length) and the Jacobian of that value. All values are bilinear in positions and body-fixed directions
//! or divided by a factor that makes them so, see [`Rows`](terraglue_linear_solver::Rows) and
//! [`mean_rows`](crate::dynamics::joint_rows::mean_rows): with poses at both ends of a step, the Jacobian made of mean
//! vectors times the mean rates times h is the change of the value.

pub(crate) mod configure;

use crate::dynamics::joint_rows::{coordinate, gap, mean_rows, rows};
use crate::joint::Joint;
use crate::math::V3;
use crate::motion::Motion;
use terraglue_linear_solver::{Cut, MOST_PARTS, Rows};

/// A connection.
#[derive(Clone, Debug)]
pub(crate) struct Closure {
    pub name: String,
    pub law: ClosureLaw,
}

/// Law of a closure.
#[derive(Clone, Debug)]
pub(crate) enum ClosureLaw {
    /// The rigid rows of a joint.
    Joint(Joint),
    /// A rod without mass between two points, of a length in m.
    Rod(Points, f64),
    /// A spring and a damper along the line between two points.
    Spring(Points, Spring),
    /// follower = ratio·leader + offset for the coordinates of two joints of the tree.
    Coupling { follower: usize, leader: usize, ratio: f64, offset: f64 },
}

/// A point on a child and one on its parent (or the world), from the centres of mass in body axes (world), m.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Points {
    pub parent: Option<usize>,
    pub child: usize,
    pub parent_point: V3,
    pub child_point: V3,
}

/// N/m, N s/m, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Spring {
    pub stiffness: f64,
    pub damping: f64,
    pub rest_length: f64,
}

impl Spring {
    /// Energy stored at a length, J.
    pub fn stored(&self, length: f64) -> f64 {
        0.5 * self.stiffness * (length - self.rest_length) * (length - self.rest_length)
    }
}

/// Poses of all bodies at one or both ends of a step, joints of the tree and their coordinates nearby.
#[derive(Clone, Copy)]
pub(crate) struct Poses<'a> {
    pub joints: &'a [Joint],
    /// Poses at the start, where the Jacobian is to be that of the whole step.
    pub before: Option<&'a [Motion]>,
    pub bodies: &'a [Motion],
    pub near: &'a [f64],
}

impl Poses<'_> {
    fn rows(&self, joint: &Joint) -> Rows {
        self.before.map_or_else(|| rows(joint, self.bodies), |before| mean_rows(joint, before, self.bodies))
    }
}

impl Points {
    fn ends(&self, bodies: &[Motion]) -> [V3; 2] {
        let parent = self.parent.map_or(self.parent_point, |p| bodies[p].point(&self.parent_point));
        [parent, bodies[self.child].point(&self.child_point)]
    }

    /// From the point on the parent to that on the child.
    fn apart(&self, bodies: &[Motion]) -> V3 {
        let [parent, child] = self.ends(bodies);
        child - parent
    }

    /// Distance of the points, m.
    pub fn length(&self, bodies: &[Motion]) -> f64 {
        self.apart(bodies).norm()
    }

    /// The row along `direction`.
    fn row(&self, poses: &Poses, direction: &V3) -> [Option<(usize, [f64; 6])>; MOST_PARTS] {
        let arm = |body: usize, point: &V3| {
            let now = poses.bodies[body].q * point;
            poses.before.map_or(now, |before| 0.5 * (now + before[body].q * point))
        };
        let wrench = |arm: V3, sign: f64| {
            let (f, m) = (sign * direction, sign * arm.cross(direction));
            [f.x, f.y, f.z, m.x, m.y, m.z]
        };
        let child = (self.child, wrench(arm(self.child, &self.child_point), 1.0));
        let parent = self.parent.map(|p| (p, wrench(arm(p, &self.parent_point), -1.0)));
        [Some(child), parent, None, None]
    }

    /// Mean vector between the points and mean of its length over the step.
    fn mean(&self, poses: &Poses) -> (V3, f64) {
        let now = self.apart(poses.bodies);
        let Some(before) = poses.before.map(|before| self.apart(before)) else { return (now, now.norm()) };
        (0.5 * (now + before), 0.5 * (now.norm() + before.norm()))
    }
}

impl Closure {
    /// Number of its rows.
    pub fn len(&self) -> usize {
        match &self.law {
            ClosureLaw::Joint(joint) => joint.rigid().iter().filter(|r| **r).count(),
            _ => 1,
        }
    }

    /// The spring, if it is one.
    pub fn spring(&self) -> Option<(&Points, &Spring)> {
        if let ClosureLaw::Spring(points, spring) = &self.law { Some((points, spring)) } else { None }
    }

    /// Jacobians of all rows; compliance is left alone.
    pub fn fill(&self, poses: &Poses, out: &mut [Cut]) {
        match &self.law {
            ClosureLaw::Joint(joint) => {
                let rows = poses.rows(joint);
                let rigid = (0..6).filter(|r| joint.rigid()[*r]);
                for (r, cut) in rigid.zip(out) {
                    let parent = joint.parent.map(|p| (p, rows.on_parent(r)));
                    cut.parts = [Some((joint.child, rows.on_child(r))), parent, None, None];
                }
            }
            ClosureLaw::Rod(points, length) => {
                out[0].parts = points.row(poses, &(points.mean(poses).0 / *length))
            }
            ClosureLaw::Spring(points, _) => {
                let (apart, length) = points.mean(poses);
                let direction = if length > 0.0 { apart / length } else { V3::x() };
                out[0].parts = points.row(poses, &direction);
            }
            ClosureLaw::Coupling { follower, leader, ratio, .. } => {
                out[0].parts = [None; MOST_PARTS];
                for (k, (j, factor)) in [(*follower, 1.0), (*leader, -ratio)].into_iter().enumerate() {
                    let joint = &poses.joints[j];
                    let Some(free) = joint.free_row() else { continue };
                    let rows = poses.rows(joint);
                    let times = |w: [f64; 6]| w.map(|w| factor * w);
                    out[0].parts[2 * k] = Some((joint.child, times(rows.on_child(free))));
                    out[0].parts[2 * k + 1] = joint.parent.map(|p| (p, times(rows.on_parent(free))));
                }
            }
        }
    }

    /// Values of all rows: how far they are open, or the length of a spring.
    pub fn values(&self, poses: &Poses, out: &mut [f64]) {
        match &self.law {
            ClosureLaw::Joint(joint) => {
                let open = gap(joint, poses.bodies);
                let rigid = (0..6).filter(|r| joint.rigid()[*r]);
                rigid.zip(out).for_each(|(r, out)| *out = open[r]);
            }
            ClosureLaw::Rod(points, length) => {
                let apart = points.apart(poses.bodies);
                out[0] = 0.5 * (apart.norm_squared() - length * length) / length;
            }
            ClosureLaw::Spring(points, _) => out[0] = points.length(poses.bodies),
            ClosureLaw::Coupling { follower, leader, ratio, offset } => {
                let at = |j: usize| coordinate(&poses.joints[j], poses.bodies, poses.near[j]);
                out[0] = at(*follower) - ratio * at(*leader) - offset;
            }
        }
    }
}
