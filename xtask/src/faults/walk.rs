//! One run of the program, and the path of the body in it.

use crate::process::{Outcome, run_scenario};
use serde_json::Value;
use std::path::PathBuf;

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
    /// Runs a scenario with `--set` options and reads what it recorded of `robot.body`.
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

    /// Largest distance of the paths, mm, and largest difference of the headings, degrees; both recorded at the
    /// same times.
    pub fn difference(&self, other: &Self) -> Outcome<(f64, f64)> {
        let same =
            self.t.len() == other.t.len() && self.t.iter().zip(&other.t).all(|(a, b)| (a - b).abs() < 1e-9);
        if !same {
            return Err("two walks were recorded at different times".into());
        }
        let path = (0..self.t.len()).map(|k| (self.x[k] - other.x[k]).hypot(self.y[k] - other.y[k]));
        let heading = (0..self.t.len()).map(|k| (self.yaw[k] - other.yaw[k]).abs().to_degrees());
        Ok((1e3 * path.fold(0.0, f64::max), heading.fold(0.0, f64::max)))
    }
}
