//! Links that move as one: a link without mass, or with an inertia that no body can have, becomes part of the link that it is
//! fixed to. Links that can stand alone stay bodies of their own, so that forces on a foot and on its leg stay separate.

use crate::check::isometry;
use crate::error::Source;
use crate::inertia::{Inertial, flaw, shown};
use crate::tree::LinkPlace;
use nalgebra::{Isometry3, Point3};
use urdf_rs::{JointType, Robot};

/// Links by the body that they belong to.
pub(crate) struct Merged {
    /// Per link: its group.
    pub group: Vec<usize>,
    /// Per link: its frame in the frame of the group's first link.
    pub group_from_link: Vec<Isometry3<f64>>,
    /// Per group: the link with mass that gives it name and frame.
    pub chief: Vec<Option<usize>>,
    /// Per group: its first link and the joint above it.
    pub first: Vec<(usize, Option<usize>)>,
    /// Per group: all links with mass.
    massive: Vec<Vec<usize>>,
}

/// Groups the links; `order` has parents first. Links fixed to a massless root called `world` belong to it.
pub(crate) fn merge(robot: &Robot, order: &[LinkPlace], inertials: &[Option<Inertial>]) -> Merged {
    let n = robot.links.len();
    let mut m = Merged {
        group: vec![0; n],
        group_from_link: vec![Isometry3::identity(); n],
        chief: Vec::new(),
        first: Vec::new(),
        massive: Vec::new(),
    };
    let in_world =
        order.first().is_some_and(|p| robot.links[p.link].name == "world" && inertials[p.link].is_none());
    let sound = |link: Option<usize>| link.and_then(|l| inertials[l]).is_some_and(|i| i.is_sound());
    for place in order {
        let link = place.link;
        let joint = place.joint.map(|j| &robot.joints[j]).filter(|j| j.joint_type == JointType::Fixed);
        let parent = joint.and_then(|j| robot.links.iter().position(|l| l.name == j.parent.link));
        if let (Some(joint), Some(parent)) = (joint, parent) {
            let group = m.group[parent];
            let still = in_world && group == 0;
            if still || !sound(Some(link)) || !sound(m.chief[group]) {
                m.group[link] = group;
                m.group_from_link[link] = m.group_from_link[parent] * isometry(&joint.origin);
                if !still {
                    m.add_mass(group, link, inertials, sound(Some(link)));
                }
                continue;
            }
        }
        m.group[link] = m.chief.len();
        m.chief.push(None);
        m.massive.push(Vec::new());
        m.first.push((link, place.joint));
        m.add_mass(m.group[link], link, inertials, true);
    }
    m
}

impl Merged {
    /// A sound link leads its group, else the heaviest one.
    fn add_mass(&mut self, group: usize, link: usize, inertials: &[Option<Inertial>], sound: bool) {
        let Some(own) = inertials[link] else { return };
        self.massive[group].push(link);
        let heavier =
            self.chief[group].and_then(|c| inertials[c]).is_none_or(|c| own.mass > c.mass && !c.is_sound());
        if sound || heavier {
            self.chief[group] = Some(link);
        }
    }

    /// Frame of a link in the frame of its group's body.
    pub fn body_from_link(&self, link: usize) -> Isometry3<f64> {
        let body = self.chief[self.group[link]].unwrap_or(self.first[self.group[link]].0);
        self.group_from_link[body].inverse() * self.group_from_link[link]
    }

    /// Of all links of a group together, in the frame of its body.
    pub fn together(&self, group: usize, inertials: &[Option<Inertial>]) -> Option<Inertial> {
        let placed = self.massive[group].iter().filter_map(|l| {
            let (pose, own) = (self.body_from_link(*l), inertials[*l]?);
            let r = pose.rotation.to_rotation_matrix();
            let com = (pose * Point3::from(own.com)).coords;
            Some(Inertial { mass: own.mass, com, tensor: r * own.tensor * r.transpose() })
        });
        placed.reduce(|a, b| a.with(&b))
    }

    /// Says which links with mass are no bodies of their own, and why: one warning for all.
    pub fn warning(&self, source: &Source, robot: &Robot, inertials: &[Option<Inertial>]) -> Option<String> {
        let mut parts = self.massive.iter().enumerate().flat_map(|(group, links)| {
            let chief = self.chief[group];
            links.iter().filter(move |l| Some(**l) != chief).map(move |l| (group, *l))
        });
        let (group, link) = parts.next()?;
        let chief = &robot.links[self.chief[group]?].name;
        let own = inertials[link]?;
        let why = flaw(&own.tensor).unwrap_or_else(|| format!("its mass is {} kg", own.mass));
        let all = self.together(group, inertials)?;
        let more: Vec<String> = parts.map(|(_, l)| format!("`{}`", robot.links[l].name)).collect();
        let more = match more.len() {
            0 => String::new(),
            n => format!(" ({n} more like it: {})", more.join(", ")),
        };
        let text = format!(
            "{why}; it is fixed to `{chief}` and counts as part of it: together {} kg, {}{more}",
            format!("{:.9}", all.mass).trim_end_matches('0').trim_end_matches('.'),
            shown(&all.tensor)
        );
        Some(source.link(&robot.links[link].name, text).to_string())
    }
}
