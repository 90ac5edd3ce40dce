//! A wheel with grousers as geometry (`models/wheel_rig_grousers.urdf`) against the smooth wheel and against the cylinder on
//! which its tips lie: sinkage and drawbar pull by slip.

use super::rig_scenario::means;
use crate::parallel::in_parallel;
use crate::process::{Outcome, read, root, run_scenario};
use crate::{Context, Figure, Limit};
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};
use terraglue_numerics::extremes::smaller;

const SCENARIO: &str = "scenarios/wheel_rig.toml";
const SMOOTH: &str = "models/wheel_rig.urdf";
const GROUSERS: &str = "models/wheel_rig_grousers.urdf";
/// Radius of the rim, and of the circle of the tips, as the files have them, m.
const RIM: f64 = 0.092;
const TIPS: f64 = 0.097;
/// Rate of the wheel in the scenario, rad/s.
const RATE: f64 = 0.2 / RIM;
/// Way of the axle, m.
const WAY: f64 = 0.30;
/// Turn of the wheel at the end over which means are taken: 5 grousers, rad.
const MEASURED: f64 = 5.0 * TAU / 24.0;

/// A wheel of the comparison: its name, its file and the radius by which its slip is reckoned, m.
struct Wheel {
    name: &'static str,
    model: PathBuf,
    radius: f64,
}

/// Figures of a driven wheel.
#[derive(Clone, Copy)]
struct Driven {
    /// Depth of its lowest point, mm.
    sinkage: f64,
    /// Drawbar pull, N.
    pull: f64,
    /// Drift of the energy ledger over the work of the motors, %.
    drift: f64,
}

/// Smooth, with grousers, and smooth up to the tips, whose file is written to the scratch folder.
fn wheels(scratch: &Path) -> Outcome<[Wheel; 3]> {
    let outer = scratch.join("wheel_rig_outer.urdf");
    let text = read(&root().join(SMOOTH))?.replace(&RIM.to_string(), &TIPS.to_string());
    std::fs::create_dir_all(scratch).map_err(|e| format!("{}: {e}", scratch.display()))?;
    std::fs::write(&outer, text).map_err(|e| format!("{}: {e}", outer.display()))?;
    Ok([
        Wheel { name: "smooth", model: root().join(SMOOTH), radius: RIM },
        Wheel { name: "grousers", model: root().join(GROUSERS), radius: TIPS },
        Wheel { name: "outer", model: outer, radius: TIPS },
    ])
}

/// Means of a run over its last way.
fn driven(context: &Context, wheel: &Wheel, slip: f64) -> Outcome<Driven> {
    let id = format!("grousers.{}.{slip}", wheel.name);
    let out = context.scratch.join(&id);
    let speed = wheel.radius * RATE * (1.0 - slip);
    let seconds = format!("{:.3}", WAY / speed);
    let sets = [
        format!("rig.model={}", wheel.model.display()),
        format!("rig.velocity_target.travel={speed:?}"),
        "gluing.strategy=cooperative-compliant".to_owned(),
    ];
    let mut options = vec!["--csv", "--duration", &seconds];
    sets.iter().for_each(|set| options.extend(["--set", set]));
    let summary = run_scenario(&context.program, &id, SCENARIO, &out, &options)?;
    if summary["status"] != "done" {
        return Err(format!("{id}: {}", summary["error"]));
    }
    let found = means(&read(&out.join("variables.csv"))?, WAY / speed - MEASURED / RATE)
        .ok_or_else(|| format!("{id}: no table"))?;
    let of = |name: &str| found.get(name).copied().unwrap_or(f64::NAN);
    let energy = |name: &str| summary[name].as_f64().unwrap_or(f64::NAN);
    Ok(Driven {
        sinkage: 1e3 * of("rig.press.angle"),
        pull: of("soil.contact1.pull"),
        drift: 100.0 * (energy("energy_balance_j") / energy("energy_j")).abs(),
    })
}

/// All figures.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    let slips: &[f64] = if context.quick { &[0.3] } else { &[0.1, 0.3, 0.6] };
    let wheels = wheels(&context.scratch)?;
    let cases: Vec<(f64, &Wheel)> = slips.iter().flat_map(|s| wheels.iter().map(move |w| (*s, w))).collect();
    let runs = in_parallel(&cases, |(slip, wheel)| driven(context, wheel, *slip));
    let runs = runs.into_iter().collect::<Outcome<Vec<_>>>()?;
    let mut all = Vec::new();
    for ((slip, wheel), run) in cases.iter().zip(&runs) {
        let id = |quantity: &str| format!("soil.grousers.{}.slip_{slip}.{quantity}", wheel.name);
        let of = format!("of the {} wheel at slip {slip}, {SCENARIO}", wheel.name);
        all.push(Figure::new(
            id("sinkage"),
            run.sinkage,
            Limit::None,
            format!("depth of the lowest point, mm, {of}"),
        ));
        all.push(Figure::new(id("pull"), run.pull, Limit::None, format!("drawbar pull, N, {of}")));
    }
    let all_slips = |quantity: &str| format!("soil.grousers.{}_slips.{quantity}", runs.len() / wheels.len());
    let each = || runs.chunks_exact(wheels.len());
    let least = |values: &mut dyn Iterator<Item = f64>| values.fold(f64::INFINITY, smaller);
    let most = |values: &mut dyn Iterator<Item = f64>| -least(&mut values.map(|v| -v));
    all.push(Figure::new(
        all_slips("pull"),
        least(&mut each().map(|w| w[1].pull - w[0].pull)),
        Limit::AtLeast(0.0),
        "least gain of drawbar pull by 24 grousers of 5 mm over the smooth wheel, N",
    ));
    all.push(Figure::new(
        all_slips("outer"),
        most(&mut each().map(|w| (w[1].pull - w[2].pull).abs())),
        Limit::AtMost(0.2),
        "largest difference of its drawbar pull from that of the cylinder on which the tips lie, N",
    ));
    all.push(Figure::new(
        all_slips("sinkage"),
        most(&mut each().map(|w| w[1].sinkage / w[2].sinkage)),
        Limit::AtMost(1.1),
        "largest depth of the tips over that of a cylinder of their radius",
    ));
    all.push(Figure::new(
        all_slips("energy"),
        most(&mut each().map(|w| w[1].drift)),
        Limit::AtMost(1.0),
        "largest drift of the energy ledger of the wheel with grousers, % of the work of the motors",
    ));
    Ok(all)
}
