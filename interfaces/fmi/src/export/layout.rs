//! Which value reference stands for which variable, or for which element of an array.

use crate::description::Version;
use terraglue_subsystem::{ValueType, Variable};

/// Variable, or element of one, behind a value reference.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Name in the description.
    pub name: String,
    /// Position in the variables of the subsystem.
    pub variable: usize,
    /// Element of an array that is shown element by element.
    pub element: Option<usize>,
}

/// All value references of an FMU: entry k has the reference k + 1; 0 is the time (FMI 3.0).
#[derive(Clone, Debug, PartialEq)]
pub struct Layout {
    /// Version of the standard.
    pub version: Version,
    /// In the order of the variables.
    pub entries: Vec<Entry>,
}

impl Layout {
    /// Lays out variables. Arrays are shown element by element in FMI 2.0 or where `scalars` asks for it. Types that
    /// the version does not have are left out.
    pub fn new(version: Version, scalars: bool, variables: &[Variable]) -> Self {
        let split = scalars || version == Version::V2;
        let mut entries = Vec::new();
        for (k, v) in variables.iter().enumerate().filter(|(_, v)| has_type(version, v.value_type)) {
            if v.dims.is_empty() || !split {
                entries.push(Entry { name: v.name.clone(), variable: k, element: None });
                continue;
            }
            for element in 0..v.len() {
                entries.push(Entry { name: v.element_name(element), variable: k, element: Some(element) });
            }
        }
        Self { version, entries }
    }

    /// Entry of a value reference.
    pub fn entry(&self, reference: u32) -> Option<&Entry> {
        self.entries.get((reference as usize).checked_sub(1)?)
    }

    /// Names of variables that the version has no type for.
    pub fn left_out<'a>(&'a self, variables: &'a [Variable]) -> impl Iterator<Item = &'a str> {
        let out = |v: &&Variable| !has_type(self.version, v.value_type);
        variables.iter().filter(out).map(|v| v.name.as_str())
    }
}

fn has_type(version: Version, value_type: ValueType) -> bool {
    use ValueType::*;
    match (version, value_type) {
        (_, Clock) => false,
        (Version::V3, _) => true,
        (Version::V2, I64 | U32 | U64 | Binary) => false,
        (Version::V2, _) => true,
    }
}
