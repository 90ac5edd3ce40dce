//! Contacts that are pushed sideways: the force that drags them is the same on both soils but for the heap that the automaton
//! builds up, on every grid, and in every direction.

use super::MODULES;
use super::drive::{Drive, Move, Vertical, on_rim, turned};
use super::plates::Maker;
use super::rows::{SoilRow, eight};
use crate::parallel::in_parallel;
use crate::process::Outcome;
use crate::{Context, Figure, Limit};
use std::f64::consts::FRAC_PI_2;
use terraglue_numerics::extremes::{larger, smaller};
use terraglue_subsystem::Geometry;

/// Length of the way, m.
const WAY: f64 = 0.3;
/// Part of a cell that a body goes in a step: soil that comes below it at once bears less, a hundredth here, a tenth in steps
/// of a fifth of a cell.
const STEP: f64 = 0.05;
/// Way over which the load is laid on, m.
const LAID_ON: f64 = 0.03;
/// Where the way begins: the middle of a cell on no grid, so that no direction has the nodes of another by chance alone.
const START: [f64; 2] = [0.0031, 0.0013];

/// A body, how it lies when it is dragged along x, and its load (N) in [`SOILS`], which does not bury it.
struct Dragged {
    name: &'static str,
    geometry: Geometry,
    lies: [f64; 4],
    load: [f64; 2],
}

const SOILS: [&str; 2] = ["lunar_nominal", "LETE_sand"];

fn bodies() -> [Dragged; 3] {
    const LEVEL: [f64; 4] = [1.0, 0.0, 0.0, 0.0];
    let wheel = Geometry::Cylinder { half_length: 0.0535, radius: 0.092 };
    [
        Dragged { name: "wheel", geometry: wheel, lies: on_rim(FRAC_PI_2), load: [30.0, 64.7] },
        Dragged {
            name: "sphere",
            geometry: Geometry::Sphere { radius: 0.03 },
            lies: LEVEL,
            load: [8.0, 20.0],
        },
        Dragged {
            name: "box",
            geometry: Geometry::Box { half_extents: [0.04, 0.03, 0.03] },
            lies: LEVEL,
            load: [8.0, 20.0],
        },
    ]
}

/// Drags a body in the direction `angle` (rad from x): mean of the force that it takes (N) and of the sinkage (m) over the
/// last fifth of the way.
fn drag(make: Maker, soil: &SoilRow, body: &Dragged, spacing: f64, angle: f64) -> [f64; 2] {
    let (s, c) = angle.sin_cos();
    let load = body.load[usize::from(soil.name != SOILS[0])];
    let ground = make(&soil.own, ((2.0 * WAY + 0.4) / spacing) as u32 / 2 * 2 + 1, spacing);
    let [x, y] = START.map(|start| start - 0.5 * WAY);
    let from = [c * x - s * y, s * x + c * y];
    let mut bench = Drive::new(ground, body.geometry.clone(), turned(body.lies, [0.0, 0.0, angle]), from);
    let ahead = STEP * spacing;
    let steps = (WAY / ahead).round() as u32;
    let mut sum = [0.0; 2];
    for k in 0..steps {
        let load = load * (f64::from(k + 1) * ahead / LAID_ON).min(1.0);
        let [force, _] = bench.step(&Move {
            ahead: [c * ahead, s * ahead],
            vertical: Vertical::Load(load),
            turn: [0.0; 3],
        });
        if k >= steps - steps / 5 {
            sum[0] -= c * force[0] + s * force[1];
            sum[1] += bench.sinkage();
        }
    }
    sum.map(|sum| sum / f64::from(steps / 5))
}

/// Both groups of figures.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    let rows = eight()?;
    let row = |name: &str| rows.iter().find(|r| r.name == name).ok_or_else(|| format!("no soil {name}"));
    let mut all = Vec::new();
    for name in SOILS {
        all.extend(by_grid(context, row(name)?));
        if !context.quick || name == SOILS[0] {
            all.extend(by_direction(context, row(name)?));
        }
    }
    all.extend(leaning(context, row(SOILS[1])?));
    Ok(all)
}

/// Angle by which a body leans about its way, rad.
const LEAN: f64 = 15.0 * std::f64::consts::PI / 180.0;

/// Places of the leaning box beside its way, in cells.
const PLACES: [f64; 4] = [0.0, 0.25, 0.5, 0.75];

/// Side force on a leaning box that is dragged along x and lies `aside` (m) on the lattice, over its load; its underside alone gives −tan 15°.
fn lean(make: Maker, soil: &SoilRow, spacing: f64, aside: f64) -> f64 {
    const LOAD: f64 = 20.0;
    let ground = make(&soil.own, ((2.0 * WAY + 0.4) / spacing) as u32 / 2 * 2 + 1, spacing);
    let geometry = Geometry::Box { half_extents: [0.04, 0.025, 0.02] };
    let lies = turned([1.0, 0.0, 0.0, 0.0], [LEAN, 0.0, 0.0]);
    let [x, y] = START.map(|start| start - 0.5 * WAY);
    let mut bench = Drive::new(ground, geometry, lies, [x, y + aside]);
    let ahead = STEP * spacing;
    let steps = (WAY / ahead).round() as u32;
    let mut sum = 0.0;
    for k in 0..steps {
        let load = LOAD * (f64::from(k + 1) * ahead / LAID_ON).min(1.0);
        let [force, _] =
            bench.step(&Move { ahead: [ahead, 0.0], vertical: Vertical::Load(load), turn: [0.0; 3] });
        if k >= steps - steps / 5 {
            sum += force[1] / LOAD;
        }
    }
    sum / f64::from(steps / 5)
}

/// How far the side force on a leaning body is off, grid by grid.
fn leaning(context: &Context, soil: &SoilRow) -> Vec<Figure> {
    let grids: &[f64] = if context.quick { &[0.01, 0.005] } else { &[0.01, 0.005, 0.0025] };
    let cases: Vec<_> = MODULES.iter().flat_map(|m| grids.iter().map(move |grid| (m, *grid))).collect();
    let found = in_parallel(&cases, |((_, make), spacing)| {
        let error = |part: f64| (lean(*make, soil, *spacing, part * spacing) + LEAN.tan()).abs();
        PLACES.map(error).iter().sum::<f64>() / PLACES.len() as f64
    });
    let figure = |(((module, _), spacing), error): (&(&(&str, Maker), f64), f64)| {
        let millimetres = 1e3 * spacing;
        let what = format!(
            "side force on a box that leans by 15° and is dragged in {}, against that of its underside, % of the load, mean of {} places on the {millimetres} mm grid",
            soil.name,
            PLACES.len()
        );
        Figure::new(
            format!("soil.{module}.lean.box.{millimetres}mm"),
            100.0 * error,
            Limit::AtMost(10.0),
            what,
        )
    };
    cases.iter().zip(found).map(figure).collect()
}

/// Largest over smallest value, %.
fn spread(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let largest = values.clone().fold(f64::NEG_INFINITY, larger);
    100.0 * (largest / values.fold(f64::INFINITY, smaller) - 1.0)
}

/// The grids on which a body is dragged. In the quick form all of them for the one whose force depends most on them: a sphere that digs
/// itself in, since sheared soil bears less.
fn spacings(context: &Context, soil: &SoilRow, body: &Dragged) -> &'static [f64] {
    let all = !context.quick || (soil.name != SOILS[0] && body.name == "sphere");
    if all { &[0.01, 0.005, 0.0025] } else { &[0.01] }
}

/// The force on both soils, grid by grid, and on the finest grid against the one before.
fn by_grid(context: &Context, soil: &SoilRow) -> Vec<Figure> {
    let bodies = bodies();
    let mut cases = Vec::new();
    for body in &bodies {
        for (_, make) in MODULES {
            cases.extend(spacings(context, soil, body).iter().map(|spacing| (body, make, *spacing)));
        }
    }
    let found = in_parallel(&cases, |(body, make, spacing)| drag(*make, soil, body, *spacing, 0.0)[0]);
    let (mut all, mut forces) = (Vec::new(), &found[..]);
    for body in &bodies {
        let count = spacings(context, soil, body).len();
        let (automaton, rest) = forces.split_at(count);
        let bekker;
        (bekker, forces) = rest.split_at(count);
        let apart = |(a, b): (&f64, &f64)| 100.0 * (a / b - 1.0).abs();
        let worst = automaton.iter().zip(bekker).map(apart).fold(0.0, larger);
        let list = |forces: &[f64]| forces.iter().map(|f| format!("{f:.2}")).collect::<Vec<_>>().join(", ");
        let what = format!(
            "largest difference of the force that drags a {} in {} on the automaton, %, from that on soil-bekker, {} grids: {} \
             and {} N",
            body.name,
            soil.name,
            count,
            list(automaton),
            list(bekker)
        );
        let id = format!("soil.drag.{}.{}", body.name, soil.name);
        all.push(Figure::new(format!("{id}.automaton"), worst, Limit::AtMost(20.0), what));
        if let ([.., a, b], [.., c, d]) = (automaton, bekker) {
            let worst = larger(apart((a, b)), apart((c, d)));
            let what = format!(
                "change of the force that drags a {} in {} from the 5 mm grid to the 2.5 mm grid, %",
                body.name, soil.name
            );
            all.push(Figure::new(format!("{id}.grid"), worst, Limit::AtMost(10.0), what));
        }
    }
    all
}

/// The force in directions along the axes of the lattice and across.
fn by_direction(context: &Context, soil: &SoilRow) -> Vec<Figure> {
    let angles: &[f64] =
        if context.quick { &[0.0, 90.0, 45.0] } else { &[0.0, 90.0, 180.0, 270.0, 15.0, 30.0, 45.0] };
    let bodies = bodies();
    let mut cases = Vec::new();
    for body in &bodies {
        for (module, make) in MODULES {
            cases.extend(angles.iter().map(|angle| (body, module, make, *angle)));
        }
    }
    let found =
        in_parallel(&cases, |(body, _, make, angle)| drag(*make, soil, body, 0.005, angle.to_radians()));
    let mut all = Vec::new();
    for body in &bodies {
        for (module, _) in MODULES {
            let of = |along: bool| {
                let is = move |angle: f64| !along || angle % 90.0 == 0.0;
                let mine = cases
                    .iter()
                    .zip(&found)
                    .filter(move |(c, _)| c.0.name == body.name && c.1 == module && is(c.3));
                mine.map(|(_, f)| *f)
            };
            // turned by 90° the lattice and the nodes are the same: the rest are units of height that do not divide
            for (name, along, limit) in [("quarter_turns", true, 1.0), ("directions", false, 10.0)] {
                let worst = larger(spread(of(along).map(|f| f[0])), spread(of(along).map(|f| f[1])));
                let what = format!(
                    "largest force and sinkage of a {} in {} that is dragged in {} directions over the smallest, %",
                    body.name,
                    soil.name,
                    of(along).count()
                );
                all.push(Figure::new(
                    format!("soil.{module}.drag.{}.{}.{name}", body.name, soil.name),
                    worst,
                    Limit::AtMost(limit),
                    what,
                ));
            }
        }
    }
    all
}
