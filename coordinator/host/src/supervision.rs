//! Supervision of a subsystem while code of it is called: its names, the time, and whether it has failed for good.
//! Failures get name, function and time here.

use super::crash::{self, Names};
use std::cell::Cell;
use terraglue_diagnostics::error::{Error, Result};
use terraglue_subsystem::Error as Failure;

/// The supervision of one subsystem.
pub(super) struct Supervision {
    /// Simulated time of the last call, s.
    pub time_s: Cell<f64>,
    dead: Cell<bool>,
    // in a place of its own: the note of a call points there
    names: Box<Names>,
}

impl Supervision {
    /// Of a subsystem that is called `name` in the scenario and comes from a module.
    pub fn new(name: &str, module: &str) -> Self {
        let names = Names { instance: name.to_owned(), module: module.to_owned() };
        Self { names: Box::new(names), time_s: Cell::new(0.0), dead: Cell::new(false) }
    }

    pub fn names(&self) -> &Names {
        &self.names
    }

    /// Whether it failed for good.
    pub fn has_failed(&self) -> bool {
        self.dead.get()
    }

    /// An error in a function of the interface at the last time it was called with.
    #[cold]
    pub fn error(&self, function: &'static str, message: impl Into<String>) -> Error {
        Error::Module {
            subsystem: self.names.instance.clone(),
            module: self.names.module.clone(),
            function,
            time_s: self.time_s.get(),
            message: message.into(),
        }
    }

    /// Error of a function; after a fatal failure the function is never called again.
    #[cold]
    pub fn failed(&self, function: &'static str, failure: Failure) -> Error {
        let text = match failure {
            Failure::Fatal(text) => {
                self.dead.set(true);
                text
            }
            other => other.to_string(),
        };
        self.error(function, text)
    }

    /// Whether it may still be called; the call is noted.
    #[inline]
    pub fn alive(&self, function: &'static str) -> Result {
        match self.dead.get() {
            true => Err(self.is_dead(function)),
            false => {
                crash::note(&self.names, function, self.time_s.get());
                Ok(())
            }
        }
    }

    #[cold]
    fn is_dead(&self, function: &'static str) -> Error {
        self.error(function, "not called: it failed for good before")
    }

    #[inline]
    pub fn outcome<T>(&self, function: &'static str, result: terraglue_subsystem::Result<T>) -> Result<T> {
        result.map_err(|failure| self.failed(function, failure))
    }

    /// An error where something `wrong` was found in an answer.
    #[inline]
    pub fn all_finite(&self, function: &'static str, wrong: Option<String>) -> Result {
        wrong.map_or(Ok(()), |text| Err(self.error(function, text)))
    }
}

impl Drop for Supervision {
    fn drop(&mut self) {
        crash::forget(&self.names);
    }
}
