//! The path of one foot in the body frame: against the body's twist on the ground, through the air to the next stance.
//!
//! In the air x and y follow a cycloid and z a raised cosine, so that the foot leaves and meets the ground at rest:
//! at rest in the body frame, or, as it should be on soft ground, at rest in the world.
//!
//! If the force on the foot is known, the swing ends in its last quarter as soon as the foot presses on the ground, and
//! the foot stands at the height where it met it. A foot that presses on nothing looks further down.

use std::f64::consts::TAU;

/// Planar velocity of the body in its own frame.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Twist {
    /// Forward, m/s.
    pub speed: f64,
    /// Turn to the left, rad/s.
    pub turn_rate: f64,
}

impl Twist {
    /// The same twist times a factor.
    pub fn scaled(self, factor: f64) -> Self {
        Self { speed: self.speed * factor, turn_rate: self.turn_rate * factor }
    }

    /// Speed at which the ground passes below the point `p` of the body frame, m/s.
    pub fn speed_at(self, p: [f64; 2]) -> f64 {
        libm::hypot(self.speed - self.turn_rate * p[1], self.turn_rate * p[0])
    }

    /// Position of a point at rest in the world, in the frame of the body `dt` seconds later (earlier when negative),
    /// m. Exact for a constant twist.
    pub fn pass_below(self, p: [f64; 2], dt: f64) -> [f64; 2] {
        let angle = self.turn_rate * dt;
        let (sin, cos) = (libm::sin(angle), libm::cos(angle));
        let [along, across] = mean_direction(angle, sin, cos);
        let way = self.speed * dt;
        let (x, y) = (p[0] - way * along, p[1] - way * across);
        [cos * x + sin * y, cos * y - sin * x]
    }
}

/// (sin θ/θ, (1 − cos θ)/θ): the mean heading while turning by θ.
fn mean_direction(angle: f64, sin: f64, cos: f64) -> [f64; 2] {
    if angle.abs() < 1e-4 {
        [1.0 - angle * angle / 6.0, angle / 2.0]
    } else {
        [sin / angle, (1.0 - cos) / angle]
    }
}

/// In which frame a swing begins and ends at rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Swing {
    /// In the body: while it lifts and lands, the foot is dragged over the ground with the body's speed.
    Body,
    /// In the world: the foot lifts and lands without dragging.
    Ground,
}

/// When a swing ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TouchDown {
    /// At its time, at the height of the plane of the standing feet.
    Time,
    /// When the foot presses on the ground.
    Contact(Search),
}

/// Search of a foot for the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Search {
    /// Force at which the foot counts as standing, as a share of the mean load over the number of legs.
    pub share: f64,
    /// Depth of the search for the ground below the plane of the standing feet, m.
    pub depth: f64,
    /// Speed at which it looks further down, m/s.
    pub speed: f64,
    /// Time constant at which the body goes back to its height above the standing feet, s.
    pub levelling_s: f64,
}

/// Measurements of the ground at a foot during a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensed {
    /// Normal force on the foot, N.
    pub force: f64,
    /// Force from which on it stands, N.
    pub threshold: f64,
    /// Its search for ground.
    pub search: Search,
}

/// State of a foot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Foot {
    /// Phase in the leg's own cycle, 0 … 1.
    pub phase: f64,
    /// Whether it is in the air.
    pub airborne: bool,
    /// Position in the body frame, m.
    pub position: [f64; 2],
    /// Height above the plane of the standing feet, m.
    pub height: f64,
    /// Whether it should stand and looks further down, since it presses on nothing.
    pub searching: bool,
    /// Whether it has pressed on ground since its last swing.
    pub found: bool,
    /// Whether it has looked for ground down to the limit without finding it, and has found none since: the gait does
    /// not wait for it, as the leg may be gone.
    pub missing: bool,
    lift_off: [f64; 2],
    lift: f64,
    /// Height at lift-off, m.
    from_height: f64,
}

/// Parameters of all feet during a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cycle {
    /// Duration, s.
    pub period: f64,
    /// Part on the ground.
    pub duty: f64,
    /// Height of the swing, m; a foot takes it at lift-off.
    pub lift: f64,
    /// Velocity of the body.
    pub twist: Twist,
    /// Whether standing feet may leave the ground.
    pub stepping: bool,
    /// Swing that begins and ends at rest.
    pub swing: Swing,
    /// Whether the cycle stands still, until a foot that looks for the ground has found it.
    pub waiting: bool,
}

/// Part of the swing from which on contact ends it: the foot is at half its height, nine tenths of the way are made. A
/// swing that ended earlier would leave a stance that the leg cannot reach to the end.
const LANDING: f64 = 0.75;
/// A foot that presses with less than this part of the threshold looks for the ground again.
const RELEASE: f64 = 0.5;

impl Foot {
    /// Standing at a point of the body frame, m.
    pub fn standing(position: [f64; 2], phase: f64) -> Self {
        Self {
            phase,
            airborne: false,
            position,
            height: 0.0,
            searching: false,
            found: true,
            missing: false,
            lift_off: position,
            lift: 0.0,
            from_height: 0.0,
        }
    }

    /// Begins a cycle where it stands.
    pub fn begin(&mut self, phase: f64) {
        let Self { height, searching, found, missing, .. } = *self;
        *self = Self { height, searching, found, missing, ..Self::standing(self.position, phase) };
    }

    /// Whether it leaves the ground within `dt` s.
    pub fn leaves(&self, cycle: &Cycle, dt: f64) -> bool {
        let until = (cycle.duty - self.phase) * cycle.period;
        cycle.stepping && !self.airborne && (0.0..=dt).contains(&until)
    }

    /// Reacts to the force at the start of a step of `dt` s: the swing ends in its last quarter; a foot that should
    /// stand and presses on nothing goes further down, as far as it may.
    pub fn feel(&mut self, cycle: &Cycle, sensed: &Sensed, dt: f64) {
        let presses = sensed.force > sensed.threshold;
        if self.airborne {
            let lands = self.phase > cycle.duty + LANDING * (1.0 - cycle.duty);
            self.airborne = !(presses && lands);
            self.found = !self.airborne;
            self.missing &= self.airborne;
            return;
        }
        self.rest(sensed, dt);
    }

    /// The same for a foot that stands.
    pub fn rest(&mut self, sensed: &Sensed, dt: f64) {
        let enough = if self.searching { sensed.threshold } else { RELEASE * sensed.threshold };
        let presses = sensed.force > enough;
        self.searching = !presses && self.height > -sensed.search.depth;
        self.found = presses || self.found && self.searching;
        self.missing = !presses && (self.missing || !self.searching);
        if self.searching {
            self.height = (self.height - sensed.search.speed * dt).max(-sensed.search.depth);
        }
    }

    /// Moves on by `dt` s; events inside the step are met exactly. `neutral` is the middle of the stance, m.
    pub fn advance(&mut self, cycle: &Cycle, neutral: [f64; 2], dt: f64) {
        if cycle.waiting {
            return self.wait(cycle, neutral, dt);
        }
        let mut left = dt;
        while left > 0.0 {
            left = if self.airborne { self.fly(cycle, neutral, left) } else { self.stand(cycle, left) };
        }
    }

    /// Start of the next stance: half a stance ahead of the neutral point, m.
    fn touch_down(cycle: &Cycle, neutral: [f64; 2]) -> [f64; 2] {
        cycle.twist.pass_below(neutral, -0.5 * cycle.duty * cycle.period)
    }

    /// Up to the next event or by `dt`; the time that is left, s.
    fn stand(&mut self, cycle: &Cycle, dt: f64) -> f64 {
        if !cycle.stepping {
            self.position = cycle.twist.pass_below(self.position, dt);
            return 0.0;
        }
        // A foot whose cycle begins in the air waits on the ground for its first lift-off.
        let ends = if self.phase <= cycle.duty { cycle.duty } else { 1.0 };
        let until = (ends - self.phase) * cycle.period;
        let passed = until.min(dt);
        self.position = cycle.twist.pass_below(self.position, passed);
        if until > dt {
            self.phase += dt / cycle.period;
            return 0.0;
        }
        if ends == 1.0 {
            self.phase = 0.0;
        } else {
            self.phase = cycle.duty;
            self.airborne = true;
            self.lift_off = self.position;
            self.lift = cycle.lift;
            self.from_height = self.height;
            (self.searching, self.found) = (false, false);
        }
        dt - passed
    }

    fn fly(&mut self, cycle: &Cycle, neutral: [f64; 2], dt: f64) -> f64 {
        let until = (1.0 - self.phase) * cycle.period;
        let target = Self::touch_down(cycle, neutral);
        if until <= dt {
            let Self { lift, missing, .. } = *self;
            *self = Self { lift, missing, found: false, ..Self::standing(target, 0.0) };
            return dt - until;
        }
        self.phase += dt / cycle.period;
        self.swing(cycle, target, dt);
        0.0
    }

    /// The place in the air at its phase.
    fn swing(&mut self, cycle: &Cycle, target: [f64; 2], dt: f64) {
        let target = match cycle.swing {
            Swing::Body => target,
            Swing::Ground => {
                // Both ends of the swing are points of the ground, seen from the moving body.
                self.lift_off = cycle.twist.pass_below(self.lift_off, dt);
                cycle.twist.pass_below(target, (self.phase - 1.0) * cycle.period)
            }
        };
        let u = ((self.phase - cycle.duty) / (1.0 - cycle.duty)).clamp(0.0, 1.0);
        let along = u - libm::sin(TAU * u) / TAU;
        self.position = std::array::from_fn(|k| self.lift_off[k] + (target[k] - self.lift_off[k]) * along);
        self.height = self.lift * 0.5 * (1.0 - libm::cos(TAU * u));
        if self.from_height != 0.0 {
            self.height += self.from_height * (1.0 - along);
        }
    }

    /// The body moves on by `dt` s while the cycle stands still: standing feet pass below it, swinging ones hover.
    fn wait(&mut self, cycle: &Cycle, neutral: [f64; 2], dt: f64) {
        if self.airborne {
            self.swing(cycle, Self::touch_down(cycle, neutral), dt);
        } else {
            self.position = cycle.twist.pass_below(self.position, dt);
        }
    }
}

terraglue_subsystem::persist!(Twist { speed, turn_rate });
terraglue_subsystem::persist!(Foot {
    phase,
    airborne,
    position,
    height,
    searching,
    found,
    missing,
    lift_off,
    lift,
    from_height
});
