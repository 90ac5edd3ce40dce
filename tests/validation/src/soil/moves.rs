//! Requirements on a soil under any body that presses, drags, twists, rolls and yaws: the same answer on every grid and on
//! both soils, the balance of energies, and the force that resistive force theory gives a sphere.

use super::MODULES;
use super::drive::{Balance, Drive, Move, Vertical, on_rim};
use super::fixture::Shown;
use super::plates::Maker;
use super::rows::{SoilRow, eight};
use crate::parallel::in_parallel;
use crate::process::Outcome;
use crate::{Context, Figure, Limit};
use std::f64::consts::{FRAC_PI_2, PI};
use terraglue_ground::Surface;
use terraglue_numerics::extremes::{larger, smaller};
use terraglue_subsystem::Geometry;

/// All figures.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    let mut all = presses(context)?;
    all.extend(yawed(context)?);
    all.extend(ruts(context)?);
    all.extend(balances(context)?);
    all.extend(resistive_force(context)?);
    Ok(all)
}

fn row(name: &str) -> Outcome<SoilRow> {
    eight()?.into_iter().find(|r| r.name == name).ok_or_else(|| format!("no soil {name}"))
}

const LEVEL: [f64; 4] = [1.0, 0.0, 0.0, 0.0];

/// Shapes of feet and wheels, how they lie, and a load (N) that sinks them by a centimetre or two in lunar soil.
fn shapes() -> [(&'static str, Geometry, [f64; 4], f64); 4] {
    [
        ("sphere", Geometry::Sphere { radius: 0.03 }, LEVEL, 20.0),
        ("capsule", Geometry::Capsule { half_length: 0.03, radius: 0.02 }, on_rim(0.0), 25.0),
        ("wheel", Geometry::Cylinder { half_length: 0.0535, radius: 0.092 }, on_rim(0.0), 64.7),
        ("box", Geometry::Box { half_extents: [0.04, 0.03, 0.03] }, LEVEL, 40.0),
    ]
}

/// Sinkage of a shape under its load, laid on in steps, and displaced and compacted volumes, m³.
fn pressed(make: Maker, config: &str, shape: usize, spacing: f64) -> f64 {
    let (_, geometry, lies, load) = shapes()[shape].clone();
    let soil = make(config, (0.6 / spacing) as u32 + 1, spacing);
    let mut bench = Drive::new(soil, geometry, lies, [0.0031, -0.0017]);
    for k in 1..=200 {
        let load = load * f64::from(k.min(160)) / 160.0;
        bench.step(&Move { ahead: [0.0; 2], vertical: Vertical::Load(load), turn: [0.0; 3] });
    }
    bench.sinkage()
}

/// Feet and wheels pressed in with the material moving: the automaton against the soil that moves nothing, by grid.
fn presses(context: &Context) -> Outcome<Vec<Figure>> {
    let soil = row("lunar_nominal")?;
    let spacings: &[f64] = if context.quick { &[0.02, 0.01] } else { &[0.02, 0.01, 0.005, 0.0025] };
    let mut cases = Vec::new();
    for shape in 0..shapes().len() {
        for (module, (_, make)) in MODULES.iter().enumerate() {
            cases.extend(spacings.iter().map(|spacing| (shape, module, *make, *spacing)));
        }
    }
    let sunk = in_parallel(&cases, |(shape, _, make, spacing)| pressed(*make, &soil.own, *shape, *spacing));
    let mut all = Vec::new();
    for (shape, (name, ..)) in shapes().iter().enumerate() {
        let of = |module: usize| -> Vec<f64> {
            let mine = cases.iter().zip(&sunk).filter(|(c, _)| c.0 == shape && c.1 == module);
            mine.map(|(_, z)| *z).collect()
        };
        let (automaton, bekker) = (of(0), of(1));
        let ratio = |(a, b): (&f64, &f64)| 100.0 * (a / b - 1.0).abs();
        let worst = automaton.iter().zip(&bekker).map(ratio).fold(0.0, larger);
        let what = format!(
            "largest difference of the sinkage of a {name} on the automaton, %, from that on soil-bekker, grids of 20 to {} mm",
            1e3 * spacings[spacings.len() - 1]
        );
        all.push(Figure::new(format!("soil.press.{name}.automaton"), worst, Limit::AtMost(5.0), what));
        if context.quick {
            continue;
        }
        for (module, z) in [("automaton", &automaton), ("bekker", &bekker)] {
            let last = 100.0 * (z[z.len() - 2] / z[z.len() - 1] - 1.0).abs();
            let what = format!("change of the sinkage of a {name} from the 5 mm grid to the 2.5 mm grid, %");
            all.push(Figure::new(format!("soil.press.{name}.{module}.grid"), last, Limit::AtMost(2.0), what));
        }
    }
    Ok(all)
}

/// A wheel of the size of `scenarios/wheel_rig.toml` that rolls at slip 0.2 over the ground, its plane at an angle to its way:
/// sinkage over the last tenth of the way, and the balance of energies.
fn rolled(make: Maker, config: &str, yaw: f64, spacing: f64, way: f64) -> (f64, Balance) {
    const RADIUS: f64 = 0.092;
    let geometry = Geometry::Cylinder { half_length: 0.0535, radius: RADIUS };
    let soil = make(config, ((way + 0.5) / spacing) as u32 + 1, spacing);
    let mut bench = Drive::new(soil, geometry, on_rim(yaw), [-0.5 * way, 0.0013]);
    let ahead = 5e-4;
    let turn = ahead * yaw.cos() / 0.8 / RADIUS;
    let now = Move::rolling(ahead, turn, yaw, 64.7);
    let steps = (way / ahead).round() as u32;
    let (mut sum, mut count) = (0.0, 0.0);
    for k in 0..steps {
        bench.step(&now);
        if k >= steps - steps / 10 {
            (sum, count) = (sum + bench.sinkage(), count + 1.0);
        }
    }
    (sum / count, bench.balance)
}

fn yawed(context: &Context) -> Outcome<Vec<Figure>> {
    let soil = row("lunar_nominal")?;
    let angles: &[f64] = if context.quick { &[15.0] } else { &[0.0, 5.0, 10.0, 15.0, 30.0] };
    let spacings: &[f64] = if context.quick { &[0.02, 0.01] } else { &[0.02, 0.01, 0.005] };
    let mut cases = Vec::new();
    for angle in angles {
        for (_, make) in MODULES {
            cases.extend(spacings.iter().map(|spacing| (*angle, make, *spacing)));
        }
    }
    let found = in_parallel(&cases, |(angle, make, spacing)| {
        rolled(*make, &soil.own, angle.to_radians(), *spacing, 0.3)
    });
    let mut all = Vec::new();
    for angle in angles {
        let of_angle = || cases.iter().zip(&found).filter(|(c, _)| c.0 == *angle).map(|(_, f)| f);
        let sunk = || of_angle().map(|(z, _)| *z);
        let (low, high) = (sunk().fold(f64::INFINITY, smaller), sunk().fold(0.0, larger));
        let what = format!(
            "largest sinkage of a wheel at slip 0.2 yawed by {angle}° over the smallest, %, both soils, {} grids; {:.1} mm",
            spacings.len(),
            1e3 * low
        );
        all.push(Figure::new(
            format!("soil.yaw.{angle}.spread"),
            100.0 * (high / low - 1.0),
            Limit::AtMost(10.0),
            what,
        ));
        let worst = of_angle().map(|(_, balance)| balance.relative()).fold(0.0, larger);
        let what = format!(
            "largest error of the balance of energies of the wheel yawed by {angle}°, % of the path of the work"
        );
        all.push(Figure::new(format!("soil.yaw.{angle}.balance"), worst, Limit::AtMost(1.0), what));
    }
    Ok(all)
}

/// Depth of the rut that a wheel leaves behind it over its sinkage: mean of the nodes along the middle of the way, well behind
/// the wheel and well after its start.
fn rut(make: Maker, config: &str, slip: f64, spacing: f64) -> f64 {
    const RADIUS: f64 = 0.092;
    let geometry = Geometry::Cylinder { half_length: 0.0535, radius: RADIUS };
    let soil = make(config, (1.0 / spacing) as u32 + 1, spacing);
    let mut bench = Drive::new(soil, geometry, on_rim(0.0), [-0.25, 0.0013]);
    let ahead = 5e-4;
    let now = Move::rolling(ahead, ahead / (1.0 - slip) / RADIUS, 0.0, 64.7);
    (0..1000).for_each(|_| {
        bench.step(&now);
    });
    let surface = Shown::new(bench.soil.as_ref());
    let lattice = *surface.lattice();
    let place = |x: f64, k: usize| ((x - lattice.origin[k]) / spacing).round() as i32;
    let nodes = || place(-0.1, 0)..=place(0.1, 0);
    let depth: f64 = nodes().map(|i| -surface.height(i, place(0.0, 1))).sum::<f64>() / nodes().count() as f64;
    depth / bench.sinkage()
}

/// A rut stays behind every wheel: in soil whose walls stand and in dry sand, which slides. On a grid of 20 mm a wheel that
/// sinks by a millimetre has less than two cells below it.
fn ruts(context: &Context) -> Outcome<Vec<Figure>> {
    let grids: &[(&str, &[f64])] =
        if context.quick { &[("", &[0.01])] } else { &[("", &[0.01, 0.005]), (".20mm", &[0.02])] };
    let slips: &[f64] = if context.quick { &[0.2] } else { &[0.0, 0.2, 0.5] };
    let mut all = Vec::new();
    for name in ["lunar_nominal", "LETE_sand", "clayey_Thai38"] {
        let soil = row(name)?;
        for (grid, spacings) in grids {
            let mut cases = Vec::new();
            for (_, make) in MODULES {
                cases.extend(spacings.iter().flat_map(|s| slips.iter().map(move |slip| (make, *s, *slip))));
            }
            let found = in_parallel(&cases, |(make, spacing, slip)| rut(*make, &soil.own, *slip, *spacing));
            let least = found.into_iter().fold(f64::INFINITY, smaller);
            let what =
                format!("least depth of the rut behind a wheel over its sinkage, {} runs", cases.len());
            all.push(Figure::new(format!("soil.rut.{name}{grid}"), least, Limit::AtLeast(0.5), what));
        }
    }
    Ok(all)
}

/// Motion of a foot in the balances, by step.
type Script = (&'static str, fn(u32) -> Move);

const fn still(ahead: f64, load: f64, turn: [f64; 3]) -> Move {
    Move { ahead: [ahead, 0.0], vertical: Vertical::Load(load), turn }
}

/// 300 steps each; loads grow over the first 60.
const SCRIPTS: [Script; 5] = [
    ("dragged", |k| still(if k < 60 { 0.0 } else { 2e-4 }, laid(k, 20.0), [0.0; 3])),
    ("reversed", |k| {
        still(
            if k < 60 {
                0.0
            } else if k < 180 {
                2e-4
            } else {
                -2e-4
            },
            laid(k, 20.0),
            [0.0; 3],
        )
    }),
    ("twisted", |k| still(0.0, laid(k, 20.0), [0.0, 0.0, if k < 60 { 0.0 } else { 3e-3 }])),
    ("unloaded", |k| {
        still(0.0, if k < 150 { laid(k, 40.0) } else { 40.0 - f64::from(k - 150) * 0.25 }, [0.0; 3])
    }),
    ("lifted", |k| {
        let vertical = if k < 100 { Vertical::Load(laid(k, 20.0)) } else { Vertical::Up(1e-4) };
        Move { ahead: [1e-4, 0.0], vertical, turn: [0.0; 3] }
    }),
];

fn laid(k: u32, load: f64) -> f64 {
    load * f64::from((k + 1).min(60)) / 60.0
}

const BALANCED: [&str; 4] = ["lunar_nominal", "LETE_sand", "snow_US_Harrison", "clayey_Thai38"];

/// Script, soil, module, shape and spacing of a run whose balance is checked.
type BalancedCase = (usize, &'static str, Maker, usize, f64);

/// Error of the balance of energies of such a run over the path of the work, and the largest fall of its heat in a step, J.
fn balanced(rows: &[SoilRow], (script, name, make, shape, spacing): &BalancedCase) -> [f64; 2] {
    let Some(row) = rows.iter().find(|r| r.name == *name) else { return [f64::NAN; 2] };
    // k_u of snow: Wong (2008) gives A_u = 109.6 MPa/m² at 2 cm
    let config = if name.starts_with("snow") {
        row.own.replacen('{', r#"{"elastic_stiffness_pa_m":2.2e6,"#, 1)
    } else {
        row.own.clone()
    };
    let (_, geometry, lies, _) = shapes()[*shape].clone();
    let mut bench =
        Drive::new(make(&config, (0.6 / spacing) as u32 + 1, *spacing), geometry, lies, [0.0031, 0.0017]);
    // weak snow carries a quarter without burying the foot
    let share = if name.starts_with("snow") { 0.25 } else { 1.0 };
    for k in 0..300 {
        let now = SCRIPTS[*script].1(k);
        let vertical =
            if let Vertical::Load(load) = now.vertical { Vertical::Load(share * load) } else { now.vertical };
        bench.step(&Move { vertical, ..now });
    }
    [bench.balance.relative(), bench.balance.fall]
}

fn balances(context: &Context) -> Outcome<Vec<Figure>> {
    let spacings: &[f64] = if context.quick { &[0.01] } else { &[0.02, 0.01, 0.005] };
    let form = if context.quick { "" } else { "long." };
    let feet = &shapes()[..];
    let mut cases = Vec::new();
    for (script, _) in SCRIPTS.iter().enumerate() {
        for (k, name) in BALANCED.iter().enumerate() {
            for (module, (_, make)) in MODULES.iter().enumerate() {
                for shape in [0, 3] {
                    // quickly each script, soil and shape with half of the others
                    if !context.quick || (script + k + module + shape) % 2 == 0 {
                        cases.extend(spacings.iter().map(|s| (script, *name, *make, shape, *s)));
                    }
                }
            }
        }
    }
    let rows = eight()?;
    let run = |case: &BalancedCase| balanced(&rows, case);
    let found = in_parallel(&cases, run);
    let mut all = Vec::new();
    for (k, (name, _)) in SCRIPTS.iter().enumerate() {
        let of_script = || cases.iter().zip(&found).filter(|(c, _)| c.0 == k);
        let worst = of_script().max_by(|a, b| a.1[0].total_cmp(&b.1[0]));
        let Some((case, [error, _])) = worst else { continue };
        let what = format!(
            "largest error of the balance of energies of a foot that is {name}, % of the path of the work, {} runs; {} on {}, {} mm",
            of_script().count(),
            feet[case.3].0,
            case.1,
            1e3 * case.4
        );
        all.push(Figure::new(format!("soil.balance.{form}{name}"), *error, Limit::AtMost(1.0), what));
        let fall = of_script().map(|(_, f)| f[1]).fold(0.0, larger);
        let what = format!("largest fall of the heat in a step while a foot is {name}, J");
        all.push(Figure::new(format!("soil.balance.{name}.heat_falls"), fall, Limit::AtMost(1e-9), what));
    }
    Ok(all)
}

/// Vertical stress on a plate at the angle `beta` that moves straight down over that on a level one: the generic coefficients
/// of Li, Zhang and Goldman (2013, Science 339, eq. S1).
fn plate(beta: f64) -> f64 {
    let at = |beta: f64| {
        let angle = |m: f64, n: f64| 2.0 * m * beta + n * FRAC_PI_2;
        0.206
            + 0.169 * angle(1.0, 0.0).cos()
            + 0.212 * angle(1.0, 1.0).sin()
            + 0.358 * angle(0.0, 1.0).sin()
            + 0.055 * angle(-1.0, 1.0).sin()
    };
    at(beta) / at(0.0)
}

/// Radius of the sphere, that of a foot of the walking robot, m.
const RADIUS: f64 = 0.03;

/// Presses the sphere straight down into lunar soil and calls `each` with its depth (m) and the force on it (N) every
/// 0.1 mm down to 3 cm.
pub fn press_sphere(make: Maker, spacing: f64, mut each: impl FnMut(f64, f64)) -> Outcome {
    let soil = make(&row("lunar_nominal")?.own, (0.4 / spacing) as u32 + 1, spacing);
    let mut bench = Drive::new(soil, Geometry::Sphere { radius: RADIUS }, LEVEL, [0.0011, 0.0007]);
    for k in 1..=300 {
        let down = Move { ahead: [0.0; 2], vertical: Vertical::Up(-1e-4), turn: [0.0; 3] };
        let [force, _] = bench.step(&down);
        each(1e-4 * f64::from(k), force[2]);
    }
    Ok(())
}

/// A sphere in soil whose pressure grows with the depth (n = 1), against resistive force theory.
fn resistive_force(context: &Context) -> Outcome<Vec<Figure>> {
    let soil = row("lunar_nominal")?;
    let depths = [0.005, 0.01, 0.015, 0.02, 0.025, 0.03];
    let theory = |z: f64| {
        let rim = (1.0 - z / RADIUS).acos();
        let modulus = soil.modulus(RADIUS * rim.sin());
        let points = 400;
        let force = |k: usize| {
            let beta = rim * (f64::from(k as u32) + 0.5) / f64::from(points as u32);
            let depth = z - RADIUS * (1.0 - beta.cos());
            plate(beta) * modulus * depth * 2.0 * PI * RADIUS * RADIUS * beta.sin()
        };
        (0..points).map(force).sum::<f64>() * rim / f64::from(points as u32)
    };
    let spacing = if context.quick { 0.005 } else { 0.0025 };
    let mut all = Vec::new();
    for (name, make) in MODULES {
        let mut worst = 0.0;
        press_sphere(make, spacing, |z, force| {
            if depths.iter().any(|d| (d - z).abs() < 1e-9) {
                worst = larger(worst, 100.0 * (force / theory(z) - 1.0).abs());
            }
        })?;
        let what = "largest error of the force on a sphere of 3 cm pressed 5 to 30 mm deep into lunar soil, %, against resistive force \
                    theory (Li et al. 2013)";
        all.push(Figure::new(format!("soil.{name}.sphere.rft"), worst, Limit::AtMost(15.0), what));
    }
    Ok(all)
}
