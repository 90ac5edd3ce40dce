//! Prints of feet: their depth in a slow gait against the law of a foot that is pressed straight down, and by the step.

use super::{Figure, Limit, Run, SOILS};
use crate::parallel::in_parallel;
use crate::process::Outcome;
use crate::soil::{MODULES, press_sphere};
use crate::{Context, columns};
use serde_json::Value;
use std::path::Path;
use terraglue_numerics::extremes::larger;

/// A gait so slow that nothing is left of the impact of feet, with strides of 9 cm, so that a foot seldom meets an old print.
const SLOW: [&str; 3] = ["gait.speed_m_s=0.015", "gait.cycle_s=12.0", "soil.contacts_shown=6"];
/// When the first prints, those of the robot that was set down, are left behind, s.
const WALKS: f64 = 2.0;

/// All of them; `usual`: the summary of the scenario as it is shipped.
pub fn figures(context: &Context, usual: &Value) -> Outcome<Vec<Figure>> {
    let cases: Vec<(&str, Load)> =
        [Load::Whole, Load::Straight].into_iter().flat_map(|load| SOILS.map(|soil| (soil, load))).collect();
    let runs = in_parallel(&cases, |(soil, load)| slow(context, soil, *load));
    let law = Law::pressed()?;
    let mut all = Vec::new();
    for ((soil, load), stances) in cases.iter().zip(runs) {
        all.push(against_law(&law, soil, *load, &stances?));
    }
    all.push(by_step(context, usual)?);
    Ok(all)
}

/// Load of a foot on the soil.
#[derive(Clone, Copy, PartialEq)]
enum Load {
    /// As the scenario has it: a foot that carries shear, too, sinks deeper.
    Whole,
    /// As the law that is measured straight down: shear has no influence on the depth.
    Straight,
}

impl Load {
    /// End of the figure's id, and the end of its meaning.
    fn names(self) -> [&'static str; 2] {
        match self {
            Self::Whole => ["slow", ""],
            Self::Straight => ["slow_straight", " without the influence of their shear"],
        }
    }
}

/// A foot on the ground from touch-down to lift-off.
#[derive(Clone, Copy, Debug, Default)]
struct Stance {
    begins: f64,
    ends: f64,
    /// Largest normal force, N.
    force: f64,
    /// Largest depth, m.
    depth: f64,
}

fn slow(context: &Context, soil: &str, load: Load) -> Outcome<Vec<Stance>> {
    let module = format!("soil.module={soil}");
    let inclined = format!("soil.load_inclination={}", load == Load::Whole);
    let mut options = vec!["--duration", "40", "--csv", "--set", "recording.every_steps=5"];
    options.extend(["--set", &module, "--set", &inclined]);
    options.extend(SLOW.iter().flat_map(|s| ["--set", s]));
    let options = options.into_iter().map(str::to_owned).collect();
    let run = Run { context, name: format!("prints.{}.{soil}", load.names()[0]), options };
    run.summary()?;
    stances(&run.folder().join("variables.csv"))
}

/// The stances that begin while the robot walks and end before the run does.
fn stances(path: &Path) -> Outcome<Vec<Stance>> {
    let of = |what: &'static str| {
        columns(path, move |name| name.starts_with("soil.contact") && name.ends_with(what))
    };
    let [times, forces, depths] =
        [columns(path, |name| name == "t_s")?, of(".normal_force")?, of(".sinkage")?];
    let mut all = Vec::new();
    for ((_, forces), (_, depths)) in forces.iter().zip(&depths) {
        let mut now: Option<Stance> = None;
        for ((t, force), depth) in times[0].1.iter().zip(forces).zip(depths) {
            if *force > 0.0 {
                let stance = now.get_or_insert(Stance { begins: *t, ..Stance::default() });
                stance.ends = *t;
                (stance.force, stance.depth) = (larger(stance.force, *force), larger(stance.depth, *depth));
            } else {
                all.extend(now.take());
            }
        }
    }
    all.retain(|s| s.begins > WALKS && s.ends - s.begins > 0.5);
    Ok(all)
}

/// Depths of the sphere pressed straight down into soil that moves nothing, by its force.
struct Law(Vec<[f64; 2]>);

impl Law {
    fn pressed() -> Outcome<Self> {
        let mut all = vec![[0.0; 2]];
        press_sphere(MODULES[1].1, 0.0025, |depth, force| all.push([force, depth]))?;
        Ok(Self(all))
    }

    fn depth(&self, force: f64) -> f64 {
        let at = self.0.partition_point(|p| p[0] < force).max(1);
        let Some([a, b]) = self.0.get(at - 1..=at).map(|p| [p[0], p[1]]) else { return f64::NAN };
        a[1] + (force - a[0]) / (b[0] - a[0]) * (b[1] - a[1])
    }
}

fn against_law(law: &Law, soil: &str, load: Load, stances: &[Stance]) -> Figure {
    let [id, shear] = load.names();
    let mean = |of: &dyn Fn(&Stance) -> f64| stances.iter().map(of).sum::<f64>() / stances.len() as f64;
    let (depth, expected) = (mean(&|s| s.depth), mean(&|s| law.depth(s.force)));
    let what = format!(
        "mean print of {} slow steps{shear}, {:.1} mm, against {:.1} mm by the law of a foot pressed straight down by the largest force of each, difference in %",
        stances.len(),
        1e3 * depth,
        1e3 * expected
    );
    let difference = 100.0 * (depth / expected - 1.0).abs();
    Figure::new(format!("walk.{soil}.prints.{id}"), difference, Limit::AtMost(5.0), what)
}

/// The mean print of the scenario as it is shipped with a quarter of the step.
fn by_step(context: &Context, usual: &Value) -> Outcome<Figure> {
    let duration = if context.quick { "7" } else { "10" };
    let options = ["--duration", duration, "--set", "time.step_s=0.00025"];
    let run = Run { context, name: "prints.step".into(), options: options.map(str::to_owned).to_vec() };
    let of = |s: &Value| s["mean_sinkage_m"].as_f64().unwrap_or(f64::NAN);
    let [usual, fine] = [of(usual), of(&run.summary()?)];
    let what =
        format!("mean print with steps of 1 ms against 0.25 ms, {:.1} mm, difference in %", 1e3 * fine);
    Ok(Figure::new("walk.prints.step", 100.0 * (usual / fine - 1.0).abs(), Limit::AtMost(5.0), what))
}
