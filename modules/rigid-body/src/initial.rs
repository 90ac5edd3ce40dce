//! The motion at the start through the I/O model: before the first step the pose and rates of free bodies and the
//! coordinates and rates of joints can be set by the names under which they are read. Bodies on joints follow theirs.

use crate::dynamics::joint_rows::{place_child, rates_of_child};
use crate::joint::Kind;
use crate::math::{Q, V3, euler};
use crate::model::Model;
use crate::motion::Motion;
use crate::state::State;
use terraglue_subsystem::{Error, Result};

/// Whether the pose of a body is its own: it hangs on no joint, and no loop ties it to others.
pub(crate) fn is_free(model: &Model, body: usize) -> bool {
    model.joint_above[body].is_none() && model.closures.is_empty()
}

/// Whether the coordinate of a joint is its own: it has one, and no loop or coupling ties it to others.
pub(crate) fn has_coordinate(model: &Model, joint: usize) -> bool {
    matches!(model.joints[joint].kind, Kind::Revolute | Kind::Prismatic) && model.closures.is_empty()
}

/// Sets a number of the motion of a free body: 0–2 place of its frame, 3–5 z-y-x Euler angles, 6–8 velocity of the frame's
/// origin, 9–11 rotation rate, world axes.
///
/// # Errors
/// The robot has stepped, the body is not free, or the pitch is beyond ±π/2.
pub(crate) fn set_body(model: &Model, state: &mut State, body: usize, item: usize, value: f64) -> Result {
    if !is_free(model, body) {
        let text = "its joints give the motion of this body: set that of the free body, or their `.angle`";
        return Err(Error::Refused(text.into()));
    }
    early(state)?;
    let com = model.bodies[body].com;
    let m = state.bodies[body];
    let (mut place, mut angles, mut v, mut w) =
        (m.point(&-com), euler(&m.q), m.v - m.w.cross(&(m.q * com)), m.w);
    let mut q = m.q;
    let k = item % 3;
    match item / 3 {
        0 => place[k] = value,
        1 => {
            if k == 1 && value.abs() > std::f64::consts::FRAC_PI_2 {
                return Err(Error::Refused(format!("a pitch of {value} is beyond ±π/2: take roll and yaw")));
            }
            angles[k] = value;
            let turn = |axis: V3, angle: f64| Q::from_axis_angle(&nalgebra::Unit::new_unchecked(axis), angle);
            q = turn(V3::z(), angles[2]) * turn(V3::y(), angles[1]) * turn(V3::x(), angles[0]);
        }
        2 => v[k] = value,
        _ => w[k] = value,
    }
    let arm = q * com;
    state.bodies[body] = Motion { v: v + w.cross(&arm), w, ..Motion::at(place + arm, q) };
    follow(model, state);
    Ok(())
}

/// Sets the coordinate (rad or m) of a joint, or its rate. A motor that holds the joint where it is takes the coordinate
/// as its target.
///
/// # Errors
/// The robot has stepped, the joint has no coordinate of its own, or the coordinate is outside its limits.
pub(crate) fn set_joint(model: &Model, state: &mut State, joint: usize, rate: bool, value: f64) -> Result {
    if !has_coordinate(model, joint) {
        return Err(Error::Refused("other joints give the motion of this one".into()));
    }
    early(state)?;
    let (data, j) = (&model.joints[joint], &mut state.joints[joint]);
    if rate {
        j.velocity = value;
    } else {
        if let Some([low, high]) = data.limits.filter(|[low, high]| !(low..=high).contains(&&value)) {
            let text = format!(
                "{value} is outside the limits {low} … {high} {} of joint `{}`",
                data.unit(),
                data.name
            );
            return Err(Error::Refused(text));
        }
        if j.angle_target == j.angle {
            j.angle_target = value;
        }
        j.angle = value;
    }
    follow(model, state);
    Ok(())
}

fn early(state: &State) -> Result {
    match state.start {
        None => Ok(()),
        Some(_) => Err(Error::Refused("the motion can only be set before the first step".into())),
    }
}

/// Places the bodies on joints that hold, parents first.
fn follow(model: &Model, state: &mut State) {
    for (b, above) in model.joint_above.iter().enumerate() {
        let Some(j) = *above else { continue };
        let (joint, own) = (&model.joints[j], &state.joints[j]);
        if own.broken {
            continue;
        }
        state.bodies[b] = place_child(joint, joint.parent.map(|p| &state.bodies[p]), own.angle);
        (state.bodies[b].v, state.bodies[b].w) = rates_of_child(joint, &state.bodies, own.velocity);
    }
    state.accelerated = false;
}
