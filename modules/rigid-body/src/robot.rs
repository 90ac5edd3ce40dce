//! An instance: committed state, the step in hand, and the calls of the subsystem interface.

use crate::actuator::Item;
use crate::actuator::battery::Draw;
use crate::actuator::energy_ledger::Outcome;
use crate::balance;
use crate::contact::estimate::{Estimator, Problem};
use crate::contact::port_jacobian::PortJacobian;
use crate::contact::ports::{Ports, committed, displacement, response, standing};
use crate::drive::FULL_BLOCK;
use crate::dynamics::joint_rows::coordinate;
use crate::dynamics::{Dynamics, Failure};
use crate::math::V3;
use crate::model::Model;
use crate::motor::Motor;
use crate::scene;
use crate::state::State;
use crate::variables;
use std::sync::Arc;
use terraglue_subsystem::{
    Action, BodyState, Capabilities, Energy, Error, Estimate, Host, Input, Law, Level, Motion, Port,
    PortKind, Response, Result, Scene, Step, Subsystem, Values, ValuesMut, Variable,
};

/// A partial block that is off by more than this has given way, rad or m.
const GIVEN_WAY: f64 = 1e-9;

/// A robot in a run.
pub(crate) struct Robot {
    /// Kept alive as long as the instance.
    _host: Arc<dyn Host>,
    dynamics: Dynamics,
    state: State,
    slots: Vec<State>,
    /// State before a `set`.
    backup: State,
    variables: Vec<Variable>,
    actions: Vec<Action>,
    ports: Ports,
    port_jacobian: PortJacobian,
    estimator: Estimator,
    /// Step for which `dynamics` and `ports` are prepared.
    prepared: Option<Prepared>,
    step_ports: Vec<Port>,
    /// Grows whenever the state changes.
    revision: u64,
    /// Whether the last trial was an `advance` that can be committed.
    trial: bool,
    scratch: EstimateScratch,
}

/// Data on which a preparation depends besides the ports.
#[derive(Clone, Copy, PartialEq)]
struct Prepared {
    revision: u64,
    h: f64,
}

/// Packed vectors of the estimate.
#[derive(Default)]
struct EstimateScratch {
    g: Vec<f64>,
    gap: Vec<f64>,
    free: Vec<f64>,
}

/// Solver of a trial.
type Solve = fn(&mut Dynamics) -> std::result::Result<(), Failure>;

fn failed(failure: Failure) -> Error {
    Error::Failed(failure.to_string())
}

impl Robot {
    pub fn new(host: Arc<dyn Host>, dynamics: Dynamics, state: State) -> Result<Self> {
        let slots = (0..host.slots()).map(|_| State::default()).collect();
        let variables = variables::describe(&dynamics.model, &state);
        variables::check_names(&variables)?;
        Ok(Self {
            _host: host,
            variables,
            actions: variables::actions(&dynamics.model),
            ports: Ports::default(),
            dynamics,
            state,
            slots,
            backup: State::default(),
            port_jacobian: PortJacobian::default(),
            estimator: Estimator::default(),
            prepared: None,
            step_ports: Vec::new(),
            revision: 0,
            trial: false,
            scratch: EstimateScratch::default(),
        })
    }

    fn model(&self) -> &Model {
        &self.dynamics.model
    }

    fn changed(&mut self) {
        self.revision += 1;
        self.trial = false;
    }

    /// Linearises the step unless that has been done for the same state, length and ports.
    fn prepare(&mut self, step: &Step) -> Result {
        if !(step.h > 0.0 && step.h.is_finite()) {
            return Err(Error::Refused(format!(
                "a step of {} s is not possible; it must be longer than 0",
                step.h
            )));
        }
        let wanted = Prepared { revision: self.revision, h: step.h };
        let stepped = self.prepared != Some(wanted);
        if stepped {
            self.prepared = None;
            self.dynamics.prepare(&self.state, step.h).map_err(failed)?;
            self.prepared = Some(wanted);
        }
        if stepped || self.step_ports != step.ports || self.ports.len() != step.n as usize {
            self.assign(step)?;
        }
        Ok(())
    }

    fn assign(&mut self, step: &Step) -> Result {
        self.port_jacobian.forget();
        self.step_ports.clear();
        self.step_ports.extend_from_slice(step.ports);
        if !self.ports.assign(step.ports, step.n as usize, &self.state.bodies) {
            self.prepared = None;
            return Err(Error::Refused("a port names a body that the robot does not have".into()));
        }
        Ok(())
    }

    /// A step of no length: accelerations at t under T, for the forces of glued joints at the start.
    fn stand_still(&mut self, step: &Step, t: &[f64], out: &mut Response) -> Result {
        self.prepared = None;
        self.assign(step)?;
        self.dynamics.h = 0.0;
        self.ports.load(&mut self.dynamics, t);
        self.dynamics.stand_still(&self.state).map_err(failed)?;
        standing(step.ports, &self.dynamics, out);
        Ok(())
    }

    /// Solves the step under the wrenches t.
    fn try_wrenches(&mut self, t: &[f64]) -> Result {
        self.solve_under(t, Dynamics::solve)
    }

    /// Loads the wrenches t and solves by `solve`.
    fn solve_under(&mut self, t: &[f64], solve: Solve) -> Result {
        self.ports.load(&mut self.dynamics, t);
        loop {
            match solve(&mut self.dynamics) {
                Err(Failure::Branches { .. }) if self.dynamics.soften(&self.state) => {}
                done => return done.map_err(failed),
            }
        }
    }

    /// Fills `scratch.g` with d(x1 − x2)/dT and `scratch.gap` with x_free − x2 in the sign of side 1.
    fn linear_contact(&mut self, x_free: &[f64], partner: &Motion) {
        let n = self.ports.len();
        let g = self.ports.compliance(&self.dynamics);
        self.scratch.g.clear();
        self.scratch.g.extend_from_slice(g);
        let first = if n > 0 { self.ports.side(0) } else { 1.0 };
        if (1..n).any(|i| self.ports.side(i) != first) {
            for c in 0..n {
                for r in 0..n {
                    self.scratch.g[c * n + r] *= self.ports.side(r) * self.ports.side(c);
                }
            }
        }
        self.scratch.gap.clear();
        let gaps = (0..n).map(|i| self.ports.side(i) * (x_free[i] - partner.x[i]));
        self.scratch.gap.extend(gaps);
    }

    /// T* on the present branches of the motors; whether it is unique.
    fn solve_contact(&mut self, step: &Step, partner: &Motion, out: &mut Estimate) -> Result<bool> {
        self.linear_contact(out.x_free, partner);
        let problem = Problem { ports: step.ports, g: &self.scratch.g, gap: &self.scratch.gap };
        self.estimator.solve(&problem, out.t_star).map_err(|e| Error::Failed(e.into()))
    }

    /// x_free as it would be on the branches of the motors under T*: x(T*) − G·T*.
    fn extrapolate_free(&mut self, step: &Step, t: &[f64], x_free: &mut [f64]) {
        let n = self.ports.len();
        displacement(step.ports, &self.dynamics, x_free);
        self.ports.compliance(&self.dynamics);
        for (r, x) in x_free.iter_mut().enumerate() {
            let moved: f64 = (0..n).map(|c| self.ports.g(r, c) * self.ports.side(c) * t[c]).sum();
            *x -= moved;
        }
    }

    fn book_joints(&mut self) {
        let Self { dynamics, state, .. } = self;
        let h = dynamics.h;
        let (supply_v, mut draw) = (state.supply.limit, Draw::default());
        for (j, joint) in dynamics.model.joints.iter().enumerate() {
            let axis = dynamics.axis_result(j);
            state.reactions[j] = dynamics.reaction(j, axis.map_or(0.0, |a| a.impulse));
            let Some(axis) = axis else { continue };
            let mode = dynamics.branches.modes[j];
            let shares = dynamics.branches.axes[j].shares(mode, axis.rate, axis.impulse);
            let s = &mut state.joints[j];
            let (spring, _) = s.actuator.stored(s.angle);
            s.angle = coordinate(joint, &dynamics.trial.ends, s.angle);
            s.velocity = axis.end_rate;
            s.torque = (shares.motor / h).clamp(-s.max_torque, s.max_torque);
            // A partial block that has given way holds on where it is now.
            let slipped = s.blocked.is_some_and(|held| (s.angle - held).abs() > GIVEN_WAY);
            if slipped && s.actuator[Item::BlockTorque] < FULL_BLOCK {
                s.blocked = Some(s.angle);
            }
            s.mode = mode;
            let outcome = Outcome {
                shares,
                rate: axis.rate,
                mean_rate: axis.mean_rate,
                starved: dynamics.branches.axes[j].starved(axis.rate),
                motor_off: s.motor == Motor::Off || s.max_torque <= 0.0,
            };
            s.actuator.commit(&outcome, supply_v, h, &mut draw);
            let e = &mut state.energy;
            e.actuator_work += shares.motor * axis.mean_rate;
            // A brake or a stop that catches a moving joint turns its energy into heat, and so does friction; the
            // implicit spring loses the work that it does not store.
            let passive = shares.stop + shares.friction + shares.damper + shares.spring;
            e.dissipated -= passive * axis.mean_rate + s.actuator.stored(s.angle).0 - spring;
            e.electrical += s.actuator.ledger.electrical_power * h;
        }
        state.supply.advance(&draw, h);
        for (b, load) in state.loads.iter().enumerate() {
            let at = dynamics.kkt.body_at[b];
            let [mut way, mut turn] =
                [0, 3].map(|k| V3::from_row_slice(&dynamics.trial.solution[at + k..][..3]));
            if !dynamics.integrator.is_second_order() {
                let kick = dynamics.trial.kick(b, &dynamics.kkt, &dynamics.start);
                way -= 0.5 * V3::from_row_slice(&kick[..3]);
                turn -= 0.5 * V3::from_row_slice(&kick[3..]);
            }
            state.energy.actuator_work += h * (load.force.dot(&way) + load.moment.dot(&turn));
        }
        // Positions of the first-order scheme are half a step ahead of its rates.
        state.stagger = if dynamics.integrator.is_second_order() { 0.0 } else { 0.5 * h };
        state.accelerations.clone_from(&dynamics.trial.accelerations);
        state.accelerated = true;
        if state.start.is_none() {
            state.start = state.bodies.first().map(|b| b.c);
        }
    }

    fn book_contacts(&mut self) {
        let Self { dynamics, state, .. } = self;
        state.contact_normal.fill(0.0);
        state.contact.points = 0;
        state.contact.residual = 0.0;
        state.contact.yielding = dynamics.branches.yielding;
        if dynamics.integrator.is_second_order() {
            return;
        }
        let contacts = &dynamics.contacts;
        contacts.add_normal_forces(dynamics.h, &mut state.contact_normal);
        let lost = -dynamics.contact_work();
        state.energy.dissipated += lost;
        state.contact.lost += lost;
        contacts.remember(&state.bodies, dynamics.h, &mut state.pressed);
        state.contact.points = contacts.pressing();
        state.contact.residual = contacts.residual;
    }

    fn book_ports(&mut self, step: &Step, t: &[f64]) {
        displacement(step.ports, &self.dynamics, &mut self.scratch.free);
        for port in step.ports {
            for (i, c) in port.components() {
                // The work on both sides is T·X; the energy that an impact takes from the body is lost.
                let push = self.ports.side(i) * t[i];
                self.state.energy.port_work += push * self.scratch.free[i];
                if !self.dynamics.integrator.is_second_order() {
                    self.state.energy.dissipated +=
                        0.5 * push * self.dynamics.h * self.ports.kick(&self.dynamics, i);
                }
                if c == 0 {
                    self.state.contact_normal[port.body as usize] += t[i];
                }
            }
        }
    }

    fn set_one(&mut self, id: u32, values: &Values, k: usize) -> Result {
        let Self { dynamics, state, .. } = self;
        let model = &dynamics.model;
        match values {
            Values::F64(v) => variables::set_number(model, state, id, v[k]),
            Values::Bool(v) => variables::set_flag(model, state, id, v[k]),
            Values::Enumeration(v) => variables::set_motor(model, state, id, v[k]),
            _ => Err(Error::Refused(format!("variable number {id} is of another type"))),
        }
    }
}

fn value_count(values: &Values) -> usize {
    match values {
        Values::F64(v) => v.len(),
        Values::Bool(v) => v.len(),
        Values::Enumeration(v) => v.len(),
        _ => 0,
    }
}

impl Subsystem for Robot {
    fn capabilities(&self) -> Capabilities {
        Capabilities::FORCE
            | Capabilities::ESTIMATE
            | Capabilities::DERIVATIVES
            | Capabilities::RETRY
            | Capabilities::STATE
            | Capabilities::SERIALIZE
    }

    fn set_ports(&mut self, step: &Step, _laws: &mut [Law], now: &mut Response) -> Result {
        if let Some(port) = step.ports.iter().find(|p| p.body as usize >= self.state.bodies.len()) {
            return Err(Error::Refused(format!(
                "port {} names body {}, which does not exist",
                port.key, port.body
            )));
        }
        committed(step.ports, &self.state.bodies, now);
        now.reached = step.t;
        Ok(())
    }

    fn estimate_forces(&mut self, step: &Step, partner: &Motion, out: &mut Estimate) -> Result {
        self.prepare(step)?;
        self.trial = false;
        let n = self.ports.len();
        out.t_star.fill(0.0);
        self.try_wrenches(out.t_star)?;
        self.scratch.free.resize(n, 0.0);
        displacement(step.ports, &self.dynamics, out.x_free);
        out.unique = true;
        // Motors may change branch under T*; then the free motion is taken on the new branches.
        for _ in 0..4 {
            out.unique = self.solve_contact(step, partner, out)?;
            let factor = self.dynamics.kkt.factor_count;
            if self.solve_under(out.t_star, Dynamics::find_branches).is_err() {
                // An impact that no step can follow: motors stay on the branches without it.
                out.t_star.fill(0.0);
                self.try_wrenches(out.t_star)?;
                displacement(step.ports, &self.dynamics, out.x_free);
                out.unique = self.solve_contact(step, partner, out)?;
                break;
            }
            if self.dynamics.kkt.factor_count == factor {
                break;
            }
            self.extrapolate_free(step, out.t_star, out.x_free);
        }
        out.g.copy_from_slice(self.ports.compliance(&self.dynamics));
        for (active, port) in out.active.iter_mut().zip(step.ports) {
            *active = u8::from(out.t_star[port.first as usize] > 0.0);
        }
        Ok(())
    }

    fn advance(&mut self, step: &Step, input: &Input, out: &mut Response) -> Result {
        let Input::Force { t, .. } = input else { return Err(Error::Unsupported) };
        self.trial = false;
        if let Some(bad) = t.iter().position(|t| !t.is_finite()) {
            return Err(Error::Refused(format!("component {bad} of the wrench is not a finite number")));
        }
        if step.h == 0.0 {
            self.stand_still(step, t, out)?;
        } else {
            self.prepare(step)?;
            self.try_wrenches(t)?;
            if !self.dynamics.integrator.is_second_order() {
                step.ports.iter().for_each(|p| self.dynamics.find_rates(p.body as usize));
            }
            response(step.ports, &self.dynamics, out);
        }
        out.t.copy_from_slice(t);
        out.reached = step.t + step.h;
        self.trial = true;
        Ok(())
    }

    fn interface_jacobian(&mut self, step: &Step, level: Level, out: &mut [f64]) -> Result {
        if step.h > 0.0 {
            self.prepare(step)?;
            self.dynamics.ensure_factor().map_err(failed)?;
            let joint = |p: &Port| p.kind == PortKind::Joint as u32;
            if step.ports.iter().any(joint) && self.dynamics.contacts.pressing() == 0 {
                let jacobian = self.port_jacobian.at(level, step.ports, &self.ports, &mut self.dynamics);
                out.copy_from_slice(jacobian);
                return Ok(());
            }
        }
        let per = match level {
            _ if step.h == 0.0 => f64::from(u8::from(level == Level::Acceleration)),
            Level::Position => 1.0,
            Level::Velocity => self.dynamics.integrator.rate_weight() / step.h,
            Level::Acceleration => 1.0 / (step.h * self.dynamics.impulse_per_force()),
        };
        let g = self.ports.compliance(&self.dynamics);
        out.iter_mut().zip(g).for_each(|(o, g)| *o = per * g);
        Ok(())
    }

    fn commit(&mut self, step: &Step, t: &[f64], _partner: &Motion) -> Result {
        if !self.trial {
            return Err(Error::Failed("commit without a trial of this step".into()));
        }
        if step.h == 0.0 {
            self.state.accelerations.clone_from(&self.dynamics.start.accelerations);
            self.state.accelerated = true;
            self.changed();
            return Ok(());
        }
        self.dynamics.complete();
        self.scratch.free.resize(step.n as usize, 0.0);
        self.book_contacts();
        self.book_ports(step, t);
        self.book_joints();
        self.dynamics.book_closures(&mut self.state);
        self.state.bodies.clone_from(&self.dynamics.trial.ends);
        self.changed();
        Ok(())
    }

    fn save_state(&mut self, slot: u32) -> Result {
        let Self { slots, state, .. } = self;
        let slot = slots.get_mut(slot as usize).ok_or_else(|| no_slot(slot))?;
        slot.copy_from(state);
        Ok(())
    }

    fn restore_state(&mut self, slot: u32) -> Result {
        let Self { slots, state, .. } = self;
        let saved = slots.get(slot as usize).filter(|s| !s.bodies.is_empty()).ok_or_else(|| no_slot(slot))?;
        state.copy_from(saved);
        self.changed();
        Ok(())
    }

    fn serialize(&self) -> Result<Vec<u8>> {
        Ok(self.state.to_bytes(self.model()))
    }

    fn deserialize(&mut self, from: &[u8]) -> Result {
        let state = self.state.restored(self.model(), from)?;
        self.state.copy_from(&state);
        self.changed();
        Ok(())
    }

    fn variables(&self) -> &[Variable] {
        &self.variables
    }

    fn get(&self, ids: &[u32], out: ValuesMut) -> Result {
        let (model, state) = (self.model(), &self.state);
        match out {
            ValuesMut::F64(out) => variables::numbers(model, state, ids, out),
            ValuesMut::Bool(out) => out
                .iter_mut()
                .zip(ids)
                .try_for_each(|(o, id)| variables::flag_value(model, state, *id).map(|v| *o = v)),
            ValuesMut::Enumeration(out) => out
                .iter_mut()
                .zip(ids)
                .try_for_each(|(o, id)| variables::motor(model, state, *id).map(|v| *o = v)),
            _ => Err(Error::Refused("numbers are f64, flags bool, motors enumerations".into())),
        }
    }

    fn set(&mut self, ids: &[u32], values: Values) -> Result {
        if value_count(&values) != ids.len() {
            return Err(Error::Refused(
                "numbers are f64, flags bool, motors enumerations; one value per variable".into(),
            ));
        }
        self.changed();
        // All or nothing: a refusal leaves the robot as it was.
        self.backup.copy_from(&self.state);
        let done = ids.iter().enumerate().try_for_each(|(k, id)| self.set_one(*id, &values, k));
        if done.is_err() {
            self.state.copy_from(&self.backup);
        }
        done
    }

    fn actions(&self) -> &[Action] {
        &self.actions
    }

    fn act(&mut self, action: &str, _arguments: &str) -> Result {
        let unknown = || Error::Refused(format!("there is no action `{action}`"));
        if action == variables::RESTART {
            self.state.restart_ledger();
            self.changed();
            return Ok(());
        }
        let (name, what) = action.rsplit_once('.').ok_or_else(unknown)?;
        if let Some(closure) = self.model().closures.iter().position(|c| c.name == name) {
            if what != "break" {
                return Err(unknown());
            }
            variables::break_closure(&mut self.state, closure);
            self.changed();
            return Ok(());
        }
        let joint = self.model().joints.iter().position(|j| j.name == name).ok_or_else(unknown)?;
        let moves = self.model().joints[joint].moves();
        match what {
            "break" => variables::break_joint(&mut self.state, joint),
            "block" if moves => variables::block(&mut self.state, joint, true)?,
            "release" if moves => variables::block(&mut self.state, joint, false)?,
            _ => return Err(unknown()),
        }
        self.changed();
        Ok(())
    }

    fn scene(&self) -> Scene {
        scene::scene(self.model())
    }

    fn body_states(&self, out: &mut [BodyState]) -> Result {
        for ((out, body), motion) in out.iter_mut().zip(&self.model().bodies).zip(&self.state.bodies) {
            *out = scene::body_state(body, motion);
        }
        // fixed shapes, where the scene has them
        out.iter_mut().skip(self.state.bodies.len()).for_each(|out| *out = BodyState::REST);
        Ok(())
    }

    fn energy(&self) -> Energy {
        balance::energy(self.model(), &self.state)
    }
}

fn no_slot(slot: u32) -> Error {
    Error::Refused(format!("nothing was saved in slot {slot}"))
}
