//! The instance on the other side of the C interface: each call is checked before, and its status after.

use super::functions::{Api, Callbacks2, InstanceHandle};
use super::log::InstanceLog;
use super::step_fault::StepFault;
use crate::binary::Loaded;
use crate::error::{Error, Result};
use crate::floating_point::Keep;
use std::cell::Cell;
use std::ffi::c_int;
use std::fmt;
use std::sync::Arc;

/// Whether an instance may be called.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Health {
    /// Yes.
    Good,
    /// It answered `error`: only reset, state and free are allowed.
    Erroneous,
    /// It answered `fatal`: nothing is allowed.
    Dead,
}

/// Status of a call.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CallStatus {
    /// Done.
    Ok,
    /// Done, with a warning.
    Warning,
    /// Not done, and nothing has changed.
    Discard,
    /// Failed.
    Error,
    /// Failed for good.
    Fatal,
    /// Still at work (FMI 2.0 only).
    Pending,
    /// None of the standard.
    Unknown(c_int),
}

impl From<c_int> for CallStatus {
    fn from(status: c_int) -> Self {
        match status {
            0 => Self::Ok,
            1 => Self::Warning,
            2 => Self::Discard,
            3 => Self::Error,
            4 => Self::Fatal,
            5 => Self::Pending,
            other => Self::Unknown(other),
        }
    }
}

impl fmt::Display for CallStatus {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::Ok => f.write_str("ok"),
            Self::Warning => f.write_str("warning"),
            Self::Discard => f.write_str("discard"),
            Self::Error => f.write_str("error"),
            Self::Fatal => f.write_str("fatal"),
            Self::Pending => f.write_str("pending"),
            Self::Unknown(status) => write!(f, "{status}, which is no status"),
        }
    }
}

/// Whether a status lets the caller go on.
#[inline]
pub fn goes_on(status: CallStatus) -> bool {
    matches!(status, CallStatus::Ok | CallStatus::Warning)
}

/// The instance on the other side of the C interface, from its making to its end: whether it may be called, its
/// answers, and the values of its variables. Members that every step uses come first.
#[repr(C)]
pub struct ForeignInstance {
    component: InstanceHandle,
    // The order matters: call-backs and log outlive the instance, the library both.
    pub(super) log: Arc<InstanceLog>,
    health: Cell<Health>,
    /// Begins with the functions of a step.
    pub(super) api: Api,
    _callbacks: Option<Box<Callbacks2>>,
    loaded: Arc<Loaded>,
}

impl ForeignInstance {
    /// An instance that was just made, with all that it needs to live.
    pub(super) fn new(
        component: InstanceHandle,
        log: Arc<InstanceLog>,
        api: Api,
        callbacks: Option<Box<Callbacks2>>,
        loaded: Arc<Loaded>,
    ) -> Self {
        Self { component, log, health: Cell::new(Health::Good), api, _callbacks: callbacks, loaded }
    }

    /// Where it lies, for calls inside its own call-backs.
    pub(super) fn address(&self) -> usize {
        self.component as usize
    }

    /// Whether every function may be called that its phase allows.
    #[inline]
    pub(super) fn is_good(&self) -> bool {
        self.health.get() == Health::Good
    }

    /// Whether nothing of the instance may be called any more.
    #[inline]
    pub(super) fn is_dead(&self) -> bool {
        self.health.get() == Health::Dead
    }

    /// It was reset: every function may be called again.
    pub(super) fn recover(&self) {
        self.health.set(Health::Good);
    }

    /// Calls a function that must succeed.
    #[inline(always)]
    pub(super) fn call<F>(
        &self,
        function: &'static str,
        f: Option<F>,
        run: impl FnOnce(F, InstanceHandle) -> c_int,
    ) -> Result {
        let (Health::Good, Some(f)) = (self.health.get(), f) else {
            return Err(self.not_called(function));
        };
        self.log.begin();
        self.trace(format_args!("{function}"));
        let status = run(f, self.component);
        self.trace(format_args!("  {}", CallStatus::from(status)));
        match status {
            0 => Ok(()),
            other => self.no_plain_success(function, other),
        }
    }

    /// Traces each call, where there is a trace, before it is made, so that the last one is known after a crash.
    #[inline(always)]
    pub(super) fn trace(&self, text: fmt::Arguments) {
        if self.log.is_traced() {
            self.log.trace(&text);
        }
    }

    #[cold]
    fn no_plain_success(&self, function: &'static str, status: c_int) -> Result {
        match status.into() {
            status if goes_on(status) => Ok(()),
            status => Err(self.failed(function, status)),
        }
    }

    /// The same where the standard lets an instance be called that answered `error`.
    pub(super) fn call_after_error<F>(
        &self,
        function: &'static str,
        f: Option<F>,
        run: impl FnOnce(F, InstanceHandle) -> c_int,
    ) -> Result {
        let before = self.health.get();
        if before == Health::Erroneous {
            self.health.set(Health::Good);
        }
        let done = self.call(function, f, run);
        if done.is_err() && self.health.get() == Health::Good {
            self.health.set(before);
        }
        done
    }

    /// Calls a function and returns its status; a function that may not be called is an error.
    #[inline(always)]
    pub(super) fn status<F>(
        &self,
        function: &'static str,
        f: Option<F>,
        run: impl FnOnce(F, InstanceHandle) -> c_int,
    ) -> Result<CallStatus> {
        let (Health::Good, Some(f)) = (self.health.get(), f) else {
            return Err(self.not_called(function));
        };
        self.log.begin();
        self.trace(format_args!("{function}"));
        let status = run(f, self.component);
        self.trace(format_args!("  {}", CallStatus::from(status)));
        match status {
            0 => Ok(CallStatus::Ok),
            other => Ok(other.into()),
        }
    }

    /// Why a function was not called: the instance may not be, or there is no such function.
    #[cold]
    fn not_called(&self, function: &'static str) -> Error {
        if self.health.get() == Health::Good {
            return Error::Refused(format!("its library has no function `{function}`"));
        }
        let outcome = "was not called: the instance failed before".into();
        Error::Call { function, outcome, log: Vec::new(), fatal: true }
    }

    /// The error of a status that is no success, remembered where the standard asks for it.
    #[cold]
    pub(super) fn failed(&self, function: &'static str, status: CallStatus) -> Error {
        let (health, outcome) = match status {
            CallStatus::Error => (Health::Erroneous, "answered the status error".to_owned()),
            CallStatus::Fatal => (Health::Dead, "answered the status fatal".to_owned()),
            CallStatus::Discard if changes_mode(function) => {
                let text = "answered the status discard, which only steps and values may be answered with";
                (Health::Erroneous, text.to_owned())
            }
            CallStatus::Discard => (Health::Good, "answered the status discard".to_owned()),
            CallStatus::Pending => {
                let text = "answered the status pending, although nothing was to be done in the background";
                (Health::Dead, text.to_owned())
            }
            CallStatus::Unknown(n) => {
                (Health::Dead, format!("answered {n}, which is no status of the standard"))
            }
            CallStatus::Ok | CallStatus::Warning => (Health::Good, "succeeded".to_owned()),
        };
        self.health.set(health);
        Error::Call { function, outcome, log: self.log.last(), fatal: health != Health::Good }
    }

    /// The error of a step in which an intermediate update went wrong.
    #[cold]
    pub(super) fn stopped_between(
        &self,
        function: &'static str,
        wrong: StepFault,
        status: CallStatus,
    ) -> Error {
        let dead = wrong.fatal || !goes_on(status) && status != CallStatus::Error;
        let error = self.lied(function, wrong.text);
        if dead {
            self.health.set(Health::Dead);
        }
        error
    }

    /// An error in the answer of a function.
    #[cold]
    pub(super) fn lied(&self, function: &'static str, outcome: String) -> Error {
        self.health.set(Health::Erroneous);
        Error::Call { function, outcome, log: self.log.last(), fatal: true }
    }
}

impl Drop for ForeignInstance {
    fn drop(&mut self) {
        let _mode = Keep::new();
        if self.is_dead() {
            // Nothing of it may be called, so everything that it still holds must stay loaded.
            std::mem::forget(self.loaded.clone());
            return;
        }
        let (free, function) = match &self.api {
            Api::Two(two) => (two.free, "fmi2FreeInstance"),
            Api::Three(three) => (three.free, "fmi3FreeInstance"),
        };
        self.trace(format_args!("{function}"));
        if let Some(free) = free {
            // SAFETY: a live instance, freed once.
            unsafe { free(self.component) };
        }
    }
}

/// Whether a function takes the instance from one mode to another.
fn changes_mode(function: &str) -> bool {
    ["Setup", "Enter", "Exit", "Terminate"].iter().any(|verb| function["fmi2".len()..].starts_with(verb))
}
