//! A system structure without its systems: FMUs by path, and every way from one FMU to another.

use std::collections::BTreeMap;
use terraglue_fmi::description::{ModelDescription, Variable};
use terraglue_fmi::ssp::{
    Component, Connector, Dictionary, End, Package, System, SystemElement, Table, Transformation,
};
use terraglue_fmi::{Error, Fmu, Result};
use terraglue_subsystem::unit::Unit;

/// Path of an element (`outer/inner`, empty: the outermost system) and one of its connectors.
pub type ConnectorPath = (String, String);

/// target = a · value + b.
pub type Affine = (f64, f64);

/// An FMU of the structure.
pub struct Part<'a> {
    /// Name of its table in the scenario.
    pub name: String,
    /// Path in the structure.
    pub path: String,
    /// Its entry in the structure.
    pub component: &'a Component,
    /// Its own model description.
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
        let text = self.description.unit_of(self.variable(name)?);
        Unit::parse(&text).ok().filter(|_| !text.is_empty())
    }
}

/// A way from one FMU to another.
pub struct Way {
    /// Output.
    pub from: ConnectorPath,
    /// Input.
    pub to: ConnectorPath,
    /// How the value changes on the way: a number by this,
    pub affine: Affine,
    /// anything else by a table.
    pub table: Option<Table>,
}

/// A value on its way: what became of it, and its unit.
#[derive(Clone, Debug, PartialEq)]
pub struct Carried {
    /// Of a number.
    pub affine: Affine,
    /// Of what is no f64.
    pub table: Option<Table>,
    /// Physical unit, where it is known.
    pub unit: Option<Unit>,
}

impl Carried {
    /// A value as it is.
    pub fn new(unit: Option<Unit>) -> Self {
        Self { affine: (1.0, 0.0), table: None, unit }
    }

    /// The same after the conversion of units and a transformation; the reason where that cannot be.
    pub fn changed(
        &self,
        to: Option<Unit>,
        transformation: &Transformation,
    ) -> std::result::Result<Self, &'static str> {
        if let Some(table) = &transformation.table {
            let table = match (&self.table, self.affine) {
                (Some(first), _) => table.after(first),
                (None, (1.0, 0.0)) => table.clone(),
                (None, affine) => table.after_linear(affine).ok_or(MIXED)?,
            };
            return Ok(Self { affine: (1.0, 0.0), table: Some(table), unit: to });
        }
        if let Some(table) = &self.table {
            let Transformation { factor, offset, .. } = *transformation;
            let plain = transformation.is_plain();
            let table =
                if plain { table.clone() } else { table.before_linear((factor, offset)).ok_or(MIXED)? };
            return Ok(Self { table: Some(table), ..self.clone() });
        }
        let affine = changed(self.affine, self.unit, to, transformation).ok_or(DIMENSIONS)?;
        let same = *transformation == Transformation::default();
        Ok(Self { affine, table: None, unit: to.or(self.unit.filter(|_| same)) })
    }
}

struct Edge {
    start: ConnectorPath,
    end: ConnectorPath,
    transformation: Transformation,
}

/// FMUs and connections of all systems.
pub struct Network<'a> {
    /// In the order of the structure.
    pub parts: Vec<Part<'a>>,
    edges: Vec<Edge>,
    /// Units that the structure gives connectors.
    units: BTreeMap<ConnectorPath, Unit>,
    /// Dictionaries of the systems around the one that is read, the outermost first, with the path of their signals.
    dictionaries: Vec<(String, &'a Dictionary)>,
}

/// Path of an element inside a system.
pub fn below(path: &str, element: &str) -> String {
    if path.is_empty() { element.to_owned() } else { format!("{path}/{element}") }
}

impl<'a> Network<'a> {
    /// Reads the descriptions of all FMUs and resolves the connections.
    ///
    /// # Errors
    /// An FMU that cannot be read, a connection to what does not exist.
    pub fn new(package: &'a Package) -> Result<Self> {
        let (units, dictionaries) = (BTreeMap::new(), Vec::new());
        let mut network = Self { parts: Vec::new(), edges: Vec::new(), units, dictionaries };
        network.system(package, "", &package.structure().system)?;
        Ok(network)
    }

    fn system(&mut self, package: &Package, path: &str, system: &'a System) -> Result {
        self.connectors(path, &system.connectors);
        let around = self.dictionaries.len();
        for dictionary in &system.dictionaries {
            // no element has such a path: names of elements do not begin like this
            let own = below(path, &format!("\u{0}{}", dictionary.name));
            self.connectors(&own, &dictionary.entries);
            self.dictionaries.push((own, dictionary));
        }
        for element in &system.elements {
            let inner = below(path, element.name());
            match element {
                SystemElement::System(nested) => self.system(package, &inner, nested)?,
                SystemElement::Dictionary(reference) => {
                    self.dictionary(&reference.dictionary).ok_or_else(|| {
                        let message = format!("there is no signal dictionary `{}`", reference.dictionary);
                        refused(package, message)
                    })?;
                }
                SystemElement::Component(component) => {
                    let file = package.folder().join(&component.source);
                    let (description, _) = Fmu::inspect(&file).map_err(|error| {
                        // the package lies unpacked in a folder of its own
                        let message =
                            error.to_string().replace(&file.display().to_string(), &component.source);
                        refused(package, format!("the component `{inner}`: {message}"))
                    })?;
                    self.connectors(&inner, &component.connectors);
                    let name = self.free_name(&inner);
                    self.parts.push(Part { name, path: inner, component, description });
                }
            }
        }
        for connection in &system.connections {
            let ends = [&connection.start, &connection.end].map(|end| self.end(package, path, system, end));
            let [start, end] = ends;
            let edge = Edge { start: start?, end: end?, transformation: connection.transformation.clone() };
            if let Some(other) = self.edges.iter().find(|e| e.end == edge.end) {
                let ends = [&edge.end, &other.start, &edge.start].map(shown);
                let message = format!("{} is fed by {} and by {}", ends[0], ends[1], ends[2]);
                return Err(refused(package, message));
            }
            self.edges.push(edge);
        }
        self.dictionaries.truncate(around);
        Ok(())
    }

    /// The nearest dictionary of that name around the system that is read, with the path of its signals.
    fn dictionary(&self, name: &str) -> Option<&(String, &'a Dictionary)> {
        self.dictionaries.iter().rev().find(|(_, d)| d.name == name)
    }

    fn connectors(&mut self, path: &str, connectors: &[Connector]) {
        let known = connectors.iter().filter_map(|c| Some(((path.to_owned(), c.name.clone()), c.unit?)));
        self.units.extend(known);
    }

    fn end(&self, package: &Package, path: &str, system: &System, end: &End) -> Result<ConnectorPath> {
        let Some(name) = &end.element else {
            return match system.connectors.iter().any(|c| c.name == end.connector) {
                true => Ok((path.to_owned(), end.connector.clone())),
                false => {
                    Err(refused(package, format!("`{}` has no connector `{}`", system.name, end.connector)))
                }
            };
        };
        let element = system.elements.iter().find(|e| e.name() == name);
        let mut key = (below(path, name), end.connector.clone());
        let known = match element {
            Some(SystemElement::Dictionary(reference)) => match self.dictionary(&reference.dictionary) {
                Some((own, dictionary)) => {
                    key.0.clone_from(own);
                    dictionary.entries.iter().any(|e| e.name == end.connector)
                }
                None => false,
            },
            None => return Err(refused(package, format!("there is no element `{}`", key.0))),
            Some(SystemElement::System(inner)) => inner.connectors.iter().any(|c| c.name == end.connector),
            Some(SystemElement::Component(_)) => {
                self.part(&key.0).is_some_and(|p| p.variable(&end.connector).is_some())
            }
        };
        if known { Ok(key) } else { Err(refused(package, format!("there is no connector {}", shown(&key)))) }
    }

    /// The FMU at a path.
    pub fn part(&self, path: &str) -> Option<&Part<'a>> {
        self.parts.iter().find(|p| p.path == path)
    }

    /// The physical unit of a connector: the structure's before the FMU's.
    pub fn unit(&self, key: &ConnectorPath) -> Option<Unit> {
        let given = self.units.get(key).copied();
        given.or_else(|| self.part(&key.0).and_then(|part| part.own_unit(&key.1)))
    }

    /// A name for a table that no other FMU and no table of a scenario has.
    fn free_name(&self, path: &str) -> String {
        let usual = |c: char| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' };
        let plain: String = path.chars().map(usual).collect();
        let reserved = crate::keys::tables();
        let taken =
            |name: &str| reserved.iter().any(|t| t.name == name) || self.parts.iter().any(|p| p.name == name);
        let numbered = (2..).map(|k| format!("{plain}_{k}"));
        std::iter::once(plain.clone()).chain(numbered).find(|name| !taken(name)).unwrap_or(plain)
    }

    /// Every way from an output of an FMU to an input of an FMU.
    ///
    /// # Errors
    /// Units of different dimensions on the way, or a table of what is no number and a linear transformation.
    pub fn ways(&self, package: &Package) -> Result<Vec<Way>> {
        let mut all = Vec::new();
        for edge in self.edges.iter().filter(|e| self.part(&e.end.0).is_some()) {
            if let Some((from, Carried { affine, table, .. })) =
                self.traced(package, edge, self.edges.len())?
            {
                all.push(Way { from, to: edge.end.clone(), affine, table });
            }
        }
        Ok(all)
    }

    /// Where an edge comes from in the end, and the value at its end.
    fn traced(
        &self,
        package: &Package,
        edge: &Edge,
        left: usize,
    ) -> Result<Option<(ConnectorPath, Carried)>> {
        if self.part(&edge.start.0).is_some() {
            let value = self.along(package, edge, &Carried::new(self.unit(&edge.start)))?;
            return Ok(Some((edge.start.clone(), value)));
        }
        let Some(before) = self.edges.iter().find(|e| e.end == edge.start) else { return Ok(None) };
        if left == 0 {
            return Err(refused(
                package,
                format!("the connections of {} go round in a circle", shown(&edge.start)),
            ));
        }
        let Some((from, value)) = self.traced(package, before, left - 1)? else { return Ok(None) };
        Ok(Some((from, self.along(package, edge, &value)?)))
    }

    /// A value after an edge.
    fn along(&self, package: &Package, edge: &Edge, value: &Carried) -> Result<Carried> {
        value
            .changed(self.unit(&edge.end), &edge.transformation)
            .map_err(|why| refused(package, format!("{} → {}: {why}", shown(&edge.start), shown(&edge.end))))
    }

    /// The inputs and parameters of FMUs that a connector of a system leads to, with what becomes of a value there.
    ///
    /// # Errors
    /// As of [`Network::ways`].
    pub fn leads_to(
        &self,
        package: &Package,
        key: &ConnectorPath,
        value: Carried,
    ) -> Result<Vec<(ConnectorPath, Carried)>> {
        let mut found = Vec::new();
        let mut open = vec![(key.clone(), value, self.edges.len())];
        while let Some((key, value, left)) = open.pop() {
            for edge in self.edges.iter().filter(|e| e.start == key && left > 0) {
                let value = self.along(package, edge, &value)?;
                match self.part(&edge.end.0) {
                    Some(_) => found.push((edge.end.clone(), value)),
                    None => open.push((edge.end.clone(), value, left - 1)),
                }
            }
        }
        Ok(found)
    }
}

/// Why two connectors do not fit.
const DIMENSIONS: &str = "their units are of different dimensions";
/// The same of transformations.
const MIXED: &str = "numbers are converted before or behind a table of what are none";

/// A value after the conversion of units and a transformation; nothing where the dimensions differ.
fn changed(
    value: Affine,
    from: Option<Unit>,
    to: Option<Unit>,
    transformation: &Transformation,
) -> Option<Affine> {
    let (a, b) = match (from, to) {
        (Some(from), Some(to)) if !transformation.keeps_unit => from.conversion_to(&to)?,
        _ => (1.0, 0.0),
    };
    let Transformation { factor, offset, .. } = *transformation;
    Some((factor * a * value.0, factor * (a * value.1 + b) + offset))
}

/// A connector for people.
pub fn shown(key: &ConnectorPath) -> String {
    let path = key.0.replace('\u{0}', "");
    if path.is_empty() { format!("`{}`", key.1) } else { format!("`{path}.{}`", key.1) }
}

/// Error about a structure that cannot be used.
pub fn refused(package: &Package, message: String) -> Error {
    Error::Refused(format!("{}: {message}", package.path().display()))
}
