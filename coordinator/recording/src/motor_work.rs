//! Mechanical work of the motors, driving and braking apart: what a motor puts in, and what it takes out again.

use crate::snapshot::{failed, real_id};
use terraglue_diagnostics::error::Result;
use terraglue_engine::observer::{SubsystemView, View};
use terraglue_subsystem::ValuesMut;

/// Work of all motors of a run, J.
#[derive(Default)]
pub(crate) struct MotorWork {
    robots: Vec<Motors>,
    /// Work of the motors that push a joint the way it goes; ≥ 0.
    pub driving_j: f64,
    /// Work of the motors that hold a joint back; ≥ 0.
    pub braking_j: f64,
}

/// The joints of a subsystem that show the power of their motor, or its torque and the joint's velocity.
struct Motors {
    subsystem: usize,
    /// Power of a motor, W; then torque and velocity of those that show none, N m and rad/s.
    ids: Vec<u32>,
    powers: usize,
    values: Vec<f64>,
}

terraglue_subsystem::persist!(Motors { subsystem, ids, powers, values });
terraglue_subsystem::persist!(MotorWork { robots, driving_j, braking_j });

impl Motors {
    fn find(subsystem: usize, view: &SubsystemView) -> Option<Self> {
        let id = |joint: &str, part: &str| real_id(view.instance, &format!("{joint}.{part}"));
        let (mut powers, mut pairs) = (Vec::new(), Vec::new());
        for joint in view.instance.variables().iter().filter_map(|v| v.name.strip_suffix(".torque")) {
            let (Some(torque), Some(velocity)) = (id(joint, "torque"), id(joint, "velocity")) else {
                continue;
            };
            match id(joint, "power") {
                Some(power) => powers.push(power),
                None => pairs.extend([torque, velocity]),
            }
        }
        let ids = [powers.as_slice(), &pairs].concat();
        (!ids.is_empty()).then(|| Self { subsystem, powers: powers.len(), values: vec![0.0; ids.len()], ids })
    }

    /// Power of those that drive and of those that brake, W; both ≥ 0.
    fn power(&mut self, view: &View) -> Result<[f64; 2]> {
        let s = &view.subsystems[self.subsystem];
        s.instance
            .get(&self.ids, ValuesMut::F64(&mut self.values))
            .map_err(|e| failed(s, view.t_s, "get", e.to_string()))?;
        let (powers, pairs) = self.values.split_at(self.powers);
        let all = powers.iter().copied().chain(pairs.chunks_exact(2).map(|p| p[0] * p[1]));
        Ok(all.fold([0.0, 0.0], |[driving, braking], p| [driving + p.max(0.0), braking - p.min(0.0)]))
    }
}

impl MotorWork {
    /// The motors of all subsystems.
    pub fn find(view: &View) -> Self {
        let robots = view.subsystems.iter().enumerate().filter_map(|(k, s)| Motors::find(k, s)).collect();
        Self { robots, ..Self::default() }
    }

    /// Adds the step that was just committed.
    pub fn follow(&mut self, view: &View) -> Result {
        for motors in &mut self.robots {
            let [driving, braking] = motors.power(view)?;
            self.driving_j += driving * view.h_s;
            self.braking_j += braking * view.h_s;
        }
        Ok(())
    }

    /// Driving and braking together, J.
    pub fn both_j(&self) -> f64 {
        self.driving_j + self.braking_j
    }
}
