//! `cut`: one part of a robot that a scenario divides at joints, so that its parts are subsystems and meet in glue.
//!
//! The joint itself stays with the part beyond it, with its motor, stops and friction. The link above the joint is
//! divided: a share of its mass and inertia goes with the joint, the rest stays, and `[[glue]]` welds both pieces, which
//! move as one. So any joint can be cut, and the glue transmits the wrench that the link transmitted there. Shapes stay
//! with the root's piece. Both parts start from the pose and the rates of the whole robot.

use crate::joint::Joint;
use crate::math::V3;
use crate::model::{Body, Model};
use crate::motion::Motion;
use crate::placement::matches;
use crate::state::JointState;
use nalgebra::{Isometry3, Translation3};
use terraglue_robot_import as import;
use terraglue_subsystem::{Config, Error, Parameter, ParameterType, Result};

/// The parameters of the scenario.
pub(crate) fn parameters() -> [Parameter; 2] {
    [
        Parameter::of(
            "cut",
            ParameterType::TextByName,
            "Where the robot is cut, by joint: this subsystem is the part towards the root, or the one from the joint on to the \
             tip. The link above the joint is in both, and glue of all six components welds it",
        )
        .optional()
        .choices(&["root", "tip"]),
        Parameter::number("cut_share", "1", 0.25, "Share of a divided link that goes with each joint that is cut")
            .within(0.0, 1.0),
    ]
}

/// A robot as it starts.
pub(crate) struct Start<'a> {
    pub model: &'a mut Model,
    pub bodies: &'a mut Vec<Motion>,
    pub angles: &'a mut Vec<f64>,
    pub joints: &'a mut Vec<JointState>,
}

/// Which side of a joint stays.
#[derive(Clone, Copy, PartialEq)]
enum Side {
    Root,
    Tip,
}

/// Keeps the part that the scenario selects, also of the couplings and loops in `file`.
pub(crate) fn keep(
    config: &Config,
    base: &Isometry3<f64>,
    start: Start,
    file: &mut import::Robot,
) -> Result<()> {
    let cuts = cuts(config, start.model)?;
    if cuts.is_empty() {
        return Ok(());
    }
    let share = config.number("cut_share")?;
    if !(share > 0.0 && share < 1.0) {
        return Err(Error::Refused(format!("parameter `cut_share` = {share} must lie between 0 and 1")));
    }
    let kept = kept(start.model, &cuts);
    let places = |keep: &[bool]| -> Vec<Option<usize>> {
        let mut next = 0..;
        keep.iter().map(|k| k.then(|| next.next()).flatten()).collect()
    };
    divide(start.model, &cuts, share, &kept)?;
    let stays = |j: &Joint| kept[j.child] && j.parent.is_none_or(|p| kept[p]);
    let joints: Vec<bool> = start
        .model
        .joints
        .iter()
        .enumerate()
        .map(|(k, j)| stays(j) && !cuts.contains(&(k, Side::Root)) && !is_stub(start.model, &cuts, j.child))
        .collect();
    let (of_body, of_joint) = (places(&kept), places(&joints));
    follow(file, start.model, &of_body, &of_joint)?;
    retain(start.bodies, &kept);
    retain(start.angles, &joints);
    retain(start.joints, &joints);
    shrink(start.model, base, start.bodies, (&kept, &of_body), &joints);
    Ok(())
}

/// The joints that are cut, with the side that stays.
fn cuts(config: &Config, model: &Model) -> Result<Vec<(usize, Side)>> {
    let mut cuts = Vec::new();
    let Some(table) = config.get("cut") else { return Ok(cuts) };
    let refuse = |text: String| Error::Refused(format!("parameter `cut`: {text}"));
    let table = table.as_object();
    let table = table.ok_or_else(|| refuse("takes joints, `{ JOINT = \"root\" }` or `\"tip\"`".into()))?;
    for (pattern, side) in table {
        let side = if side.as_str() == Some("tip") { Side::Tip } else { Side::Root };
        let found = model.joints.iter().enumerate().filter(|(_, j)| matches(pattern, &j.name));
        let before = cuts.len();
        for (k, joint) in found {
            if joint.parent.is_none() {
                let text = format!("joint `{}` hangs from the world, which cannot be divided", joint.name);
                return Err(refuse(text));
            }
            cuts.push((k, side));
        }
        if cuts.len() == before {
            return Err(refuse(format!("no joint is called `{pattern}`")));
        }
    }
    cuts.sort_by_key(|c| c.0);
    if cuts.windows(2).any(|c| c[0].0 == c[1].0) {
        return Err(refuse("two patterns name one joint".into()));
    }
    Ok(cuts)
}

/// Whether a body is the piece of a divided link that belongs to the part beyond its joint: its root.
fn is_stub(model: &Model, cuts: &[(usize, Side)], body: usize) -> bool {
    cuts.iter().any(|(j, side)| *side == Side::Tip && model.joints[*j].parent == Some(body))
}

/// Bodies of this part.
fn kept(model: &Model, cuts: &[(usize, Side)]) -> Vec<bool> {
    let mut kept = vec![true; model.bodies.len()];
    for (cut, side) in cuts {
        let mut below = vec![false; kept.len()];
        below[model.joints[*cut].child] = true;
        // parents come before their children
        for joint in &model.joints {
            below[joint.child] |= joint.parent.is_some_and(|p| below[p]);
        }
        for (b, kept) in kept.iter_mut().enumerate() {
            let stub = model.joints[*cut].parent == Some(b);
            *kept &= match side {
                Side::Root => !below[b],
                Side::Tip => below[b] || stub,
            };
        }
    }
    kept
}

/// Gives every piece of a divided link its mass.
fn divide(model: &mut Model, cuts: &[(usize, Side)], share: f64, kept: &[bool]) -> Result<()> {
    for b in (0..kept.len()).filter(|b| kept[*b]) {
        let here = |side: Side| {
            let at = |c: &&(usize, Side)| c.1 == side && model.joints[c.0].parent == Some(b);
            cuts.iter().filter(at).count()
        };
        let (gone, stubs) = (here(Side::Root), here(Side::Tip));
        let part = if stubs > 0 { share } else { 1.0 - share * gone as f64 };
        if part == 1.0 {
            continue;
        }
        if !(part > 0.0) || stubs > 1 || (stubs > 0 && gone > 0) {
            return Err(Error::Refused(format!(
                "parameter `cut`: link `{}` is divided {} times; nothing of it is left with `cut_share` = {share}",
                model.bodies[b].name,
                gone + stubs
            )));
        }
        let body = &mut model.bodies[b];
        body.share = part;
        body.mass *= part;
        body.inertia *= part;
        body.inverse_inertia /= part;
        if stubs > 0 {
            body.shapes.clear();
        }
    }
    Ok(())
}

/// Couplings and loops of the file between bodies of this part.
fn follow(
    file: &mut import::Robot,
    model: &Model,
    of_body: &[Option<usize>],
    of_joint: &[Option<usize>],
) -> Result<()> {
    let across = |name: &str| {
        Err(Error::Refused(format!(
            "parameter `cut`: `{name}` of the robot file connects what the cut divides"
        )))
    };
    let welded = usize::from(model.welded && of_joint.first().is_some_and(Option::is_some));
    let joint = |k: usize| of_joint[model.joint_of_file(k)].map(|k| k - welded);
    let mut couplings = Vec::new();
    for c in std::mem::take(&mut file.couplings) {
        match [joint(c.follower), joint(c.leader)] {
            [Some(follower), Some(leader)] => {
                couplings.push(import::Coupling { follower, leader, ..c });
            }
            [None, None] => {}
            _ => return across(&c.name),
        }
    }
    file.couplings = couplings;
    let mut loops = Vec::new();
    for l in std::mem::take(&mut file.loops) {
        let here = l.bodies.map(|b| b.map(|b| of_body[b]));
        match here {
            [Some(None), Some(None)] | [Some(None), None] | [None, Some(None)] => {}
            [Some(None), _] | [_, Some(None)] => return across(&l.name),
            _ => loops.push(import::Loop { bodies: here.map(Option::flatten), ..l }),
        }
    }
    file.loops = loops;
    Ok(())
}

fn retain<T>(list: &mut Vec<T>, keep: &[bool]) {
    let mut keep = keep.iter();
    list.retain(|_| keep.next().copied().unwrap_or(true));
}

/// Reduces the model to the part that stays; a divided link at the root of the part moves freely from where it is.
fn shrink(
    model: &mut Model,
    base: &Isometry3<f64>,
    bodies: &[Motion],
    (kept, of_body): (&[bool], &[Option<usize>]),
    joints: &[bool],
) {
    let own = kept[..model.own].iter().filter(|k| **k).count();
    model.welded &= joints.first() == Some(&true);
    retain(&mut model.bodies, kept);
    retain(&mut model.free, kept);
    retain(&mut model.joints, joints);
    for joint in &mut model.joints {
        joint.child = of_body[joint.child].unwrap_or(0);
        joint.parent = joint.parent.and_then(|p| of_body[p]);
    }
    let both = |pair: &[usize; 2]| Some([of_body[pair[0]]?, of_body[pair[1]]?]);
    model.excluded = model.excluded.iter().filter_map(both).collect();
    model.own = own;
    model.joint_above = vec![None; model.bodies.len()];
    for (k, joint) in model.joints.iter().enumerate() {
        model.joint_above[joint.child] = Some(k);
    }
    for (b, motion) in bodies.iter().enumerate() {
        if model.joint_above[b].is_none() {
            let pose = frame(&model.bodies[b], motion);
            model.free[b] = Some(base.inverse() * pose);
        }
    }
}

/// Pose of a body's frame in the world.
fn frame(body: &Body, motion: &Motion) -> Isometry3<f64> {
    let origin: V3 = motion.point(&-body.com);
    Isometry3::from_parts(Translation3::from(origin), motion.q)
}
