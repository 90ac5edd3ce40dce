//! Displacement, attitude and progress of the reported body.

use crate::summary::Stall;
use terraglue_engine::observer::{SubsystemView, View};
use terraglue_gluing::PortReport;
use terraglue_numerics::rotation;
use terraglue_subsystem::{Effect, Kind, Pose, SceneBody, Variable};

/// Time between the samples by which a stall is found, s.
const SAMPLE_S: f64 = 0.5;
/// Shortest time without progress that counts as a stall, s.
const STALL_S: f64 = 5.0;
/// Progress below this share of the commanded distance is none.
const STALL_SHARE: f64 = 0.1;

/// Follows one body over a run.
pub(crate) struct BodyTrack {
    subsystem: usize,
    body: usize,
    start: [f64; 3],
    heading: [f64; 2],
    now: Sample,
    samples: Vec<Sample>,
    /// Against gravity, of length 1; none without gravity.
    up: Option<[f64; 3]>,
    now_at: [f64; 3],
    peak_n: f64,
    /// Whether its subsystem is fixed to the world: the ground does not carry its weight alone.
    held: bool,
    /// Length of the way of its origin, m.
    pub path_m: f64,
    /// Mass of its whole subsystem, kg.
    pub mass_kg: f64,
    /// Horizontal displacement along the initial heading, m.
    pub distance_m: f64,
    /// Largest |roll|, rad.
    pub max_roll_rad: f64,
    /// Largest |pitch|, rad.
    pub max_pitch_rad: f64,
}

#[derive(Clone, Copy, Default)]
struct Sample {
    t_s: f64,
    distance_m: f64,
    commanded_m: f64,
    position: [f64; 2],
}

terraglue_subsystem::persist!(Sample { t_s, distance_m, commanded_m, position });
terraglue_subsystem::persist!(BodyTrack {
    subsystem,
    body,
    start,
    heading,
    now,
    samples,
    up,
    now_at,
    peak_n,
    held,
    path_m,
    mass_kg,
    distance_m,
    max_roll_rad,
    max_pitch_rad,
});

impl BodyTrack {
    /// The body of that name, see [`find_body`]; `None` when there is none. `gravity_m_s2` says where up is.
    pub fn find(view: &View, name: Option<&str>, gravity_m_s2: &[f64; 3]) -> Option<Self> {
        let (subsystem, body) = find_body(view, name)?;
        let s = &view.subsystems[subsystem];
        let pose = &s.body_states.get(body)?.world_from_body;
        let yaw = roll_pitch_yaw(&pose.orientation)[2];
        Some(Self {
            subsystem,
            body,
            start: pose.position,
            heading: [libm::cos(yaw), libm::sin(yaw)],
            now: Sample::default(),
            samples: Vec::new(),
            up: up(gravity_m_s2),
            now_at: pose.position,
            peak_n: 0.0,
            held: is_held(s),
            path_m: 0.0,
            mass_kg: s.scene.bodies.iter().map(|b| b.mass).sum(),
            distance_m: 0.0,
            max_roll_rad: 0.0,
            max_pitch_rad: 0.0,
        })
    }

    /// Takes the committed state; `commanded_m` is the distance commanded so far.
    pub fn follow(&mut self, view: &View, commanded_m: f64) {
        let states = view.subsystems[self.subsystem].body_states;
        let Some(Pose { position, orientation }) = states.get(self.body).map(|s| s.world_from_body) else {
            return;
        };
        let moved = [position[0] - self.start[0], position[1] - self.start[1]];
        self.distance_m = moved[0] * self.heading[0] + moved[1] * self.heading[1];
        let step = [0, 1, 2].map(|k| position[k] - self.now_at[k]);
        self.path_m += rotation::length(step);
        self.now_at = position;
        self.follow_force(view);
        let [roll, pitch, _] = roll_pitch_yaw(&orientation);
        self.max_roll_rad = self.max_roll_rad.max(roll.abs());
        self.max_pitch_rad = self.max_pitch_rad.max(pitch.abs());
        self.now = Sample {
            t_s: view.t_s,
            distance_m: self.distance_m,
            commanded_m,
            position: [position[0], position[1]],
        };
        if self.samples.last().is_none_or(|s| view.t_s - s.t_s >= SAMPLE_S) {
            self.samples.push(self.now);
        }
    }

    /// Height at the end above that at the start, against gravity, m.
    pub fn height_gained_m(&self) -> Option<f64> {
        let up = self.up?;
        Some((0..3).map(|k| (self.now_at[k] - self.start[k]) * up[k]).sum())
    }

    /// Tracks the peak of the total normal force of the ground on the robot.
    fn follow_force(&mut self, view: &View) {
        let own = |p: &&PortReport| p.subsystem as usize == self.subsystem && p.wrench[0] > 0.0;
        // a joint to another subsystem is no ground
        if !view.gluing.joints {
            let sum = view.gluing.ports.iter().filter(own).map(|p| p.wrench[0]).sum();
            self.peak_n = self.peak_n.max(sum);
        }
    }

    /// Largest normal force of the ground on its whole subsystem, N; none where nothing ever pressed, or where the world
    /// holds it: a press or a rig loads the ground with more than its weight.
    pub fn peak_n(&self) -> Option<f64> {
        (self.peak_n > 0.0 && !self.held).then_some(self.peak_n)
    }

    /// Since when and where the body has not come on, at the end of the run.
    pub fn stall(&self) -> Option<Stall> {
        let end = &self.now;
        let stands = |s: &&Sample| {
            let commanded = end.commanded_m - s.commanded_m;
            end.t_s - s.t_s >= STALL_S
                && commanded > 0.0
                && end.distance_m - s.distance_m < STALL_SHARE * commanded
        };
        let since = self.samples.iter().find(stands)?;
        Some(Stall { t_s: since.t_s, x_m: since.position[0], y_m: since.position[1] })
    }
}

/// Whether a robot reports the poses of its bodies and none of them can be chosen: its root is fixed to the world.
fn is_held(robot: &SubsystemView) -> bool {
    let variables = robot.instance.variables();
    let of = |body: &str, part: &str| {
        let name =
            |v: &&Variable| v.name.strip_prefix(body).and_then(|rest| rest.strip_prefix('.')) == Some(part);
        variables.iter().find(name)
    };
    let mut tells = robot.scene.bodies.iter().filter(|b| of(&b.name, "qw").is_some()).peekable();
    let chosen = |b: &SceneBody| of(&b.name, "z").is_none_or(|v| v.effect == Effect::NeedsReset);
    tells.peek().is_some() && !tells.any(chosen)
}

/// Against gravity, of length 1.
fn up(gravity: &[f64; 3]) -> Option<[f64; 3]> {
    let g = rotation::length(*gravity);
    (g > 0.0).then(|| gravity.map(|x| -x / g))
}

/// Roll, pitch and yaw (z-y-x Euler angles, rad) of a unit quaternion w, x, y, z.
pub(crate) fn roll_pitch_yaw(q: &[f64; 4]) -> [f64; 3] {
    let [w, x, y, z] = *q;
    let roll = libm::atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y));
    let pitch = libm::asin((2.0 * (w * y - z * x)).clamp(-1.0, 1.0));
    let yaw = libm::atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z));
    [roll, pitch, yaw]
}

/// Subsystem and body by `subsystem.body`; the first body of the first robot where no name is given.
pub(crate) fn find_body(view: &View, name: Option<&str>) -> Option<(usize, usize)> {
    let Some(name) = name else {
        let robot =
            view.subsystems.iter().position(|s| s.kind == Kind::Robot && !s.scene.bodies.is_empty())?;
        return Some((robot, 0));
    };
    let (subsystem, body) = name.split_once('.')?;
    let s = view.subsystems.iter().position(|s| s.name == subsystem)?;
    let b = view.subsystems[s].scene.bodies.iter().position(|b| b.name == body)?;
    Some((s, b))
}
