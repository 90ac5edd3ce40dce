//! A system structure without its systems: units by path, and every way from one unit to another.

use super::super::map;
use std::collections::BTreeMap;
use terraglue_fmi::description::{ModelDescription, Variable};
use terraglue_fmi::ssp::{Component, Connector, Element, End, Package, System, Transformation};
use terraglue_fmi::{Error, Fmu, Result};
use terraglue_subsystem::unit::Unit;

/// Path of an element (`outer/inner`, empty: the outermost system) and one of its connectors.
pub type Key = (String, String);

/// target = a · value + b.
pub type Affine = (f64, f64);

/// A unit of the structure.
pub struct Part<'a> {
    /// Name of its table in the scenario.
    pub name: String,
    /// Path in the structure.
    pub path: String,
    /// What the structure says of it.
    pub component: &'a Component,
    /// What it says of itself.
    pub description: ModelDescription,
}

impl Part<'_> {
    /// A variable, by name; elements of arrays by the name of the array.
    pub fn variable(&self, name: &str) -> Option<&Variable> {
        let base = name.split_once('[').map_or(name, |(base, _)| base);
        let find = |name: &str| self.description.position(name).map(|k| &self.description.variables[k]);
        find(name).or_else(|| find(base))
    }

    /// The unit that the FMU itself gives a variable.
    pub fn own_unit(&self, name: &str) -> Option<Unit> {
        let text = map::unit(&self.description, self.variable(name)?);
        Unit::parse(&text).ok().filter(|_| !text.is_empty())
    }
}

/// A way from one unit to another.
pub struct Way {
    /// Output.
    pub from: Key,
    /// Input.
    pub to: Key,
    /// How the value changes on the way.
    pub affine: Affine,
}

struct Edge {
    start: Key,
    end: Key,
    transformation: Transformation,
}

/// Units and connections of all systems.
pub struct Network<'a> {
    /// In the order of the structure.
    pub parts: Vec<Part<'a>>,
    edges: Vec<Edge>,
    /// Units that the structure gives connectors.
    units: BTreeMap<Key, Unit>,
}

/// Path of an element inside a system.
pub fn below(path: &str, element: &str) -> String {
    if path.is_empty() { element.to_owned() } else { format!("{path}/{element}") }
}

impl<'a> Network<'a> {
    /// Reads the descriptions of all units and resolves the connections.
    ///
    /// # Errors
    /// A unit that cannot be read, a connection to what does not exist.
    pub fn new(package: &'a Package) -> Result<Self> {
        let mut network = Self { parts: Vec::new(), edges: Vec::new(), units: BTreeMap::new() };
        network.system(package, "", &package.structure().system)?;
        Ok(network)
    }

    fn system(&mut self, package: &Package, path: &str, system: &'a System) -> Result {
        self.connectors(path, &system.connectors);
        for element in &system.elements {
            let inner = below(path, element.name());
            match element {
                Element::System(nested) => self.system(package, &inner, nested)?,
                Element::Component(component) => {
                    let (description, _) = Fmu::inspect(&package.folder().join(&component.source))?;
                    self.connectors(&inner, &component.connectors);
                    let name = self.free_name(&inner);
                    self.parts.push(Part { name, path: inner, component, description });
                }
            }
        }
        for connection in &system.connections {
            let ends = [&connection.start, &connection.end].map(|end| self.end(package, path, system, end));
            let [start, end] = ends;
            let edge = Edge { start: start?, end: end?, transformation: connection.transformation };
            if let Some(other) = self.edges.iter().find(|e| e.end == edge.end) {
                let ends = [&edge.end, &other.start, &edge.start].map(shown);
                let message = format!("{} is fed by {} and by {}", ends[0], ends[1], ends[2]);
                return Err(refused(package, message));
            }
            self.edges.push(edge);
        }
        Ok(())
    }

    fn connectors(&mut self, path: &str, connectors: &[Connector]) {
        let known = connectors.iter().filter_map(|c| Some(((path.to_owned(), c.name.clone()), c.unit?)));
        self.units.extend(known);
    }

    fn end(&self, package: &Package, path: &str, system: &System, end: &End) -> Result<Key> {
        let Some(name) = &end.element else {
            return match system.connectors.iter().any(|c| c.name == end.connector) {
                true => Ok((path.to_owned(), end.connector.clone())),
                false => {
                    Err(refused(package, format!("`{}` has no connector `{}`", system.name, end.connector)))
                }
            };
        };
        let element = system.elements.iter().find(|e| e.name() == name);
        let key = (below(path, name), end.connector.clone());
        let known = match element {
            None => return Err(refused(package, format!("there is no element `{}`", key.0))),
            Some(Element::System(inner)) => inner.connectors.iter().any(|c| c.name == end.connector),
            Some(Element::Component(_)) => {
                self.part(&key.0).is_some_and(|p| p.variable(&end.connector).is_some())
            }
        };
        if known { Ok(key) } else { Err(refused(package, format!("there is no connector {}", shown(&key)))) }
    }

    /// The unit at a path.
    pub fn part(&self, path: &str) -> Option<&Part<'a>> {
        self.parts.iter().find(|p| p.path == path)
    }

    /// The physical unit of a connector: the structure's before the FMU's.
    pub fn unit(&self, key: &Key) -> Option<Unit> {
        let given = self.units.get(key).copied();
        given.or_else(|| self.part(&key.0).and_then(|part| part.own_unit(&key.1)))
    }

    /// A name for a table that no other unit and no table of a scenario has.
    fn free_name(&self, path: &str) -> String {
        let usual = |c: char| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' };
        let plain: String = path.chars().map(usual).collect();
        let reserved = crate::scenario::keys::tables();
        let taken =
            |name: &str| reserved.iter().any(|t| t.name == name) || self.parts.iter().any(|p| p.name == name);
        let numbered = (2..).map(|k| format!("{plain}_{k}"));
        std::iter::once(plain.clone()).chain(numbered).find(|name| !taken(name)).unwrap_or(plain)
    }

    /// Every way from an output of a unit to an input of a unit.
    ///
    /// # Errors
    /// Units of different dimensions on the way.
    pub fn ways(&self, package: &Package) -> Result<Vec<Way>> {
        let mut all = Vec::new();
        for edge in self.edges.iter().filter(|e| self.part(&e.end.0).is_some()) {
            if let Some((from, affine, _)) = self.traced(package, edge, self.edges.len())? {
                all.push(Way { from, to: edge.end.clone(), affine });
            }
        }
        Ok(all)
    }

    /// Where an edge comes from in the end, and the value at its end with its unit.
    fn traced(
        &self,
        package: &Package,
        edge: &Edge,
        left: usize,
    ) -> Result<Option<(Key, Affine, Option<Unit>)>> {
        if self.part(&edge.start.0).is_some() {
            let (affine, unit) = self.along(package, edge, (1.0, 0.0), self.unit(&edge.start))?;
            return Ok(Some((edge.start.clone(), affine, unit)));
        }
        let Some(before) = self.edges.iter().find(|e| e.end == edge.start) else { return Ok(None) };
        if left == 0 {
            return Err(refused(
                package,
                format!("the connections of {} go round in a circle", shown(&edge.start)),
            ));
        }
        let Some((from, affine, unit)) = self.traced(package, before, left - 1)? else { return Ok(None) };
        let (affine, unit) = self.along(package, edge, affine, unit)?;
        Ok(Some((from, affine, unit)))
    }

    /// A value with its unit after an edge.
    fn along(
        &self,
        package: &Package,
        edge: &Edge,
        value: Affine,
        unit: Option<Unit>,
    ) -> Result<(Affine, Option<Unit>)> {
        let end = self.unit(&edge.end);
        let after = changed(value, unit, end, edge.transformation).ok_or_else(|| {
            refused(package, format!("{} → {}: {DIMENSIONS}", shown(&edge.start), shown(&edge.end)))
        })?;
        let same = edge.transformation == Transformation::default();
        Ok((after, end.or(unit.filter(|_| same))))
    }

    /// The inputs and parameters of units that a connector of a system leads to, with what becomes of a value there.
    ///
    /// # Errors
    /// Units of different dimensions on the way.
    pub fn leads_to(
        &self,
        package: &Package,
        key: &Key,
        value: Affine,
        unit: Option<Unit>,
    ) -> Result<Vec<(Key, Affine)>> {
        let mut found = Vec::new();
        let mut open = vec![(key.clone(), value, unit, self.edges.len())];
        while let Some((key, value, unit, left)) = open.pop() {
            for edge in self.edges.iter().filter(|e| e.start == key && left > 0) {
                let (value, unit) = self.along(package, edge, value, unit)?;
                match self.part(&edge.end.0) {
                    Some(_) => found.push((edge.end.clone(), value)),
                    None => open.push((edge.end.clone(), value, unit, left - 1)),
                }
            }
        }
        Ok(found)
    }
}

/// Why two connectors do not fit.
pub const DIMENSIONS: &str = "their units are of different dimensions";

/// A value after the conversion of units and a transformation; nothing where the dimensions differ.
pub fn changed(
    value: Affine,
    from: Option<Unit>,
    to: Option<Unit>,
    transformation: Transformation,
) -> Option<Affine> {
    let (a, b) = match (from, to) {
        (Some(from), Some(to)) if !transformation.keeps_unit => from.conversion_to(&to)?,
        _ => (1.0, 0.0),
    };
    let Transformation { factor, offset, .. } = transformation;
    Some((factor * a * value.0, factor * (a * value.1 + b) + offset))
}

/// A connector for people.
pub fn shown(key: &Key) -> String {
    if key.0.is_empty() { format!("`{}`", key.1) } else { format!("`{}.{}`", key.0, key.1) }
}

/// What makes the structure unusable.
pub fn refused(package: &Package, message: String) -> Error {
    Error::Refused(format!("{}: {message}", package.path().display()))
}
