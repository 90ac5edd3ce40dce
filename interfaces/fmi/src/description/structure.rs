//! The model structure: which outputs and initial unknowns there are, and their dependencies.

use super::element::Element;
use super::model::*;
use crate::error::Result;
use std::collections::BTreeMap;

/// Reads the structure into the description.
pub fn read(root: &Element, description: &mut ModelDescription) -> Result {
    let Some(structure) = root.child("ModelStructure") else {
        description.problems.push("there is no <ModelStructure>".into());
        return Ok(());
    };
    let lookup = Lookup::of(description);
    let (outputs, initial) = match description.version {
        Version::V2 => (lookup.below(&structure, "Outputs")?, lookup.below(&structure, "InitialUnknowns")?),
        Version::V3 => (lookup.named(&structure, "Output")?, lookup.named(&structure, "InitialUnknown")?),
    };
    (description.outputs, description.initial_unknowns) = (outputs, initial);
    Ok(())
}

/// Positions of variables by the number that elements of the structure have for them.
pub struct Lookup {
    version: Version,
    by_reference: BTreeMap<u32, usize>,
    count: usize,
}

impl Lookup {
    /// Of the variables of a description.
    pub fn of(description: &ModelDescription) -> Self {
        let mut by_reference = BTreeMap::new();
        for (k, v) in description.variables.iter().enumerate().filter(|(_, v)| !v.alias) {
            by_reference.entry(v.reference).or_insert(k);
        }
        Self { version: description.version, by_reference, count: description.variables.len() }
    }

    /// The attribute that holds the number.
    pub fn key(&self) -> &'static str {
        if self.version == Version::V2 { "index" } else { "valueReference" }
    }

    /// The position of the variable with this number: its place from 1 in FMI 2, its number in calls in FMI 3.
    pub fn find(&self, number: u32) -> Option<usize> {
        match self.version {
            Version::V2 => (number as usize).checked_sub(1).filter(|k| *k < self.count),
            Version::V3 => self.by_reference.get(&number).copied(),
        }
    }

    fn below(&self, structure: &Element, list: &str) -> Result<Vec<Unknown>> {
        let children = structure.child(list).into_iter().flat_map(|e| e.children().collect::<Vec<_>>());
        children.filter(|e| e.name() == "Unknown").map(|e| self.unknown(&e)).collect()
    }

    fn named(&self, structure: &Element, name: &str) -> Result<Vec<Unknown>> {
        structure.children().filter(|e| e.name() == name).map(|e| self.unknown(&e)).collect()
    }

    fn unknown(&self, element: &Element) -> Result<Unknown> {
        let variable = self.position(element, element.reference(self.key())?)?;
        let dependencies = match element.attribute("dependencies") {
            None => None,
            Some(text) => {
                let numbers = text.split_whitespace().map(|w| {
                    let n =
                        w.parse().map_err(|_| element.wrong("dependencies", text, "a list of numbers"))?;
                    self.position(element, n)
                });
                Some(numbers.collect::<Result<Vec<_>>>()?)
            }
        };
        Ok(Unknown { variable, dependencies })
    }

    fn position(&self, element: &Element, number: u32) -> Result<usize> {
        self.find(number).ok_or_else(|| element.error(format!("no variable has the number {number}")))
    }
}
