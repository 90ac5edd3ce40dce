//! From the text of a URDF file to the checked robot; links without mass are merged into their neighbours.

use crate::Options;
use crate::check::{inertial, isometry, mass_spread, not_positive};
use crate::error::{Error, Source};
use crate::inertia::Inertial;
use crate::merge::{Merged, merge};
use crate::model::{AxisData, Base, Body, Coupling, Joint, JointKind, Robot, Shape};
use crate::plausible;
use crate::repair::repair;
use crate::shapes::Shapes;
use crate::tree::{LinkPlace, order};
use crate::unread;
use nalgebra::{Unit, Vector3};
use urdf_rs::JointType;

/// Reads the text of a file; `file` appears in messages and gives the folder of meshes.
///
/// # Errors
/// [`Error`] with line and element: a part that cannot be read or simulated.
pub fn read_urdf_text(file: &str, text: &str, options: &Options) -> Result<Robot, Error> {
    let text = crate::syntax::declared(text);
    let source = &Source { file, text: &text };
    crate::syntax::check(source)?;
    let robot = urdf_rs::read_from_string(&crate::syntax::complete(&text))
        .map_err(|e| source.syntax(0, e.to_string()))?;
    let order = order(source, &robot)?;
    let inertials = robot.links.iter().map(|l| inertial(source, l)).collect::<Result<Vec<_>, _>>()?;
    let merged = merge(&robot, &order, &inertials);
    build(source, &robot, &order, &inertials, &merged, options)
}

fn build(
    source: &Source,
    robot: &urdf_rs::Robot,
    order: &[LinkPlace],
    inertials: &[Option<Inertial>],
    merged: &Merged,
    options: &Options,
) -> Result<Robot, Error> {
    let world = merged.chief[0].is_none();
    if world {
        check_world(source, robot, merged, options.fixed_base)?;
    }
    let (mut bodies, joints) = bodies_and_joints(source, robot, inertials, merged)?;
    let folders = options.folders(source.file);
    let mut shapes = Shapes::new(source, &folders);
    let world_shapes = give_shapes(robot, order, merged, &mut shapes, &mut bodies)?;
    let base = match merged.chief[0] {
        Some(link) => Base::Free(merged.group_from_link[link]),
        None => Base::World,
    };
    let mut warnings: Vec<String> = merged.warning(source, robot, inertials).into_iter().collect();
    for body in &mut bodies {
        let said = repair(body).map(|text| source.link(&body.name, text).to_string());
        warnings.extend(said);
    }
    let (unclear, mut notices) = shapes.said();
    warnings.extend(unclear);
    let (unread, unused) = unread::told(source, robot);
    warnings.extend(unread);
    notices.extend(unused);
    warnings.extend(without_limits(source, robot));
    warnings.extend(fixed_followers(source, robot));
    warnings.extend(doubtful(source, &bodies));
    let couplings = couplings(source, robot, &joints)?;
    let excluded = next_to_each_other(bodies.len(), &joints);
    Ok(Robot {
        name: robot.name.clone(),
        base,
        bodies,
        joints,
        others: Vec::new(),
        world_shapes,
        planes: Vec::new(),
        excluded,
        couplings,
        loops: Vec::new(),
        warnings,
        notices,
    })
}

/// The bodies that are left of the links, without shapes, and the joints between them.
fn bodies_and_joints(
    source: &Source,
    robot: &urdf_rs::Robot,
    inertials: &[Option<Inertial>],
    merged: &Merged,
) -> Result<(Vec<Body>, Vec<Joint>), Error> {
    let shift = usize::from(merged.chief[0].is_none());
    let (mut bodies, mut joints) = (Vec::new(), Vec::new());
    for group in shift..merged.chief.len() {
        let (first, above) = merged.first[group];
        let name = &robot.links[merged.chief[group].unwrap_or(first)].name;
        let Some(Inertial { mass, com, tensor: inertia }) = merged.together(group, inertials) else {
            let problem =
                "moves on a joint but has no mass; give it an <inertial>, or make a joint next to it fixed";
            return Err(source.link(name, problem));
        };
        if mass <= 0.0 {
            return Err(source.link(name, not_positive(mass)));
        }
        if let Some(j) = above {
            joints.push(joint(source, robot, merged, j, first, bodies.len(), shift)?);
        }
        bodies.push(Body { name: name.clone(), mass, com, inertia, shapes: Vec::new() });
    }
    Ok((bodies, joints))
}

/// Gives the bodies the shapes of their links; returns the shapes that stand still in the world.
fn give_shapes(
    robot: &urdf_rs::Robot,
    order: &[LinkPlace],
    merged: &Merged,
    shapes: &mut Shapes,
    bodies: &mut [Body],
) -> Result<Vec<Shape>, Error> {
    let shift = usize::from(merged.chief[0].is_none());
    let mut still = Vec::new();
    for place in order {
        let (frame, body) = (merged.body_from_link(place.link), merged.group[place.link].checked_sub(shift));
        let found = shapes.of(&robot.links[place.link], body.is_none())?;
        let moved = found.into_iter().map(|s| Shape { body_from_shape: frame * s.body_from_shape, ..s });
        match body {
            Some(body) => bodies[body].shapes.extend(moved),
            None => still.extend(moved),
        }
    }
    Ok(still)
}

/// Pairs of bodies with fixed joints only between them, or one joint that moves besides: their shapes overlap where they are joined,
/// as those of a body and its parent do, which never touch anyway.
fn next_to_each_other(bodies: usize, joints: &[Joint]) -> Vec<[usize; 2]> {
    // Per body: the first of those that move as one with it.
    let mut leader: Vec<usize> = (0..bodies).collect();
    for joint in joints.iter().filter(|j| j.kind == JointKind::Fixed) {
        leader[joint.child] = joint.parent.map_or(joint.child, |p| leader[p]);
    }
    let mut joined: Vec<[usize; 2]> = joints
        .iter()
        .filter_map(|j| j.parent.map(|p| [leader[p], leader[j.child]]))
        .filter(|[above, below]| above != below)
        .collect();
    joined.sort_unstable();
    let near = |a: usize, b: usize| {
        let (a, b) = (leader[a], leader[b]);
        a == b || joined.binary_search(&[a, b]).is_ok() || joined.binary_search(&[b, a]).is_ok()
    };
    let direct = |a: usize, b: usize| joints.iter().any(|j| j.child == b && j.parent == Some(a));
    (0..bodies)
        .flat_map(|a| (a + 1..bodies).map(move |b| [a, b]))
        .filter(|[a, b]| near(*a, *b) && !direct(*a, *b))
        .collect()
}

/// Friction in the joint, from `<dynamics>`, and its largest torque, from `<limit>`: 0 stands for no limit.
fn data(source: &Source, joint: &urdf_rs::Joint) -> Result<AxisData, Error> {
    let (damping, friction) = joint.dynamics.as_ref().map_or((0.0, 0.0), |d| (d.damping, d.friction));
    if let Some(bad) = [damping, friction].iter().find(|x| **x < 0.0) {
        let problem = format!("<dynamics> has {bad}; damping and friction are not below 0");
        return Err(source.joint(&joint.name, problem));
    }
    let effort = Some(joint.limit.effort).filter(|e| *e > 0.0);
    Ok(AxisData { damping, friction, effort, ..AxisData::default() })
}

/// Joints that follow others, from `<mimic>`.
fn couplings(source: &Source, robot: &urdf_rs::Robot, joints: &[Joint]) -> Result<Vec<Coupling>, Error> {
    let moving = |name: &str| joints.iter().position(|j| j.name == name && j.kind != JointKind::Fixed);
    let mut all = Vec::new();
    for joint in &robot.joints {
        let Some(mimic) = joint.mimic.as_ref().filter(|_| joint.joint_type != JointType::Fixed) else {
            continue;
        };
        let wrong = |problem: String| source.joint(&joint.name, format!("<mimic>: {problem}"));
        let Some(follower) = moving(&joint.name) else { continue };
        let leader = moving(&mimic.joint);
        let leader = leader.ok_or_else(|| wrong(format!("no moving joint is called `{}`", mimic.joint)))?;
        let (ratio, offset) = (mimic.multiplier.unwrap_or(1.0), mimic.offset.unwrap_or(0.0));
        if leader == follower {
            return Err(wrong("it follows another joint, not itself".into()));
        }
        all.push(Coupling { name: format!("{}_mimic", joint.name), follower, leader, ratio, offset });
    }
    for coupling in &all {
        let next = |j: usize| all.iter().find(|c: &&Coupling| c.follower == j).map(|c| c.leader);
        let mut chain = std::iter::successors(Some(coupling.leader), |j: &usize| next(*j)).take(joints.len());
        if chain.any(|j| j == coupling.follower) {
            let problem = "<mimic>: joints follow each other in a circle; one of them has to lead";
            return Err(source.joint(&joints[coupling.follower].name, problem));
        }
    }
    Ok(all)
}

/// Doubts about the masses of the bodies, together and one by one.
fn doubtful(source: &Source, bodies: &[Body]) -> impl Iterator<Item = String> {
    let odd = bodies.iter().filter_map(|Body { name, mass, com, inertia, .. }| {
        let odd = plausible::body(&Inertial { mass: *mass, com: *com, tensor: *inertia })?;
        Some(source.link(name, odd).to_string())
    });
    mass_spread(source.file, bodies).into_iter().chain(plausible::first(odd.collect()))
}

fn check_world(
    source: &Source,
    robot: &urdf_rs::Robot,
    merged: &Merged,
    fixed_base: bool,
) -> Result<(), Error> {
    let root = &robot.links[merged.first[0].0].name;
    if merged.chief.len() == 1 {
        return Err(source.link(root, "the robot has no mass at all; give at least one link an <inertial>"));
    }
    if root == "world" || fixed_base {
        return Ok(());
    }
    let problem = "the root has no mass and cannot move; give it an <inertial>, name it `world`, \
                   or set fixed_base = true";
    Err(source.link(root, problem))
}

fn joint(
    source: &Source,
    robot: &urdf_rs::Robot,
    merged: &Merged,
    j: usize,
    child_link: usize,
    child: usize,
    shift: usize,
) -> Result<Joint, Error> {
    let joint = &robot.joints[j];
    let (kind, limited) = kind(source, joint)?;
    let parent_link = robot.links.iter().position(|l| l.name == joint.parent.link).unwrap_or(0);
    let axis = Vector3::from(joint.axis.xyz.0);
    if kind != JointKind::Fixed && axis.norm() <= 1e-9 {
        let problem =
            format!("the axis {:?} has no direction; write e.g. <axis xyz=\"0 0 1\"/>", joint.axis.xyz.0);
        return Err(source.joint(&joint.name, problem));
    }
    let axis = if kind == JointKind::Fixed { Vector3::x() } else { axis };
    let parent = merged.group[parent_link].checked_sub(shift);
    Ok(Joint {
        name: joint.name.clone(),
        kind,
        parent,
        child,
        parent_from_joint: merged.body_from_link(parent_link) * isometry(&joint.origin),
        child_from_joint: merged.body_from_link(child_link),
        axis: Unit::new_normalize(axis),
        limits: if limited { limits(source, joint)? } else { None },
        data: data(source, joint)?,
    })
}

fn kind(source: &Source, joint: &urdf_rs::Joint) -> Result<(JointKind, bool), Error> {
    match joint.joint_type {
        JointType::Revolute => Ok((JointKind::Revolute, true)),
        JointType::Continuous => Ok((JointKind::Revolute, false)),
        JointType::Prismatic => Ok((JointKind::Prismatic, true)),
        JointType::Fixed => Ok((JointKind::Fixed, false)),
        JointType::Planar => Ok((JointKind::Planar, false)),
        JointType::Spherical => Ok((JointKind::Spherical, false)),
        ref other => Err(source.joint(
            &joint.name,
            format!("type `{other:?}` cannot be simulated; use revolute, continuous, prismatic, planar, spherical or fixed"),
        )),
    }
}

/// The range of a joint; where both ends are the same there is none, as in MuJoCo.
fn limits(source: &Source, joint: &urdf_rs::Joint) -> Result<Option<[f64; 2]>, Error> {
    let (lower, upper) = (joint.limit.lower, joint.limit.upper);
    if lower > upper {
        let problem = format!(
            "the limits {lower} … {upper} leave no room; write <limit lower= upper= …> with lower < upper, or make it continuous or fixed"
        );
        return Err(source.joint(&joint.name, problem));
    }
    Ok((lower < upper).then_some([lower, upper]))
}

/// Says which joints move without limits though their kind has some.
fn without_limits(source: &Source, robot: &urdf_rs::Robot) -> Option<String> {
    let mut open = robot.joints.iter().filter(|j| {
        matches!(j.joint_type, JointType::Revolute | JointType::Prismatic) && j.limit.lower == j.limit.upper
    });
    let (first, more) = (open.next()?, open.count());
    let says = if has_range(source, &first.name) {
        format!("the limits {0} … {0} leave no room", first.limit.lower)
    } else {
        "<limit> has neither `lower` nor `upper`, and 0 … 0 leaves no room".into()
    };
    let more = if more > 0 { format!(" ({more} more like it)") } else { String::new() };
    let text =
        format!("{says}: it moves without limits, as in MuJoCo{more}; write lower < upper, or make it fixed");
    Some(source.joint(&first.name, text).to_string())
}

/// Says which fixed joints follow others, which does nothing.
fn fixed_followers(source: &Source, robot: &urdf_rs::Robot) -> Option<String> {
    let mut idle = robot.joints.iter().filter(|j| j.mimic.is_some() && j.joint_type == JointType::Fixed);
    let (first, more) = (idle.next()?, idle.count());
    let more = if more > 0 { format!(" ({more} more like it)") } else { String::new() };
    let text = format!(
        "<mimic> does nothing on a fixed joint{more}; make it revolute or prismatic, or leave <mimic> out"
    );
    Some(source.joint(&first.name, text).to_string())
}

/// Whether a joint names one of its limits at all.
fn has_range(source: &Source, joint: &str) -> bool {
    let Ok(document) = roxmltree::Document::parse(source.text) else { return false };
    let mut joints = document.root_element().children().filter(|n| n.attribute("name") == Some(joint));
    joints.any(|j| {
        let mut limits = j.children().filter(|n| n.has_tag_name("limit"));
        limits.any(|l| l.attribute("lower").or(l.attribute("upper")).is_some())
    })
}
