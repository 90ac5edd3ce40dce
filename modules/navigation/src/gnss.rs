//! A receiver of GNSS under a canopy: an error that stays the same for minutes, white noise, and outages.
//!
//! The correlated part is a process of Gauss and Markov of first order (A. Gelb, "Applied Optimal Estimation", 1974, section 3.8) in x and in
//! y, exact for any time between two fixes; outages begin and end at random (exponential times).

use std::sync::Arc;
use terraglue_numerics::random::{normal, uniform};
use terraglue_subsystem::{
    Capabilities, Causality, Config, Error, Host, Input, Kind, Module, Mount, Parameter, Response, Result,
    Schema, Slots, Step, Subsystem, ValueTable, ValueType, Values, ValuesMut, Variable, World, bytes,
    persist,
};

/// Form of the serialized state.
const VERSION: u32 = 1;
const OUTAGE: u32 = 0;
const OFFSET_X: u32 = 1;
const OFFSET_Y: u32 = 2;
const CANOPY: u32 = 3;
const X: u32 = 4;
const Y: u32 = 5;
const DEVIATION: u32 = 6;
const FIX: u32 = 7;
/// Numbers that are drawn for a fix.
const DRAWN: u64 = 6;

/// A receiver of GNSS.
pub struct Gnss {
    mount: Mount,
    rate_hz: f64,
    noise_m: f64,
    correlation_s: f64,
    claimed: f64,
    between_outages_s: f64,
    outage_s: f64,
    seed: u64,
    table: ValueTable,
    state: State,
    slots: Slots<(State, Vec<f64>)>,
}

/// State from fix to fix.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
struct State {
    /// Number of the next fix.
    next: u64,
    /// Correlated error as a share of its deviation, along x and along y.
    error: [f64; 2],
    is_out: bool,
}
persist!(State { next, error, is_out });

/// Name, kind and parameters.
fn schema() -> Schema {
    let [mount, offset] = Mount::parameters();
    let part = |name: &str, unit: &str, default: f64, help: &str| {
        Parameter::number(name, unit, default, help).within(0.0, f64::INFINITY)
    };
    let parameters = vec![
        mount,
        offset,
        Parameter::number("rate_hz", "Hz", 1.0, "Fixes per second").positive(),
        part("noise_m", "m", 0.5, "Standard deviation of the white noise of a fix along each axis"),
        part("canopy_m", "m", 10.0, "Standard deviation of the error that stays, along each axis"),
        Parameter::number(
            "correlation_s",
            "s",
            120.0,
            "Time after which that error has forgotten a share of 1 − 1/e",
        )
        .positive(),
        Parameter::of(
            "offset_m",
            terraglue_subsystem::ParameterType::Numbers,
            "Constant error along x and y, m",
        )
        .or(vec![0.0, 0.0]),
        Parameter::number("claimed_m", "m", 0.0, "Deviation that it claims; 0: that of its errors")
            .within(0.0, 1e6),
        part("between_outages_s", "s", 0.0, "Mean time between two outages; 0: there are none"),
        part("outage_s", "s", 5.0, "Mean length of an outage"),
    ];
    let help = "GNSS under a canopy: an error that stays for minutes, noise and outages";
    Schema { name: "gnss".into(), kind: Kind::Sensor, help: help.into(), parameters }
}

fn variables() -> Vec<Variable> {
    let live = |id, name, help| Variable::real(id, name, "m", Causality::Parameter, help);
    let shown = |id, name, help| Variable::real(id, name, "m", Causality::Output, help);
    let flag =
        |id, name, causality, help| Variable::real(id, name, "", causality, help).typed(ValueType::Bool);
    vec![
        flag(OUTAGE, "outage", Causality::Parameter, "Whether it is made to show nothing"),
        live(OFFSET_X, "offset_x", "Constant error along x").within(-1e4, 1e4),
        live(OFFSET_Y, "offset_y", "Constant error along y").within(-1e4, 1e4),
        live(CANOPY, "canopy", "Standard deviation of the error that stays").within(0.0, 1e4),
        shown(X, "x", "Place along x that it shows, world; that of the fix before in an outage"),
        shown(Y, "y", "Place along y that it shows, world"),
        shown(DEVIATION, "deviation", "Deviation along each axis that it claims; 0: it shows nothing"),
        flag(FIX, "has_fix", Causality::Output, "Whether it shows a place"),
    ]
}

impl Module for Gnss {
    fn schema() -> Schema {
        schema()
    }

    fn instantiate(config: &Config, host: Arc<dyn Host>) -> Result<Box<dyn Subsystem>> {
        Ok(Box::new(Self::new(config, host.as_ref())?))
    }
}

impl Gnss {
    /// A receiver with these parameters.
    ///
    /// # Errors
    /// [`Error::Refused`]: parameters that make none.
    pub fn new(config: &Config, host: &dyn Host) -> Result<Self> {
        let offset = config.numbers("offset_m")?;
        let [x, y] = offset[..] else {
            let why = format!("parameter `offset_m` has {} numbers; x and y are needed", offset.len());
            return Err(Error::Refused(why));
        };
        if !offset.iter().all(|v| v.abs() <= 1e4) {
            return Err(Error::Refused(
                "parameter `offset_m`: numbers from −10000 to 10000 are needed".into(),
            ));
        }
        let mut table = ValueTable::new(variables());
        table.set(&[OFFSET_X, OFFSET_Y, CANOPY], Values::F64(&[x, y, config.number("canopy_m")?]))?;
        Ok(Self {
            mount: Mount::from_config(config)?,
            rate_hz: config.number("rate_hz")?,
            noise_m: config.number("noise_m")?,
            correlation_s: config.number("correlation_s")?,
            claimed: config.number("claimed_m")?,
            between_outages_s: config.number("between_outages_s")?,
            outage_s: config.number("outage_s")?,
            seed: host.seed(),
            table,
            state: State::default(),
            slots: Slots::new(host.slots()),
        })
    }

    /// Brings errors and outages to the next fix, and shows it.
    fn fix(&mut self, [x, y, _]: [f64; 3]) {
        let place = self.state.next * DRAWN;
        let drawn = |k: u64| normal(self.seed, place + k);
        // the first error is drawn from the distribution that it keeps
        let passed =
            if self.state.next == 0 { f64::INFINITY } else { 1.0 / (self.rate_hz * self.correlation_s) };
        let kept = libm::exp(-passed);
        let fresh = libm::sqrt(1.0 - kept * kept);
        self.state.error = [0, 1].map(|k| kept * self.state.error[k] + fresh * drawn(k as u64));
        self.state.is_out = self.is_out_next(uniform(self.seed, place + 4));
        self.state.next += 1;
        let canopy = self.table.value(CANOPY);
        let is_out = self.state.is_out || self.table.value(OUTAGE) > 0.5;
        if !is_out {
            let offset = [self.table.value(OFFSET_X), self.table.value(OFFSET_Y)];
            let error =
                [0, 1].map(|k| offset[k] + canopy * self.state.error[k] + self.noise_m * drawn(2 + k as u64));
            self.table.show(X, x + error[0]);
            self.table.show(Y, y + error[1]);
        }
        let own = libm::sqrt(canopy * canopy + self.noise_m * self.noise_m);
        let claimed = if self.claimed > 0.0 { self.claimed } else { own.max(1e-3) };
        self.table.show(DEVIATION, if is_out { 0.0 } else { claimed });
        self.table.show(FIX, f64::from(u8::from(!is_out)));
    }

    /// Whether an outage goes on or begins until the next fix.
    fn is_out_next(&self, drawn: f64) -> bool {
        if !(self.between_outages_s > 0.0) {
            return false;
        }
        let stays = |mean: f64| libm::exp(-1.0 / (self.rate_hz * mean.max(1e-9)));
        if self.state.is_out { drawn < stays(self.outage_s) } else { drawn >= stays(self.between_outages_s) }
    }
}

impl Subsystem for Gnss {
    fn capabilities(&self) -> Capabilities {
        Capabilities::RETRY | Capabilities::STATE | Capabilities::SERIALIZE | Capabilities::SEES
    }

    fn advance(&mut self, _: &Step, _: &Input, _: &mut Response) -> Result {
        Ok(())
    }

    fn observe(&mut self, step: &Step, world: &dyn World) -> Result {
        let end = step.t + step.h;
        self.mount.find(world)?;
        while self.state.next as f64 / self.rate_hz <= end + 1e-9 {
            let time = (self.state.next as f64 / self.rate_hz).clamp(step.t, end);
            let place = self.mount.state(world, time)?.world_from_body.position;
            self.fix(place);
        }
        Ok(())
    }

    fn save_state(&mut self, slot: u32) -> Result {
        self.slots.save(slot, (self.state, self.table.values().to_vec()))
    }

    fn restore_state(&mut self, slot: u32) -> Result {
        let (state, values) = self.slots.saved(slot)?;
        self.table.restore(&values)?;
        self.state = state;
        Ok(())
    }

    fn serialize(&self) -> Result<Vec<u8>> {
        Ok(bytes::seal(VERSION, 0, &(self.state, self.table.values().to_vec())))
    }

    fn deserialize(&mut self, from: &[u8]) -> Result {
        let (state, values): (State, Vec<f64>) = bytes::open(VERSION, 0, from)?;
        self.table.restore(&values)?;
        self.state = state;
        Ok(())
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
