//! Independent soil columns, one per port: the smallest soil with a closed solution, for tests.
//!
//! A column belongs to the key of a port. Its depth z (m) is that of the foot below the initial ground, measured
//! along the normal: z = (ground − origin)·n_z − X_n. The law is [`ColumnLaw`]. There is no
//! `solve_compatibility` on purpose: the coordinator's default pass is tried on this soil.

mod column;
mod ground;
mod state;

pub use column::ColumnLaw;
pub use ground::Ground;

use state::{Answer, Column, States};
use std::sync::Arc;
use terraglue_subsystem::{
    Capabilities, Causality, Config, Energy, Error, Host, Input, Kind, Law, Level, Module, Motion, Parameter,
    ParameterType, Port, Response, Result, Schema, Step, Subsystem, ValueType, Values, ValuesMut, Variable,
};

/// The module.
pub struct SoilColumnModule;

impl Module for SoilColumnModule {
    fn schema() -> Schema {
        Schema {
            name: "soil-column".into(),
            kind: Kind::Soil,
            help: "Independent columns T = K z^n with straight unloading and Coulomb friction".into(),
            parameters: vec![
                Parameter::number("K", "", 8340.0, "Stiffness of first loading, N/m^n").positive(),
                Parameter::number("n", "", 1.0, "Exponent of first loading").positive(),
                Parameter::number("k_u", "N/m", 2e5, "Stiffness of unloading").positive(),
                Parameter::number("k_t", "N/m", 1e5, "Tangential stiffness while a foot sticks").positive(),
                Parameter::of("mu", ParameterType::Number, "Coulomb coefficient")
                    .or(0.6)
                    .within(0.0, f64::INFINITY),
            ],
        }
    }

    fn instantiate(config: &Config, host: Arc<dyn Host>) -> Result<Box<dyn Subsystem>> {
        let law = ColumnLaw {
            k: config.number("K")?,
            n: config.number("n")?,
            k_u: config.number("k_u")?,
            k_t: config.number("k_t")?,
            mu: config.number("mu")?,
        };
        Ok(Box::new(SoilColumns::new(law, Ground::new(host.terrain()), host.slots())))
    }
}

/// An instance.
pub struct SoilColumns {
    law: ColumnLaw,
    ground: Ground,
    states: States,
    /// Per port of the current epoch: where the column is.
    of_port: Vec<usize>,
    /// Per port: the last trial, for derivatives.
    answers: Vec<Answer>,
    variables: Vec<Variable>,
}

const MAX_SINKAGE: u32 = 0;
const STIFFNESS: u32 = 1;
const COLUMNS: u32 = 2;

impl SoilColumns {
    /// Columns of one law on a ground; `slots` states can be saved.
    pub fn new(law: ColumnLaw, ground: Ground, slots: u32) -> Self {
        let variables = vec![
            Variable::real(MAX_SINKAGE, "max_sinkage", "m", Causality::Output, "Deepest column so far"),
            Variable::real(STIFFNESS, "K", "", Causality::Parameter, "Stiffness of first loading, N/m^n")
                .within(f64::MIN_POSITIVE, f64::INFINITY),
            Variable::real(COLUMNS, "columns", "", Causality::Local, "Number of columns")
                .typed(ValueType::U32),
        ];
        let (states, of_port, answers) = (States::new(slots), Vec::new(), Vec::new());
        Self { law, ground, states, of_port, answers, variables }
    }

    /// Depth of the foot at t, m.
    fn depth_now(&self, port: &Port) -> f64 {
        let [x, y, z] = port.origin;
        (self.ground.height(x, y) - z) * port.frame[2]
    }

    fn column(&self, p: usize) -> &Column {
        self.states.column(self.of_port[p])
    }

    /// Answer of port p to a motion x at t + h; the normal force is that of the law where `t_n` is absent.
    fn under_motion(&self, port: &Port, p: usize, x: &[f64], t_n: Option<f64>) -> Answer {
        let (column, z_now) = (self.column(p), self.depth_now(port));
        let z = z_now - x[port.first as usize];
        let (force, slope) = self.law.force(column.z_max, z);
        let (t_n, x_n, slope, compliance) = match t_n {
            None => (force, x[port.first as usize], slope, 0.0),
            Some(given) => {
                let (z, compliance) = self.law.depth(column.z_max, given);
                (given, z_now - z, 0.0, compliance)
            }
        };
        let mut moved = [0.0; 2];
        for (i, c) in port.components().filter(|(_, c)| *c == 1 || *c == 2) {
            moved[c - 1] = x[i];
        }
        let (t_t, trial) = self.law.friction(column.tangential(port), moved, t_n);
        Answer { x_n, t_n, t_t, slope, compliance, sliding_trial: trial, force_alone: false, moved }
    }

    /// Answer of port p to a wrench alone: the tangential spring yields until it carries the wrench.
    fn under_force(&self, port: &Port, p: usize, t: &[f64]) -> Answer {
        let (column, t_n) = (self.column(p), t[port.first as usize]);
        let (z, compliance) = self.law.depth(column.z_max, t_n);
        let (mut t_t, t0) = ([0.0; 2], column.tangential(port));
        for (i, c) in port.components().filter(|(_, c)| *c == 1 || *c == 2) {
            t_t[c - 1] = t[i];
        }
        let moved = [0, 1].map(|k| (t0[k] - t_t[k]) / self.law.k_t);
        let x_n = self.depth_now(port) - z;
        Answer { x_n, t_n, t_t, slope: 0.0, compliance, sliding_trial: 0.0, force_alone: true, moved }
    }
}

/// Writes an answer into a response; moments are not carried.
fn write(port: &Port, answer: &Answer, out: &mut Response) {
    for (i, c) in port.components() {
        (out.x[i], out.t[i]) = match c {
            0 => (answer.x_n, answer.t_n),
            1 | 2 => (answer.moved[c - 1], answer.t_t[c - 1]),
            _ => (0.0, 0.0),
        };
        (out.v[i], out.a[i]) = (0.0, 0.0);
    }
}

impl Subsystem for SoilColumns {
    fn capabilities(&self) -> Capabilities {
        Capabilities::FORCE
            | Capabilities::MOTION
            | Capabilities::DERIVATIVES
            | Capabilities::RETRY
            | Capabilities::STATE
            | Capabilities::SERIALIZE
    }

    fn set_ports(&mut self, step: &Step, laws: &mut [Law], now: &mut Response) -> Result {
        self.of_port.clear();
        self.answers.clear();
        for (p, port) in step.ports.iter().enumerate() {
            let index = self.states.find_or_add(port.key);
            self.of_port.push(index);
            let (column, z) = (self.column(p), self.depth_now(port));
            let (t_n, slope) = self.law.force(column.z_max, z);
            let x_n = (z - self.law.free_depth(column.z_max)).min(0.0);
            let (t_t, _) = self.law.friction(column.tangential(port), [0.0; 2], t_n);
            let answer = Answer { x_n, t_n, t_t, slope, ..Answer::default() };
            write(port, &answer, now);
            self.answers.push(answer);
            laws[p].mu = laws[p].mu.min(self.law.mu);
        }
        Ok(())
    }

    fn advance(&mut self, step: &Step, input: &Input, out: &mut Response) -> Result {
        for (p, port) in step.ports.iter().enumerate() {
            let answer = match input {
                Input::Force { t, motion: Some(m), .. } => {
                    self.under_motion(port, p, m.x, Some(t[port.first as usize]))
                }
                Input::Force { t, motion: None, .. } => self.under_force(port, p, t),
                Input::Motion(m) => self.under_motion(port, p, m.x, None),
            };
            write(port, &answer, out);
            self.answers[p] = answer;
        }
        out.reached = step.t + step.h;
        Ok(())
    }

    fn interface_jacobian(&mut self, step: &Step, level: Level, out: &mut [f64]) -> Result {
        if level == Level::Acceleration {
            return Err(Error::Unsupported);
        }
        let n = step.n as usize;
        out[..n * n].fill(0.0);
        if level == Level::Velocity {
            return Ok(());
        }
        for (port, answer) in step.ports.iter().zip(&self.answers) {
            for (i, row) in port.components() {
                for (j, column) in port.components() {
                    out[j * n + i] = answer.derivative(&self.law, row, column);
                }
            }
        }
        Ok(())
    }

    fn commit(&mut self, step: &Step, _: &[f64], partner: &Motion) -> Result {
        for (p, port) in step.ports.iter().enumerate() {
            let answer = self.under_motion(port, p, partner.x, None);
            let z = self.depth_now(port) - partner.x[port.first as usize];
            // the work of its own law, whatever the wrench passed to it
            let own = [answer.t_n, answer.t_t[0], answer.t_t[1]];
            let forces = port.components().filter(|(_, c)| *c < 3);
            let work: f64 = forces.map(|(i, c)| -own[c] * partner.x[i]).sum();
            self.states.column_mut(self.of_port[p]).commit(port, z, answer.t_t);
            self.states.book(work);
        }
        Ok(())
    }

    fn save_state(&mut self, slot: u32) -> Result {
        self.states.save(slot)
    }

    fn restore_state(&mut self, slot: u32) -> Result {
        self.states.restore(slot)
    }

    fn serialize(&self) -> Result<Vec<u8>> {
        Ok(self.states.to_bytes())
    }

    fn deserialize(&mut self, bytes: &[u8]) -> Result {
        self.states.read_bytes(bytes)
    }

    fn variables(&self) -> &[Variable] {
        &self.variables
    }

    fn get(&self, ids: &[u32], out: ValuesMut) -> Result {
        match out {
            ValuesMut::F64(out) => ids.iter().zip(out).try_for_each(|(id, to)| {
                *to = match *id {
                    MAX_SINKAGE => self.states.max_sinkage(),
                    STIFFNESS => self.law.k,
                    id => return Err(Error::Refused(format!("no number {id}"))),
                };
                Ok(())
            }),
            ValuesMut::U32(out) if ids == [COLUMNS] => {
                out.fill(self.states.len() as u32);
                Ok(())
            }
            _ => Err(Error::Refused("no variable of this type".into())),
        }
    }

    fn set(&mut self, ids: &[u32], values: Values) -> Result {
        match (ids, values) {
            ([STIFFNESS], Values::F64([k])) if *k > 0.0 && k.is_finite() => {
                self.law.k = *k;
                Ok(())
            }
            _ => Err(Error::Refused("only K can be set, to a positive number".into())),
        }
    }

    fn energy(&self) -> Energy {
        self.states.energy(&self.law)
    }
}
