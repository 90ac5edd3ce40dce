//! Odometry: the way from the rates of wheels, which slip, and from the rate of turning that a gyroscope shows.

use std::sync::Arc;
use terraglue_numerics::random::normal;
use terraglue_subsystem::{
    Capabilities, Causality, Config, Host, Input, Kind, Module, Motion, Parameter, ParameterType, Response,
    Result, Schema, Slots, Step, Subsystem, ValueTable, Values, ValuesMut, Variable, bytes,
};

/// Form of the serialized state.
const VERSION: u32 = 1;
const X: u32 = 0;
const Y: u32 = 1;
const YAW: u32 = 2;
const SPEED: u32 = 3;
const TURN_RATE: u32 = 4;
const SLIP: u32 = 5;
const SHIFT_X: u32 = 6;
const SHIFT_Y: u32 = 7;
const GYRO: u32 = 8;
/// First of the rates of the wheels.
const WHEEL: u32 = 9;
/// Most wheels of a machine.
const MOST_WHEELS: f64 = 64.0;

/// Odometry of a machine on wheels, in the frame in which it stood at the start.
pub struct Odometry {
    wheels: u32,
    /// Radius that the machine believes in, m, with the error that it has.
    radius_m: f64,
    drift_rad_s: f64,
    table: ValueTable,
    /// Outputs of the trial: x, y, yaw, speed, rate of turning.
    trial: [f64; 5],
    /// Place without the shift.
    place: [f64; 2],
    slots: Slots<Vec<f64>>,
}

fn schema() -> Schema {
    let part = |name: &str, unit: &str, default: f64, help: &str| {
        Parameter::number(name, unit, default, help).within(0.0, f64::INFINITY)
    };
    let parameters = vec![
        Parameter::of("wheels", ParameterType::Integer, "Wheels whose rates it reads, `rate_1` and so on")
            .or(4)
            .within(1.0, MOST_WHEELS),
        Parameter::number("radius_m", "m", 0.5, "Radius of the wheels").positive(),
        Parameter::number("slip", "", 0.0, "Share of the way of the rim that is taken for slip")
            .within(-1.0, 1.0),
        part(
            "scale_error",
            "",
            0.0,
            "Standard deviation of the constant error of the way, m/m, drawn from the seed",
        ),
        part("turn_drift", "rad/s", 0.0, "Standard deviation of a constant error of the rate of turning"),
    ];
    let help = "The way of a machine from the rates of its wheels, which slip, and from a gyroscope";
    Schema { name: "odometry".into(), kind: Kind::Controller, help: help.into(), parameters }
}

fn variables(wheels: u32) -> Vec<Variable> {
    let shown = |id, name: &str, unit, help| Variable::real(id, name, unit, Causality::Output, help);
    let live = |id, name: &str, unit, help| Variable::real(id, name, unit, Causality::Parameter, help);
    let input =
        |id, name: String, help| Variable::real(id, name, "rad/s", Causality::Input, help).within(-1e3, 1e3);
    let mut all = vec![
        shown(X, "x", "m", "Place along x since the start, in the frame of the start"),
        shown(Y, "y", "m", "Place along y since the start"),
        shown(YAW, "yaw", "rad", "Direction since the start, not wrapped"),
        shown(SPEED, "speed", "m/s", "Speed along the machine"),
        shown(TURN_RATE, "turn_rate", "rad/s", "Rate of turning about z"),
        live(SLIP, "slip", "", "Share of the way of the rim that is taken for slip").within(-1.0, 1.0),
        live(SHIFT_X, "shift_x", "m", "Added to `x`: as if it had been carried off").within(-1e4, 1e4),
        live(SHIFT_Y, "shift_y", "m", "Added to `y`").within(-1e4, 1e4),
        input(GYRO, "gyro".into(), "Rate of turning about z that a gyroscope shows"),
    ];
    all.extend(
        (0..wheels).map(|k| input(WHEEL + k, format!("rate_{}", k + 1), "Rate of a wheel, forward positive")),
    );
    all
}

impl Module for Odometry {
    fn schema() -> Schema {
        schema()
    }

    fn instantiate(config: &Config, host: Arc<dyn Host>) -> Result<Box<dyn Subsystem>> {
        Ok(Box::new(Self::new(config, host.as_ref())?))
    }
}

impl Odometry {
    /// With these parameters.
    ///
    /// # Errors
    /// [`terraglue_subsystem::Error::Refused`]: parameters that make none.
    pub fn new(config: &Config, host: &dyn Host) -> Result<Self> {
        let wheels = config.number("wheels")? as u32;
        let mut table = ValueTable::new(variables(wheels));
        table.set(&[SLIP], Values::F64(&[config.number("slip")?]))?;
        let scale = 1.0 + config.number("scale_error")? * normal(host.seed(), 0);
        Ok(Self {
            wheels,
            radius_m: config.number("radius_m")? * scale,
            drift_rad_s: config.number("turn_drift")? * normal(host.seed(), 1),
            table,
            trial: [0.0; 5],
            place: [0.0; 2],
            slots: Slots::new(host.slots()),
        })
    }

    /// Everything that lasts: the values, and the place without the shift.
    fn state(&self) -> Vec<f64> {
        let mut state = self.table.values().to_vec();
        state.extend(self.place);
        state
    }

    fn put(&mut self, state: &[f64]) -> Result {
        let (values, place) = state.split_last_chunk::<2>().ok_or_else(|| bytes::wrong("it is too short"))?;
        self.table.restore(values)?;
        self.place = *place;
        Ok(())
    }
}

impl Subsystem for Odometry {
    fn capabilities(&self) -> Capabilities {
        Capabilities::RETRY | Capabilities::STATE | Capabilities::SERIALIZE
    }

    fn advance(&mut self, step: &Step, _: &Input, out: &mut Response) -> Result {
        let rates =
            (0..self.wheels).map(|k| self.table.value(WHEEL + k)).sum::<f64>() / f64::from(self.wheels);
        let speed = rates * self.radius_m * (1.0 - self.table.value(SLIP));
        let turn_rate = self.table.value(GYRO) + self.drift_rad_s;
        // an arc, with the direction half way
        let yaw = self.table.value(YAW);
        let half = yaw + 0.5 * turn_rate * step.h;
        let way = speed * step.h;
        let [x, y] = self.place;
        self.trial = [
            x + way * libm::cos(half),
            y + way * libm::sin(half),
            yaw + turn_rate * step.h,
            speed,
            turn_rate,
        ];
        out.reached = step.t + step.h;
        out.flags = 0;
        Ok(())
    }

    fn commit(&mut self, _: &Step, _: &[f64], _: &Motion) -> Result {
        let [x, y, yaw, speed, turn_rate] = self.trial;
        self.place = [x, y];
        self.table.show(X, x + self.table.value(SHIFT_X));
        self.table.show(Y, y + self.table.value(SHIFT_Y));
        self.table.show(YAW, yaw);
        self.table.show(SPEED, speed);
        self.table.show(TURN_RATE, turn_rate);
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
        Ok(bytes::seal(VERSION, u64::from(self.wheels), &self.state()))
    }

    fn deserialize(&mut self, from: &[u8]) -> Result {
        let state: Vec<f64> = bytes::open(VERSION, u64::from(self.wheels), from)?;
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
