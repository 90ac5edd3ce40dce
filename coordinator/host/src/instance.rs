//! An instance under supervision: answers are checked, failures get name, function and time.

use super::check;
use super::crash::{self, Names};
use super::elements::Elements;
use std::cell::Cell;
use std::time::{Duration, Instant as Clock};
use terraglue_diagnostics::error::{Error, Result};
use terraglue_subsystem::{
    Action, Batch, BodyState, Capabilities, Energy, Error as Failure, Estimate, FieldInfo, FieldTile, Input,
    Kind, Law, Level, Motion, Response, Scene, Step, Subsystem, Values, ValuesMut, Variable,
};

/// How far a trial went.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Progress {
    /// To t + h.
    Complete,
    /// It ended early: all sides repeat the trial up to this time.
    Early {
        /// Simulated time reached, s; later than the start of the step.
        reached_s: f64,
    },
}

/// Answer to `set` and `act`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Reply {
    /// Done.
    Accepted,
    /// Not acceptable, and why; nothing has changed.
    Refused(String),
}

/// A subsystem of a run. What no step asks for lies apart: the cost of many cheap subsystems is that of their memory.
pub struct Instance {
    subsystem: Box<dyn Subsystem>,
    time_s: Cell<f64>,
    dead: Cell<bool>,
    /// Whether its calls are timed, and what they took.
    watched: bool,
    cost: Duration,
    kind: Kind,
    /// Whether variables are arrays.
    arrays: bool,
    about: Box<InstanceInfo>,
}

/// What an instance is.
struct InstanceInfo {
    names: Names,
    capabilities: Capabilities,
    scene: Scene,
    elements: Option<Elements>,
}

impl Instance {
    /// Takes a subsystem under supervision; `name` is that of the scenario.
    pub fn new(name: &str, module: &str, kind: Kind, subsystem: Box<dyn Subsystem>) -> Self {
        let about = InstanceInfo {
            names: Names { instance: name.to_owned(), module: module.to_owned() },
            capabilities: subsystem.capabilities(),
            scene: subsystem.scene(),
            elements: Elements::of(subsystem.variables()),
        };
        Self {
            arrays: about.elements.is_some(),
            about: Box::new(about),
            kind,
            subsystem,
            time_s: Cell::new(0.0),
            dead: Cell::new(false),
            watched: false,
            cost: Duration::ZERO,
        }
    }

    /// Times its calls from now on.
    pub fn watch(&mut self) {
        self.watched = true;
    }

    /// Counts what its calls take from here on.
    pub fn forget_cost(&mut self) {
        self.cost = Duration::ZERO;
    }

    /// What its calls in steps took while it was watched.
    pub fn cost(&self) -> Duration {
        self.cost
    }

    #[inline]
    fn begin(&self) -> Option<Clock> {
        self.watched.then(Clock::now)
    }

    #[inline]
    fn charge(&mut self, start: Option<Clock>) {
        if let Some(start) = start {
            self.cost += start.elapsed();
        }
    }

    /// The same around the subsystem that `wrap` makes of it.
    pub fn wrapped(mut self, wrap: impl FnOnce(Box<dyn Subsystem>) -> Box<dyn Subsystem>) -> Self {
        self.subsystem = wrap(self.subsystem);
        self
    }

    /// Name in the scenario.
    pub fn name(&self) -> &str {
        &self.about.names.instance
    }

    /// Module name.
    pub fn module(&self) -> &str {
        &self.about.names.module
    }

    /// Kind.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// What it can do.
    pub fn capabilities(&self) -> Capabilities {
        self.about.capabilities
    }

    /// Bodies and shapes.
    pub fn scene(&self) -> &Scene {
        &self.about.scene
    }

    /// For observers: committed values only.
    pub fn subsystem(&self) -> &dyn Subsystem {
        self.subsystem.as_ref()
    }

    /// An error of this instance in a function of the interface at the last time it was called with, s.
    #[cold]
    pub fn error(&self, function: &'static str, message: impl Into<String>) -> Error {
        Error::Module {
            subsystem: self.about.names.instance.clone(),
            module: self.about.names.module.clone(),
            function,
            time_s: self.time_s.get(),
            message: message.into(),
        }
    }

    #[cold]
    fn failed(&self, function: &'static str, failure: Failure) -> Error {
        let text = match failure {
            Failure::Fatal(text) => {
                self.dead.set(true);
                text
            }
            other => other.to_string(),
        };
        self.error(function, text)
    }

    /// Whether it failed for good.
    pub fn has_failed(&self) -> bool {
        self.dead.get()
    }

    /// Whether it may still be called.
    #[inline]
    fn alive(&self, function: &'static str) -> Result {
        match self.dead.get() {
            true => Err(self.is_dead(function)),
            false => {
                crash::note(&self.about.names, function, self.time_s.get());
                Ok(())
            }
        }
    }

    #[cold]
    fn is_dead(&self, function: &'static str) -> Error {
        self.error(function, "not called: it failed for good before")
    }

    #[inline]
    fn outcome<T>(&self, function: &'static str, result: terraglue_subsystem::Result<T>) -> Result<T> {
        result.map_err(|failure| self.failed(function, failure))
    }

    #[inline]
    fn all_finite(&self, function: &'static str, wrong: Option<String>) -> Result {
        wrong.map_or(Ok(()), |text| Err(self.error(function, text)))
    }

    /// Paper, step 1. X and V must be answered, by a soil T too.
    pub fn set_ports(&mut self, step: &Step, laws: &mut [Law], now: &mut Response) -> Result {
        const NAME: &str = "set_ports";
        self.time_s.set(step.t);
        self.alive(NAME)?;
        prepare(now);
        (now.reached, now.flags) = (step.t + step.h, 0);
        let start = self.begin();
        let result = self.subsystem.set_ports(step, laws, now);
        self.charge(start);
        self.outcome(NAME, result)?;
        self.all_finite(NAME, check::packed(step, "x", now.x))?;
        self.all_finite(NAME, check::packed(step, "v", now.v))?;
        if self.kind == Kind::Soil {
            self.all_finite(NAME, check::packed(step, "t", now.t))?;
        }
        match laws.iter().position(|l| l.mu.is_nan() || l.t_min.is_nan() || l.t_max.is_nan()) {
            Some(p) => Err(self.error(NAME, format!("the law of port {p} is NaN"))),
            None => Ok(()),
        }
    }

    /// Paper, step 2.
    pub fn estimate_forces(&mut self, step: &Step, partner: &Motion, out: &mut Estimate) -> Result<Progress> {
        const NAME: &str = "estimate_forces";
        self.time_s.set(step.t);
        self.alive(NAME)?;
        for vector in [&mut *out.t_star, &mut *out.x_free, &mut *out.g] {
            vector.fill(f64::NAN);
        }
        out.active.fill(0);
        let start = self.begin();
        let result = self.subsystem.estimate_forces(step, partner, out);
        self.charge(start);
        match result {
            Err(Failure::Discard { reached }) => return self.early(NAME, step, reached),
            result => self.outcome(NAME, result)?,
        }
        self.all_finite(NAME, check::packed(step, "t_star", out.t_star))?;
        self.all_finite(NAME, check::packed(step, "x_free", out.x_free))?;
        self.all_finite(NAME, check::matrix(step.n as usize, "g", out.g))?;
        Ok(Progress::Complete)
    }

    /// Paper, step 3.
    pub fn solve_compatibility(
        &mut self,
        step: &Step,
        estimate: &Estimate,
        out: &mut Response,
    ) -> Result<Progress> {
        self.trial("solve_compatibility", step, out, |s, out| s.solve_compatibility(step, estimate, out))
    }

    /// Paper, steps 3 and 4.
    #[inline]
    pub fn advance(&mut self, step: &Step, input: &Input, out: &mut Response) -> Result<Progress> {
        self.trial("advance", step, out, |s, out| s.advance(step, input, out))
    }

    /// Trials under several wrenches in one exchange.
    pub fn advance_batch(&mut self, step: &Step, t: &[f64], out: &mut Batch) -> Result<Progress> {
        const NAME: &str = "advance_batch";
        self.time_s.set(step.t);
        self.alive(NAME)?;
        for vector in [&mut *out.x, &mut *out.v, &mut *out.a, &mut *out.t] {
            vector.fill(f64::NAN);
        }
        out.reached = step.t + step.h;
        let start = self.begin();
        let result = self.subsystem.advance_batch(step, t, out);
        self.charge(start);
        match result {
            Err(Failure::Discard { reached }) => return self.early(NAME, step, reached),
            result => self.outcome(NAME, result)?,
        }
        for (vector, values) in [("x", &*out.x), ("v", &*out.v), ("a", &*out.a)] {
            for values in values.chunks_exact((step.n as usize).max(1)) {
                self.all_finite(NAME, check::packed(step, vector, values))?;
            }
        }
        let end = step.t + step.h;
        if out.reached < end - 1e-9 * step.h || out.reached.is_nan() {
            return self.early(NAME, step, out.reached);
        }
        Ok(Progress::Complete)
    }

    /// Runs a trial on vectors filled with NaN and looks for what stayed so.
    #[inline]
    fn trial(
        &mut self,
        name: &'static str,
        step: &Step,
        out: &mut Response,
        call: impl FnOnce(&mut dyn Subsystem, &mut Response) -> terraglue_subsystem::Result,
    ) -> Result<Progress> {
        self.time_s.set(step.t);
        self.alive(name)?;
        let end = step.t + step.h;
        (out.reached, out.flags) = (end, 0);
        if step.n != 0 {
            prepare(out);
        }
        let start = self.begin();
        let result = call(self.subsystem.as_mut(), out);
        self.charge(start);
        if result.is_err() || step.n != 0 || out.reached.is_nan() || out.reached < end - 1e-9 * step.h {
            return self.look_at(name, step, result, out);
        }
        Ok(Progress::Complete)
    }

    /// What a trial was that had ports or did not go as it should.
    #[inline(never)]
    fn look_at(
        &self,
        name: &'static str,
        step: &Step,
        result: terraglue_subsystem::Result,
        out: &mut Response,
    ) -> Result<Progress> {
        if let Err(Failure::Discard { reached }) = result {
            out.reached = reached;
            return self.early(name, step, reached);
        }
        self.outcome(name, result)?;
        let answers = [("x", &*out.x), ("v", &*out.v), ("a", &*out.a), ("t", &*out.t)];
        for (vector, values) in answers.into_iter().filter(|_| step.n != 0) {
            self.all_finite(name, check::packed(step, vector, values))?;
        }
        match out.reached >= step.t + step.h - 1e-9 * step.h {
            true => Ok(Progress::Complete),
            false => self.early(name, step, out.reached),
        }
    }

    #[cold]
    fn early(&self, name: &'static str, step: &Step, reached: f64) -> Result<Progress> {
        if reached > step.t && reached < step.t + step.h {
            return Ok(Progress::Early { reached_s: reached });
        }
        let message = format!("ended early at t = {reached} s, outside the step of h = {} s", step.h);
        Err(self.error(name, message))
    }

    /// Derivatives at the last trial.
    pub fn interface_jacobian(&mut self, step: &Step, level: Level, out: &mut [f64]) -> Result {
        const NAME: &str = "interface_jacobian";
        self.alive(NAME)?;
        out.fill(f64::NAN);
        let start = self.begin();
        let result = self.subsystem.interface_jacobian(step, level, out);
        self.charge(start);
        self.outcome(NAME, result)?;
        self.all_finite(NAME, check::matrix(step.n as usize, "the derivative", out))
    }

    /// Paper, step 5.
    #[inline]
    pub fn commit(&mut self, step: &Step, t: &[f64], partner: &Motion) -> Result {
        self.alive("commit")?;
        let start = self.begin();
        let result = self.subsystem.commit(step, t, partner);
        self.charge(start);
        if let Err(failure) = result {
            return Err(self.failed("commit", failure));
        }
        self.time_s.set(step.t + step.h);
        Ok(())
    }

    /// The committed state into a numbered slot.
    pub fn save_state(&mut self, slot: u32) -> Result {
        self.alive("save_state")?;
        let result = self.subsystem.save_state(slot);
        self.outcome("save_state", result)
    }

    /// Back to the state of a slot.
    pub fn restore_state(&mut self, slot: u32) -> Result {
        self.alive("restore_state")?;
        let result = self.subsystem.restore_state(slot);
        self.outcome("restore_state", result)
    }

    /// The committed state as bytes.
    pub fn serialize(&self) -> Result<Vec<u8>> {
        self.alive("serialize")?;
        self.outcome("serialize", self.subsystem.serialize())
    }

    /// Back to a state made by `serialize`.
    pub fn deserialize(&mut self, bytes: &[u8]) -> Result {
        self.alive("deserialize")?;
        let result = self.subsystem.deserialize(bytes);
        self.outcome("deserialize", result)
    }

    /// All variables; an array is shown as its elements.
    pub fn variables(&self) -> &[Variable] {
        self.elements().map_or_else(|| self.subsystem.variables(), |e| &e.variables)
    }

    #[inline]
    fn elements(&self) -> Option<&Elements> {
        if self.arrays { self.about.elements.as_ref() } else { None }
    }

    /// Numbers of the elements of an array among [`Instance::variables`]; that of a scalar itself.
    pub fn elements_of(&self, id: u32) -> Vec<u32> {
        let elements: Vec<u32> = self.elements().into_iter().flat_map(|e| e.of_array(id)).collect();
        if elements.is_empty() { vec![id] } else { elements }
    }

    /// Committed values as they are.
    #[inline]
    pub fn peek(&self, ids: &[u32], out: ValuesMut) -> terraglue_subsystem::Result {
        match self.elements() {
            None => self.subsystem.get(ids, out),
            Some(elements) => elements.get(self.subsystem.as_ref(), ids, out),
        }
    }

    /// Committed values. Numbers that are not finite are an error.
    #[inline]
    pub fn get(&self, ids: &[u32], out: ValuesMut) -> Result {
        self.alive("get")?;
        let ValuesMut::F64(values) = out else { return self.outcome("get", self.peek(ids, out)) };
        match &mut *values {
            [value] => *value = f64::NAN,
            all => all.fill(f64::NAN),
        }
        if let Err(failure) = self.peek(ids, ValuesMut::F64(values)) {
            return Err(self.failed("get", failure));
        }
        match values.iter().position(|v| v.is_nan()) {
            Some(k) => Err(self.is_nan(ids, k)),
            None => Ok(()),
        }
    }

    #[cold]
    fn is_nan(&self, ids: &[u32], element: usize) -> Error {
        self.error("get", self.nan_variable(ids, element))
    }

    fn nan_variable(&self, ids: &[u32], element: usize) -> String {
        let mut first = 0;
        for id in ids {
            let mut all = self.variables().iter().chain(self.subsystem.variables());
            let Some(variable) = all.find(|v| v.id == *id) else { break };
            first += variable.len();
            if element < first {
                return format!("the variable `{}` is NaN", variable.name);
            }
        }
        format!("value {element} is NaN")
    }

    /// New values, or why not.
    #[inline]
    pub fn set(&mut self, ids: &[u32], values: Values) -> Result<Reply> {
        self.alive("set")?;
        let result = if self.arrays
            && let Some(elements) = &self.about.elements
        {
            elements.set(self.subsystem.as_mut(), ids, values)
        } else {
            self.subsystem.set(ids, values)
        };
        self.reply("set", result)
    }

    /// d(unknowns)/d(known) of f64 variables where the subsystem knows it; false where it must be tried.
    pub fn derivative(&self, unknowns: &[u32], known: u32, out: &mut [f64]) -> Result<bool> {
        const NAME: &str = "directional_derivative";
        self.alive(NAME)?;
        let mut of_element = unknowns.iter().chain([&known]);
        if self.elements().is_some_and(|e| of_element.any(|id| e.has(*id))) {
            return Ok(false);
        }
        out.fill(f64::NAN);
        match self.subsystem.directional_derivative(unknowns, &[known], &[1.0], out) {
            Err(Failure::Unsupported) => Ok(false),
            result => {
                self.outcome(NAME, result)?;
                Ok(out.iter().all(|x| x.is_finite()))
            }
        }
    }

    /// All actions.
    pub fn actions(&self) -> &[Action] {
        self.subsystem.actions()
    }

    /// Does an action; `arguments` is a JSON object.
    pub fn act(&mut self, action: &str, arguments: &str) -> Result<Reply> {
        self.alive("act")?;
        let result = self.subsystem.act(action, arguments);
        self.reply("act", result)
    }

    #[inline]
    fn reply(&self, function: &'static str, result: terraglue_subsystem::Result) -> Result<Reply> {
        match result {
            Ok(()) => Ok(Reply::Accepted),
            Err(failure) => self.not_accepted(function, failure),
        }
    }

    #[cold]
    fn not_accepted(&self, function: &'static str, failure: Failure) -> Result<Reply> {
        match failure {
            Failure::Refused(reason) => Ok(Reply::Refused(reason)),
            failure => Err(self.failed(function, failure)),
        }
    }

    /// Time of the next event known beforehand, s; ∞: none.
    pub fn next_event_time(&self) -> Result<f64> {
        self.alive("next_event_time")?;
        let t = self.subsystem.next_event_time();
        if t.is_nan() { Err(self.error("next_event_time", "answered NaN")) } else { Ok(t) }
    }

    /// Committed states of the bodies; all must be finite.
    pub fn body_states(&self, out: &mut [BodyState]) -> Result {
        self.alive("body_states")?;
        let result = self.subsystem.body_states(out);
        self.outcome("body_states", result)?;
        let numbers = |s: &BodyState| {
            let pose = s.world_from_body;
            let all = pose.position.into_iter().chain(pose.orientation).chain(s.linear_velocity);
            all.chain(s.angular_velocity).all(f64::is_finite)
        };
        match out.iter().position(|s| !numbers(s)) {
            Some(k) => {
                let body = self.about.scene.bodies.get(k).map_or("?", |b| &b.name);
                Err(self.error("body_states", format!("the state of body `{body}` is not finite")))
            }
            None => Ok(()),
        }
    }

    /// Fields over the ground.
    pub fn fields(&self) -> &[FieldInfo] {
        self.subsystem.fields()
    }

    /// A tile of a field.
    pub fn field_tile(&self, field: usize, a: u32, b: u32) -> Result<FieldTile<'_>> {
        self.alive("field_tile")?;
        self.outcome("field_tile", self.subsystem.field_tile(field, a, b))
    }

    /// Energies of the committed state; what is unknown is not a number.
    pub fn energy(&self) -> Result<Energy> {
        self.alive("energy")?;
        let e = self.subsystem.energy();
        let all = [e.kinetic, e.potential, e.dissipated, e.port_work, e.actuator_work, e.electrical];
        if all.iter().all(|v| !v.is_infinite()) {
            return Ok(e);
        }
        Err(self.error("energy", "an energy is infinite"))
    }
}

impl Drop for InstanceInfo {
    fn drop(&mut self) {
        crash::forget(&self.names);
    }
}

/// Fills a response with NaN, to find what a subsystem does not answer.
#[inline(never)]
fn prepare(out: &mut Response) {
    for vector in [&mut *out.x, &mut *out.v, &mut *out.a, &mut *out.t] {
        vector.fill(f64::NAN);
    }
}
