//! Intermediate update (FMI 3.0, 4.2.2): a unit shows values at its own inner steps and may be asked to stop there.
//!
//! A unit calls from inside its `doStep`. What it calls at another time, from another thread, from inside another call of
//! its own or without places for an answer is not followed and said once.

use super::Slave;
use super::functions::Vr;
use super::log::meant;
use crate::error::{Error, Result};
use std::ffi::{c_int, c_void};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};
use std::thread::ThreadId;
use terraglue_subsystem::ValueType;

type Read = unsafe extern "C" fn(*mut c_void, *const Vr, usize, *mut f64, usize) -> c_int;

/// A row of values at an intermediate time.
#[derive(Clone, Debug, PartialEq)]
pub struct IntermediateRow {
    /// s.
    pub t: f64,
    /// Whether the unit has finished an inner step there; else it is a trial of its solver.
    pub finished: bool,
    /// Of the variables that were asked for, arrays one after the other.
    pub values: Vec<f64>,
}

/// What an instance's intermediate updates are answered with.
#[derive(Default)]
pub struct Updates {
    inner: Mutex<Inner>,
    /// Whether it was said that a call is not followed.
    said: AtomicBool,
}

#[derive(Default)]
struct Inner {
    window: Option<Window>,
    references: Vec<Vr>,
    names: Vec<String>,
    /// Numbers behind all references.
    count: usize,
    rows: Vec<IntermediateRow>,
    /// Why the step cannot stand.
    wrong: Option<String>,
}

/// The step inside which the unit may call.
#[derive(Clone, Copy)]
struct Window {
    thread: ThreadId,
    start: f64,
    end: f64,
    component: usize,
    read: Option<Read>,
}

impl Updates {
    fn inner(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes the call of a unit; answers where the step shall end early, if so, or why the call is not followed.
    fn take(
        &self,
        t: f64,
        [allowed, finished, early]: [bool; 3],
    ) -> std::result::Result<Option<f64>, String> {
        let mut inner = match self.inner.try_lock() {
            Ok(inner) => inner,
            Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
            Err(TryLockError::WouldBlock) => return Err("from inside another call".into()),
        };
        let Some(window) = inner.window else { return Err("outside doStep".into()) };
        if window.thread != std::thread::current().id() {
            return Err("from another thread".into());
        }
        if inner.wrong.is_some() {
            return Ok(early.then_some(t));
        }
        let slack = 1e-9 * (window.end - window.start) + 4.0 * f64::EPSILON * window.end.abs();
        if !(t >= window.start - slack && t <= window.end + slack) {
            let text = format!("for t = {t} s in the step from {} s to {} s", window.start, window.end);
            if inner.references.is_empty() {
                return Err(text);
            }
            inner.wrong = Some(format!("called its intermediate update {text}"));
        } else if allowed && !inner.references.is_empty() {
            inner.wrong = inner.read(window, t, finished).err();
        }
        Ok(inner.wrong.as_ref().filter(|_| early).map(|_| t))
    }
}

impl Inner {
    fn read(&mut self, window: Window, t: f64, finished: bool) -> std::result::Result<(), String> {
        let mut values = vec![f64::NAN; self.count];
        let read = window.read.ok_or("has no function fmi3GetFloat64")?;
        let (r, n) = (self.references.as_ptr(), self.references.len());
        // SAFETY: a live instance inside its own call-back, so many references and values.
        let status =
            unsafe { read(window.component as *mut c_void, r, n, values.as_mut_ptr(), values.len()) };
        if status != 0 && status != 1 {
            return Err(format!(
                "answered {status} to fmi3GetFloat64 in its intermediate update at t = {t} s"
            ));
        }
        if let Some(wrong) = values.iter().find(|x| !x.is_finite()) {
            let names = self.names.join("`, `");
            return Err(format!("showed {wrong} in its intermediate update at t = {t} s, among `{names}`"));
        }
        self.rows.push(IntermediateRow { t, finished, values });
        Ok(())
    }
}

/// `fmi3IntermediateUpdateCallback`.
///
/// # Safety
/// Both places are null or may be written.
pub unsafe extern "C" fn update(
    environment: *mut c_void,
    t: f64,
    _set_requested: bool,
    get_allowed: bool,
    finished: bool,
    can_return: bool,
    early: *mut bool,
    early_time: *mut f64,
) {
    // A panic must not cross; nothing here is left half done.
    let answer = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
        let book = meant(environment as usize, "")?;
        match book.updates.take(t, [get_allowed, finished, can_return]) {
            Ok(end) => end,
            Err(why) => {
                if !book.updates.said.swap(true, Ordering::Relaxed) {
                    book.note(&format!("called its intermediate update {why}; that is not followed"));
                }
                None
            }
        }
    }));
    let end = answer.unwrap_or(None);
    // SAFETY: by the caller.
    unsafe {
        if !early.is_null() {
            *early = end.is_some();
        }
        if let Some(end) = end.filter(|_| !early_time.is_null()) {
            *early_time = end;
        }
    }
}

impl Slave {
    /// The numbers in calls of variables that are shown at intermediate times.
    pub(super) fn shown_between(description: &crate::ModelDescription, names: &[String]) -> Result<Vec<Vr>> {
        if !names.is_empty() && !description.capabilities.intermediate_update {
            return Err(Error::Refused("the unit does not offer intermediate update".into()));
        }
        let one = |name: &String| {
            let v = description.position(name).map(|k| &description.variables[k]);
            let v = v.ok_or_else(|| Error::Refused(format!("there is no variable `{name}`")))?;
            match v.intermediate && v.value_type == ValueType::F64 {
                true => Ok(v.reference),
                false => Err(Error::Refused(format!(
                    "`{name}` is no Float64 with intermediateUpdate = \"true\": it cannot be read at intermediate times"
                ))),
            }
        };
        names.iter().map(one).collect()
    }

    /// Fixes which numbers are read, once arrays have their sizes.
    pub(super) fn watch_between(&self) {
        let mut inner = self.log.updates.inner();
        inner.references.clone_from(&self.shown);
        let shown = |reference: &Vr| {
            self.description.variables.iter().find(|v| v.reference == *reference && !v.alias)
        };
        let shown: Vec<_> = self.shown.iter().filter_map(shown).collect();
        inner.count = shown.iter().map(|v| v.len()).sum();
        inner.names = shown.iter().map(|v| v.name.clone()).collect();
    }

    /// A step begins inside which the unit may call.
    pub(super) fn open_between(&self, start: f64, end: f64, read: Option<Read>) {
        let thread = std::thread::current().id();
        let component = self.component as usize;
        self.log.updates.inner().window = Some(Window { thread, start, end, component, read });
    }

    /// The step has ended; why it cannot stand, if so.
    pub(super) fn close_between(&self) -> Option<String> {
        let mut inner = self.log.updates.inner();
        inner.window = None;
        inner.wrong.take()
    }

    /// Forgets the rows of a step that is made again.
    pub(super) fn forget_between(&self) {
        self.log.updates.inner().rows.clear();
    }

    /// Rows of intermediate times since the last step began.
    pub fn take_intermediate(&self) -> Vec<IntermediateRow> {
        std::mem::take(&mut self.log.updates.inner().rows)
    }
}
