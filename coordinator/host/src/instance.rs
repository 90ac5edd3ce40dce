//! An instance under supervision: answers are checked, failures get name, function and time.

use super::check;
use super::elements::Elements;
use super::supervision::Supervision;
use std::time::{Duration, Instant as Clock};
use terraglue_diagnostics::error::{Error, Result};
use terraglue_subsystem::{
    Action, Batch, BodyState, Capabilities, Energy, Error as Failure, Estimate, FieldInfo, FieldTile, Input,
    Kind, Law, Level, Message, Motion, Response, Scene, Step, Subsystem, Values, ValuesMut, Variable, World,
};

/// Extent of a trial.
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

/// A subsystem of a run. Fields that no step reads lie apart: the cost of many cheap subsystems is that of their memory.
pub struct Instance {
    subsystem: Box<dyn Subsystem>,
    supervision: Supervision,
    watch: CallWatch,
    kind: Kind,
    /// Whether variables are arrays.
    arrays: bool,
    about: Box<InstanceInfo>,
}

/// Properties of an instance.
struct InstanceInfo {
    capabilities: Capabilities,
    scene: Scene,
    elements: Option<Elements>,
}

/// Times calls once it was started.
#[derive(Default)]
struct CallWatch {
    runs: bool,
    cost: Duration,
}

impl CallWatch {
    #[inline]
    fn begin(&self) -> Option<Clock> {
        self.runs.then(Clock::now)
    }

    #[inline]
    fn charge(&mut self, start: Option<Clock>) {
        if let Some(start) = start {
            self.cost += start.elapsed();
        }
    }
}

/// Quantity with respect to which derivatives are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum By {
    /// A variable.
    Variable(u32),
    /// Simulated time: per second.
    Time,
}

impl Instance {
    /// Takes a subsystem under supervision; `name` is that of the scenario.
    pub fn new(name: &str, module: &str, kind: Kind, subsystem: Box<dyn Subsystem>) -> Self {
        let about = InstanceInfo {
            capabilities: subsystem.capabilities(),
            scene: subsystem.scene(),
            elements: Elements::of(subsystem.variables()),
        };
        Self {
            arrays: about.elements.is_some(),
            about: Box::new(about),
            kind,
            subsystem,
            supervision: Supervision::new(name, module),
            watch: CallWatch::default(),
        }
    }

    /// Times its calls from now on.
    pub fn watch(&mut self) {
        self.watch.runs = true;
    }

    /// Counts what its calls take from here on.
    pub fn forget_cost(&mut self) {
        self.watch.cost = Duration::ZERO;
    }

    /// Time of its calls in steps while it was watched.
    pub fn cost(&self) -> Duration {
        self.watch.cost
    }

    /// The same around the subsystem that `wrap` makes of it.
    pub fn wrapped(mut self, wrap: impl FnOnce(Box<dyn Subsystem>) -> Box<dyn Subsystem>) -> Self {
        self.subsystem = wrap(self.subsystem);
        self
    }

    /// Name in the scenario.
    pub fn name(&self) -> &str {
        &self.supervision.names().instance
    }

    /// Module name.
    pub fn module(&self) -> &str {
        &self.supervision.names().module
    }

    /// Kind.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// Its capabilities.
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
        self.supervision.error(function, message)
    }

    /// Whether it failed for good.
    pub fn has_failed(&self) -> bool {
        self.supervision.has_failed()
    }

    /// Paper, step 1. X and V must be answered, by a soil T too.
    ///
    /// # Errors
    /// [`Error::Module`]: the subsystem failed, or failed for good before, or an answer or law is not finite.
    pub fn set_ports(&mut self, step: &Step, laws: &mut [Law], now: &mut Response) -> Result {
        const NAME: &str = "set_ports";
        self.supervision.time_s.set(step.t);
        self.supervision.alive(NAME)?;
        prepare(now);
        (now.reached, now.flags) = (step.t + step.h, 0);
        let start = self.watch.begin();
        let result = self.subsystem.set_ports(step, laws, now);
        self.watch.charge(start);
        self.supervision.outcome(NAME, result)?;
        self.supervision.all_finite(NAME, check::packed(step, "x", now.x))?;
        self.supervision.all_finite(NAME, check::packed(step, "v", now.v))?;
        if self.kind == Kind::Soil {
            self.supervision.all_finite(NAME, check::packed(step, "t", now.t))?;
        }
        match laws.iter().position(|l| l.mu.is_nan() || l.t_min.is_nan() || l.t_max.is_nan()) {
            Some(p) => Err(self.error(NAME, format!("the law of port {p} is NaN"))),
            None => Ok(()),
        }
    }

    /// Paper, step 2.
    ///
    /// # Errors
    /// [`Error::Module`]: the subsystem failed, or failed for good before, or an answer is not finite.
    pub fn estimate_forces(&mut self, step: &Step, partner: &Motion, out: &mut Estimate) -> Result<Progress> {
        const NAME: &str = "estimate_forces";
        self.supervision.time_s.set(step.t);
        self.supervision.alive(NAME)?;
        for vector in [&mut *out.t_star, &mut *out.x_free, &mut *out.g] {
            vector.fill(f64::NAN);
        }
        out.active.fill(0);
        let start = self.watch.begin();
        let result = self.subsystem.estimate_forces(step, partner, out);
        self.watch.charge(start);
        match result {
            Err(Failure::Discard { reached }) => return early(&self.supervision, NAME, step, reached),
            result => self.supervision.outcome(NAME, result)?,
        }
        self.supervision.all_finite(NAME, check::packed(step, "t_star", out.t_star))?;
        self.supervision.all_finite(NAME, check::packed(step, "x_free", out.x_free))?;
        self.supervision.all_finite(NAME, check::matrix(step.n as usize, "g", out.g))?;
        Ok(Progress::Complete)
    }

    /// Paper, step 3.
    ///
    /// # Errors
    /// [`Error::Module`]: the subsystem failed, or failed for good before, or an answer is not finite.
    pub fn solve_compatibility(
        &mut self,
        step: &Step,
        estimate: &Estimate,
        out: &mut Response,
    ) -> Result<Progress> {
        self.trial("solve_compatibility", step, out, |s, out| s.solve_compatibility(step, estimate, out))
    }

    /// Paper, steps 3 and 4.
    ///
    /// # Errors
    /// [`Error::Module`]: the subsystem failed, or failed for good before, or an answer is not finite.
    #[inline]
    pub fn advance(&mut self, step: &Step, input: &Input, out: &mut Response) -> Result<Progress> {
        self.trial("advance", step, out, |s, out| s.advance(step, input, out))
    }

    /// Trials under several wrenches in one exchange.
    ///
    /// # Errors
    /// [`Error::Module`]: the subsystem failed, or failed for good before, or an answer is not finite.
    pub fn advance_batch(&mut self, step: &Step, t: &[f64], out: &mut Batch) -> Result<Progress> {
        const NAME: &str = "advance_batch";
        self.supervision.time_s.set(step.t);
        self.supervision.alive(NAME)?;
        for vector in [&mut *out.x, &mut *out.v, &mut *out.a, &mut *out.t] {
            vector.fill(f64::NAN);
        }
        out.reached = step.t + step.h;
        let start = self.watch.begin();
        let result = self.subsystem.advance_batch(step, t, out);
        self.watch.charge(start);
        match result {
            Err(Failure::Discard { reached }) => return early(&self.supervision, NAME, step, reached),
            result => self.supervision.outcome(NAME, result)?,
        }
        for (vector, values) in [("x", &*out.x), ("v", &*out.v), ("a", &*out.a)] {
            for values in values.chunks_exact((step.n as usize).max(1)) {
                self.supervision.all_finite(NAME, check::packed(step, vector, values))?;
            }
        }
        let end = step.t + step.h;
        if out.reached < end - 1e-9 * step.h || out.reached.is_nan() {
            return early(&self.supervision, NAME, step, out.reached);
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
        self.supervision.time_s.set(step.t);
        self.supervision.alive(name)?;
        let end = step.t + step.h;
        (out.reached, out.flags) = (end, 0);
        if step.n != 0 {
            prepare(out);
        }
        let start = self.watch.begin();
        let result = call(self.subsystem.as_mut(), out);
        self.watch.charge(start);
        if result.is_err() || step.n != 0 || out.reached.is_nan() || out.reached < end - 1e-9 * step.h {
            return self.look_at(name, step, result, out);
        }
        Ok(Progress::Complete)
    }

    /// Data of a trial that had ports or failed.
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
            return early(&self.supervision, name, step, reached);
        }
        self.supervision.outcome(name, result)?;
        let answers = [("x", &*out.x), ("v", &*out.v), ("a", &*out.a), ("t", &*out.t)];
        for (vector, values) in answers.into_iter().filter(|_| step.n != 0) {
            self.supervision.all_finite(name, check::packed(step, vector, values))?;
        }
        match out.reached >= step.t + step.h - 1e-9 * step.h {
            true => Ok(Progress::Complete),
            false => early(&self.supervision, name, step, out.reached),
        }
    }

    /// Derivatives at the last trial.
    ///
    /// # Errors
    /// [`Error::Module`]: the subsystem failed, or failed for good before, or a derivative is not finite.
    pub fn interface_jacobian(&mut self, step: &Step, level: Level, out: &mut [f64]) -> Result {
        const NAME: &str = "interface_jacobian";
        self.supervision.alive(NAME)?;
        out.fill(f64::NAN);
        let start = self.watch.begin();
        let result = self.subsystem.interface_jacobian(step, level, out);
        self.watch.charge(start);
        self.supervision.outcome(NAME, result)?;
        self.supervision.all_finite(NAME, check::matrix(step.n as usize, "the derivative", out))
    }

    /// Paper, step 5.
    ///
    /// # Errors
    /// [`Error::Module`]: the subsystem failed, or failed for good before.
    #[inline]
    pub fn commit(&mut self, step: &Step, t: &[f64], partner: &Motion) -> Result {
        self.supervision.alive("commit")?;
        let start = self.watch.begin();
        let result = self.subsystem.commit(step, t, partner);
        self.watch.charge(start);
        if let Err(failure) = result {
            return Err(self.supervision.failed("commit", failure));
        }
        self.supervision.time_s.set(step.t + step.h);
        Ok(())
    }

    /// The committed state into a numbered slot.
    ///
    /// # Errors
    /// [`Error::Module`]: the subsystem failed, or failed for good before, or it cannot keep its state.
    pub fn save_state(&mut self, slot: u32) -> Result {
        self.supervision.alive("save_state")?;
        let result = self.subsystem.save_state(slot);
        self.supervision.outcome("save_state", result)
    }

    /// Back to the state of a slot.
    ///
    /// # Errors
    /// [`Error::Module`]: the subsystem failed, or failed for good before, or nothing was kept in the slot.
    pub fn restore_state(&mut self, slot: u32) -> Result {
        self.supervision.alive("restore_state")?;
        let result = self.subsystem.restore_state(slot);
        self.supervision.outcome("restore_state", result)
    }

    /// The committed state as bytes.
    ///
    /// # Errors
    /// [`Error::Module`]: the subsystem failed, or failed for good before, or it cannot give its state as bytes.
    pub fn serialize(&self) -> Result<Vec<u8>> {
        self.supervision.alive("serialize")?;
        self.supervision.outcome("serialize", self.subsystem.serialize())
    }

    /// Back to a state made by `serialize`.
    ///
    /// # Errors
    /// [`Error::Module`]: the subsystem failed, or failed for good before, or the bytes are no state of it.
    pub fn deserialize(&mut self, bytes: &[u8]) -> Result {
        self.supervision.alive("deserialize")?;
        let result = self.subsystem.deserialize(bytes);
        self.supervision.outcome("deserialize", result)
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
    ///
    /// # Errors
    /// Errors of the subsystem: an unknown variable, another type.
    #[inline]
    pub fn peek(&self, ids: &[u32], out: ValuesMut) -> terraglue_subsystem::Result {
        match self.elements() {
            None => self.subsystem.get(ids, out),
            Some(elements) => elements.get(self.subsystem.as_ref(), ids, out),
        }
    }

    /// Committed values. Numbers that are not finite are an error.
    ///
    /// # Errors
    /// [`Error::Module`]: the subsystem failed, or failed for good before, or a value is NaN.
    #[inline]
    pub fn get(&self, ids: &[u32], out: ValuesMut) -> Result {
        self.supervision.alive("get")?;
        let ValuesMut::F64(values) = out else { return self.supervision.outcome("get", self.peek(ids, out)) };
        match &mut *values {
            [value] => *value = f64::NAN,
            all => all.fill(f64::NAN),
        }
        if let Err(failure) = self.peek(ids, ValuesMut::F64(values)) {
            return Err(self.supervision.failed("get", failure));
        }
        match values.iter().position(|v| v.is_nan()) {
            Some(k) => Err(self.error("get", nan_variable(self, ids, k))),
            None => Ok(()),
        }
    }

    /// New values, or why not.
    ///
    /// # Errors
    /// [`Error::Module`]: the subsystem failed, or failed for good before; values that it does not accept are
    /// [`Reply::Refused`].
    #[inline]
    pub fn set(&mut self, ids: &[u32], values: Values) -> Result<Reply> {
        self.supervision.alive("set")?;
        let result = if self.arrays
            && let Some(elements) = &self.about.elements
        {
            elements.set(self.subsystem.as_mut(), ids, values)
        } else {
            self.subsystem.set(ids, values)
        };
        reply(&self.supervision, "set", result)
    }

    /// Derivatives of f64 variables by another one or by time, where the subsystem knows them; false where it does not.
    ///
    /// # Errors
    /// [`Error::Module`]: the subsystem failed, or failed for good before.
    pub fn derivatives(&self, of: &[u32], by: By, out: &mut [f64]) -> Result<bool> {
        let (name, known) = match by {
            By::Variable(id) => ("directional_derivative", Some(id)),
            By::Time => ("output_derivatives", None),
        };
        self.supervision.alive(name)?;
        let mut of_element = of.iter().chain(&known);
        if self.elements().is_some_and(|e| of_element.any(|id| e.has(*id))) {
            return Ok(false);
        }
        out.fill(f64::NAN);
        let told = match known {
            Some(id) => self.subsystem.directional_derivative(of, &[id], &[1.0], out),
            None => self.subsystem.output_derivatives(of, out),
        };
        match told {
            Err(Failure::Unsupported) => Ok(false),
            result => {
                self.supervision.outcome(name, result)?;
                Ok(out.iter().all(|x| x.is_finite()))
            }
        }
    }

    /// All actions.
    pub fn actions(&self) -> &[Action] {
        self.subsystem.actions()
    }

    /// Does an action; `arguments` is a JSON object.
    ///
    /// # Errors
    /// [`Error::Module`]: the subsystem failed, or failed for good before; an action that it does not accept is
    /// [`Reply::Refused`].
    pub fn act(&mut self, action: &str, arguments: &str) -> Result<Reply> {
        self.supervision.alive("act")?;
        let result = self.subsystem.act(action, arguments);
        reply(&self.supervision, "act", result)
    }

    /// Time of the next event known beforehand, s; ∞: none.
    ///
    /// # Errors
    /// [`Error::Module`]: the subsystem failed, or failed for good before, or the time is NaN.
    pub fn next_event_time(&self) -> Result<f64> {
        self.supervision.alive("next_event_time")?;
        let t = self.subsystem.next_event_time();
        if t.is_nan() { Err(self.error("next_event_time", "answered NaN")) } else { Ok(t) }
    }

    /// Committed states of the bodies; all must be finite.
    ///
    /// # Errors
    /// [`Error::Module`]: the subsystem failed, or failed for good before, or a state is not finite.
    pub fn body_states(&self, out: &mut [BodyState]) -> Result {
        self.supervision.alive("body_states")?;
        let result = self.subsystem.body_states(out);
        self.supervision.outcome("body_states", result)?;
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
    ///
    /// # Errors
    /// [`Error::Module`]: the subsystem failed, or failed for good before, or there is no such tile.
    pub fn field_tile(&self, field: usize, a: u32, b: u32) -> Result<FieldTile<'_>> {
        self.supervision.alive("field_tile")?;
        self.supervision.outcome("field_tile", self.subsystem.field_tile(field, a, b))
    }

    /// Energies of the committed state; what is unknown is not a number.
    ///
    /// # Errors
    /// [`Error::Module`]: the subsystem failed, or failed for good before, or an energy is infinite.
    pub fn energy(&self) -> Result<Energy> {
        self.supervision.alive("energy")?;
        let e = self.subsystem.energy();
        let all = [e.kinetic, e.potential, e.dissipated, e.port_work, e.actuator_work, e.electrical];
        if all.iter().all(|v| !v.is_infinite()) {
            return Ok(e);
        }
        Err(self.error("energy", "an energy is infinite"))
    }
}

/// Shows an instance the committed world.
///
/// # Errors
/// [`Error::Module`]: the subsystem failed, or failed for good before.
pub fn observe(instance: &mut Instance, step: &Step, world: &dyn World) -> Result {
    const NAME: &str = "observe";
    instance.supervision.alive(NAME)?;
    let start = instance.watch.begin();
    let result = instance.subsystem.observe(step, world);
    instance.watch.charge(start);
    instance.supervision.outcome(NAME, result)
}

/// Which shapes of an instance are shown.
///
/// # Errors
/// [`Error::Module`]: the subsystem failed, or failed for good before.
pub fn shape_visibility(instance: &Instance, out: &mut [bool]) -> Result {
    const NAME: &str = "shape_visibility";
    instance.supervision.alive(NAME)?;
    instance.supervision.outcome(NAME, instance.subsystem.shape_visibility(out))
}

/// The message that the last step of an instance made on a stream.
///
/// # Errors
/// [`Error::Module`]: the subsystem failed, or failed for good before, or the time of the message is not finite.
pub fn message(instance: &Instance, k: usize) -> Result<Option<Message<'_>>> {
    const NAME: &str = "stream";
    instance.supervision.alive(NAME)?;
    let message = instance.supervision.outcome(NAME, instance.subsystem.stream(k))?;
    if message.is_none_or(|m| m.time.is_finite()) {
        return Ok(message);
    }
    let name = instance.subsystem.streams().get(k).map_or("?", |s| &s.name);
    Err(instance.error(NAME, format!("the time of a message on `{name}` is not finite")))
}

/// A trial that ended before the end of its step.
#[cold]
fn early(supervision: &Supervision, name: &'static str, step: &Step, reached: f64) -> Result<Progress> {
    if reached > step.t && reached < step.t + step.h {
        return Ok(Progress::Early { reached_s: reached });
    }
    let message = format!("ended early at t = {reached} s, outside the step of h = {} s", step.h);
    Err(supervision.error(name, message))
}

#[inline]
fn reply(
    supervision: &Supervision,
    function: &'static str,
    result: terraglue_subsystem::Result,
) -> Result<Reply> {
    match result {
        Ok(()) => Ok(Reply::Accepted),
        Err(failure) => not_accepted(supervision, function, failure),
    }
}

#[cold]
fn not_accepted(supervision: &Supervision, function: &'static str, failure: Failure) -> Result<Reply> {
    match failure {
        Failure::Refused(reason) => Ok(Reply::Refused(reason)),
        failure => Err(supervision.failed(function, failure)),
    }
}

/// Which of the variables asked for answered NaN at an element.
#[cold]
fn nan_variable(instance: &Instance, ids: &[u32], element: usize) -> String {
    let mut first = 0;
    for id in ids {
        let mut all = instance.variables().iter().chain(instance.subsystem.variables());
        let Some(variable) = all.find(|v| v.id == *id) else { break };
        first += variable.len();
        if element < first {
            return format!("the variable `{}` is NaN", variable.name);
        }
    }
    format!("value {element} is NaN")
}

/// Fills a response with NaN, to find what a subsystem does not answer.
#[inline(never)]
fn prepare(out: &mut Response) {
    for vector in [&mut *out.x, &mut *out.v, &mut *out.a, &mut *out.t] {
        vector.fill(f64::NAN);
    }
}
