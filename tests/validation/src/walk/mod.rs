//! Area `walk`: `scenarios/moon_walk.toml` with both soils and both strategies, run as a user runs it; and the motion of
//! the feet under its gait.

mod picture;
mod prints;
pub mod speed;

pub use picture::write_picture;
use terraglue_numerics::extremes::larger;

use super::parallel::in_parallel;
use super::timing::{calibration_s, median};
use super::{Context, Figure, Limit, columns};
use crate::process::{Outcome, read, root, run_scenario};
use serde_json::Value;
use std::path::{Path, PathBuf};
use terraglue::scenario::SoilTable;

const SCENARIO: &str = "scenarios/moon_walk.toml";
const SOILS: [&str; 2] = ["soil-cellular-automaton", "soil-bekker"];
const STRATEGIES: [&str; 2] = ["cooperative", "iterative"];

/// The scenario as it is shipped, and glued otherwise.
const GAITS: [(&str, Option<&str>); 3] =
    [("default", None), ("compliant", Some("cooperative-compliant")), ("iterative", Some("iterative"))];

/// One run of the program.
struct Run<'a> {
    context: &'a Context,
    name: String,
    options: Vec<String>,
}

/// All figures of the area.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    let mut all = Vec::new();
    let combinations: Vec<_> =
        SOILS.iter().flat_map(|soil| STRATEGIES.map(|strategy| (*soil, strategy))).collect();
    let summaries: Vec<Outcome<Value>> = in_parallel(&combinations, |(soil, strategy)| {
        // The robot stands for half a second and then needs a second to reach its speed.
        let duration = if context.quick { "7" } else { "10" };
        run(context, &format!("{soil}.{strategy}"), soil, strategy, duration, "1").summary()
    });
    let summaries = summaries.into_iter().collect::<Outcome<Vec<_>>>()?;
    for ((soil, strategy), summary) in combinations.iter().zip(&summaries) {
        all.extend(quality(&format!("walk.{soil}.{strategy}"), summary));
    }
    for (name, strategy) in GAITS {
        all.extend(steps_of_feet(context, name, strategy)?);
    }
    all.extend(prints(&combinations, &summaries));
    all.extend(prints::figures(context, &summaries[0])?);
    all.extend(rows(context)?);
    for soil in SOILS {
        all.push(same_bytes(context, soil)?);
    }
    for (soil, strategy) in combinations {
        all.extend(speed(context, soil, strategy)?);
    }
    Ok(all)
}

/// Drift of the energy ledger, % of the work of the motors.
fn drift(s: &Value) -> f64 {
    let number = |key: &str| s[key].as_f64().unwrap_or(f64::NAN);
    100.0 * number("energy_balance_j").abs() / number("energy_j")
}

/// The mean print by the single pass against that by the iteration.
fn prints(combinations: &[(&str, &str)], summaries: &[Value]) -> Vec<Figure> {
    let of = |soil: &str, strategy: &str| {
        let found = combinations.iter().position(|c| *c == (soil, strategy));
        found.and_then(|k| summaries[k]["mean_sinkage_m"].as_f64()).unwrap_or(f64::NAN)
    };
    let figure = |soil: &str| {
        let [once, iterated] = STRATEGIES.map(|strategy| of(soil, strategy));
        let what =
            format!("mean print by cooperative against iterative, {:.1} mm, difference in %", 1e3 * iterated);
        let difference = 100.0 * (once / iterated - 1.0).abs();
        Figure::new(format!("walk.{soil}.prints"), difference, Limit::AtMost(5.0), what)
    };
    SOILS.map(figure).into()
}

/// The walk on every row of the table that has all numbers; quickly on two. Burying the robot has to be reported.
fn rows(context: &Context) -> Outcome<Vec<Figure>> {
    let table = SoilTable::parse(&read(&root().join("models/soils.csv"))?).map_err(|e| e.to_string())?;
    let usable = table.rows.iter().filter(|row| row.offered(&[]).is_ok()).map(|row| row.name.clone());
    let names: Vec<String> = usable
        .filter(|n| !context.quick || ["LETE_sand", "snow_US_Harrison"].contains(&n.as_str()))
        .collect();
    let cases: Vec<_> = SOILS.iter().flat_map(|soil| names.iter().map(move |name| (*soil, name))).collect();
    let runs = in_parallel(&cases, |(soil, name)| {
        let id = format!("rows.{soil}.{name}");
        let options = [
            "--duration",
            "3",
            "--set",
            &format!("soil.parameters={name}"),
            "--set",
            &format!("soil.module={soil}"),
        ];
        Run { context, name: id, options: options.map(str::to_owned).into() }.summary()
    });
    let runs = runs.into_iter().collect::<Outcome<Vec<_>>>()?;
    let figure = |soil: &&str| {
        let of_soil = || cases.iter().zip(&runs).filter(|(case, _)| case.0 == *soil);
        let (mut worst, mut at, mut weak) = (0.0, "", Vec::new());
        for ((_, name), run) in of_soil() {
            let reason = run["error"]["message"].as_str().unwrap_or_default();
            if reason.contains("is buried") {
                weak.push(name.as_str());
                continue;
            }
            let now = if run["status"] == "done" { drift(run) } else { f64::NAN };
            if now > worst || now.is_nan() {
                (worst, at) = (now, name.as_str());
            }
        }
        let what = format!(
            "largest drift of the energy ledger in 3 s of moon_walk, % of the work of the motors, {} soils; {at}; too weak for the \
             robot, as the run says: {}",
            of_soil().count(),
            if weak.is_empty() { "none".to_owned() } else { weak.join(", ") }
        );
        Figure::new(format!("walk.rows.{soil}.drift"), worst, Limit::AtMost(1.0), what)
    };
    Ok(SOILS.iter().map(figure).collect())
}

fn quality(id: &str, s: &Value) -> Vec<Figure> {
    let number = |key: &str| s[key].as_f64().unwrap_or(f64::NAN);
    let figure =
        |name: &str, value: f64, limit, what: &str| Figure::new(format!("{id}.{name}"), value, limit, what);
    let degrees = |key: &str| number(key).to_degrees();
    let ratio = number("distance_m") / number("commanded_distance_m");
    let mass = match s["soil_mass_error_relative"].as_f64() {
        Some(error) => {
            figure("mass_error", error.abs(), Limit::Equal(0.0), "relative error of the soil's mass")
        }
        None => Figure::skipped(format!("{id}.mass_error"), "this soil moves no material"),
    };
    let not_converged = match s["steps_not_converged"].as_f64() {
        Some(steps) => figure("not_converged", steps, Limit::Equal(0.0), "steps that did not converge"),
        None => Figure::skipped(format!("{id}.not_converged"), "a single pass has nothing to converge to"),
    };
    vec![
        figure("distance", ratio, Limit::AtLeast(0.9), "distance walked / asked for after stand and ramp"),
        figure(
            "drift",
            drift(s),
            Limit::AtMost(1.0),
            "drift of the energy ledger, % of the work of the motors",
        ),
        figure("roll", degrees("max_roll_rad"), Limit::AtMost(15.0), "largest roll, degrees"),
        figure("pitch", degrees("max_pitch_rad"), Limit::AtMost(15.0), "largest pitch, degrees"),
        figure("sinkage_min", 1e3 * number("max_sinkage_m"), Limit::AtLeast(2.0), "largest sinkage, mm"),
        figure("sinkage_max", 1e3 * number("max_sinkage_m"), Limit::AtMost(60.0), "largest sinkage, mm"),
        not_converged,
        mass,
    ]
}

/// The forces on the feet in every step: whether the robot ever leaves the ground, and how hard a foot meets it.
/// Limits hold for the scenario as it is shipped.
fn steps_of_feet(context: &Context, name: &str, strategy: Option<&str>) -> Outcome<Vec<Figure>> {
    let duration = if context.quick { "7" } else { "10" };
    let mut options =
        vec!["--duration", duration, "--threads", "1", "--csv", "--set", "recording.every_steps=1"];
    let glued = strategy.map(|s| format!("gluing.strategy={s}"));
    options.extend(glued.iter().flat_map(|s| ["--set", s.as_str()]));
    let options = options.into_iter().map(str::to_owned).collect();
    let run = Run { context, name: format!("gait.{name}"), options };
    let summary = run.summary()?;
    let feet = Feet::read(&run.folder().join("variables.csv"))?;
    let number = |key: &str| summary[key].as_f64().unwrap_or(f64::NAN);
    let cost = number("cost_of_transport");
    let weight = number("energy_j") / (cost * number("distance_m").abs());
    let limit = |limit| if strategy.is_none() { limit } else { Limit::None };
    let figure = |what: &str, value: f64, limit, help: &str| {
        Figure::new(format!("walk.gait.{name}.{what}"), value, limit, help)
    };
    Ok(vec![
        figure("airborne", feet.airborne as f64, limit(Limit::Equal(0.0)), "steps in which no foot presses"),
        figure("peak", feet.peak / weight, limit(Limit::AtMost(2.5)), "largest force on a foot / weight"),
        figure(
            "peak_sum",
            feet.peak_sum / weight,
            limit(Limit::AtMost(2.5)),
            "largest force on all feet / weight",
        ),
        figure("cost_of_transport", cost, Limit::None, "energy of the motors / (weight · distance)"),
    ])
}

/// Normal forces of the ground over a run.
#[derive(Default)]
struct Feet {
    /// Steps without any.
    airborne: usize,
    /// Largest of one foot, N.
    peak: f64,
    /// Largest of all feet together, N.
    peak_sum: f64,
}

impl Feet {
    /// From the variables of every step.
    fn read(path: &Path) -> Outcome<Self> {
        let wanted = |name: &str| name.starts_with("robot.") && name.ends_with("4.contact_normal");
        let forces = columns(path, wanted)?;
        let mut feet = Self::default();
        for step in 0..forces[0].1.len() {
            let of_step = || forces.iter().map(|(_, column)| column[step]);
            let sum: f64 = of_step().sum();
            feet.peak = of_step().fold(feet.peak, larger);
            feet.airborne += usize::from(sum <= 0.0);
            feet.peak_sum = larger(feet.peak_sum, sum);
        }
        Ok(feet)
    }
}

/// The same run with one and with two threads, and once more: recordings equal byte for byte.
fn same_bytes(context: &Context, soil: &str) -> Outcome<Figure> {
    let duration = if context.quick { "0.5" } else { "2" };
    let runs = [("a", "1"), ("b", "1"), ("c", "2")];
    let bytes = in_parallel(&runs, |(name, threads)| {
        run(context, &format!("bytes.{soil}.{name}"), soil, "iterative", duration, threads).recording()
    });
    let bytes = bytes.into_iter().collect::<Outcome<Vec<_>>>()?;
    let different = bytes[1..].iter().filter(|b| **b != bytes[0]).count();
    let what = "recordings that differ among three runs with 1, 1 and 2 threads";
    Ok(Figure::new(format!("walk.{soil}.different_bytes"), different as f64, Limit::Equal(0.0), what))
}

/// CPU time of the stepping thread, median of five runs one after the other.
fn speed(context: &Context, soil: &str, strategy: &str) -> Outcome<Vec<Figure>> {
    let id = format!("walk.{soil}.{strategy}");
    if !context.timing {
        return Ok(vec![Figure::skipped(format!("{id}.real_time_factor"), "timing was left out")]);
    }
    let duration = if context.quick { "2" } else { "10" };
    let calibration = calibration_s();
    let mut per_step = Vec::new();
    let mut factors = Vec::new();
    for k in 0..5 {
        let s =
            run(context, &format!("speed.{soil}.{strategy}.{k}"), soil, strategy, duration, "1").summary()?;
        let number = |key: &str| s[key].as_f64().unwrap_or(f64::NAN);
        factors.push(number("simulated_s") / number("cpu_s"));
        per_step.push(number("cpu_s") / number("steps"));
    }
    let ratio = median(per_step) / calibration;
    Ok(vec![
        Figure::new(
            format!("{id}.real_time_factor"),
            median(factors),
            Limit::AtLeast(1.0),
            "simulated time / CPU time",
        )
        .timed(),
        Figure::new(format!("{id}.cost"), ratio, Limit::None, "CPU time of a step / a million multiply-adds")
            .timed(),
    ])
}

fn run<'a>(
    context: &'a Context,
    name: &str,
    soil: &str,
    strategy: &str,
    duration: &str,
    threads: &str,
) -> Run<'a> {
    let soil = format!("soil.module={soil}");
    let strategy = format!("gluing.strategy={strategy}");
    // All bits, so that equal bytes mean equal numbers.
    let bits = ["--set", "recording.digits=17"];
    let options = ["--set", &soil, "--set", &strategy, "--duration", duration, "--threads", threads];
    let options = [&options[..], &bits[..]].concat().into_iter();
    Run { context, name: name.into(), options: options.map(str::to_owned).collect() }
}

impl Run<'_> {
    fn folder(&self) -> PathBuf {
        self.context.scratch.join(&self.name)
    }

    /// Runs and reads `summary.json` from standard output.
    fn summary(&self) -> Outcome<Value> {
        let options: Vec<&str> = self.options.iter().map(String::as_str).collect();
        run_scenario(&self.context.program, &self.name, SCENARIO, &self.folder(), &options)
    }

    fn recording(&self) -> Outcome<Vec<u8>> {
        self.summary()?;
        let path = self.folder().join("recording.mcap");
        std::fs::read(&path).map_err(|e| format!("{}: {e}", path.display()))
    }
}
