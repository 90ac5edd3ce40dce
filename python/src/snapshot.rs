//! States of testbeds that can be gone back to.

use crate::lock::locked;
use pyo3::prelude::*;
use std::sync::{Arc, Mutex};
use terraglue::testbed;

/// Numbers of the states that a testbed can keep at a time.
#[derive(Debug)]
pub struct Places(Mutex<Vec<u32>>);

impl Places {
    /// Of so many states.
    pub fn new(count: u32) -> Arc<Self> {
        Arc::new(Self(Mutex::new((0..count).rev().collect())))
    }

    /// A free one; none: all are taken.
    pub fn take(&self) -> Option<u32> {
        locked(&self.0).pop()
    }

    fn give_back(&self, place: u32) {
        locked(&self.0).push(place);
    }
}

/// One of those numbers, while it is in use.
pub struct Place {
    pub place: u32,
    pub places: Arc<Places>,
}

impl Drop for Place {
    fn drop(&mut self) {
        self.places.give_back(self.place);
    }
}

/// The state of a testbed at a communication point, kept while this lives.
#[pyclass(frozen, module = "terraglue")]
pub struct Snapshot {
    pub state: testbed::Snapshot,
    pub place: Place,
}
