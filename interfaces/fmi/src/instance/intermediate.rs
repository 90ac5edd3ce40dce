//! Intermediate update (FMI 3.0, 4.2.2): an FMU shows values at its own inner steps, takes inputs there and can be
//! requested to stop there.
//!
//! An FMU calls from inside its `doStep`. A call at another time, from another thread, from inside another call of its
//! own or without places for an answer is ignored and logged once.

use super::follow::Followed;
use super::functions::Vr;
use super::step_fault::StepFault;
use crate::description::ModelDescription;
use crate::error::{Error, Result};
use std::ffi::{c_int, c_void};
use std::sync::atomic::AtomicBool;
use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};
use std::thread::ThreadId;
use terraglue_subsystem::ValueType;

type Read = unsafe extern "C" fn(*mut c_void, *const Vr, usize, *mut f64, usize) -> c_int;

/// A row of values at an intermediate time.
#[derive(Clone, Debug, PartialEq)]
pub struct IntermediateRow {
    /// s.
    pub t: f64,
    /// Whether the FMU has finished an inner step there; else it is a trial of its solver.
    pub finished: bool,
    /// Of the requested variables, arrays one after the other.
    pub values: Vec<f64>,
}

/// Message for calls at a wrong time.
const UNHEARD: &str = "; that is not followed";

/// State from which an instance's intermediate updates are answered.
#[derive(Default)]
pub struct Updates {
    inner: Mutex<Inner>,
    /// Whether an odd call has been logged.
    pub(super) said: AtomicBool,
}

#[derive(Default)]
pub(super) struct Inner {
    window: Option<Window>,
    /// Variables that are read.
    references: Vec<Vr>,
    names: Vec<String>,
    /// Numbers behind all references.
    count: usize,
    rows: Vec<IntermediateRow>,
    /// Inputs that are set.
    pub followed: Vec<Followed>,
    /// Why the step cannot stand.
    wrong: Option<StepFault>,
}

/// The step inside which the FMU may call.
#[derive(Clone, Copy)]
struct Window {
    thread: ThreadId,
    start: f64,
    end: f64,
    component: usize,
    read: Option<Read>,
}

impl Updates {
    pub(super) fn inner(&self) -> MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes the call of an FMU; returns where the step shall end early, if so, or a complaint about the call.
    pub(super) fn take(
        &self,
        t: f64,
        [requested, allowed, finished, early]: [bool; 4],
    ) -> std::result::Result<Option<f64>, String> {
        let mut inner = match self.inner.try_lock() {
            Ok(inner) => inner,
            Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
            Err(TryLockError::WouldBlock) => return Err("from inside another call".to_owned() + UNHEARD),
        };
        let Some(window) = inner.window else { return Err("outside doStep".to_owned() + UNHEARD) };
        if window.thread != std::thread::current().id() {
            return Err("from another thread".to_owned() + UNHEARD);
        }
        if inner.wrong.is_some() {
            return Ok(early.then_some(t));
        }
        let slack = 1e-9 * (window.end - window.start) + 4.0 * f64::EPSILON * window.end.abs();
        if !(t >= window.start - slack && t <= window.end + slack) {
            inner.outside(window, t, requested)?;
        } else {
            inner.inside(window, t, [requested, allowed, finished]);
        }
        Ok(inner.wrong.as_ref().filter(|_| early).map(|_| t))
    }

    /// Fixes which numbers are read, once arrays have their sizes.
    pub(super) fn watch(&self, shown: &[Vr], description: &ModelDescription) {
        let mut inner = self.inner();
        inner.references = shown.to_vec();
        let variable =
            |reference: &Vr| description.variables.iter().find(|v| v.reference == *reference && !v.alias);
        let variables: Vec<_> = shown.iter().filter_map(variable).collect();
        inner.count = variables.iter().map(|v| v.len()).sum();
        inner.names = variables.iter().map(|v| v.name.clone()).collect();
    }

    /// A step begins inside which the FMU may call.
    pub(super) fn open(&self, start: f64, end: f64, component: usize, read: Option<Read>) {
        let thread = std::thread::current().id();
        self.inner().window = Some(Window { thread, start, end, component, read });
    }

    /// The step has ended; why it cannot stand, if so.
    pub(super) fn close(&self) -> Option<StepFault> {
        let mut inner = self.inner();
        inner.window = None;
        inner.wrong.take()
    }

    /// Forgets the rows of a step that is made again.
    pub(super) fn forget_rows(&self) {
        self.inner().rows.clear();
    }

    /// Rows of intermediate times since the last step began.
    pub(super) fn take_rows(&self) -> Vec<IntermediateRow> {
        std::mem::take(&mut self.inner().rows)
    }
}

impl Inner {
    fn inside(&mut self, window: Window, t: f64, [requested, allowed, finished]: [bool; 3]) {
        // the standard requires all reads before anything is set
        let read = allowed && !self.references.is_empty();
        let mut done = if read { self.read(window, t, finished) } else { Ok(()) };
        if requested && done.is_ok() {
            done = self.set(window, t);
        }
        self.wrong = done.err();
    }

    /// A call for a time outside the step; a complaint where the step is valid all the same.
    fn outside(&mut self, window: Window, t: f64, requested: bool) -> std::result::Result<(), String> {
        let text = format!("for t = {t} s in the step from {} s to {} s", window.start, window.end);
        let (reads, sets) = (!self.references.is_empty(), requested && !self.followed.is_empty());
        // solvers step over the end and come back; inputs are known there, values of the FMU are not of this step
        if sets && !reads && t > window.end && t.is_finite() {
            self.wrong = self.set(window, t).err();
            let given = "; the standard wants times within the step, it was given the inputs of that time";
            return if self.wrong.is_none() { Err(text + given) } else { Ok(()) };
        }
        if !reads && !sets {
            return Err(text + UNHEARD);
        }
        self.wrong = Some(format!("called its intermediate update {text}").into());
        Ok(())
    }

    fn set(&mut self, window: Window, t: f64) -> std::result::Result<(), StepFault> {
        self.followed.iter_mut().try_for_each(|input| input.set(window.component, t))
    }

    fn read(&mut self, window: Window, t: f64, finished: bool) -> std::result::Result<(), StepFault> {
        let mut values = vec![f64::NAN; self.count];
        let read = window.read.ok_or_else(|| "has no function fmi3GetFloat64".to_owned())?;
        let (r, n) = (self.references.as_ptr(), self.references.len());
        // SAFETY: a live instance inside its own call-back, so many references and values.
        let status =
            unsafe { read(window.component as *mut c_void, r, n, values.as_mut_ptr(), values.len()) };
        StepFault::of(status, || format!("fmi3GetFloat64 in its intermediate update at t = {t} s"))?;
        if let Some(wrong) = values.iter().find(|x| !x.is_finite()) {
            let names = self.names.join("`, `");
            return Err(
                format!("showed {wrong} in its intermediate update at t = {t} s, among `{names}`").into()
            );
        }
        self.rows.push(IntermediateRow { t, finished, values });
        Ok(())
    }
}

/// The numbers in calls of variables that are shown at intermediate times.
pub(super) fn shown(description: &ModelDescription, names: &[String]) -> Result<Vec<Vr>> {
    if !names.is_empty() && !description.capabilities.intermediate_update {
        return Err(Error::WrongInput("the FMU does not offer intermediate update".into()));
    }
    let one = |name: &String| {
        let v = description.position(name).map(|k| &description.variables[k]);
        let v = v.ok_or_else(|| Error::WrongInput(format!("there is no variable `{name}`")))?;
        match v.intermediate && v.value_type == ValueType::F64 {
            true => Ok(v.reference),
            false => Err(Error::WrongInput(format!(
                "`{name}` is no Float64 with intermediateUpdate = \"true\": it cannot be read at intermediate times"
            ))),
        }
    };
    names.iter().map(one).collect()
}
