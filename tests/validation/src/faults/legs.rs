//! The undisturbed walk and the three faults of a leg, each with two steps.

use super::walk::{Place, Walk};
use crate::process::Outcome;
use terraglue_numerics::extremes::{larger, smaller};

/// Runs: name in the table, name in the picture, scenario, options.
const CASES: [(&str, &str, &str, &[&str]); 4] = [
    ("undisturbed", "undisturbed", "torque", &["event=[]"]),
    ("torque of LF_j2 and LF_j3 lost", "torque lost", "torque", &[]),
    ("LF_j2 breaks", "joint broken", "loss", &[]),
    ("LF_j3 blocked", "joint blocked", "block", &[]),
];

/// Step, s, and number of steps from record to record: the same times with either step.
const STEPS: [(&str, &str); 2] = [("0.0005", "20"), ("0.00025", "40")];

/// Smallest ratio of the change by a fault to the change by halving the step of the same walk.
const LEAST_RATIO: f64 = 5.0;

/// The four walks.
pub struct Legs {
    /// With the step of the scenarios, 0.5 ms, in the order of the table.
    pub walks: Vec<(&'static str, Walk)>,
    /// With half the step.
    halved: Vec<Walk>,
}

impl Legs {
    /// Runs all of them.
    pub fn run(place: &Place) -> Outcome<Self> {
        let (mut walks, mut halved) = (Vec::new(), Vec::new());
        for (_, name, file, options) in CASES {
            let scenario = format!("scenarios/leg_faults_{file}.toml");
            for (k, (step, every)) in STEPS.into_iter().enumerate() {
                let mut set: Vec<String> = options.iter().map(|o| (*o).to_owned()).collect();
                set.push(format!("time.step_s={step}"));
                set.push(format!("recording.every_steps={every}"));
                let walk = Walk::run(place, &format!("{name} {step}"), &scenario, &set)?;
                if k == 0 { walks.push((name, walk)) } else { halved.push(walk) }
            }
        }
        Ok(Self { walks, halved })
    }

    /// Of a walk: path (mm) and heading (degrees) against the undisturbed walk, and against itself with half the step.
    fn effects(&self, k: usize) -> Outcome<[(f64, f64); 2]> {
        let walk = &self.walks[k].1;
        Ok([walk.difference(&self.walks[0].1)?, walk.difference(&self.halved[k])?])
    }

    /// The table of the page.
    pub fn table(&self) -> Outcome<String> {
        let mut text = "| | path | heading | halving h: path | halving h: heading | fault over step: path | heading | lowest body | \
                        largest tilt |\n|---|---|---|---|---|---|---|---|---|\n"
            .to_owned();
        for (k, (_, walk)) in self.walks.iter().enumerate() {
            let [(path, heading), (half_path, half_heading)] = self.effects(k)?;
            let [effect, ratio] = match k {
                0 => [" | ".to_owned(), " | ".to_owned()],
                _ => [
                    format!("{path:.1} mm | {heading:.2}°"),
                    format!("{:.0} | {:.0}", path / half_path, heading / half_heading),
                ],
            };
            let lowest = walk.z.iter().copied().fold(f64::INFINITY, smaller);
            let tilt = walk.tilt.iter().copied().fold(0.0, larger).to_degrees();
            text += &format!(
                "| {} | {effect} | {half_path:.1} mm | {half_heading:.2}° | {ratio} | {lowest:.2} m | {tilt:.1}° |\n",
                CASES[k].0
            );
        }
        Ok(text)
    }

    /// Whether each fault moves path and heading by [`LEAST_RATIO`] times the change by half the step.
    pub fn hold(&self) -> Outcome {
        for k in 1..CASES.len() {
            let [(path, heading), (half_path, half_heading)] = self.effects(k)?;
            if path < LEAST_RATIO * half_path || heading < LEAST_RATIO * half_heading {
                return Err(format!(
                    "{}: the fault moves path and heading by {path:.1} mm and {heading:.2}°, half the step by {half_path:.1} mm and \
                     {half_heading:.2}°: less than {LEAST_RATIO} times as much shows the step and not the fault",
                    CASES[k].0
                ));
            }
        }
        Ok(())
    }
}
