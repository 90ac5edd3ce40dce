//! Wheels are wheels in every step of the scenarios that drive: none loses its radius and its heading when few nodes look round, and
//! the slip of one that stands is 0.

use super::MODULES;
use crate::parallel::in_parallel;
use crate::process::{Outcome, run_scenario};
use crate::{Context, Figure, Limit, columns};
use terraglue_numerics::extremes::larger;

/// Name, scenario, settings besides the soil, duration (s) and the time until which its wheels stand, s. On the slope the
/// rover rolls back before it is driven: its drives hold no angle.
type DrivenRover = (&'static str, &'static str, &'static [&'static str], &'static str, f64);
const RUNS: [DrivenRover; 3] = [
    ("rover_slope", "rover_slope", &[], "8", 0.0),
    ("rover_level", "rover_slope", &["world.gravity_m_s2=[0.0,0.0,-9.81]", "time.settle_s=3.0"], "1", 1.0),
    ("wheel_rig", "wheel_rig", &["soil.contacts_shown=1"], "2", 0.0),
];
/// A wheel that carries less hardly touches, N.
const TOUCHES: f64 = 1.0;
/// When the wheels that were set down have come to rest, s.
const RESTS: f64 = 0.5;

/// Of each scenario on both soils.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    let cases: Vec<_> = RUNS.iter().flat_map(|run| MODULES.map(|(module, _)| (run, module))).collect();
    let found = in_parallel(&cases, |(run, module)| Steps::of(context, run, module));
    let mut all = Vec::new();
    for (((name, ..), module), found) in cases.iter().zip(found) {
        let Steps { steps, lost, standing, slip } = found?;
        let id = |what: &str| format!("soil.{module}.{name}.{what}");
        let what = format!("steps of a wheel under load without torque, of {steps}");
        all.push(Figure::new(id("lost_wheels"), lost as f64, Limit::Equal(0.0), what));
        if standing > 0 {
            let what = format!("largest slip of a wheel that stands, {standing} steps");
            all.push(Figure::new(id("standing_slip"), slip, Limit::Equal(0.0), what));
        }
    }
    Ok(all)
}

/// Counts over the steps of a run, by wheel.
#[derive(Default)]
struct Steps {
    steps: usize,
    /// Those in which the soil took a loaded wheel for something else.
    lost: usize,
    standing: usize,
    /// Largest of those that stand.
    slip: f64,
}

impl Steps {
    fn of(context: &Context, run: &DrivenRover, module: &str) -> Outcome<Self> {
        let (name, scenario, sets, duration, stands) = *run;
        let id = format!("wheels.{name}.{module}");
        let folder = context.scratch.join(&id);
        let soil =
            format!("soil.module=soil-{}", if module == "automaton" { "cellular-automaton" } else { module });
        let mut options =
            vec!["--csv", "--duration", duration, "--set", "recording.every_steps=1", "--set", &soil];
        options.extend(sets.iter().flat_map(|set| ["--set", set]));
        let summary =
            run_scenario(&context.program, &id, &format!("scenarios/{scenario}.toml"), &folder, &options)?;
        if summary["status"] != "done" {
            return Err(format!("{id}: {}", summary["error"]));
        }
        let path = folder.join("variables.csv");
        let of = |what: &'static str| {
            columns(&path, move |name| name.starts_with("soil.contact") && name.ends_with(what))
        };
        let times = columns(&path, |name| name == "t_s")?;
        let mut all = Self::default();
        let wheels = of(".normal_force")?.into_iter().zip(of(".torque")?).zip(of(".slip")?);
        for (((_, forces), (_, torques)), (_, slips)) in wheels {
            for (((t, force), torque), slip) in times[0].1.iter().zip(&forces).zip(&torques).zip(&slips) {
                all.count(*force, *torque, (RESTS < *t && *t < stands).then_some(*slip));
            }
        }
        Ok(all)
    }

    /// `slip`: of a wheel that stands.
    fn count(&mut self, force: f64, torque: f64, slip: Option<f64>) {
        if force < TOUCHES {
            return;
        }
        self.steps += 1;
        self.lost += usize::from(torque == 0.0);
        self.standing += usize::from(slip.is_some());
        self.slip = slip.map_or(self.slip, |s| larger(self.slip, s.abs()));
    }
}
