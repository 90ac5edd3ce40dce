//! Description of a module, readable without running it: the section `.terraglue` of a library, or the docstring of a
//! file in Python, and the check of an instance against it.

use std::path::Path;
use terraglue_fmi::elf::section;
use terraglue_plugin::describe::{variable_line, words};
use terraglue_subsystem::{Capabilities, Variable};

/// Description of a module in its section.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Description {
    /// Name of its package.
    pub name: String,
    /// Version of its package.
    pub version: String,
    /// MAJOR.MINOR of the ABI that it was built for.
    pub abi: String,
    /// Soil, robot, controller, law or sensor; empty: not given.
    pub kind: String,
    /// Capabilities of an instance, in the words of [`terraglue_plugin::describe::WORDS`]; None: not given.
    pub can: Option<Vec<String>>,
    /// Its variables, `NAME ROLE TYPE UNIT`: a `*` in a name matches any text, ` | ` separates units.
    pub variables: Vec<String>,
    /// Licence; empty: not given.
    pub license: String,
    /// Authors, separated by `:`; empty: not given.
    pub authors: String,
}

impl Description {
    /// From a file; None: unreadable, no such section, or not of our form.
    pub fn read(path: &Path) -> Option<Self> {
        Self::of(&terraglue_subsystem::files::read(path).ok()?)
    }

    /// From the bytes of a library.
    pub(super) fn of(bytes: &[u8]) -> Option<Self> {
        let section = section(bytes, terraglue_plugin::SECTION)?;
        Self::parse(str::from_utf8(section.split(|b| *b == 0).next()?).ok()?)
    }

    /// From its text.
    pub fn parse(text: &str) -> Option<Self> {
        let mut lines = text.lines();
        if lines.next() != Some("terraglue module") {
            return None;
        }
        let mut out = Self::default();
        for (key, value) in lines.filter_map(|l| l.split_once('=')) {
            let value = value.trim_end();
            match key {
                "name" => out.name = value.into(),
                "version" => out.version = value.into(),
                "abi" => out.abi = value.into(),
                "kind" => out.kind = value.into(),
                "can" => out.can = Some(value.split_whitespace().map(Into::into).collect()),
                "variable" => out.variables.push(value.into()),
                "license" => out.license = value.into(),
                "authors" => out.authors = value.into(),
                _ => {}
            }
        }
        Some(out)
    }

    /// The major version of the ABI.
    pub(super) fn abi_major(&self) -> Option<u32> {
        self.abi.split('.').next()?.parse().ok()
    }

    /// Whether it says the kind and what an instance can do.
    pub fn is_whole(&self) -> bool {
        !self.kind.is_empty() && self.can.is_some()
    }

    /// First contradiction between the description and an instance: the described and the real property.
    pub fn contradiction(
        &self,
        capabilities: Capabilities,
        variables: &[Variable],
    ) -> Option<(String, String)> {
        self.other_words(&words(capabilities)).or_else(|| self.other_variables(variables))
    }

    /// The same for what it can do alone; of a law its functions.
    pub fn other_words(&self, can: &[&str]) -> Option<(String, String)> {
        let mut said: Vec<&str> = self.can.iter().flatten().map(String::as_str).collect();
        let mut does = can.to_vec();
        said.sort_unstable();
        does.sort_unstable();
        (said != does).then(|| (format!("can={}", said.join(" ")), format!("can={}", can.join(" "))))
    }

    fn other_variables(&self, variables: &[Variable]) -> Option<(String, String)> {
        let lines: Vec<String> = variables.iter().map(variable_line).collect();
        if let Some(line) = lines.iter().find(|line| !self.variables.iter().any(|said| covers(said, line))) {
            return Some(("no such variable".into(), format!("variable={line}")));
        }
        let must = |said: &&String| !said.split(' ').next().unwrap_or_default().contains('*');
        let absent = |said: &&String| !lines.iter().any(|line| covers(said, line));
        let said = self.variables.iter().filter(must).find(absent)?;
        let hint = "no such variable; a `*` in its name allows that it is missing";
        Some((format!("variable={said}"), hint.into()))
    }
}

/// Whether a line of a description covers a variable.
fn covers(said: &str, line: &str) -> bool {
    let parts = |line: &str| {
        let mut parts = line.splitn(4, ' ').map(str::to_owned);
        [(); 4].map(|()| parts.next().unwrap_or_default())
    };
    let ([name, role, what, unit], own) = (parts(said), parts(line));
    matches(&name, &own[0])
        && role == own[1]
        && what == own[2]
        && unit.split(" | ").any(|unit| unit == own[3])
}

/// Whether a text matches the pattern, in which `*` matches any text, the empty one included.
fn matches(pattern: &str, text: &str) -> bool {
    let Some((head, rest)) = pattern.split_once('*') else { return pattern == text };
    let Some(text) = text.strip_prefix(head) else { return false };
    (0..=text.len()).filter(|k| text.is_char_boundary(*k)).any(|k| matches(rest, &text[k..]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use terraglue_subsystem::Causality;

    const TEXT: &str = "terraglue module\nname=a\nversion=1\nabi=2.1\nkind=robot\ncan=retry force\n\
        variable=*.torque output f64 N m | N\nvariable=speed parameter f64 m/s\nvariable=z* output f64\n";

    fn real(name: &str, unit: &str, role: Causality) -> Variable {
        Variable::real(0, name, unit, role, "")
    }

    #[test]
    fn files_that_are_no_library_have_no_description() {
        assert_eq!(Description::of(b""), None);
        assert_eq!(Description::of(b"#!/bin/sh\n"), None);
        assert_eq!(Description::parse("name=a\n"), None);
    }

    #[test]
    fn an_instance_agrees_or_is_told_what_differs() {
        let said = Description::parse(TEXT).expect("a description");
        assert!(said.is_whole());
        let can = Capabilities::FORCE | Capabilities::RETRY;
        let speed = real("speed", "m/s", Causality::Parameter);
        let right =
            [speed.clone(), real("hip.torque", "N m", Causality::Output), real("z", "", Causality::Output)];
        assert_eq!(said.contradiction(can, &right), None);
        let slides = [speed.clone(), real("rail.torque", "N", Causality::Output)];
        assert_eq!(said.contradiction(can, &slides), None);
        let told = |variables: &[Variable]| said.contradiction(can, variables).expect("a difference");
        assert!(said.contradiction(Capabilities::FORCE, &right).is_some_and(|(_, does)| does == "can=force"));
        assert_eq!(told(&[]).0, "variable=speed parameter f64 m/s");
        let more = [speed, real("hip.torque", "J", Causality::Output)];
        assert_eq!(told(&more).1, "variable=hip.torque output f64 J");
    }

    #[test]
    fn stars_stand_for_any_text() {
        for (pattern, text, same) in [
            ("*_j*.angle", "LF_j2.angle", true),
            ("*_j*.angle", "LF.angle", false),
            ("a*", "a", true),
            ("a", "ab", false),
            ("*.x", "ä.b.x", true),
        ] {
            assert_eq!(matches(pattern, text), same, "{pattern} {text}");
        }
    }
}
