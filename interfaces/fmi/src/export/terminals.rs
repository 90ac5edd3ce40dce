//! Terminals of FMI 3.0: the variables of a body, of a joint, and those of driven feet, as they plug into another FMU.
//!
//! Joints (`org.terraglue.joint`) come from the subsystem itself, with the names of their variables. A group `NAME.x`, `NAME.y`, `NAME.z` is a body
//! (`org.terraglue.body`), a group `NAME.position`, `NAME.force` are feet (`org.terraglue.feet`, a row per foot). Members are matched by their
//! names.

use super::Layout;
use super::xml::Xml;
use crate::description::Version;

/// Members of a body: place, orientation (z-y-x Euler angles, unit quaternion), velocities, and the force at a point of the
/// body and the moment about it.
const BODY: [&str; 25] = [
    "x",
    "y",
    "z",
    "roll",
    "pitch",
    "yaw",
    "qw",
    "qx",
    "qy",
    "qz",
    "vx",
    "vy",
    "vz",
    "wx",
    "wy",
    "wz",
    "force_x",
    "force_y",
    "force_z",
    "moment_x",
    "moment_y",
    "moment_z",
    "force_at_x",
    "force_at_y",
    "force_at_z",
];
/// Members of feet.
const FEET: [&str; 4] = ["position", "orientation", "force", "moment"];

/// A joint with the names of the variables behind its members (`position`, `velocity`, `torque`, `torque_limit`, `blocked`).
#[derive(Clone, Debug, PartialEq)]
pub struct JointTerminal {
    /// Its full name.
    pub name: String,
    /// Members and variables.
    pub members: Vec<(&'static str, String)>,
}

/// A terminal: name, kind, members with their variables.
type ExportedTerminal = (String, &'static str, Vec<(&'static str, String)>);

/// All terminals; their names differ. The name of one has no dots: those would be terminals inside it.
fn all(layout: &Layout, joints: &[JointTerminal]) -> Vec<ExportedTerminal> {
    let mut all: Vec<ExportedTerminal> = Vec::new();
    for (prefix, kind, members) in groups(layout) {
        let members = members.into_iter().map(|m| (m, format!("{prefix}.{m}"))).collect();
        all.push((prefix.replace('.', "_"), kind, members));
    }
    for joint in joints {
        let is_there = |variable: &String| layout.entries.iter().any(|e| e.name == *variable);
        let members: Vec<_> = joint.members.iter().filter(|(_, v)| is_there(v)).cloned().collect();
        if members.is_empty() {
            continue;
        }
        let mut name = joint.name.replace('.', "_");
        // a body may have the name of the joint that carries it
        while all.iter().any(|(taken, ..)| *taken == name) {
            name += "_joint";
        }
        all.push((name, "org.terraglue.joint", members));
    }
    all
}

/// `terminalsAndIcons.xml`; none where there is no terminal, or before FMI 3.0.
pub fn terminals(layout: &Layout, joints: &[JointTerminal]) -> Option<String> {
    let all = all(layout, joints);
    if layout.version == Version::V2 || all.is_empty() {
        return None;
    }
    let mut xml = Xml::new();
    xml.open("fmiTerminalsAndIcons", &[("fmiVersion", &"3.0")]);
    xml.open("Terminals", &[]);
    for (name, kind, members) in all {
        xml.open("Terminal", &[("name", &name), ("matchingRule", &"bus"), ("terminalKind", &kind)]);
        for (member, variable) in members {
            xml.leaf(
                "TerminalMemberVariable",
                &[("variableName", &variable), ("memberName", &member), ("variableKind", &"signal")],
            );
        }
        xml.close("Terminal");
    }
    xml.close("Terminals");
    xml.close("fmiTerminalsAndIcons");
    Some(xml.finish())
}

type Group<'a> = (&'a str, &'static str, Vec<&'static str>);

/// Prefix, kind and members of every group, in the order of their first variable.
fn groups(layout: &Layout) -> Vec<Group<'_>> {
    let names: std::collections::BTreeSet<&str> = layout.entries.iter().map(|e| e.name.as_str()).collect();
    let has = |prefix: &str, member: &&&str| names.contains(format!("{prefix}.{member}").as_str());
    let group = |name: &str, first: &str, all: &[&'static str]| {
        let prefix = name.strip_suffix(first)?.strip_suffix('.')?;
        let members: Vec<&'static str> = all.iter().filter(|m| has(prefix, m)).copied().collect();
        Some((prefix.len(), members))
    };
    let mut out = Vec::new();
    for entry in &layout.entries {
        if let Some((length, members)) =
            group(&entry.name, "x", &BODY).filter(|(_, m)| m.starts_with(&["x", "y", "z"]))
        {
            out.push((&entry.name[..length], "org.terraglue.body", members));
        }
        if let Some((length, members)) =
            group(&entry.name, "position", &FEET).filter(|(_, m)| m.contains(&"force"))
        {
            out.push((&entry.name[..length], "org.terraglue.feet", members));
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use terraglue_subsystem::{Causality, Variable};

    #[test]
    fn joints_are_terminals_with_the_names_that_their_variables_have() {
        let real = |(k, name): (usize, &&str)| Variable::real(k as u32, *name, "", Causality::Output, "");
        let names = ["a.leg.x", "a.leg.y", "a.leg.z", "a.leg.angle", "a.leg.rate"];
        let variables: Vec<Variable> = names.iter().enumerate().map(real).collect();
        let layout = Layout::new(Version::V3, false, &variables);
        let joint = |name: &str, members: &[(&'static str, &str)]| JointTerminal {
            name: name.into(),
            members: members.iter().map(|(m, v)| (*m, (*v).to_owned())).collect(),
        };
        let moving = [("position", "a.leg.angle"), ("velocity", "a.leg.rate"), ("torque", "a.gone")];
        let found = all(&layout, &[joint("a.leg", &moving), joint("a.weld", &[])]);
        // the body has the same name; variables without a type in this version are left out, and joints without any
        assert_eq!(found.len(), 2);
        let members = moving[..2].iter().map(|(m, v)| (*m, (*v).to_owned())).collect();
        assert_eq!(found[1], ("a_leg_joint".to_owned(), "org.terraglue.joint", members));
        let text = terminals(&layout, &[joint("a.leg", &moving)]).expect("terminals");
        assert!(text.contains("variableName=\"a.leg.rate\" memberName=\"velocity\""), "{text}");
    }

    #[test]
    fn bodies_and_feet_are_terminals_and_nothing_else_is() {
        let names = [
            "gait.speed",
            "robot.leg.x",
            "robot.leg.y",
            "robot.leg.z",
            "robot.leg.force_x",
            "robot.leg.qw",
            "map.x",
        ];
        let feet = ["foot.position", "foot.force"];
        let real = |(k, name): (usize, &&str)| Variable::real(k as u32, *name, "m", Causality::Output, "");
        let variables: Vec<Variable> = names.iter().chain(&feet).enumerate().map(real).collect();
        let layout = Layout::new(Version::V3, false, &variables);
        let found = groups(&layout);
        let wanted = vec![
            ("robot.leg", "org.terraglue.body", vec!["x", "y", "z", "qw", "force_x"]),
            ("foot", "org.terraglue.feet", vec!["position", "force"]),
        ];
        assert_eq!(found, wanted);
        let text = terminals(&layout, &[]).expect("terminals");
        assert!(
            text.contains("<Terminal name=\"robot_leg\"")
                && text.contains("variableName=\"robot.leg.force_x\"")
        );
        assert_eq!(terminals(&Layout::new(Version::V2, false, &variables), &[]), None);
    }
}
