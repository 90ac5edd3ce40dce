//! One run of the program, and the path of the body in it.

use crate::process::{Outcome, run_scenario};
use serde_json::Value;
use std::path::PathBuf;
use terraglue_numerics::extremes::larger;

/// Where the program is and where runs leave their files.
pub struct Place {
    /// The program `terraglue`.
    pub program: PathBuf,
    /// Folder of all runs.
    pub folder: PathBuf,
}

/// The recorded walk of a robot, one entry per recorded step.
pub struct Walk {
    /// Time, s.
    pub t: Vec<f64>,
    /// Position of the body, m, world.
    pub x: Vec<f64>,
    /// Position of the body, m, world.
    pub y: Vec<f64>,
    /// Height of the body, m, world.
    pub z: Vec<f64>,
    /// Heading of the body (z-y-x Euler), rad.
    pub yaw: Vec<f64>,
    /// Angle between the body's vertical and the world's, rad.
    pub tilt: Vec<f64>,
    /// `summary.json`.
    pub summary: Value,
}

impl Walk {
    /// Runs a scenario with `--set` options and reads the recorded motion of `robot.body`.
    pub fn run(place: &Place, name: &str, scenario: &str, set: &[String]) -> Outcome<Self> {
        eprintln!("walk `{name}`: {scenario} {}", set.join(" "));
        let folder = place.folder.join(name);
        let options = set.iter().flat_map(|option| ["--set", option]).chain(["--csv"]);
        let summary = run_scenario(&place.program, name, scenario, &folder, &options.collect::<Vec<_>>())?;
        if summary["status"] != "done" {
            return Err(format!("{name} ended early: {}", summary["error"]["message"]));
        }
        Self::read(&folder.join("variables.csv"), summary)
    }

    fn read(path: &std::path::Path, summary: Value) -> Outcome<Self> {
        let failed = |e: csv::Error| format!("{}: {e}", path.display());
        let mut reader = csv::Reader::from_path(path).map_err(failed)?;
        let head = reader.headers().map_err(failed)?.clone();
        let column = |name: &str| {
            head.iter()
                .position(|h| h == name)
                .ok_or_else(|| format!("{} has no column {name}", path.display()))
        };
        let names = ["t_s", "robot.body.x", "robot.body.y", "robot.body.z", "robot.body.yaw"];
        let at = names.into_iter().map(column).collect::<Outcome<Vec<_>>>()?;
        let (roll, pitch) = (column("robot.body.roll")?, column("robot.body.pitch")?);
        let mut columns: [Vec<f64>; 5] = Default::default();
        let mut tilt = Vec::new();
        for row in reader.records() {
            let row = row.map_err(failed)?;
            let number = |k: usize| row[k].parse::<f64>().map_err(|e| format!("{}: {e}", path.display()));
            for (values, k) in columns.iter_mut().zip(&at) {
                values.push(number(*k)?);
            }
            tilt.push((number(roll)?.cos() * number(pitch)?.cos()).acos());
        }
        let [t, x, y, z, yaw] = columns;
        Ok(Self { t, x, y, z, yaw, tilt, summary })
    }

    /// Largest distance of the paths, mm, and largest difference of the headings, degrees, at the times of this walk; a step that
    /// was halved shifts those of the other.
    pub fn difference(&self, other: &Self) -> Outcome<(f64, f64)> {
        let last = |walk: &Self| walk.t.last().copied().unwrap_or(f64::NAN);
        if (last(self) - last(other)).abs().partial_cmp(&1e-9).is_none_or(std::cmp::Ordering::is_gt) {
            return Err(format!("two walks end at {} s and at {} s", last(self), last(other)));
        }
        let (mut path, mut heading) = (0.0_f64, 0.0_f64);
        for (k, t) in self.t.iter().enumerate() {
            let at = |values: &[f64]| other.between(*t, values);
            path = larger(path, (self.x[k] - at(&other.x)).hypot(self.y[k] - at(&other.y)));
            heading = larger(heading, (self.yaw[k] - at(&other.yaw)).abs().to_degrees());
        }
        Ok((1e3 * path, heading))
    }

    /// The recorded value at the time `t` (s), between records on a straight line.
    fn between(&self, t: f64, values: &[f64]) -> f64 {
        let next = self.t.partition_point(|own| *own < t).clamp(1, self.t.len() - 1);
        let share = (t - self.t[next - 1]) / (self.t[next] - self.t[next - 1]);
        values[next - 1] + share * (values[next] - values[next - 1])
    }
}
