//! Parameter sets of a system structure as start values of its FMUs.
//!
//! Outer bindings go before inner ones, later ones before earlier ones of the same element. A binding with a mapping
//! gives what is mapped and nothing else.

use super::network::{Carried, ConnectorPath, Network, below, refused, shown};
use std::collections::BTreeMap;
use terraglue_fmi::Result;
use terraglue_fmi::ssp::{Binding, Package, Parameter, System, SystemElement, Transformation, Value};
use terraglue_subsystem::{ValueType, unit::Unit};

/// Start values by the path of the FMU and the name of the variable.
#[derive(Default)]
pub struct Values {
    /// Start values of variables.
    pub start: BTreeMap<ConnectorPath, Value>,
    /// Parameters that fit nothing.
    pub notes: Vec<String>,
}

/// A parameter on its way to a variable.
struct Given<'a> {
    target: String,
    parameter: &'a Parameter,
    transformation: Transformation,
}

/// Start values of all FMUs.
///
/// # Errors
/// A value that cannot be converted.
pub fn values(package: &Package, network: &Network) -> Result<Values> {
    let mut values = Values::default();
    of_system(package, network, "", &package.structure().system, &mut values)?;
    Ok(values)
}

fn of_system(
    package: &Package,
    network: &Network,
    path: &str,
    system: &System,
    values: &mut Values,
) -> Result {
    for element in &system.elements {
        let inner = below(path, element.name());
        match element {
            SystemElement::System(nested) => of_system(package, network, &inner, nested, values)?,
            SystemElement::Dictionary(_) => {}
            SystemElement::Component(component) => {
                for given in component.bindings.iter().flat_map(|b| given(b, values)).collect::<Vec<_>>() {
                    set(package, network, (inner.clone(), given.target.clone()), &given, values)?;
                }
            }
        }
    }
    for given in system.bindings.iter().flat_map(|b| given(b, values)).collect::<Vec<_>>() {
        to_system(package, network, path, system, given, values)?;
    }
    Ok(())
}

/// Parameters of a binding, under the names of the element that it is bound to.
fn given<'a>(binding: &'a Binding, values: &mut Values) -> Vec<Given<'a>> {
    let name = |p: &Parameter| format!("{}{}", binding.prefix, p.name);
    let Some(mapping) = &binding.mapping else {
        let own = |p: &'a Parameter| Given {
            target: name(p),
            parameter: p,
            transformation: Transformation::default(),
        };
        return binding.parameters.iter().map(own).collect();
    };
    let mut all = Vec::new();
    for entry in mapping {
        match binding.parameters.iter().find(|p| name(p) == entry.source) {
            Some(parameter) => {
                let (target, transformation) = (entry.target.clone(), entry.transformation.clone());
                all.push(Given { target, parameter, transformation });
            }
            None => values.notes.push(format!("a mapping names `{}`, which no set has", entry.source)),
        }
    }
    all
}

/// Gives a parameter to a connector of a system, or to an element of it by a dotted name.
fn to_system(
    package: &Package,
    network: &Network,
    path: &str,
    system: &System,
    given: Given,
    values: &mut Values,
) -> Result {
    if system.connectors.iter().any(|c| c.name == given.target) {
        return along(package, network, (path.to_owned(), given.target.clone()), &given, values);
    }
    let inside =
        |e: &&SystemElement| given.target.strip_prefix(e.name()).is_some_and(|rest| rest.starts_with('.'));
    let Some(element) = system.elements.iter().filter(inside).max_by_key(|e| e.name().len()) else {
        values.notes.push(format!("the parameter {} fits nothing", shown(&(path.to_owned(), given.target))));
        return Ok(());
    };
    let target = given.target[element.name().len() + 1..].to_owned();
    let inner = below(path, element.name());
    match element {
        SystemElement::System(nested) => {
            to_system(package, network, &inner, nested, Given { target, ..given }, values)
        }
        SystemElement::Component(_) => set(package, network, (inner, target), &given, values),
        SystemElement::Dictionary(_) => {
            values.notes.push(format!("the parameter {} fits no FMU", shown(&(inner, target))));
            Ok(())
        }
    }
}

/// Gives a parameter to all FMUs that a connector of a system leads to.
fn along(
    package: &Package,
    network: &Network,
    key: ConnectorPath,
    given: &Given,
    values: &mut Values,
) -> Result {
    let unit = network.unit(&key);
    let mut value = start(package, &key, given, unit)?;
    value.unit = unit.or(given.parameter.unit);
    let ends = network.leads_to(package, &key, value)?;
    if ends.is_empty() {
        values.notes.push(format!("the parameter {} leads to no FMU", shown(&key)));
    }
    for (end, carried) in ends {
        keep(package, network, end, &given.parameter.value, &carried, values)?;
    }
    Ok(())
}

/// A parameter after its mapping, in the unit of where it goes.
fn start(package: &Package, key: &ConnectorPath, given: &Given, unit: Option<Unit>) -> Result<Carried> {
    let own = Carried::new(given.parameter.unit);
    own.changed(unit, &given.transformation)
        .map_err(|why| refused(package, format!("the parameter {}: {why}", shown(key))))
}

/// Gives a parameter to a variable of an FMU.
fn set(
    package: &Package,
    network: &Network,
    key: ConnectorPath,
    given: &Given,
    values: &mut Values,
) -> Result {
    let carried = start(package, &key, given, network.unit(&key))?;
    keep(package, network, key, &given.parameter.value, &carried, values)
}

fn keep(
    package: &Package,
    network: &Network,
    key: ConnectorPath,
    value: &Value,
    carried: &Carried,
    values: &mut Values,
) -> Result {
    let (a, b) = carried.affine;
    let Some(variable) = network.part(&key.0).and_then(|part| part.variable(&key.1)) else {
        values.notes.push(format!("the parameter {} fits nothing", shown(&key)));
        return Ok(());
    };
    let plain = (a, b) == (1.0, 0.0);
    let value = match &carried.table {
        None => value,
        Some(table) => table.of(value).ok_or_else(|| {
            refused(package, format!("{}: the table of its mapping has no entry for {value:?}", shown(&key)))
        })?,
    };
    let real = matches!(variable.value_type, ValueType::F64 | ValueType::F32);
    let number = match value {
        Value::Real(x) => Some(a * x + b),
        Value::Integer(n) if !plain => Some(a * *n as f64 + b),
        _ => None,
    };
    let value = match (number, value) {
        (Some(x), _) if real => Value::Real(x),
        (Some(x), _) if x.fract() == 0.0 && x.abs() < 9e15 => Value::Integer(x as i64),
        (Some(x), _) => return Err(refused(package, format!("{} takes no {x}", shown(&key)))),
        (None, other) if plain => other.clone(),
        (None, _) => return Err(refused(package, format!("{} is no number to be transformed", shown(&key)))),
    };
    values.start.insert(key, value);
    Ok(())
}
