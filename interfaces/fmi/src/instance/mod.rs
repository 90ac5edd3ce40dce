//! An instance of an FMU, driven through its C interface.
//!
//! The order of calls is the standard's: instantiate, start values, initialisation, steps, terminate, free. An
//! instance that answered `error` is only freed, one that answered `fatal` is not called at all any more.
#![allow(unsafe_code)] // Functions of foreign libraries are called.

mod clocks;
mod configure;
mod discrete;
mod follow;
mod foreign;
mod functions;
mod intermediate;
mod intervals;
mod log;
mod state;
mod step;
mod step_fault;
mod update_callback;
mod values;

pub use clocks::Clocks;
pub use foreign::ForeignInstance;
pub use intermediate::IntermediateRow;
pub use log::{LogLine, Sink, Trace};
pub use state::FmuState;
pub use step::{Advance, Stepped};

use crate::description::{Causality, ModelDescription, Variable};
use crate::error::{Error, Result};
use crate::floating_point::Keep;
use crate::fmu::Fmu;
use follow::Followed;
use functions::{Api, Callbacks2, InstanceHandle};
use log::InstanceLog;
use std::cell::Cell;
use std::ffi::{CString, c_char, c_int, c_void};
use std::sync::Arc;
use terraglue_subsystem::{Values, ValuesMut};

// SAFETY: the variadic logger of logger.c, linked with this crate.
unsafe extern "C" {
    fn terraglue_fmi2_logger(
        environment: *mut c_void,
        instance: *const c_char,
        status: c_int,
        category: *const c_char,
        message: *const c_char,
        ...
    );
}

/// Options of an instance.
///
/// ```
/// use terraglue_fmi::InstanceOptions;
///
/// let options = InstanceOptions { event_mode: true, ..InstanceOptions::new("tank", Box::new(|_| ())) };
/// assert!(options.name == "tank" && options.log_categories.is_empty() && options.followed.is_empty());
/// ```
pub struct InstanceOptions {
    /// Name of the instance.
    pub name: String,
    /// Categories of its log that are switched on; `all` stands for all of them.
    pub log_categories: Vec<String>,
    /// Whether events are handled in event mode (FMI 3, where the FMU has it).
    pub event_mode: bool,
    /// Variables that are read at intermediate times (FMI 3).
    pub intermediate: Vec<String>,
    /// Inputs that are set at intermediate times (FMI 3), by [`FmuInstance::follow`].
    pub followed: Vec<String>,
    /// Where its log goes.
    pub sink: Sink,
    /// Takes a line for each call, with its values and its status.
    pub trace: Option<Trace>,
}

impl InstanceOptions {
    /// Without details in the log, event mode or intermediate times.
    pub fn new(name: impl Into<String>, sink: Sink) -> Self {
        let (intermediate, followed, log_categories) = (Vec::new(), Vec::new(), Vec::new());
        Self {
            name: name.into(),
            log_categories,
            event_mode: false,
            intermediate,
            followed,
            sink,
            trace: None,
        }
    }
}

/// Where an instance is in its life.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum InstancePhase {
    Instantiated,
    Initializing,
    Stepping,
    Terminated,
}

/// An instance of an FMU: its life from the start values to its end, and its steps. Members that every step uses come first and
/// in this order, on one line of the cache: the cost of many cheap FMUs is that of their memory.
#[repr(C)]
pub struct FmuInstance {
    phase: InstancePhase,
    event_mode: bool,
    /// Whether the FMU may call for an intermediate update.
    updates: bool,
    foreign: ForeignInstance,
    /// Description of the FMU, with the array sizes of this instance.
    description: Arc<ModelDescription>,
    clocks: Clocks,
    start: f64,
    /// Value references of discrete inputs whose changes are events, ascending; none without event mode.
    discrete_inputs: Vec<u32>,
    /// Value references that are read in intermediate updates.
    shown: Vec<u32>,
    /// Value references that may be read or set in intermediate updates.
    announced: Vec<u32>,
    /// Whether it was noted that it reports the time of its own solver.
    own_time: Cell<bool>,
    /// Whether it was noted that it returns early without the flag, or without being allowed to.
    early: Cell<bool>,
    /// Whether it was noted that it does not report how far it came.
    untold: Cell<bool>,
    /// Whether it was noted that it changes the floating-point mode.
    mode_told: Cell<bool>,
    /// Whether it was noted that its events are late.
    late_events: Cell<bool>,
    /// Whether it asked for the end of the simulation after its initialisation (FMI 3).
    ends_at_start: bool,
    // last: the folder outlives the library
    fmu: Arc<Fmu>,
}

// SAFETY: the standard lets an instance be used from any thread, one at a time.
unsafe impl Send for FmuInstance {}

impl FmuInstance {
    /// Loads the library where that was not done yet, and makes an instance.
    ///
    /// # Errors
    /// [`Error::Refused`]: options that the FMU does not offer. [`Error::Library`]: the library cannot be loaded.
    /// [`Error::Call`]: it made no instance.
    pub fn instantiate(fmu: &Arc<Fmu>, options: InstanceOptions) -> Result<Self> {
        let _mode = Keep::new();
        let description = fmu.description();
        if description.capabilities.needs_tool {
            log_needs_tool(&options.sink, description);
        }
        let [shown, announced] = between(description, &options)?;
        let updates = description.capabilities.intermediate_update;
        let loaded = fmu.library()?;
        let api = functions::find(fmu, &loaded.library)?;
        let log = InstanceLog::new(options.sink, options.trace, &options.name);
        let event_mode = options.event_mode && description.capabilities.event_mode;
        let environment = Arc::as_ptr(&log).cast_mut().cast::<c_void>();
        let text =
            |text: &str| CString::new(text).map_err(|_| Error::Refused(format!("`{text}` has a zero in it")));
        let (name, token, path) = (text(&options.name)?, text(&description.token)?, resources(fmu)?);
        let logs = !options.log_categories.is_empty();
        let modes = (logs, event_mode);
        let function =
            if matches!(api, Api::Two(..)) { "fmi2Instantiate" } else { "fmi3InstantiateCoSimulation" };
        log.trace(&function);
        let (component, callbacks) = match &api {
            Api::Two(two) => make_2(two, [&name, &token, &text(&file_uri(&path))?], logs, environment),
            Api::Three(three) => {
                let texts = [&name, &token, &text(&format!("{path}/"))?];
                (make_3(three, description, texts, modes, &announced, environment), None)
            }
        };
        let component = component.unwrap_or(std::ptr::null_mut());
        if component.is_null() {
            let outcome = "made no instance (it returned NULL)".into();
            return Err(Error::Call { function, outcome, log: log.last(), fatal: true });
        }
        log.trace(&"  an instance");
        let clocks = Clocks::new(&description.variables, event_mode, &log);
        let instance = Self {
            phase: InstancePhase::Instantiated,
            event_mode,
            updates,
            foreign: ForeignInstance::new(component, log, api, callbacks, loaded),
            description: description.clone(),
            clocks,
            start: 0.0,
            discrete_inputs: if event_mode { discrete::inputs(description) } else { Vec::new() },
            shown,
            announced,
            own_time: Cell::new(false),
            early: Cell::new(false),
            untold: Cell::new(false),
            mode_told: Cell::new(false),
            late_events: Cell::new(false),
            ends_at_start: false,
            fmu: fmu.clone(),
        };
        if logs {
            instance.log_only(&options.log_categories)?;
        }
        Ok(instance)
    }

    /// Switches categories of the log on, and all others off; `all` leaves them all on.
    fn log_only(&self, categories: &[String]) -> Result {
        if categories.iter().any(|c| c == "all") {
            return Ok(());
        }
        let known = &self.description.log_categories;
        if let Some(unknown) = categories.iter().find(|c| !known.contains(c)) {
            let offered = match known.is_empty() {
                true => "offers `all` only".to_owned(),
                false => format!("offers {}, and `all`", known.join(", ")),
            };
            return Err(Error::WrongInput(format!(
                "there is no log category `{unknown}`: the FMU {offered}"
            )));
        }
        let text = |c: &String| CString::new(c.as_str()).map_err(|_| Error::Refused(c.clone()));
        let texts = categories.iter().map(text).collect::<Result<Vec<_>>>()?;
        let pointers: Vec<*const c_char> = texts.iter().map(|t| t.as_ptr()).collect();
        let (count, first) = (pointers.len(), pointers.as_ptr());
        match self.foreign.api {
            Api::Two(two) => self
                .foreign
                .call("fmi2SetDebugLogging", two.set_logging, |f, c| unsafe { f(c, 1, count, first) }),
            Api::Three(three) => self
                .foreign
                .call("fmi3SetDebugLogging", three.set_logging, |f, c| unsafe { f(c, true, count, first) }),
        }
    }

    /// A warning of the host's about the FMU, among the lines that it logs.
    pub fn note(&self, text: &str) {
        self.foreign.log.note(text);
    }

    /// Description of the FMU, with the array sizes of this instance.
    #[inline]
    pub fn description(&self) -> &Arc<ModelDescription> {
        &self.description
    }

    /// The instance on the other side, for calls that need no more than its variables.
    #[inline]
    pub fn foreign(&self) -> &ForeignInstance {
        &self.foreign
    }

    /// [`ForeignInstance::get_f64`].
    #[allow(clippy::missing_errors_doc)]
    #[inline(always)]
    pub fn get_f64(&self, references: &[u32], out: &mut [f64]) -> Result {
        self.foreign.get_f64(references, out)
    }

    /// [`ForeignInstance::set_f64`].
    #[allow(clippy::missing_errors_doc)]
    #[inline(always)]
    pub fn set_f64(&self, references: &[u32], values: &[f64]) -> Result {
        if self.event_mode
            && !self.discrete_inputs.is_empty()
            && discrete::before_set(self, references, Values::F64(values))?
        {
            return Ok(());
        }
        self.foreign.set_f64(references, values)
    }

    /// [`ForeignInstance::get`].
    #[allow(clippy::missing_errors_doc)]
    pub fn get(&self, references: &[u32], out: ValuesMut) -> Result {
        self.foreign.get(references, out)
    }

    /// [`ForeignInstance::set`].
    #[allow(clippy::missing_errors_doc)]
    pub fn set(&self, references: &[u32], values: Values) -> Result {
        if self.event_mode
            && !self.discrete_inputs.is_empty()
            && discrete::before_set(self, references, values)?
        {
            return Ok(());
        }
        self.foreign.set(references, values)
    }

    /// Its clocks.
    pub fn clocks(&self) -> &Clocks {
        &self.clocks
    }

    /// Its clocks, to be changed.
    pub fn clocks_mut(&mut self) -> &mut Clocks {
        &mut self.clocks
    }

    /// Makes a triggered input clock tick, or not, when the next step begins, or the initialisation ends.
    ///
    /// # Errors
    /// [`Error::WrongInput`]: it is no such clock, or the FMU is not in event mode.
    pub fn trigger(&mut self, clock: &Variable, on: bool) -> Result {
        let good = clock.triggered && clock.causality == Causality::Input && self.event_mode;
        if !good || self.phase == InstancePhase::Terminated {
            return Err(Error::WrongInput(format!(
                "`{}` cannot be made to tick: it is no triggered input clock of an FMU in event mode",
                clock.name
            )));
        }
        self.clocks.trigger(clock.reference, on);
        Ok(())
    }

    /// Provides the value of an input at any time inside a step (FMI 3): `at` writes its elements at a time, s, and leaves
    /// NaN where there is no number. The FMU asks for it in its intermediate update, if it does; where a step has parts – an
    /// event, a clock, an early return – it is set between them too.
    ///
    /// # Errors
    /// An input that was not announced ([`InstanceOptions::followed`]).
    pub fn follow(&mut self, input: &Variable, at: impl Fn(f64, &mut [f64]) + Send + 'static) -> Result {
        let followed = Followed::new(&self.foreign.api, input, at)?;
        if !self.announced.contains(&input.reference) {
            return Err(Error::Refused(format!("`{}` was not announced as an input to follow", input.name)));
        }
        self.foreign.log.updates.inner().followed.push(followed);
        Ok(())
    }

    /// Rows of intermediate times since the last step began.
    pub fn take_intermediate(&self) -> Vec<IntermediateRow> {
        self.foreign.log.updates.take_rows()
    }

    /// Enters initialisation mode, after start values were set.
    ///
    /// # Errors
    /// [`Error::Call`]: the FMU failed.
    pub fn enter_initialization(&mut self, start: f64, stop: Option<f64>, tolerance: Option<f64>) -> Result {
        let _mode = Keep::new();
        self.start = start;
        if self.updates {
            self.foreign.log.updates.watch(&self.shown, &self.description);
        }
        let said = |x: Option<f64>, unit: &str| x.map_or("none".to_owned(), |x| format!("{x:?}{unit}"));
        self.foreign.trace(format_args!(
            "start {start:?} s, stop {}, tolerance {}",
            said(stop, " s"),
            said(tolerance, "")
        ));
        let (has_tolerance, tolerance) = (tolerance.is_some(), tolerance.unwrap_or(0.0));
        let (has_stop, stop) = (stop.is_some(), stop.unwrap_or(0.0));
        match self.foreign.api {
            Api::Two(two) => {
                let (tolerant, stops) = (c_int::from(has_tolerance), c_int::from(has_stop));
                self.foreign.call("fmi2SetupExperiment", two.setup, |f, c| unsafe {
                    f(c, tolerant, tolerance, start, stops, stop)
                })?;
                self.foreign.call(
                    "fmi2EnterInitializationMode",
                    two.enter_initialization,
                    |f, c| unsafe { f(c) },
                )?;
            }
            Api::Three(three) => {
                self.foreign.call(
                    "fmi3EnterInitializationMode",
                    three.enter_initialization,
                    |f, c| unsafe { f(c, has_tolerance, tolerance, start, has_stop, stop) },
                )?;
            }
        }
        self.phase = InstancePhase::Initializing;
        Ok(())
    }

    /// Leaves initialisation mode; the FMU can be stepped.
    ///
    /// # Errors
    /// [`Error::Call`]: the FMU failed.
    pub fn exit_initialization(&mut self) -> Result {
        let _mode = Keep::new();
        match self.foreign.api {
            Api::Two(two) => {
                self.foreign
                    .call("fmi2ExitInitializationMode", two.exit_initialization, |f, c| unsafe { f(c) })?;
            }
            Api::Three(three) => {
                self.foreign.call(
                    "fmi3ExitInitializationMode",
                    three.exit_initialization,
                    |f, c| unsafe { f(c) },
                )?;
                if self.event_mode {
                    self.clocks.begin(self.start);
                    self.clocks.tick(&self.foreign, self.start, true)?;
                    self.clocks.forget_triggers();
                    self.ends_at_start = self.update_discrete_states(self.start)?;
                    if !self.ends_at_start {
                        self.foreign
                            .call("fmi3EnterStepMode", three.enter_step_mode, |f, c| unsafe { f(c) })?;
                    }
                }
            }
        }
        self.phase = InstancePhase::Stepping;
        Ok(())
    }

    /// Whether every function may be called that its phase allows.
    #[inline]
    pub fn is_good(&self) -> bool {
        self.foreign.is_good()
    }

    /// Whether the initialisation has not begun: values can be set, not read.
    #[inline]
    pub fn is_instantiated(&self) -> bool {
        self.phase == InstancePhase::Instantiated
    }

    /// Ends the simulation; values can still be read.
    ///
    /// # Errors
    /// [`Error::Call`]: the FMU failed.
    pub fn terminate(&mut self) -> Result {
        if self.phase != InstancePhase::Stepping {
            return Ok(());
        }
        self.phase = InstancePhase::Terminated;
        let _mode = Keep::new();
        match self.foreign.api {
            Api::Two(two) => self.foreign.call("fmi2Terminate", two.terminate, |f, c| unsafe { f(c) }),
            Api::Three(three) => self.foreign.call("fmi3Terminate", three.terminate, |f, c| unsafe { f(c) }),
        }
    }

    /// Back to the state after instantiation.
    ///
    /// # Errors
    /// [`Error::Call`]: the FMU failed.
    pub fn reset(&mut self) -> Result {
        match self.foreign.api {
            Api::Two(two) => self.foreign.call_after_error("fmi2Reset", two.reset, |f, c| unsafe { f(c) })?,
            Api::Three(three) => {
                self.foreign.call_after_error("fmi3Reset", three.reset, |f, c| unsafe { f(c) })?
            }
        }
        (self.phase, self.ends_at_start) = (InstancePhase::Instantiated, false);
        self.foreign.log.updates.inner().followed.clear();
        self.description = self.fmu.description().clone();
        self.clocks = Clocks::new(&self.description.variables, self.event_mode, &self.foreign.log);
        self.foreign.recover();
        Ok(())
    }
}

/// Value references that are read at intermediate times, and those that are read or set there.
fn between(description: &ModelDescription, options: &InstanceOptions) -> Result<[Vec<u32>; 2]> {
    let shown = intermediate::shown(description, &options.intermediate)?;
    let mut announced = follow::announced(description, &options.followed)?;
    announced.extend(&shown);
    announced.sort_unstable();
    announced.dedup();
    Ok([shown, announced])
}

impl Drop for FmuInstance {
    fn drop(&mut self) {
        if self.foreign.is_good() {
            // The run is over; its complaint is in its log.
            drop(self.terminate());
        }
    }
}

impl std::fmt::Debug for FmuInstance {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("FmuInstance").field("fmu", &self.fmu.path()).field("phase", &self.phase).finish()
    }
}

fn log_needs_tool(sink: &Sink, description: &crate::ModelDescription) {
    let text = format!("needs the tool that made it ({}) to be installed", description.generation_tool);
    sink(&LogLine { level: terraglue_subsystem::LogLevel::Warning, text });
}

/// The folder of resources, which is made where the archive has none.
fn resources(fmu: &Fmu) -> Result<String> {
    let folder = fmu.folder().join("resources");
    match std::fs::create_dir_all(&folder) {
        Ok(()) => Ok(folder.display().to_string()),
        Err(e) => Err(Error::Refused(format!("{}: {e}", folder.display()))),
    }
}

/// An instance of FMI 2 with that name, token and folder of resources, and the call-backs that it keeps.
fn make_2(
    two: &functions::Two,
    [name, token, resources]: [&CString; 3],
    verbose: bool,
    environment: *mut c_void,
) -> (Option<InstanceHandle>, Option<Box<Callbacks2>>) {
    let callbacks = Box::new(Callbacks2 {
        logger: terraglue_fmi2_logger,
        allocate: libc::calloc,
        free: libc::free,
        step_finished: None,
        environment,
    });
    let (place, verbose) = (&raw const *callbacks, c_int::from(verbose));
    // SAFETY: the arguments are those of the standard and live long enough.
    let made = two
        .instantiate
        .map(|f| unsafe { f(name.as_ptr(), 1, token.as_ptr(), resources.as_ptr(), place, 0, verbose) });
    (made, Some(callbacks))
}

/// Whether an FMU may leave a step early: only where the event is handled then, and the rest of the step can be made in a step of another
/// length. Without event mode an FMU handles its events inside the step, unless it may leave it at one.
fn may_return_early(description: &ModelDescription, event_mode: bool) -> bool {
    let c = description.capabilities;
    event_mode && c.variable_step && (c.may_return_early || c.return_early)
}

/// An instance of FMI 3 with that name, token and folder of resources; `modes`: it logs details, it has event mode.
fn make_3(
    three: &functions::Three,
    description: &ModelDescription,
    [name, token, resources]: [&CString; 3],
    (verbose, event_mode): (bool, bool),
    announced: &[u32],
    environment: *mut c_void,
) -> Option<InstanceHandle> {
    let update: Option<functions::Update3> =
        description.capabilities.intermediate_update.then_some(update_callback::update);
    let early = may_return_early(description, event_mode);
    // SAFETY: the arguments are those of the standard and live long enough.
    three.instantiate.map(|f| unsafe {
        f(
            name.as_ptr(),
            token.as_ptr(),
            resources.as_ptr(),
            false,
            verbose,
            event_mode,
            early,
            announced.as_ptr(),
            announced.len(),
            environment,
            log::log_3,
            update,
        )
    })
}

/// A path as the URI that FMI 2.0 asks for.
fn file_uri(path: &str) -> String {
    let mut uri = String::from("file://");
    for byte in path.bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'/' | b'-' | b'_' | b'.' | b'~' => {
                uri.push(char::from(byte))
            }
            other => uri.push_str(&format!("%{other:02X}")),
        }
    }
    uri
}
