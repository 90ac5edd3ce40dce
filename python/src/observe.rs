//! `Observation`: values at every communication point of a testbed that goes on in long stretches.

use crate::lock::locked;
use crate::run::Run;
use crate::testbed::matrix;
use crate::{errors, names};
use numpy::{PyArray1, PyArray2, ToPyArray};
use pyo3::prelude::*;
use std::sync::{Arc, Mutex, Weak};
use terraglue::Testbed;
use terraglue::signals::VariableRef;

/// Times (s) and values, row by row.
#[derive(Default)]
struct Rows {
    t_s: Vec<f64>,
    values: Vec<f64>,
}

/// The side of the testbed.
pub struct Follower {
    variables: Vec<VariableRef>,
    every: u64,
    /// Steps that were made since it was begun.
    steps: u64,
    rows: Weak<Mutex<Rows>>,
}

impl Follower {
    /// Whether somebody still holds the observation.
    pub fn is_wanted(&self) -> bool {
        self.rows.strong_count() > 0
    }

    /// Adds a row where it is time for one.
    pub fn look(&mut self, testbed: &Testbed) {
        self.steps += 1;
        let Some(rows) = self.rows.upgrade().filter(|_| self.steps.is_multiple_of(self.every)) else {
            return;
        };
        let mut rows = locked(&rows);
        rows.t_s.push(testbed.t_s());
        let first = rows.values.len();
        rows.values.resize(first + self.variables.len(), f64::NAN);
        names::values(testbed, &self.variables, &mut rows.values[first..]);
    }
}

/// Values of variables at the communication points since it was begun; it ends with the last reference to it.
#[pyclass(frozen, module = "terraglue")]
pub struct Observation {
    names: Vec<String>,
    units: Vec<String>,
    rows: Arc<Mutex<Rows>>,
}

/// Begins one.
pub fn begin(run: &Run, names: Vec<String>, every: u64) -> errors::Refused<(Observation, Follower)> {
    if every == 0 {
        let message = "observe: every = 0: a number of steps from 1 on is wanted";
        return Err(errors::Refusal::Input(message.into()));
    }
    let variables = names::find_all(run, &names)?;
    let units = variables.iter().map(|v| v.describe(run.testbed.instances()).unit.clone()).collect();
    let rows = Arc::new(Mutex::new(Rows::default()));
    let follower = Follower { variables, every, steps: 0, rows: Arc::downgrade(&rows) };
    Ok((Observation { names, units, rows }, follower))
}

#[pymethods]
impl Observation {
    /// The variables.
    #[getter]
    fn names(&self) -> Vec<String> {
        self.names.clone()
    }

    /// Their units.
    #[getter]
    fn units(&self) -> Vec<String> {
        self.units.clone()
    }

    /// Times of the rows, s.
    #[getter]
    fn t<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let times = locked(&self.rows).t_s.clone();
        times.to_pyarray(py)
    }

    /// A row for each time, a column for each variable.
    #[getter]
    fn values<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let values = locked(&self.rows).values.clone();
        let columns = self.names.len();
        matrix(py, values.len().checked_div(columns).unwrap_or(0), columns, values)
    }

    fn __len__(&self) -> usize {
        locked(&self.rows).t_s.len()
    }

    /// Drops the rows so far.
    fn clear(&self) {
        *locked(&self.rows) = Rows::default();
    }
}
