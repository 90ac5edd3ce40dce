//! An FMU as a subsystem: trials by its saved states, values by name, every error with the messages of the FMU.

mod elements;
pub(crate) mod opening;

use super::array_starts::ArrayStarts;
use super::bodies::{Axis, Bodies, terminals};
use super::clocks;
use super::limits;
use super::map::{self, ValueLocation};
use super::rollback;
use super::settings::{OnNan, options, structure};
use serde_json::{Map, Value};
use std::cell::{Cell, RefCell};
use std::path::Path;
use std::sync::Arc;
use terraglue_fmi::description::{ModelDescription, hexadecimal};
use terraglue_fmi::{Advance, Error as FmiError, Fmu, FmuInstance, FmuState, Stepped};
use terraglue_host::TeardownErrors;
use terraglue_scenario::did_you_mean;
use terraglue_subsystem::{
    BodyState, Capabilities, Error, FeedThrough, Host, Input, Law, Level, LogLevel, Motion, Response, Result,
    Scene, Step, Subsystem, ValueType, Values, ValuesMut, Variable,
};

/// An instance of an FMU as a subsystem. Fields that every step reads come first and in this order, on two lines of the
/// cache with the beginning of the instance.
#[repr(C, align(64))]
pub struct FmuSubsystem {
    places: Box<[ValueLocation]>,
    /// Whether a trial was made that is not committed.
    open: bool,
    /// Whether the initialisation is over.
    running: bool,
    /// Whether it has made a step, if only before it went back.
    begun: bool,
    /// Whether any variable is a clock or belongs to one.
    clocks: bool,
    can_go_back: bool,
    has_bodies: bool,
    /// Whether a state was saved to which a run may go back over more than the last step.
    kept: Cell<bool>,
    instance: FmuInstance,
    host: Arc<dyn Host>,
    variables: Vec<Variable>,
    /// State at the start of the step, where the FMU can save it.
    before: FmuState,
    /// Whether it was seen that the FMU comes back to a saved state.
    proved: bool,
    /// States that are kept, each with whether the FMU is initialised in it.
    slots: Vec<(FmuState, bool)>,
    on_nan: OnNan,
    warned: Cell<bool>,
    references: RefCell<Vec<u32>>,
    bodies: Bodies,
    /// Arrays by reference that are being set element by element before the initialisation.
    starts: ArrayStarts,
    feeds_through: bool,
    /// Time of the FMU at t = 0, s.
    start_time_s: f64,
    /// The end that the FMU was given, in its own time, s; ∞: none, or a step beyond it was warned of.
    stop_time_s: f64,
    teardown_errors: TeardownErrors,
}

impl FmuSubsystem {
    /// Opens an FMU, sets `start` and enters initialisation mode; the first step ends it, so that values which are
    /// connected at the start are set while the FMU initialises. Host keys: `on_nan`, `event_mode`, `rollback`, `tolerance`,
    /// `start_time_s`, `stop_time_s`, `log_categories`, `strict`, `trace`, `bodies`.
    ///
    /// # Errors
    /// A defect of the FMU, or a start value that it does not take.
    pub fn new(path: &Path, parameters: &Map<String, Value>, host: Arc<dyn Host>) -> Result<Self> {
        let fmu = Fmu::open(path).map_err(error)?;
        let (options, start) = options(parameters)?;
        opening::warn(&fmu, options.strict, &*host)?;
        opening::warn_of_start(fmu.description(), parameters, &*host);
        let mut instance =
            FmuInstance::instantiate(&fmu, opening::of_instance(&options, &host)?).map_err(error)?;
        let (structure, start) = structure(instance.description(), start)?;
        let structure: Vec<(&str, i128)> = structure.iter().map(|(name, n)| (name.as_str(), *n)).collect();
        instance.configure(&structure).map_err(error)?;
        let description = instance.description().clone();
        let capabilities = description.capabilities;
        let (variables, places) = map::variables(&description, options.event_mode && capabilities.event_mode);
        let clocks = clocks::concerned(&places);
        let mut subsystem = Self {
            instance,
            variables,
            clocks,
            places: places.into(),
            has_bodies: false,
            before: FmuState::default(),
            can_go_back: capabilities.state && options.rollback,
            open: false,
            running: false,
            begun: false,
            proved: false,
            slots: (0..host.slots()).map(|_| Default::default()).collect(),
            kept: Cell::new(false),
            on_nan: options.on_nan,
            warned: Cell::new(false),
            references: RefCell::default(),
            bodies: Bodies::default(),
            starts: ArrayStarts::default(),
            feeds_through: feeds_through(&description, &description.initial_unknowns),
            start_time_s: options.start_time_s,
            stop_time_s: options.stop_time_s.unwrap_or(f64::INFINITY),
            teardown_errors: TeardownErrors::default(),
            host,
        };
        for (name, value) in start {
            subsystem.set_start(&name, &value)?;
        }
        std::mem::take(&mut subsystem.starts).set(&subsystem.instance).map_err(error)?;
        subsystem.bodies = bodies(&subsystem, &options.bodies, &description)?;
        subsystem.has_bodies = !subsystem.bodies.is_empty();
        if subsystem.has_bodies && !subsystem.can_go_back {
            let text = "glued bodies need an FMU that can save its state, to repeat a step";
            return Err(Error::Refused(text.into()));
        }
        let tolerance = options.tolerance.or(description.experiment.tolerance);
        let (start, stop) = (options.start_time_s, options.stop_time_s);
        subsystem.instance.enter_initialization(start, stop, tolerance).map_err(error)?;
        Ok(subsystem)
    }

    /// Argument of [`terraglue_host::Library::with_fmus`].
    ///
    /// # Errors
    /// As [`FmuSubsystem::new`].
    pub fn make(
        path: &Path,
        parameters: &Map<String, Value>,
        host: Arc<dyn Host>,
        teardown_errors: TeardownErrors,
    ) -> Result<Box<dyn Subsystem>> {
        Ok(Box::new(Self::new(path, parameters, host)?.with_teardown_errors(teardown_errors)))
    }

    /// Where an error at the end of its life goes.
    pub fn with_teardown_errors(mut self, teardown_errors: TeardownErrors) -> Self {
        self.teardown_errors = teardown_errors;
        self
    }

    fn set_start(&mut self, name: &str, value: &Value) -> Result {
        let Some(k) = self.variables.iter().position(|v| v.name == name) else {
            let hint = did_you_mean(name, self.variables.iter().map(|v| v.name.as_str()));
            let hint = hint.map(|h| format!("; {h}")).unwrap_or_default();
            return Err(Error::Refused(format!("the FMU has no variable `{name}`{hint}")));
        };
        if self.variables[k].effect == terraglue_subsystem::Effect::ReadOnly {
            return Err(Error::Refused(format!("`{name}` of the FMU cannot be set")));
        }
        let v = &self.variables[k];
        let declared = &self.instance.description().variables[self.places[k].variable as usize];
        if let Some(x) = value.as_f64() {
            limits::check(declared, name, &[x]).map_err(error)?;
        }
        let wrong = || Error::Refused(format!("`{name}` of the FMU does not take {value}"));
        let (number, whole, id) = (value.as_f64(), value.as_i64(), [v.id]);
        macro_rules! narrow {
            ($variant:ident) => {
                self.set(&id, Values::$variant(&[whole.and_then(|w| w.try_into().ok()).ok_or_else(wrong)?]))
            };
        }
        match v.value_type {
            ValueType::F64 => self.set(&id, Values::F64(&[number.ok_or_else(wrong)?])),
            ValueType::F32 => self.set(&id, Values::F32(&[number.ok_or_else(wrong)? as f32])),
            ValueType::Bool => self.set(&id, Values::Bool(&[value.as_bool().ok_or_else(wrong)?])),
            ValueType::String => {
                self.set(&id, Values::String(&[value.as_str().ok_or_else(wrong)?.to_owned()]))
            }
            ValueType::Enumeration => {
                // numbers are those of the FMU, as of `fmu run --start`; `set` takes places in the list of items
                let named = value.as_str().and_then(|text| limits::named_item(declared, text));
                let number = named.or(whole.filter(|number| limits::is_item(declared, *number)));
                let none = || Error::Refused(format!("`{name}` = {value}: {}", limits::items(declared)));
                let number = number.ok_or_else(none)?;
                let place = declared.items.iter().position(|(_, item)| *item == number);
                self.set(&id, Values::Enumeration(&[place.map_or(number, |place| place as i64)]))
            }
            ValueType::I8 => narrow!(I8),
            ValueType::I16 => narrow!(I16),
            ValueType::I32 => narrow!(I32),
            ValueType::I64 => narrow!(I64),
            ValueType::U8 => narrow!(U8),
            ValueType::U16 => narrow!(U16),
            ValueType::U32 => narrow!(U32),
            ValueType::U64 => self.set(&id, Values::U64(&[value.as_u64().ok_or_else(wrong)?])),
            ValueType::Binary => {
                let bytes = value.as_str().and_then(hexadecimal).ok_or_else(wrong)?;
                self.set(&id, Values::Binary(&[bytes]))
            }
            ValueType::Clock => Err(wrong()),
        }
    }

    /// Keeps an element of an array until all are known: nothing can be read yet.
    fn start_element(&mut self, id: u32, value: f64) -> Result {
        let place = *self.place(id)?;
        self.starts.give(place.reference, (place.element as usize, place.count as usize), value);
        Ok(())
    }

    /// Once: does the FMU come back to the state before this step?
    fn prove(&mut self, step: &Step, wrench: &[f64]) -> Result {
        if std::mem::replace(&mut self.proved, true) {
            return Ok(());
        }
        let for_good = !self.kept.get();
        let Self { instance, bodies, variables, places, before, start_time_s, .. } = self;
        let number = |(v, place): &(&Variable, &ValueLocation)| {
            let output = v.causality == terraglue_subsystem::Causality::Output;
            output && v.value_type == ValueType::F64 && place.count == 1
        };
        let outputs = variables.iter().zip(places.iter()).filter(number);
        let outputs: Vec<(&str, u32)> = outputs.map(|(v, p)| (v.name.as_str(), p.reference)).collect();
        let short = Advance { t: *start_time_s + step.t, h: step.h, for_good };
        rollback::prove(
            instance,
            before,
            &outputs,
            short,
            |instance| bodies.push(instance, step, wrench, error),
            error,
        )
    }

    /// Prepares a step: ends the initialisation, takes back a trial, saves a state, sets wrenches. Returns whether the step
    /// is to be made then.
    #[inline(never)]
    fn prepare(&mut self, step: &Step, wrench: &[f64], out: &mut Response) -> Result<bool> {
        let begins = !self.running;
        if begins {
            self.instance.exit_initialization().map_err(error)?;
            self.running = true;
        }
        if step.h == 0.0 {
            if self.has_bodies {
                self.bodies.still(&mut self.instance, step, wrench, out, error)?;
            }
            return Ok(false);
        }
        if !std::mem::replace(&mut self.begun, true) {
            opening::warn_of_length(self.instance.description(), step.h, &*self.host);
        }
        if self.open && !self.can_go_back {
            let text =
                "a step had to be repeated, but the FMU cannot save its state; make time.step_s shorter";
            return Err(Error::Failed(text.into()));
        }
        if self.open {
            self.instance.restore(&self.before).map_err(error)?;
        } else {
            self.bodies.forget_trials();
            if self.can_go_back {
                self.instance.save(&mut self.before).map_err(unsaved)?;
            }
        }
        self.open = true;
        if self.clocks && !begins {
            self.instance.clocks_mut().forget_ticks();
        }
        if self.has_bodies {
            self.prove(step, wrench)?;
            self.bodies.push(&mut self.instance, step, wrench, error)?;
        }
        Ok(true)
    }

    /// Why a step was not made to its end.
    #[cold]
    fn stopped(&self, step: &Step, done: terraglue_fmi::Result<Stepped>) -> Error {
        match done {
            Ok(Stepped { reached, .. }) => {
                Error::Failed(format!("the FMU asks for the end of the simulation at t = {reached} s"))
            }
            Err(discard @ FmiError::Discard { .. }) => {
                let variable = self.instance.description().capabilities.variable_step;
                if !self.can_go_back || !variable {
                    let lack = if variable { "save its state" } else { "make steps of another length" };
                    return Error::Failed(format!("{discard}; the step cannot be halved: it cannot {lack}"));
                }
                self.host.log(LogLevel::Info, &discard.to_string());
                Error::Discard { reached: step.t + 0.5 * step.h }
            }
            Err(other) => error(other),
        }
    }

    /// Where one variable lies that is asked for and is no element of an array.
    #[inline]
    fn single(&self, ids: &[u32]) -> Option<&ValueLocation> {
        let [id] = ids else { return None };
        self.places.get(*id as usize).filter(|p| p.count == 1)
    }

    /// Whether a variable may be set now.
    #[inline]
    fn takes(&self, place: &ValueLocation) -> bool {
        !place.structural && (place.live || !self.running)
    }

    fn place(&self, id: u32) -> Result<&ValueLocation> {
        self.places.get(id as usize).ok_or_else(|| Error::Refused(format!("no variable has the number {id}")))
    }

    /// Item values of an enumeration where they are not simply 0, 1, 2, …
    fn items(&self, place: &ValueLocation) -> &[(String, i64)] {
        &self.instance.description().variables[place.variable as usize].items
    }

    #[inline]
    fn check_numbers<T: Copy + Into<f64>>(&self, ids: &[u32], values: &[T]) -> Result {
        match values.iter().position(|v| !(*v).into().is_finite()) {
            None => Ok(()),
            Some(k) => self.not_finite(ids, values[k].into(), k),
        }
    }

    #[cold]
    fn not_finite(&self, ids: &[u32], value: f64, k: usize) -> Result {
        let name = ids.get(k).and_then(|id| self.variables.get(*id as usize)).map_or("?", |v| &v.name);
        let text = format!("the variable `{name}` is {value}");
        match self.on_nan {
            OnNan::Stop => Err(Error::Failed(format!("{text}; on_nan = \"warn\" lets the run go on"))),
            OnNan::Warn => {
                if !self.warned.replace(true) {
                    self.host.log(LogLevel::Warning, &text);
                }
                Ok(())
            }
        }
    }

    /// References of variables that are all scalars; false where one is an element of an array.
    fn collect(&self, ids: &[u32], references: &mut Vec<u32>) -> Result<bool> {
        references.clear();
        for id in ids {
            let place = self.place(*id)?;
            if place.count != 1 {
                return Ok(false);
            }
            references.push(place.reference);
        }
        Ok(true)
    }
}

/// Whether an output, or another one of these, may depend on an input of the same time.
fn feeds_through(
    description: &terraglue_fmi::ModelDescription,
    others: &[terraglue_fmi::description::Unknown],
) -> bool {
    let is_input =
        |k: &usize| description.variables[*k].causality == terraglue_fmi::description::Causality::Input;
    let unknowns = others.iter().chain(&description.outputs);
    let mut all = unknowns.map(|u| u.dependencies.as_ref().is_none_or(|d| d.iter().any(is_input)));
    let inputs = (0..description.variables.len()).any(|k| is_input(&k));
    inputs && all.any(|depends| depends)
}

/// Sets values of which some belong to clocks.
fn set_one_by_one(of: &mut FmuSubsystem, ids: &[u32], values: Values) -> Result {
    let Values::F64(values) = values else {
        return Err(Error::Refused("clocks and what belongs to them is set one by one".into()));
    };
    ids.iter().zip(values).try_for_each(|(id, x)| of.set(&[*id], Values::F64(&[*x])))
}

/// An error of an FMU as an error of a subsystem.
#[cold]
fn error(error: FmiError) -> Error {
    match error {
        FmiError::Call { fatal: true, .. } => Error::Fatal(error.to_string()),
        FmiError::Call { .. } => Error::Failed(error.to_string()),
        other => Error::Refused(other.to_string()),
    }
}

/// The same where the state before a step could not be saved.
#[cold]
fn unsaved(why: FmiError) -> Error {
    match why {
        FmiError::Refused(text) => {
            Error::Refused(format!("{text}; `rollback = false` in its table does without"))
        }
        other => error(other),
    }
}

impl Subsystem for FmuSubsystem {
    fn capabilities(&self) -> Capabilities {
        let c = self.instance.description().capabilities;
        let derivatives = c.tells_derivatives() && self.can_go_back && self.bodies.tell_derivatives();
        let all = [
            (self.can_go_back, Capabilities::RETRY | Capabilities::STATE),
            (c.serialize && !self.clocks, Capabilities::SERIALIZE),
            (!self.bodies.is_empty(), Capabilities::FORCE),
            (self.feeds_through, Capabilities::FEEDTHROUGH),
            (!c.variable_step, Capabilities::FIXED_STEP),
            (derivatives, Capabilities::DERIVATIVES),
            (elements::knows_directional(self), Capabilities::DIRECTIONAL),
            (c.output_derivatives, Capabilities::OUTPUT_DERIVATIVES),
        ];
        let own = all.into_iter().filter(|(has, _)| *has).map(|(_, what)| what);
        own.fold(Capabilities::default(), |set, what| set | what)
    }

    fn feed_through(&self) -> Vec<FeedThrough> {
        // a clock ticks at a communication point, with the values of that time
        if self.clocks { Vec::new() } else { map::feed_through(self.instance.description(), &self.places) }
    }

    fn interface_jacobian(&mut self, step: &Step, level: Level, out: &mut [f64]) -> Result {
        if !self.capabilities().has(Capabilities::DERIVATIVES) {
            return Err(Error::Unsupported);
        }
        self.bodies.jacobian(&self.instance, step, level, out, error)
    }

    fn set_ports(&mut self, step: &Step, _: &mut [Law], now: &mut Response) -> Result {
        self.bodies.check(step)?;
        for values in [&mut *now.x, &mut *now.v, &mut *now.a, &mut *now.t] {
            values.fill(0.0);
        }
        Ok(())
    }

    fn scene(&self) -> Scene {
        self.bodies.scene()
    }

    fn body_states(&self, out: &mut [BodyState]) -> Result {
        self.bodies.states(&self.instance, out, error)
    }

    fn advance(&mut self, step: &Step, input: &Input, out: &mut Response) -> Result {
        let Input::Force { t: wrench, .. } = *input else { return Err(Error::Unsupported) };
        if (step.h == 0.0 || self.open || !self.running || self.clocks || self.can_go_back || self.has_bodies)
            && !self.prepare(step, wrench, out)?
        {
            return Ok(());
        }
        self.open = true;
        let t = self.start_time_s + step.t;
        if t + 0.5 * step.h > self.stop_time_s {
            opening::warn_of_end(std::mem::replace(&mut self.stop_time_s, f64::INFINITY), &*self.host);
        }
        match self.instance.do_step(Advance { t, h: step.h, for_good: !self.kept.get() }) {
            Ok(Stepped { terminate: false, .. }) => {}
            other => return Err(self.stopped(step, other)),
        }
        out.reached = step.t + step.h;
        match self.has_bodies {
            true => self.bodies.pull(&self.instance, step, wrench, out, error),
            false => Ok(()),
        }
    }

    fn commit(&mut self, _: &Step, _: &[f64], _: &Motion) -> Result {
        self.open = false;
        if self.clocks {
            self.instance.clocks_mut().forget_triggers();
        }
        Ok(())
    }

    fn save_state(&mut self, slot: u32) -> Result {
        let (state, running) = self.slots.get_mut(slot as usize).ok_or(Error::Unsupported)?;
        self.kept.set(true);
        *running = self.running;
        self.instance.save(state).map_err(error)
    }

    fn restore_state(&mut self, slot: u32) -> Result {
        let (state, running) = self.slots.get(slot as usize).ok_or(Error::Unsupported)?;
        (self.open, self.running) = (false, *running);
        self.instance.restore(state).map_err(error)
    }

    fn serialize(&self) -> Result<Vec<u8>> {
        self.kept.set(true);
        let mut state = FmuState::default();
        self.instance.save(&mut state).map_err(error)?;
        let bytes = self.instance.serialize(&state).map_err(error);
        self.instance.release(&mut state).map_err(error)?;
        // whether it is initialised is the host's to know
        Ok([&[u8::from(self.running)], bytes?.as_slice()].concat())
    }

    fn deserialize(&mut self, bytes: &[u8]) -> Result {
        let wrong = || Error::Refused("these bytes are no state of an FMU".into());
        let (running, bytes) = bytes.split_first().filter(|(running, _)| **running <= 1).ok_or_else(wrong)?;
        let mut state = FmuState::default();
        self.instance.deserialize(bytes, &mut state).map_err(error)?;
        if *running == 1 && !self.running {
            self.instance.exit_initialization().map_err(error)?;
        }
        let done = self.instance.restore(&state).map_err(error);
        self.instance.release(&mut state).map_err(error)?;
        (self.running, self.open) = (*running == 1, false);
        done
    }

    fn directional_derivative(
        &self,
        unknowns: &[u32],
        knowns: &[u32],
        seed: &[f64],
        out: &mut [f64],
    ) -> Result {
        let (mut z, mut v) = (Vec::new(), Vec::new());
        if !self.instance.description().capabilities.tells_derivatives() {
            return Err(Error::Unsupported);
        }
        if self.collect(unknowns, &mut z)? && self.collect(knowns, &mut v)? {
            return self.instance.directional_derivative(&z, &v, seed, out).map_err(error);
        }
        elements::derivatives_of_arrays(self, unknowns, knowns, seed, out)
    }

    fn output_derivatives(&self, ids: &[u32], out: &mut [f64]) -> Result {
        let mut references = Vec::new();
        if !self.collect(ids, &mut references)? {
            return Err(Error::Unsupported);
        }
        self.instance.output_derivatives(&references, out).map_err(error)
    }

    fn variables(&self) -> &[Variable] {
        &self.variables
    }

    fn get(&self, ids: &[u32], out: ValuesMut) -> Result {
        match (out, self.single(ids)) {
            (ValuesMut::F64(out), Some(place)) => {
                if let Err(failure) = self.instance.get_f64(&[place.reference], out) {
                    return Err(error(failure));
                }
                self.check_numbers(ids, out)
            }
            (out, _) => self.get_all(ids, out),
        }
    }

    fn set(&mut self, ids: &[u32], values: Values) -> Result {
        if self.open && self.can_go_back {
            // a value that is set before a step is repeated belongs to the state at its start
            self.instance.restore(&self.before).map_err(error)?;
            self.open = false;
        }
        match (values, self.single(ids)) {
            (Values::F64(values), Some(place)) if self.takes(place) && !place.clocked => {
                self.instance.set_f64(&[place.reference], values).map_err(error)
            }
            (values, _) => self.set_all(ids, values),
        }
    }
}

impl FmuSubsystem {
    /// Values of any type and number.
    #[inline(never)]
    fn get_all(&self, ids: &[u32], mut out: ValuesMut) -> Result {
        if self.clocks {
            let places = ids.iter().map(|id| self.place(*id)).collect::<Result<Vec<_>>>()?;
            if clocks::get(&self.instance, &places, &mut out, error)? {
                return Ok(());
            }
        }
        let mut references = self.references.borrow_mut();
        if self.collect(ids, &mut references)? {
            return match out {
                ValuesMut::F64(out) => {
                    self.instance.get_f64(&references, out).map_err(error)?;
                    self.check_numbers(ids, out)
                }
                ValuesMut::F32(out) => {
                    self.instance.get(&references, ValuesMut::F32(&mut *out)).map_err(error)?;
                    self.check_numbers(ids, out)
                }
                ValuesMut::Enumeration(out) => {
                    self.instance.get(&references, ValuesMut::Enumeration(out)).map_err(error)?;
                    for (id, value) in ids.iter().zip(out) {
                        let items = self.items(self.place(*id)?);
                        *value = items.iter().position(|(_, v)| v == value).map_or(*value, |k| k as i64);
                    }
                    Ok(())
                }
                other => self.instance.get(&references, other).map_err(error),
            };
        }
        drop(references);
        self.get_elements(ids, out)
    }

    /// New values of any type and number.
    #[inline(never)]
    fn set_all(&mut self, ids: &[u32], values: Values) -> Result {
        for id in ids {
            let place = self.place(*id)?;
            if !self.takes(place) {
                let name = &self.variables[*id as usize].name;
                let when = if place.structural { "in the table of its FMU" } else { "before the first step" };
                return Err(Error::Refused(format!("`{name}` can only be set {when}")));
            }
        }
        if self.clocks {
            let place = |id: &u32| self.places.get(*id as usize);
            let places: Vec<&ValueLocation> = ids.iter().filter_map(place).collect();
            if places.iter().any(|p| p.clock || p.clocked) && ids.len() > 1 {
                return set_one_by_one(self, ids, values);
            }
            if clocks::set(&mut self.instance, &places, &values, error)? {
                return Ok(());
            }
        }
        let mut references = self.references.borrow_mut();
        if self.collect(ids, &mut references)? {
            if let Values::Enumeration(indices) = values {
                let item = |(id, k): (&u32, &i64)| -> Result<i64> {
                    let items = self.items(self.place(*id)?);
                    Ok(usize::try_from(*k).ok().and_then(|k| items.get(k)).map_or(*k, |(_, v)| *v))
                };
                let own = ids.iter().zip(indices).map(item).collect::<Result<Vec<i64>>>()?;
                return self.instance.set(&references, Values::Enumeration(&own)).map_err(error);
            }
            return self.instance.set(&references, values).map_err(error);
        }
        drop(references);
        self.set_elements(ids, values)
    }
}

impl Drop for FmuSubsystem {
    fn drop(&mut self) {
        for state in self.slots.iter_mut().map(|(state, _)| state).chain([&mut self.before]) {
            // The instance goes next; what it says to this is in its log.
            drop(self.instance.release(state));
        }
        if self.instance.is_good()
            && let Err(error) = self.instance.terminate()
        {
            self.teardown_errors.put(format!("`{}` at its end: {error}", self.host.name()));
        }
    }
}

/// The bodies that the options name.
fn bodies(of: &FmuSubsystem, named: &Map<String, Value>, description: &ModelDescription) -> Result<Bodies> {
    let axis = |p: &ValueLocation| Axis {
        reference: p.reference,
        element: p.element as usize,
        count: p.count as usize,
    };
    let place = |id: u32| of.places.get(id as usize).map(axis);
    Bodies::read(named, &of.variables, &terminals(description), place)
}
