//! The columns of `/energy`: kinetic, potential, dissipated energy and works, J, of all and of each subsystem that can
//! have any. Unknown values are NaN.

use crate::columns::{About, Columns};
use crate::snapshot::{Column, ScalarKind};
use terraglue_engine::observer::View;
use terraglue_subsystem::{Energy, Kind};

const PARTS: [(&str, &str); 6] = [
    ("kinetic", "kinetic energy"),
    ("potential", "potential energy"),
    ("dissipated", "turned into heat since the start"),
    ("port_work", "work done through the ports since the start"),
    ("actuator_work", "mechanical work of the motors since the start"),
    ("electrical", "electrical energy drawn by the motors since the start, where a motor models it"),
];

fn parts(e: &Energy) -> [f64; 6] {
    [e.kinetic, e.potential, e.dissipated, e.port_work, e.actuator_work, e.electrical]
}

fn with_energy<'a>(
    view: &'a View,
) -> impl Iterator<Item = &'a terraglue_engine::observer::SubsystemView<'a>> {
    view.subsystems.iter().filter(|s| matches!(s.kind, Kind::Robot | Kind::Soil))
}

/// The sum, and each subsystem.
pub(crate) fn columns(view: &View) -> (Columns, Vec<About>) {
    let column =
        |name: String, unit: &str, help: &str| Column::new(name, unit.into(), help.into(), ScalarKind::Real);
    let mut all: Vec<Column> =
        PARTS.map(|(name, help)| column(name.into(), "J", &format!("{help}, of all"))).into();
    for s in with_energy(view) {
        all.extend(PARTS.map(|(name, help)| column(format!("{}.{name}", s.name), "J", help)));
    }
    Columns::new(all.iter().enumerate())
}

/// The numbers of a communication point, in the order of the columns.
pub(crate) fn values(view: &View) -> Vec<f64> {
    let mut all = parts(&view.energy).to_vec();
    with_energy(view).for_each(|s| all.extend(parts(&s.instance.energy())));
    all
}
