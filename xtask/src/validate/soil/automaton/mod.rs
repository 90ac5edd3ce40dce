//! The cellular automaton: mass, slopes, curvature, reproducibility, cost.

mod cone;
mod field;

use super::rig::{LUNAR, Rig, Shown, flat, read, soil};
use crate::process::Outcome;
use crate::validate::{Context, Figure, Limit};
use terraglue_ground::{Surface, UNIT_M};
use terraglue_soil_cellular_automaton::SoilCellularAutomaton as Automaton;
use terraglue_subsystem::{Geometry, Subsystem};

/// κ_max where a scenario is silent, 1/m.
const CURVATURE: f64 = 40.0;

/// All figures.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    let mut all = cone::cones(context)?;
    all.extend(cone::planes(context)?);
    all.push(mass_under_a_dragged_ball(context));
    Ok(all)
}

/// Sum of all heights, units.
fn total(soil: &dyn Subsystem) -> i64 {
    let shown = Shown::new(soil);
    let [nx, ny] = shown.lattice.size.map(|n| n as i32);
    let node = |i, j| (shown.height(i, j) / UNIT_M).round() as i64;
    (0..ny).map(|j| (0..nx).map(|i| node(i, j)).sum::<i64>()).sum()
}

fn mass_under_a_dragged_ball(context: &Context) -> Figure {
    let steps = if context.quick { 20_000 } else { 1_000_000 };
    let ball = Geometry::Sphere { radius: 0.04 };
    let mut rig = Rig::new(soil::<Automaton>(LUNAR, 65, 0.01, flat), ball, 1.0, 0.045);
    let before = total(&*rig.soil);
    for k in 0..steps {
        let phase = 1e-3 * f64::from(k);
        let goal =
            [0.2 * (0.7 * phase).sin(), 0.2 * (0.43 * phase).cos(), 0.035 + 0.02 * (2.9 * phase).sin()];
        let step: [f64; 3] = std::array::from_fn(|c| goal[c] - rig.position[c]);
        rig.prescribed_step(&[step[2], step[0], step[1]]);
    }
    let cell = 0.01 * 0.01 * UNIT_M;
    let compacted = (read(&*rig.soil, "compacted_volume") / cell).round() as i64;
    let error = total(&*rig.soil) + compacted - before;
    let what = format!(
        "units of mass gained, compaction counted, over {steps} steps of a ball that is pressed and dragged"
    );
    let booked = read(&*rig.soil, "mass_error_units");
    Figure::new("soil.automaton.mass.dragged_ball", error as f64 + booked, Limit::Equal(0.0), what)
}
