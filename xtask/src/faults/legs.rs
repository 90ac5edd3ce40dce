//! The undisturbed walk and the three faults of a leg, each with two steps.

use super::walk::{Place, Walk};
use crate::process::Outcome;

/// What is run: name in the table, name in the picture, scenario, options.
const CASES: [(&str, &str, &str, &[&str]); 4] = [
    ("undisturbed", "undisturbed", "torque", &["event=[]"]),
    ("torque of LF_j2 and LF_j3 lost", "torque lost", "torque", &[]),
    ("LF_j2 breaks", "joint broken", "loss", &[]),
    ("LF_j3 blocked", "joint blocked", "block", &[]),
];

/// Step, s, and number of steps from record to record: the same times with either step.
const STEPS: [(&str, &str); 2] = [("0.001", "10"), ("0.0005", "20")];

/// The four walks.
pub struct Legs {
    /// With h = 1 ms, in the order of the table.
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

    /// The table of the page.
    pub fn table(&self) -> String {
        let mut text =
            "| | path | heading | halving h: path | halving h: heading | lowest body | largest tilt |\n\
                        |---|---|---|---|---|---|---|\n"
                .to_owned();
        for (k, ((_, walk), half)) in self.walks.iter().zip(&self.halved).enumerate() {
            let text_of = |difference: Outcome<(f64, f64)>| {
                difference
                    .map_or_else(|e| (e, String::new()), |(p, h)| (format!("{p:.1} mm"), format!("{h:.2}°")))
            };
            let (path, heading) =
                if k == 0 { Default::default() } else { text_of(walk.difference(&self.walks[0].1)) };
            let (half_path, half_heading) = text_of(walk.difference(half));
            let lowest = walk.z.iter().copied().fold(f64::INFINITY, f64::min);
            let tilt = walk.tilt.iter().copied().fold(0.0, f64::max).to_degrees();
            text += &format!(
                "| {} | {path} | {heading} | {half_path} | {half_heading} | {lowest:.2} m | {tilt:.1}° |\n",
                CASES[k].0
            );
        }
        text
    }
}
