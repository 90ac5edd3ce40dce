//! The hexapod with its tripod gait on flat rigid ground: targets, drives, one step.

use crate::process::Outcome;
use crate::rigid_body::fixture::{Fixture, G, table};

/// Rows of the gait table less one: the last repeats the first.
const INTERVALS: usize = 240;
/// Duration of one cycle, s.
const CYCLE: f64 = 1.2;
/// All legs.
pub const LEGS: [&str; 6] = ["LF", "LM", "LR", "RF", "RM", "RR"];
/// Standing pose of a leg, rad.
const STAND: [f64; 4] = [0.0, 0.9581921787462744, -1.3796341802638374, -1.1493543252773333];

/// How the joints are driven.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GaitDrive {
    /// Implicit PD: 600 N m/rad, 10 N m s/rad.
    Soft,
    /// Constraint motor: the error is taken back within ten steps of 1 ms, at 20 rad/s at most.
    Stiff,
}

/// A walking hexapod.
pub struct GaitWalk {
    pub fixture: Fixture,
    table: Vec<[f64; 24]>,
    ids: Vec<u32>,
    angles: Vec<u32>,
    targets: [f64; 24],
}

impl GaitWalk {
    /// On flat ground with μ = 0.8 under full gravity; `model` relative to the repository.
    pub fn new(model: &str, drive: GaitDrive, h: f64) -> Outcome<Self> {
        let motor = match drive {
            GaitDrive::Soft => "position",
            GaitDrive::Stiff => "rigid-position",
        };
        let [_, a, b, c] = STAND;
        let parameters = format!(
            r#"{{"model": "{model}", "position_m": [0, 0, 0.33], "ground": "half-space", "friction": 0.8,
            "motor": "{motor}", "joints": {{"*_j2": {a}, "*_j3": {b}, "*_j4": {c}}}}}"#
        );
        let fixture = Fixture::new(&parameters, [0.0, 0.0, -G], h)?;
        let joints: Vec<String> =
            LEGS.iter().flat_map(|leg| (1..=4).map(move |j| format!("{leg}_j{j}"))).collect();
        let number =
            |what: &str| joints.iter().map(|j| fixture.id(&format!("{j}.{what}"))).collect::<Outcome<_>>();
        let (ids, angles) = (number("angle_target")?, number("angle")?);
        Ok(Self { fixture, table: rows()?, ids, angles, targets: [0.0; 24] })
    }

    /// The targets of the time t.
    fn aim(&mut self, t: f64) {
        let blend = (t - 0.5).clamp(0.0, 1.0);
        let at = ((t - 0.5).max(0.0) % CYCLE) / CYCLE * INTERVALS as f64;
        let row = (at as usize).min(INTERVALS - 1);
        let share = at - row as f64;
        for (k, target) in self.targets.iter_mut().enumerate() {
            let wanted = self.table[row][k] + share * (self.table[row + 1][k] - self.table[row][k]);
            *target = STAND[k % 4] + blend * (wanted - STAND[k % 4]);
        }
    }

    /// Sets the 24 targets and steps.
    pub fn step(&mut self) -> Outcome {
        self.aim(self.fixture.t());
        self.fixture.set(&self.ids, &self.targets)?;
        self.fixture.step()
    }

    /// Mean square of angle − target at the end of the last step, rad².
    pub fn tracking_error(&self) -> Outcome<f64> {
        let mut sum = 0.0;
        for (angle, target) in self.angles.iter().zip(&self.targets) {
            let error = self.fixture.get(*angle)? - target;
            sum += error * error;
        }
        Ok(sum / self.targets.len() as f64)
    }
}

fn rows() -> Outcome<Vec<[f64; 24]>> {
    let bad = || format!("gait_tripod.csv is not a table of {} rows of 25 numbers", INTERVALS + 1);
    let rows: Option<Vec<[f64; 24]>> =
        table("gait_tripod.csv")?.iter().map(|row| row.get(1..)?.try_into().ok()).collect();
    rows.filter(|r| r.len() == INTERVALS + 1).ok_or_else(bad)
}
