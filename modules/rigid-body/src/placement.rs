//! Initial placement of the robot: joint coordinates by name pattern, pose of the root, feet on the ground.

use crate::contact::shapes::{parry_local, parry_shape};
use crate::dynamics::joint_rows::{place_child, rates_of_child};
use crate::joint::Joint;
use crate::math::V3;
use crate::model::Model;
use crate::motion::Motion;
use nalgebra::{Isometry3, Translation3};
use parry3d_f64::math::{Pose, Vector};
use parry3d_f64::query::{Ray, RayCast};
use terraglue_subsystem::{Error, Result, Terrain};

/// Coordinates of all joints from a table of patterns: an exact name wins, else the longest pattern that matches. Others are 0, or the end of their
/// range next to it.
pub(crate) fn coordinates(model: &Model, table: &[(String, f64)]) -> Result<Vec<f64>> {
    known(model, "joints", table)?;
    model.joints.iter().map(|joint| coordinate(joint, table)).collect()
}

/// Rates of all joints from the same kind of table, rad/s or m/s.
pub(crate) fn joint_rates(model: &Model, table: &[(String, f64)]) -> Result<Vec<f64>> {
    known(model, "joint_rates", table)?;
    Ok(model.joints.iter().map(|joint| best(joint, table).map_or(0.0, |(_, rate)| *rate)).collect())
}

fn known(model: &Model, parameter: &str, table: &[(String, f64)]) -> Result<()> {
    for (pattern, value) in table {
        if !model.joints.iter().any(|j| j.moves() && matches(pattern, &j.name)) {
            return Err(Error::Refused(format!(
                "parameter `{parameter}`: no moving joint is called `{pattern}`{}",
                nearest(model, pattern)
            )));
        }
        if !value.is_finite() {
            return Err(Error::Refused(format!(
                "parameter `{parameter}`: {pattern} = {value} is not finite"
            )));
        }
    }
    Ok(())
}

fn best<'a>(joint: &Joint, table: &'a [(String, f64)]) -> Option<&'a (String, f64)> {
    let fitting = table.iter().filter(|(pattern, _)| joint.moves() && matches(pattern, &joint.name));
    fitting.max_by_key(|(pattern, _)| (*pattern == joint.name, pattern.len()))
}

fn coordinate(joint: &Joint, table: &[(String, f64)]) -> Result<f64> {
    let Some((pattern, value)) = best(joint, table) else {
        return Ok(joint.limits.map_or(0.0, |[lower, upper]| 0.0_f64.max(lower).min(upper)));
    };
    match joint.limits {
        Some([lower, upper]) if !(lower..=upper).contains(value) => Err(Error::Refused(format!(
            "parameter `joints`: {pattern} = {value} is outside the limits {lower} … {upper} {} of joint `{}`",
            joint.unit(),
            joint.name
        ))),
        _ => Ok(*value),
    }
}

fn nearest(model: &Model, name: &str) -> String {
    let names = model.joints.iter().filter(|j| j.moves()).map(|j| j.name.as_str());
    let near = names.min_by_key(|j| strsim::damerau_levenshtein(j, name));
    near.map(|j| format!("; did you mean `{j}`?")).unwrap_or_default()
}

/// Whether a name matches a pattern in which `*` stands for any text.
pub(crate) fn matches(pattern: &str, name: &str) -> bool {
    let Some((head, rest)) = pattern.split_once('*') else { return pattern == name };
    let Some(name) = name.strip_prefix(head) else { return false };
    (0..=name.len()).any(|k| name.is_char_boundary(k) && matches(rest, &name[k..]))
}

/// Motion at rest of all bodies for a pose of the root frame and joint coordinates.
pub(crate) fn at_rest(model: &Model, base: &Isometry3<f64>, coordinates: &[f64]) -> Vec<Motion> {
    let mut bodies: Vec<Motion> = Vec::with_capacity(model.bodies.len());
    for (b, body) in model.bodies.iter().enumerate() {
        let motion = match model.joint_above[b] {
            Some(j) => {
                let joint = &model.joints[j];
                place_child(joint, joint.parent.map(|p| &bodies[p]), coordinates[j])
            }
            None => {
                let pose = base * model.free[b].unwrap_or_else(Isometry3::identity);
                Motion::at(
                    pose * nalgebra::Point3::from(body.com) - nalgebra::Point3::origin(),
                    pose.rotation,
                )
            }
        };
        bodies.push(motion);
    }
    bodies
}

/// Rates of all bodies at the start.
pub(crate) struct StartRates {
    /// Velocity of the root frame's origin, world axes, m/s.
    pub velocity: V3,
    /// Rotation of the root, axes of its frame, rad/s.
    pub rotation: V3,
    /// Of all joints, rad/s or m/s.
    pub joints: Vec<f64>,
}

/// Gives bodies at rest their rates at the start.
pub(crate) fn set_moving(model: &Model, base: &Isometry3<f64>, rates: &StartRates, bodies: &mut [Motion]) {
    let w = base.rotation * rates.rotation;
    for b in 0..bodies.len() {
        (bodies[b].v, bodies[b].w) = match model.joint_above[b] {
            Some(j) => rates_of_child(&model.joints[j], bodies, rates.joints[j]),
            None if b >= model.own => (V3::zeros(), V3::zeros()),
            None => (rates.velocity + w.cross(&(bodies[b].c - base.translation.vector)), w),
        };
    }
}

/// Smallest vertical distance between all collision shapes and the ground, m; none without shapes above it.
pub(crate) fn clearance(model: &Model, bodies: &[Motion], terrain: &dyn Terrain) -> Option<f64> {
    let mut smallest: Option<f64> = None;
    for (body, motion) in model.bodies.iter().zip(bodies) {
        for shape in body.shapes.iter().filter(|s| s.collides) {
            let local = Translation3::from(-body.com) * parry_local(shape);
            let pose: Pose = (Isometry3::from_parts(Translation3::from(motion.c), motion.q) * local).into();
            let Some(shape) = parry_shape(shape) else { continue };
            let found = shape_clearance(&*shape, &pose, terrain);
            smallest = Some(smallest.map_or(found, |s| s.min(found)));
        }
    }
    smallest
}

/// Nodes beyond the edge of the terrain that count, whose height is that of the edge.
const BESIDE: i64 = 100;

/// Of one shape: over the lattice nodes below it, where the soil will feel it, and below its lowest corner.
fn shape_clearance(shape: &dyn parry3d_f64::shape::Shape, pose: &Pose, terrain: &dyn Terrain) -> f64 {
    let aabb = shape.compute_aabb(pose);
    let (origin, spacing) = (terrain.origin(), terrain.spacing());
    // A shape may be far larger than the terrain.
    let size = terrain.size().map(i64::from);
    let index = |x: f64, axis: usize| {
        (((x - origin[axis]) / spacing).floor() as i64).clamp(-BESIDE, size[axis] + BESIDE)
    };
    let (i0, j0) = (index(aabb.mins.x, 0), index(aabb.mins.y, 1));
    let (ni, nj) = (index(aabb.maxs.x, 0) - i0 + 2, index(aabb.maxs.y, 1) - j0 + 2);
    let mut row = vec![0.0; ni as usize];
    let below = aabb.mins.z - 1.0;
    let mut smallest = f64::INFINITY;
    let mut highest = f64::NEG_INFINITY;
    for j in j0..j0 + nj {
        terrain.heights(i0, j, row.len(), 1, &mut row);
        for (i, height) in (i0..).zip(&row) {
            highest = highest.max(*height);
            let (x, y) = (origin[0] + i as f64 * spacing, origin[1] + j as f64 * spacing);
            let ray = Ray::new(Vector::new(x, y, below), Vector::new(0.0, 0.0, 1.0));
            if let Some(time) = RayCast::cast_ray(shape, pose, &ray, f64::MAX, true) {
                smallest = smallest.min(below + time - height);
            }
        }
    }
    // A shape between the nodes rests on the highest of its neighbours.
    if smallest.is_finite() { smallest } else { aabb.mins.z - highest }
}

/// Pose of the root frame.
pub(crate) fn base_pose(position: &V3, heading: f64) -> Isometry3<f64> {
    let q = crate::math::Q::from_axis_angle(&V3::z_axis(), heading);
    Isometry3::from_parts(Translation3::from(*position), q)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_match_names() {
        assert!(
            matches("*_j2", "LF_j2") && matches("L*_j*", "LM_j4") && matches("a", "a") && matches("*", "x")
        );
        assert!(!matches("*_j2", "LF_j3") && !matches("LF", "LF_j2"));
    }
}
