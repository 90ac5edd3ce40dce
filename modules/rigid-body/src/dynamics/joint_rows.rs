//! Rows of a joint: six directions, their Jacobians on both bodies, and how far the joint is out of place.
//!
//! Rows 0–2: translation of the child's anchor against the parent's along axis, t1, t2; rows 3–5: rotation about
//! them. The frame is the parent's. A revolute joint leaves row 3 free, a prismatic one row 0.

use crate::joint::{Joint, Kind};
use crate::math::{Q, V3, unwrap_angle};
use crate::motion::Motion;
use terraglue_linear_solver::Rows;

fn world() -> Motion {
    Motion::at(V3::zeros(), Q::identity())
}

/// Motion of the parent; the world is at rest in the origin.
fn parent_of(joint: &Joint, bodies: &[Motion]) -> Motion {
    joint.parent.map_or_else(world, |p| bodies[p])
}

/// Directions of the rows at the given poses.
pub(crate) fn rows(joint: &Joint, bodies: &[Motion]) -> Rows {
    let (parent, child) = (parent_of(joint, bodies), &bodies[joint.child]);
    let frame = (parent.q * joint.parent_frame).to_rotation_matrix();
    let direction = |k: usize| frame.matrix().column(k).into();
    let anchor = child.q * joint.child_anchor;
    let mut directions: [V3; 6] = std::array::from_fn(|r| direction(r % 3));
    if joint.kind == Kind::Universal {
        let (x, y) = (directions[3], second_axis(joint, bodies));
        directions[4] = (y - x * x.dot(&y)).normalize();
        directions[5] = x.cross(&directions[4]);
    }
    Rows { directions, anchor, lever: child.c + anchor - parent.c }
}

/// The child's axis of a universal joint.
fn second_axis(joint: &Joint, bodies: &[Motion]) -> V3 {
    bodies[joint.child].q * (joint.child_frame * V3::y())
}

/// Rows whose product with the mean rates times h is the change of the joint's equations over a step, for poses at its
/// two ends: all vectors are means, and the rotational rows of a revolute joint are those of −t2·axis and t1·axis.
pub(crate) fn mean_rows(joint: &Joint, starts: &[Motion], ends: &[Motion]) -> Rows {
    let (before, after) = (rows(joint, starts), rows(joint, ends));
    let mean = |a: &V3, b: &V3| 0.5 * (a + b);
    let mut directions: [V3; 6] = std::array::from_fn(|r| mean(&before.directions[r], &after.directions[r]));
    if joint.kind == Kind::Universal {
        let second = mean(&second_axis(joint, starts), &second_axis(joint, ends));
        directions[5] = directions[3].cross(&second);
    }
    if joint.aligns_axes() {
        let axis = |bodies: &[Motion]| bodies[joint.child].q * (joint.child_frame * V3::x());
        let axis = mean(&axis(starts), &axis(ends));
        (directions[4], directions[5]) = (directions[2].cross(&axis), axis.cross(&directions[1]));
    }
    Rows { directions, anchor: mean(&before.anchor, &after.anchor), lever: mean(&before.lever, &after.lever) }
}

/// Pose of the child relative to the parent, in the frame of the joint on the parent.
pub(crate) struct Stand {
    /// From the parent's anchor to the child's, m.
    apart: V3,
    /// Orientation of the child's frame.
    turn: Q,
}

impl Stand {
    /// At the given poses.
    pub fn of(joint: &Joint, bodies: &[Motion]) -> Self {
        let (parent, child) = (parent_of(joint, bodies), &bodies[joint.child]);
        let frame = parent.q * joint.parent_frame;
        let apart = child.point(&joint.child_anchor) - parent.point(&joint.parent_anchor);
        Self {
            apart: frame.inverse_transform_vector(&apart),
            turn: frame.inverse() * (child.q * joint.child_frame),
        }
    }

    /// Position error of the joint, in the rows' order, m and rad; rows that do not hold are 0.
    pub fn gap(&self, joint: &Joint) -> [f64; 6] {
        let Self { apart, turn } = self;
        let turned = if joint.kind == Kind::Universal {
            V3::new(0.0, 0.0, -(turn * V3::y()).x)
        } else if joint.aligns_axes() {
            // u_parent × u_child, in the frame of the parent: the axis alone has to agree.
            let (w, i, j, k) = (turn.w, turn.i, turn.j, turn.k);
            let (y, z) = (2.0 * (i * j + w * k), 2.0 * (i * k - w * j));
            V3::new(0.0, -z, y)
        } else {
            turn.imag() * (2.0_f64.copysign(turn.w))
        };
        let mut gap = [apart.x, apart.y, apart.z, turned.x, turned.y, turned.z];
        let rigid = joint.rigid();
        (0..6).filter(|r| !rigid[*r]).for_each(|r| gap[r] = 0.0);
        gap
    }

    /// Coordinate of the joint, rad (continued from `near` over full turns) or m.
    pub fn coordinate(&self, joint: &Joint, near: f64) -> f64 {
        match joint.kind {
            Kind::Prismatic => self.apart.x,
            Kind::Revolute => unwrap_angle(2.0 * libm::atan2(self.turn.i, self.turn.w), near),
            _ => 0.0,
        }
    }
}

/// [`Stand::gap`] at the given poses.
pub(crate) fn gap(joint: &Joint, bodies: &[Motion]) -> [f64; 6] {
    Stand::of(joint, bodies).gap(joint)
}

/// [`Stand::coordinate`] at the given poses.
pub(crate) fn coordinate(joint: &Joint, bodies: &[Motion], near: f64) -> f64 {
    Stand::of(joint, bodies).coordinate(joint, near)
}

/// Pose of the child (centre of mass and orientation) for a coordinate.
pub(crate) fn place_child(joint: &Joint, parent: Option<&Motion>, coordinate: f64) -> Motion {
    let parent = parent.copied().unwrap_or_else(world);
    let frame = parent.q * joint.parent_frame;
    let (slide, turn) = match joint.kind {
        Kind::Prismatic => (coordinate, 0.0),
        Kind::Revolute => (0.0, coordinate),
        _ => (0.0, 0.0),
    };
    let q = frame * Q::from_axis_angle(&V3::x_axis(), turn) * joint.child_frame.inverse();
    let anchor = parent.point(&joint.parent_anchor) + frame * V3::new(slide, 0.0, 0.0);
    Motion::at(anchor - q * joint.child_anchor, q)
}

/// Velocity of the centre of mass and rotation rate of the child, for a rate of the coordinate.
pub(crate) fn rates_of_child(joint: &Joint, bodies: &[Motion], rate: f64) -> (V3, V3) {
    let parent = parent_of(joint, bodies);
    let axis = parent.q * (joint.parent_frame * V3::x());
    let (slide, turn) = match joint.kind {
        Kind::Prismatic => (rate, 0.0),
        Kind::Revolute => (0.0, rate),
        _ => (0.0, 0.0),
    };
    let child = &bodies[joint.child];
    let anchor = child.point(&joint.child_anchor);
    let w = parent.w + turn * axis;
    (parent.v + parent.w.cross(&(anchor - parent.c)) + slide * axis + w.cross(&(child.c - anchor)), w)
}
