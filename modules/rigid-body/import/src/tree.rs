//! The order of the links: one root, every other link below exactly one joint.

use crate::error::{Error, Source};
use std::collections::BTreeMap;
use urdf_rs::Robot;

/// A link and the joint above it, as indices into the file.
pub(crate) struct LinkPlace {
    pub(crate) link: usize,
    pub(crate) joint: Option<usize>,
}

/// Links from the root downwards, each after its parent, children in the order of the file.
pub(crate) fn order(source: &Source, robot: &Robot) -> Result<Vec<LinkPlace>, Error> {
    let links = names(source, robot)?;
    let above = joints_above(source, robot, &links)?;
    let root = root(source, robot, &above)?;
    let mut below: Vec<Vec<usize>> = vec![Vec::new(); robot.links.len()];
    for (j, joint) in robot.joints.iter().enumerate() {
        below[links[joint.parent.link.as_str()]].push(j);
    }
    let mut order = Vec::with_capacity(robot.links.len());
    let mut open = vec![LinkPlace { link: root, joint: None }];
    while let Some(place) = open.pop() {
        let children = &below[place.link];
        order.push(place);
        open.extend(
            children
                .iter()
                .rev()
                .map(|j| LinkPlace { link: links[robot.joints[*j].child.link.as_str()], joint: Some(*j) }),
        );
    }
    if order.len() < robot.links.len() {
        return Err(unreached(source, robot, &order));
    }
    Ok(order)
}

fn names<'a>(source: &Source, robot: &'a Robot) -> Result<BTreeMap<&'a str, usize>, Error> {
    let mut links = BTreeMap::new();
    for (i, link) in robot.links.iter().enumerate() {
        if links.insert(link.name.as_str(), i).is_some() {
            return Err(source.link(&link.name, "the name is used twice; names of links are unique"));
        }
    }
    if robot.links.is_empty() {
        return Err(source.tree("there is no <link>; a robot needs at least one with an <inertial>"));
    }
    let mut joints = std::collections::BTreeSet::new();
    match robot.joints.iter().find(|j| !joints.insert(j.name.as_str())) {
        Some(j) => Err(source.joint(&j.name, "the name is used twice; names of joints are unique")),
        None => Ok(links),
    }
}

fn joints_above(
    source: &Source,
    robot: &Robot,
    links: &BTreeMap<&str, usize>,
) -> Result<Vec<Option<usize>>, Error> {
    let mut above: Vec<Option<usize>> = vec![None; robot.links.len()];
    for (j, joint) in robot.joints.iter().enumerate() {
        for name in [&joint.parent.link, &joint.child.link] {
            if !links.contains_key(name.as_str()) {
                let problem = format!("there is no link `{name}`{}", nearest(name, links));
                return Err(source.joint(&joint.name, problem));
            }
        }
        let child = &mut above[links[joint.child.link.as_str()]];
        if let Some(first) = *child {
            let problem = format!(
                "link `{}` already hangs below joint `{}`: this closes a loop, and URDF describes trees; \
                 remove one of the two joints",
                joint.child.link, robot.joints[first].name
            );
            return Err(source.joint(&joint.name, problem));
        }
        *child = Some(j);
    }
    Ok(above)
}

fn root(source: &Source, robot: &Robot, above: &[Option<usize>]) -> Result<usize, Error> {
    let roots: Vec<usize> = (0..above.len()).filter(|l| above[*l].is_none()).collect();
    match roots[..] {
        [root] => Ok(root),
        [] => {
            Err(source.tree("every link hangs below another one: the joints form a loop; remove one joint"))
        }
        [first, second, ..] => {
            let (first, second) = (&robot.links[first].name, &robot.links[second].name);
            let problem = format!(
                "is not connected with `{first}`: a robot has one root; add a joint or remove the link"
            );
            Err(source.link(second, problem))
        }
    }
}

fn unreached(source: &Source, robot: &Robot, order: &[LinkPlace]) -> Error {
    let lost = (0..robot.links.len()).find(|l| order.iter().all(|p| p.link != *l)).unwrap_or(0);
    let problem = "cannot be reached from the root: the joints around it form a loop; remove one of them";
    source.link(&robot.links[lost].name, problem)
}

fn nearest(name: &str, links: &BTreeMap<&str, usize>) -> String {
    let near = links.keys().min_by_key(|l| strsim::damerau_levenshtein(l, name));
    near.map(|l| format!("; did you mean `{l}`?")).unwrap_or_default()
}
