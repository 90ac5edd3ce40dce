//! The walking machine: command in, joint angles out; standing, walking and stopping.

use crate::command::Command;
use crate::foot::{Cycle, Foot, Search, Sensed, TouchDown, Twist};
use crate::geometry::{JOINTS, LEGS};
use crate::load::Load;
use crate::parameters::Settings;
use crate::pattern::Pattern;
use crate::plane::Plane;
use crate::posture::{Posture, wrap};
use terraglue_subsystem::Result;
use terraglue_subsystem::bytes::{self, Persist};

/// Mode of the machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mode {
    /// All feet rest; walking starts when the time (s) has passed and a speed is commanded.
    Standing(f64),
    /// The cycle runs.
    Walking,
    /// Feet in the air come down, the body comes to rest.
    Stopping,
}

/// Everything that changes from step to step; a copy of it is a snapshot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Walker {
    /// Its mode.
    pub mode: Mode,
    /// Pattern in force.
    pub pattern: Pattern,
    /// Feet in the order of the legs.
    pub feet: [Foot; LEGS],
    /// Correction of the tilt.
    pub posture: Posture,
    /// Twist that the feet make, after limits and ramps.
    pub twist: Twist,
    /// Targets of all joints, legs one after the other, rad.
    pub targets: [f64; LEGS * JOINTS],
    /// Number of legs whose foot had to be pulled into reach.
    pub out_of_reach: u32,
    /// Phase of the cycle, 0 … 1.
    pub phase: f64,
    /// Mean force on all feet together.
    pub load: Load,
    ramp: f64,
    slewed: Twist,
    turned: f64,
}

impl Walker {
    /// Standing with all feet at their neutral points.
    pub fn new(settings: &Settings, command: &Command) -> Self {
        let phases = command.pattern.phases();
        let feet = std::array::from_fn(|leg| Foot::standing(settings.neutral[leg], phases[leg]));
        let mut walker = Self {
            mode: Mode::Standing(settings.stand_s),
            pattern: command.pattern,
            feet,
            posture: Posture::default(),
            twist: Twist::default(),
            targets: [0.0; LEGS * JOINTS],
            out_of_reach: 0,
            phase: 0.0,
            load: Load::default(),
            ramp: 0.0,
            slewed: Twist { speed: command.speed, turn_rate: command.turn_rate },
            turned: 0.0,
        };
        walker.aim(settings);
        walker
    }

    /// Moves on by `dt` s under a command that holds over the step.
    pub fn advance(&mut self, settings: &Settings, command: &Command, dt: f64) {
        if dt <= 0.0 {
            return;
        }
        let tilt = [command.attitude[0], command.attitude[1]];
        self.posture.advance(&settings.gains, command.posture_feedback, tilt, dt);
        self.slew(settings, command, dt);
        self.load.advance(&command.contact, dt);
        let left = self.wait(command, dt);
        if left > 0.0 && !matches!(self.mode, Mode::Standing(_)) {
            self.walk(settings, command, left);
        } else {
            self.stand(settings, command, dt);
        }
        self.aim(settings);
    }

    /// Stands still for the rest of the waiting time; the time of the step that is left for walking, s.
    fn wait(&mut self, command: &Command, dt: f64) -> f64 {
        let Mode::Standing(wait) = self.mode else { return dt };
        if wait >= dt || !moves(command) {
            self.mode = Mode::Standing((wait - dt).max(0.0));
            self.twist = Twist::default();
            return 0.0;
        }
        self.start(command);
        dt - wait
    }

    fn start(&mut self, command: &Command) {
        self.mode = Mode::Walking;
        self.pattern = command.pattern;
        self.ramp = 0.0;
        self.phase = 0.0;
        let phases = self.pattern.phases();
        for (foot, phase) in self.feet.iter_mut().zip(phases) {
            foot.begin(phase);
        }
    }

    fn walk(&mut self, settings: &Settings, command: &Command, dt: f64) {
        if command.pattern != self.pattern || !moves(command) {
            self.mode = Mode::Stopping;
        }
        let stepping = self.mode == Mode::Walking;
        let before = self.ramp;
        let rate = if stepping { 1.0 / settings.ramp_s } else { -2.0 / settings.ramp_s };
        self.ramp = (before + rate * dt).clamp(0.0, 1.0);
        self.twist = self.limited(settings).scaled(0.5 * (before + self.ramp));
        self.turned = wrap(self.turned + self.ramp * command.turn_rate * dt);
        let mut cycle = Cycle {
            period: settings.cycle_s(self.pattern),
            duty: settings.duty(self.pattern),
            lift: command.lift,
            twist: self.twist,
            stepping,
            swing: settings.swing,
            waiting: false,
        };
        if let TouchDown::Contact(search) = settings.touch_down {
            self.feel(&cycle, &search, command, dt);
            cycle.waiting = self.waits(settings, &cycle, dt);
        }
        for (foot, neutral) in self.feet.iter_mut().zip(settings.neutral) {
            foot.advance(&cycle, neutral, dt);
        }
        if cycle.waiting {
            return;
        }
        if stepping {
            self.phase = (self.phase + dt / cycle.period).fract();
        } else if self.ramp <= 0.0 && self.feet.iter().all(|f| !f.airborne) {
            self.mode = Mode::Standing(0.0);
        }
    }

    /// All feet rest.
    fn stand(&mut self, settings: &Settings, command: &Command, dt: f64) {
        let TouchDown::Contact(search) = settings.touch_down else { return };
        for leg in 0..LEGS {
            if let Some(sensed) = self.sensed(&search, command, leg) {
                self.feet[leg].rest(&sensed, dt);
            }
        }
        self.level(&search, command, dt);
    }

    /// Reacts to the forces at the start of a step of walking.
    fn feel(&mut self, cycle: &Cycle, search: &Search, command: &Command, dt: f64) {
        for leg in 0..LEGS {
            if let Some(sensed) = self.sensed(search, command, leg) {
                self.feet[leg].feel(cycle, &sensed, dt);
            }
        }
        self.level(search, command, dt);
    }

    /// Whether a foot that is about to leave has to wait for one that looks for the ground. No foot is carried farther
    /// from its neutral point meanwhile than the longest stride carries it.
    fn waits(&self, settings: &Settings, cycle: &Cycle, dt: f64) -> bool {
        let searching = self.feet.iter().any(|f| f.searching && !f.missing);
        let farthest = 0.5 * settings.stride_limit;
        let near = |(foot, neutral): (&Foot, &[f64; 2])| {
            libm::hypot(foot.position[0] - neutral[0], foot.position[1] - neutral[1]) < farthest
        };
        searching
            && self.feet.iter().any(|f| f.leaves(cycle, dt))
            && self.feet.iter().zip(&settings.neutral).filter(|(f, _)| !f.airborne).all(near)
    }

    /// Measurement of a foot, if it is connected.
    fn sensed(&self, search: &Search, command: &Command, leg: usize) -> Option<Sensed> {
        let threshold = search.share * self.load.mean() / LEGS as f64;
        command.contact[leg].map(|force| Sensed { force, threshold, search: *search })
    }

    /// The body goes back to its height above the feet that stand on ground. Where its tilt is not measured, it goes
    /// parallel to them, too.
    fn level(&mut self, search: &Search, command: &Command, dt: f64) {
        let stands = |f: &Foot| !f.airborne && !f.searching && f.found;
        let feet = self.feet;
        let points = feet.iter().filter(|f| stands(f)).map(|f| (f.position, f.height));
        let Some(mut plane) = Plane::through(points) else { return };
        if command.posture_feedback {
            plane.slope = [0.0; 2];
        }
        let share = dt / (search.levelling_s + dt);
        for foot in self.feet.iter_mut().filter(|f| stands(f)) {
            foot.height -= share * plane.at(foot.position);
        }
    }

    /// Speed and turn rate follow the command with a bounded acceleration.
    fn slew(&mut self, settings: &Settings, command: &Command, dt: f64) {
        let change = |from: f64, to: f64, rate: f64| from + (to - from).clamp(-rate * dt, rate * dt);
        self.slewed.speed = change(self.slewed.speed, command.speed, settings.acceleration);
        let heading = command.heading + self.turned;
        let error = if command.heading_feedback { heading - command.attitude[2] } else { 0.0 };
        let correction = self.posture.turn(&settings.gains, wrap(error), dt);
        let wanted = command.turn_rate + correction;
        self.slewed.turn_rate = change(self.slewed.turn_rate, wanted, settings.turn_acceleration);
    }

    /// The twist scaled down so that no foot has to make a longer stride than the legs reach.
    fn limited(&self, settings: &Settings) -> Twist {
        let stance = settings.duty(self.pattern) * settings.cycle_s(self.pattern);
        let fastest = settings.neutral.iter().map(|p| self.slewed.speed_at(*p)).fold(0.0, f64::max);
        let allowed = settings.stride_limit / stance;
        if fastest > allowed { self.slewed.scaled(allowed / fastest) } else { self.slewed }
    }

    /// Inverse kinematics of all legs.
    fn aim(&mut self, settings: &Settings) {
        self.out_of_reach = 0;
        for (leg, (foot, geometry)) in self.feet.iter().zip(&settings.legs).enumerate() {
            let [x, y] = foot.position;
            let z = foot.height - settings.body_height + self.posture.raise(foot.position);
            let solution = geometry.inverse([x, y, z]);
            self.out_of_reach += u32::from(solution.clipped);
            self.targets[leg * JOINTS..][..JOINTS].copy_from_slice(&solution.angles);
        }
    }
}

fn moves(command: &Command) -> bool {
    command.speed != 0.0 || command.turn_rate != 0.0
}

terraglue_subsystem::persist!(Walker {
    mode,
    pattern,
    feet,
    posture,
    twist,
    targets,
    out_of_reach,
    phase,
    load,
    ramp,
    slewed,
    turned,
});

impl Persist for Mode {
    fn write(&self, out: &mut Vec<u8>) {
        match self {
            Self::Standing(left) => (0_u8, *left),
            Self::Walking => (1, 0.0),
            Self::Stopping => (2, 0.0),
        }
        .write(out);
    }
    fn read(from: &mut &[u8]) -> Result<Self> {
        match <(u8, f64)>::read(from)? {
            (0, left) => Ok(Self::Standing(left)),
            (1, _) => Ok(Self::Walking),
            (2, _) => Ok(Self::Stopping),
            _ => Err(bytes::wrong("a walking machine has no such mode")),
        }
    }
}
