//! The footprint: slope of the rim, curvature, and the destination of the material of the crater.

use super::feet::{Feet, Soil, instance, shape};
use super::field::{Function, largest_curvature};
use super::machine::Machine;
use crate::process::Outcome;
use crate::soil::fixture::{DRY_SAND, LETE, LUNAR};
use crate::{Context, Figure, Limit};
use std::sync::Arc;
use terraglue_ground::UNIT_M;
use terraglue_numerics::extremes::larger;
use terraglue_soil_cellular_automaton::SoilCellularAutomaton;
use terraglue_subsystem::{Geometry, Pose};

/// Name, parameters and angle of repose (degrees).
const SOILS: [(&str, &str, f64); 3] =
    [("lunar", LUNAR, 35.0), ("lete", LETE, 31.1), ("dry_sand", DRY_SAND, 28.0)];
const DEPTH: f64 = 0.03;
const STRIDE: f64 = 1e-4;

/// The worst of several prints.
#[derive(Clone, Copy, Default)]
struct Worst {
    standing: f64,
    lifted: f64,
    curvature: f64,
    lost: i64,
}

/// A body pressed 3 cm into level ground, dragged a little, held until the material rests, then taken away.
fn print(config: &str, spacing: f64, geometry: &Geometry, phi: f64) -> Worst {
    let size = [(0.5 / spacing) as u32 | 1; 2];
    let terrain = Function { size, spacing, height: |_, _| 0.0 };
    let machine = Arc::new(Machine::new(Box::new(terrain), 1));
    let mut fixture = Feet::new(instance::<SoilCellularAutomaton>(config, machine));
    let above = Pose { position: [0.003, -0.002, 0.06], ..Pose::IDENTITY };
    fixture.add(geometry, above);
    let touch = fixture.bodies[0].aabb().min[2];
    let at = |side: f64, depth: f64| Pose {
        position: [0.003 + side, -0.002, 0.06 - touch - depth],
        ..Pose::IDENTITY
    };
    fixture.bodies[0].move_to(&at(0.0, 0.0));
    let strides = (DEPTH / STRIDE).round() as u32;
    (1..=strides).for_each(|k| fixture.step(|_| at(0.0, STRIDE * f64::from(k))));
    (1..=100).for_each(|k| fixture.step(|_| at(STRIDE * f64::from(k), DEPTH)));
    for _ in 0..4000 {
        fixture.step(|_| at(100.0 * STRIDE, DEPTH));
        if fixture.soil.material().active_nodes() == 0 {
            break;
        }
    }
    let standing = steepest_deg(&fixture.soil, Some(&covered(&fixture))) - phi;
    fixture.lift_and_rest(60_000);
    let lifted = steepest_deg(&fixture.soil, None) - phi;
    let curvature = largest_curvature(&fixture.soil.ground().heights) / super::CURVATURE;
    Worst { standing, lifted, curvature, lost: lost(&fixture.soil) }
}

fn covered(fixture: &Feet) -> Vec<[i32; 2]> {
    fixture.nodes.iter().map(|n| [n.i, n.j]).collect()
}

/// Largest angle of √(g_n² + g_t²) over all faces; those with a covered node among their six are held by the body.
fn steepest_deg(soil: &Soil, covered: Option<&[[i32; 2]]>) -> f64 {
    let heights = &soil.ground().heights;
    let [nx, ny] = heights.lattice().size.map(|n| n as i32);
    let h = |i: i32, j: i32| f64::from(heights.units(i, j));
    let held = |i: i32, j: i32| {
        covered.is_some_and(|all| all.iter().any(|c| (c[0] - i).abs() <= 1 && (c[1] - j).abs() <= 1))
    };
    let mut worst: f64 = 0.0;
    for (i, j) in (1..ny - 1).flat_map(|j| (1..nx - 1).map(move |i| (i, j))) {
        for [a, b] in [[1, 0], [0, 1]] {
            let along = h(i, j) - h(i + a, j + b);
            let across = |i: i32, j: i32| 0.5 * (h(i + b, j + a) - h(i - b, j - a));
            let steep = along.hypot(0.5 * (across(i, j) + across(i + a, j + b)));
            if steep > worst && !held(i, j) && !held(i + a, j + b) {
                worst = steep;
            }
        }
    }
    (worst * UNIT_M / heights.lattice().spacing).atan().to_degrees()
}

/// Crater − rim − compaction, units.
fn lost(soil: &Soil) -> i64 {
    let heights = &soil.ground().heights;
    let [nx, ny] = heights.lattice().size.map(|n| n as i32);
    let sunk: i64 = (0..ny)
        .flat_map(|j| (0..nx).map(move |i| (i, j)))
        .map(|(i, j)| i64::from(heights.sinkage_units(i, j)))
        .sum();
    sunk - soil.material().compaction().total()
}

/// A print in a dry sand without cohesion in its row of the table, with every other key as it is by default.
fn sand(spacing: f64) -> Figure {
    Figure::new(
        format!("soil.automaton.print.dry_sand_{}mm.slides", spacing * 1e3),
        print(DRY_SAND, spacing, &shape(3), 28.0).lifted,
        Limit::AtMost(0.5),
        "largest slope minus angle of repose, degrees, of a print in dry sand at default keys, when the foot has gone",
    )
}

/// Three soils, three grids, five bodies.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    let spacings: &[f64] = if context.quick { &[0.01] } else { &[0.02, 0.01, 0.005] };
    let mut figures = Vec::new();
    for (name, config, phi) in SOILS {
        // material that slides: no cohesion in the walls, and sweeps enough to come to rest
        let config = &config.replacen('{', r#"{"critical_height_m":0.0,"sweeps_per_step":2,"#, 1);
        for spacing in spacings {
            let mut worst = Worst { standing: -90.0, lifted: -90.0, ..Worst::default() };
            for kind in 0..5 {
                let one = print(config, *spacing, &shape(kind), phi);
                worst.standing = larger(worst.standing, one.standing);
                worst.lifted = larger(worst.lifted, one.lifted);
                worst.curvature = larger(worst.curvature, one.curvature);
                worst.lost += one.lost.abs();
            }
            let id = |what: &str| format!("soil.automaton.print.{name}_{}mm.{what}", spacing * 1e3);
            let around = "largest slope minus angle of repose, degrees,";
            figures.extend([
                Figure::new(
                    id("rim_standing"),
                    worst.standing,
                    Limit::AtMost(0.5),
                    format!("{around} around a standing foot, five bodies 3 cm deep"),
                ),
                Figure::new(
                    id("rim"),
                    worst.lifted,
                    Limit::AtMost(0.5),
                    format!("{around} of the print when the foot has gone, five bodies"),
                ),
                Figure::new(
                    id("curvature"),
                    worst.curvature,
                    Limit::AtMost(1.02),
                    "largest curvature of the print in four directions / κ_max, five bodies",
                ),
                Figure::new(
                    id("lost"),
                    worst.lost as f64,
                    Limit::Equal(0.0),
                    "crater − rim − compaction, units, five bodies",
                ),
            ]);
        }
    }
    figures.extend(spacings.iter().map(|s| sand(*s)));
    for spacing in spacings {
        // 3 cm deep, where the cohesion of lunar soil holds 8.9 cm under the gravity of the Earth
        let wall = print(LUNAR, *spacing, &shape(3), 0.0).lifted;
        figures.push(Figure::new(
            format!("soil.automaton.print.lunar_{}mm.wall", spacing * 1e3),
            wall,
            Limit::AtLeast(60.0),
            "largest slope, degrees, of a print whose walls the cohesion holds, when the foot has gone",
        ));
    }
    Ok(figures)
}
