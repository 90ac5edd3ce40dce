//! A driver who follows way points from the pose that he believes in: pure pursuit (R. C. Coulter, "Implementation of the pure pursuit
//! path tracking algorithm", 1992) of a point ahead on the way, for a machine with a steering joint in its middle.

use crate::steering::Steering;
use std::sync::Arc;
use terraglue_subsystem::{
    Capabilities, Causality, Config, Error, Host, Input, Kind, Module, Motion, Parameter, ParameterType,
    Response, Result, Schema, Slots, Step, Subsystem, ValueTable, ValueType, Values, ValuesMut, Variable,
    bytes,
};

/// Form of the serialized state.
const VERSION: u32 = 1;
const X: u32 = 0;
const Y: u32 = 1;
const YAW: u32 = 2;
const KNOWN: u32 = 3;
const SPEED: u32 = 4;
const STEERING: u32 = 5;
const RATE_LEFT: u32 = 6;
const RATE_RIGHT: u32 = 7;
const ASIDE: u32 = 8;
const WAY: u32 = 9;
const ARRIVED: u32 = 10;
/// Values of a trial: steering angle, speed along the machine, way behind it, whether it has arrived, distance from the way.
const PARTS: usize = 5;

/// A driver.
pub struct Driver {
    points: Vec<[f64; 2]>,
    ahead_m: f64,
    steering: Steering,
    steering_rate: f64,
    acceleration: f64,
    radius_m: f64,
    half_track_m: f64,
    table: ValueTable,
    speed: f64,
    trial: [f64; PARTS],
    slots: Slots<Vec<f64>>,
}

fn schema() -> Schema {
    let positive = |name: &str, unit: &str, default: f64, help: &str| {
        Parameter::number(name, unit, default, help).positive()
    };
    let points = "Way points: x and y of each, one after the other, m, world; at least two";
    let parameters = vec![
        Parameter::of("way_points_m", ParameterType::Numbers, points).or(vec![0.0, 0.0, 10.0, 0.0]),
        Parameter::number("speed_m_s", "m/s", 1.0, "Speed on the way").within(0.0, 20.0),
        positive("ahead_m", "m", 5.0, "How far ahead on the way it steers to"),
        positive("front_m", "m", 1.8, "From the middle of the front wheels to the steering joint"),
        positive("rear_m", "m", 1.8, "From the steering joint to the middle of the rear wheels"),
        Parameter::number("steering_rad", "rad", 0.7, "Largest angle of the steering joint")
            .within(0.01, 1.5),
        positive("steering_rate_rad_s", "rad/s", 0.3, "Fastest change of that angle"),
        positive("acceleration_m_s2", "m/s^2", 0.5, "Change of the speed"),
        positive("radius_m", "m", 0.5, "Radius of the wheels"),
        Parameter::number("half_track_m", "m", 1.0, "From the middle to the wheels of a side")
            .within(0.0, 10.0),
    ];
    let help =
        "Follows way points from a pose that is believed: angle of a steering joint and rates of wheels";
    Schema { name: "driver".into(), kind: Kind::Controller, help: help.into(), parameters }
}

fn variables(steering: &Steering, most_rate: f64) -> Vec<Variable> {
    let input = |id, name, unit, help| Variable::real(id, name, unit, Causality::Input, help);
    let shown = |id, name, unit, help| Variable::real(id, name, unit, Causality::Output, help);
    let flag =
        |id, name, causality, help| Variable::real(id, name, "", causality, help).typed(ValueType::Bool);
    let most = steering.most_rad;
    vec![
        input(X, "x", "m", "Place along x that is believed, world"),
        input(Y, "y", "m", "Place along y that is believed, world"),
        input(YAW, "yaw", "rad", "Direction that is believed, world"),
        flag(KNOWN, "is_known", Causality::Input, "Whether there is such a pose; it stops without one"),
        Variable::real(SPEED, "speed", "m/s", Causality::Parameter, "Speed on the way").within(0.0, 20.0),
        shown(STEERING, "steering", "rad", "Angle of the steering joint, to the left positive")
            .within(-most, most),
        shown(RATE_LEFT, "rate_left", "rad/s", "Rate of the wheels on the left")
            .within(-most_rate, most_rate),
        shown(RATE_RIGHT, "rate_right", "rad/s", "Rate of the wheels on the right")
            .within(-most_rate, most_rate),
        shown(ASIDE, "aside", "m", "Distance of the pose that is believed from the way"),
        shown(WAY, "way", "m", "Length of the way that is behind it"),
        flag(ARRIVED, "arrived", Causality::Output, "Whether the last way point is reached"),
    ]
}

impl Module for Driver {
    fn schema() -> Schema {
        schema()
    }

    fn instantiate(config: &Config, host: Arc<dyn Host>) -> Result<Box<dyn Subsystem>> {
        Ok(Box::new(Self::new(config, host.slots())?))
    }
}

impl Driver {
    /// With these parameters.
    ///
    /// # Errors
    /// [`Error::Refused`]: way points that make no way.
    pub fn new(config: &Config, slots: u32) -> Result<Self> {
        let of = |key: &str| config.number(key);
        let points = way_points(&config.numbers("way_points_m")?)?;
        let steering =
            Steering { front_m: of("front_m")?, rear_m: of("rear_m")?, most_rad: of("steering_rad")? };
        let (radius_m, half_track_m) = (of("radius_m")?, of("half_track_m")?);
        // the inner and the outer wheels at the fastest speed and the largest angle
        let widest = 1.0 + half_track_m * steering.curvature(steering.most_rad).abs();
        let mut table = ValueTable::new(variables(&steering, 20.0 * widest / radius_m));
        table.set(&[SPEED], Values::F64(&[of("speed_m_s")?]))?;
        Ok(Self {
            points,
            ahead_m: of("ahead_m")?,
            steering,
            steering_rate: of("steering_rate_rad_s")?,
            acceleration: of("acceleration_m_s2")?,
            radius_m,
            half_track_m,
            table,
            speed: 0.0,
            trial: [0.0; PARTS],
            slots: Slots::new(slots),
        })
    }

    /// Curvature to the point ahead, 1/m; way behind, m; distance from the way, m; whether its end is reached.
    fn pursue(&self) -> (f64, f64, f64, bool) {
        let [x, y, yaw] = [X, Y, YAW].map(|id| self.table.value(id));
        let (behind, aside) = nearest(&self.points, [x, y], self.table.value(WAY));
        let (goal, is_end) = along(&self.points, behind + self.ahead_m);
        let (dx, dy) = (goal[0] - x, goal[1] - y);
        let left = libm::cos(yaw) * dy - libm::sin(yaw) * dx;
        let square = (dx * dx + dy * dy).max(1e-6);
        let arrived = is_end && behind + 0.5 >= length(&self.points);
        (2.0 * left / square.max(0.25 * self.ahead_m * self.ahead_m), behind, aside, arrived)
    }

    fn state(&self) -> Vec<f64> {
        let mut state = self.table.values().to_vec();
        state.push(self.speed);
        state
    }

    fn put(&mut self, state: &[f64]) -> Result {
        let (speed, values) = state.split_last().ok_or_else(|| bytes::wrong("it is too short"))?;
        self.table.restore(values)?;
        self.speed = *speed;
        Ok(())
    }
}

/// Way points of a list of x and y.
fn way_points(numbers: &[f64]) -> Result<Vec<[f64; 2]>> {
    let wrong = |why: &str| Err(Error::Refused(format!("parameter `way_points_m`: {why}")));
    if !numbers.iter().all(|x| x.is_finite() && x.abs() < 1e6) {
        return wrong("a number is not finite, or beyond 1000 km");
    }
    let (points, rest) = numbers.as_chunks::<2>();
    if !rest.is_empty() || points.len() < 2 {
        return wrong("x and y of at least two points are needed");
    }
    if points.windows(2).any(|p| gap(p[0], p[1]) < 1e-3) {
        return wrong("two points that follow each other are the same; leave one out");
    }
    Ok(points.to_vec())
}

fn gap(a: [f64; 2], b: [f64; 2]) -> f64 {
    let (x, y) = (a[0] - b[0], a[1] - b[1]);
    libm::sqrt(x * x + y * y)
}

fn length(points: &[[f64; 2]]) -> f64 {
    points.windows(2).map(|p| gap(p[0], p[1])).sum()
}

/// Position on the way of its nearest point that is not far behind `passed`, m, and the distance from it, m.
fn nearest(points: &[[f64; 2]], at: [f64; 2], passed: f64) -> (f64, f64) {
    /// How far it may have come back or gone on between two looks, m.
    const REACH: f64 = 10.0;
    let (mut best, mut start) = ((passed, f64::INFINITY), 0.0);
    for p in points.windows(2) {
        let long = gap(p[0], p[1]);
        let [ux, uy] = [0, 1].map(|k| (p[1][k] - p[0][k]) / long);
        let along = (at[0] - p[0][0]) * ux + (at[1] - p[0][1]) * uy;
        let [low, high] = [(passed - REACH - start).max(0.0), (passed + REACH - start).min(long)];
        if low <= high {
            let s = along.clamp(low, high);
            let d = gap(at, [p[0][0] + s * ux, p[0][1] + s * uy]);
            if d < best.1 {
                best = (start + s, d);
            }
        }
        start += long;
    }
    best
}

/// The point at a length of the way, or its end.
fn along(points: &[[f64; 2]], mut s: f64) -> ([f64; 2], bool) {
    for p in points.windows(2) {
        let long = gap(p[0], p[1]);
        if s <= long {
            return ([0, 1].map(|k| p[0][k] + s.max(0.0) / long * (p[1][k] - p[0][k])), false);
        }
        s -= long;
    }
    (points[points.len() - 1], true)
}

/// From a value to another one by at most this.
fn towards(from: f64, to: f64, most: f64) -> f64 {
    from + (to - from).clamp(-most, most)
}

impl Subsystem for Driver {
    fn capabilities(&self) -> Capabilities {
        Capabilities::RETRY | Capabilities::STATE | Capabilities::SERIALIZE
    }

    fn advance(&mut self, step: &Step, _: &Input, out: &mut Response) -> Result {
        let (curvature, behind, aside, arrived) = self.pursue();
        let is_known = self.table.value(KNOWN) > 0.5;
        let now = self.table.value(STEERING);
        let wanted = if is_known && !arrived { self.table.value(SPEED) } else { 0.0 };
        let angle = if is_known { self.steering.angle(curvature) } else { now };
        self.trial = [
            towards(now, angle, self.steering_rate * step.h),
            towards(self.speed, wanted, self.acceleration * step.h),
            if is_known { behind } else { self.table.value(WAY) },
            f64::from(u8::from(is_known && arrived)),
            if is_known { aside } else { self.table.value(ASIDE) },
        ];
        out.reached = step.t + step.h;
        out.flags = 0;
        Ok(())
    }

    fn commit(&mut self, _: &Step, _: &[f64], _: &Motion) -> Result {
        let [angle, speed, way, arrived, aside] = self.trial;
        self.speed = speed;
        let turn = self.half_track_m * self.steering.curvature(angle);
        self.table.show(STEERING, angle);
        self.table.show(RATE_LEFT, speed * (1.0 - turn) / self.radius_m);
        self.table.show(RATE_RIGHT, speed * (1.0 + turn) / self.radius_m);
        self.table.show(ASIDE, aside);
        self.table.show(WAY, way);
        self.table.show(ARRIVED, arrived);
        Ok(())
    }

    fn save_state(&mut self, slot: u32) -> Result {
        self.slots.save(slot, self.state())
    }

    fn restore_state(&mut self, slot: u32) -> Result {
        let state = self.slots.saved(slot)?;
        self.put(&state)
    }

    fn serialize(&self) -> Result<Vec<u8>> {
        Ok(bytes::seal(VERSION, self.points.len() as u64, &self.state()))
    }

    fn deserialize(&mut self, from: &[u8]) -> Result {
        let state: Vec<f64> = bytes::open(VERSION, self.points.len() as u64, from)?;
        self.put(&state)
    }

    fn variables(&self) -> &[Variable] {
        self.table.variables()
    }

    fn get(&self, ids: &[u32], out: ValuesMut) -> Result {
        self.table.get(ids, out)
    }

    fn set(&mut self, ids: &[u32], values: Values) -> Result {
        self.table.set(ids, values)
    }
}
