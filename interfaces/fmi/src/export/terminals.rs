//! Terminals of FMI 3.0: the variables of a body, and those of driven feet, named as what plugs into another FMU.
//!
//! A group `NAME.x`, `NAME.y`, `NAME.z` is a body (`org.terraglue.body`), a group `NAME.position`, `NAME.force` are feet
//! (`org.terraglue.feet`, a row per foot). Members are matched by their names.

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

/// `terminalsAndIcons.xml`; none where there is no terminal, or before FMI 3.0.
pub fn terminals(layout: &Layout) -> Option<String> {
    let all = groups(layout);
    if layout.version == Version::V2 || all.is_empty() {
        return None;
    }
    let mut xml = Xml::new();
    xml.open("fmiTerminalsAndIcons", &[("fmiVersion", &"3.0")]);
    xml.open("Terminals", &[]);
    for (prefix, kind, members) in all {
        // the name of a terminal has no dots: those would be terminals inside it
        let name = prefix.replace('.', "_");
        xml.open("Terminal", &[("name", &name), ("matchingRule", &"bus"), ("terminalKind", &kind)]);
        for member in members {
            let variable = format!("{prefix}.{member}");
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
        let text = terminals(&layout).expect("terminals");
        assert!(
            text.contains("<Terminal name=\"robot_leg\"")
                && text.contains("variableName=\"robot.leg.force_x\"")
        );
        assert_eq!(terminals(&Layout::new(Version::V2, false, &variables)), None);
    }
}
