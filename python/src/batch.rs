//! `Batch`: many testbeds of one scenario, stepped on all cores without the interpreter's lock.
//!
//! Each testbed is stepped by one thread at a time and shares nothing with the others, so its bits are those of a testbed alone, whatever the
//! number of threads. One that fails is listed while the others go on; its values are NaN.

use crate::run::Run;
use crate::scenario::{load, module_paths};
use crate::snapshot::Snapshot;
use crate::testbed::{matrix, write};
use crate::{errors, names};
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods, ToPyArray};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use std::path::PathBuf;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use terraglue::scenario::Scenario;
use terraglue::signals::VariableRef;

/// Wall time after which Python checks for signals such as Ctrl-C.
const SLICE: Duration = Duration::from_millis(50);

/// One of the testbeds.
struct Member {
    run: Option<Run>,
    failed: Option<String>,
}

/// Variables whose values an array follows.
struct Followed {
    variables: Vec<VariableRef>,
    array: Py<PyArray2<f64>>,
}

/// Many testbeds of one scenario.
#[pyclass(frozen, module = "terraglue")]
pub struct Batch {
    members: Vec<Mutex<Member>>,
    threads: usize,
    bound: Mutex<Vec<Followed>>,
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Batch {
    /// Does something with each member, on all threads.
    fn each(&self, work: impl Fn(usize, &mut Member) + Sync) {
        let next = AtomicUsize::new(0);
        let threads = self.threads.clamp(1, self.members.len().max(1));
        std::thread::scope(|scope| {
            for _ in 0..threads {
                scope.spawn(|| {
                    while let Some(k) =
                        Some(next.fetch_add(1, Ordering::Relaxed)).filter(|k| *k < self.members.len())
                    {
                        work(k, &mut locked(&self.members[k]));
                    }
                });
            }
        });
    }

    /// Steps each member up to a time of its own.
    fn run_to(&self, py: Python<'_>, until: impl Fn(&Run) -> f64 + Sync) -> PyResult<()> {
        let until_s: Vec<f64> = self
            .members
            .iter()
            .map(|member| locked(member).run.as_ref().map_or(f64::NEG_INFINITY, &until))
            .collect();
        loop {
            let open = AtomicUsize::new(0);
            py.detach(|| {
                self.each(|k, member| {
                    let Some(run) = member.run.as_mut().filter(|_| member.failed.is_none()) else { return };
                    match run.run_until(until_s[k], SLICE) {
                        Ok(true) => {}
                        Ok(false) => drop(open.fetch_add(1, Ordering::Relaxed)),
                        Err(error) => member.failed = Some(error.to_string()),
                    }
                });
            });
            if open.load(Ordering::Relaxed) == 0 {
                return self.follow(py);
            }
            py.check_signals()?;
        }
    }

    /// Values of all members, row by row.
    fn values(&self, variables: &[VariableRef]) -> Vec<f64> {
        let mut all = vec![f64::NAN; self.members.len() * variables.len()];
        let rows = all.chunks_exact_mut(variables.len().max(1));
        for (member, row) in self.members.iter().zip(rows) {
            let member = locked(member);
            if let Some(run) = member.run.as_ref().filter(|_| member.failed.is_none()) {
                names::values(&run.testbed, variables, row);
            }
        }
        all
    }

    /// Brings the arrays that are bound up to date.
    fn follow(&self, py: Python<'_>) -> PyResult<()> {
        for bound in locked(&self.bound).iter() {
            let new = matrix(py, self.members.len(), self.values(&bound.variables))?;
            new.copy_to(bound.array.bind(py))?;
        }
        Ok(())
    }

    /// Finds variables; all testbeds have the same.
    fn find(&self, py: Python<'_>, names: &[String]) -> PyResult<Vec<VariableRef>> {
        let first = self.members.iter().map(locked).find(|member| member.run.is_some());
        match first.as_ref().and_then(|member| member.run.as_ref()) {
            Some(run) => names::find_all(py, &run.testbed, names),
            None => Err(errors::ended(py, "the batch")),
        }
    }
}

#[pymethods]
impl Batch {
    #[new]
    #[pyo3(signature = (scenario, n, *, seeds=None, set=None, threads=0, module_path=Vec::new()))]
    fn new(
        scenario: &Bound<'_, PyAny>,
        n: usize,
        seeds: Option<Vec<u64>>,
        set: Option<&Bound<'_, PyAny>>,
        threads: usize,
        module_path: Vec<PathBuf>,
    ) -> PyResult<Self> {
        let py = scenario.py();
        if seeds.as_ref().is_some_and(|seeds| seeds.len() != n) {
            return Err(errors::refused(py, format!("seeds: {n} numbers are wanted, one for each testbed")));
        }
        let sets: Option<Bound<'_, PyList>> = set.and_then(|set| set.cast::<PyList>().ok().cloned());
        if sets.as_ref().is_some_and(|sets| sets.len() != n) {
            return Err(errors::refused(
                py,
                format!("set: {n} dictionaries are wanted, one for each testbed, or one for all"),
            ));
        }
        let common = set.and_then(|set| set.cast::<PyDict>().ok().cloned());
        if set.is_some() && sets.is_none() && common.is_none() {
            return Err(errors::refused(py, "set: a dictionary or a list of them is wanted"));
        }
        let modules = module_paths(py, module_path)?;
        let mut scenarios: Vec<Scenario> = Vec::with_capacity(n);
        for k in 0..n {
            let own = sets.as_ref().map(|sets| sets.get_item(k)).transpose()?;
            let own = own.as_ref().map(|own| own.cast::<PyDict>().cloned()).transpose()?;
            scenarios.push(load(scenario, own.as_ref().or(common.as_ref()), seeds.as_ref().map(|s| s[k]))?);
        }
        let threads = match threads {
            0 => std::thread::available_parallelism().map_or(1, usize::from),
            given => given,
        };
        let member = |_| Mutex::new(Member { run: None, failed: None });
        let batch = Self { members: (0..n).map(member).collect(), threads, bound: Mutex::default() };
        let wrong = Mutex::new(None);
        py.detach(|| {
            batch.each(|k, member| match Run::new(scenarios[k].clone(), 1, &modules, None) {
                Ok(run) => member.run = Some(run),
                Err(error) => drop(locked(&wrong).get_or_insert((k, error))),
            });
        });
        match wrong.into_inner().unwrap_or_else(PoisonError::into_inner) {
            Some((_, error)) => Err(errors::of(py, &error)),
            None => Ok(batch),
        }
    }

    fn __len__(&self) -> usize {
        self.members.len()
    }

    /// Simulated times, s.
    #[getter]
    fn t<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let time =
            |member: &Mutex<Member>| locked(member).run.as_ref().map_or(f64::NAN, |run| run.testbed.t_s());
        self.members.iter().map(time).collect::<Vec<f64>>().to_pyarray(py)
    }

    /// Why those that failed did so, by their numbers.
    #[getter]
    fn failed<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let out = PyDict::new(py);
        for (k, member) in self.members.iter().enumerate() {
            if let Some(why) = &locked(member).failed {
                out.set_item(k, why)?;
            }
        }
        Ok(out)
    }

    /// Makes n communication steps in each.
    #[pyo3(signature = (n=1))]
    fn step(&self, py: Python<'_>, n: u32) -> PyResult<()> {
        self.run_to(py, |run| run.testbed.t_s() + f64::from(n) * run.scenario.time.step_s)
    }

    /// Steps all up to a time, s.
    fn run_until(&self, py: Python<'_>, t: f64) -> PyResult<()> {
        if !t.is_finite() {
            return Err(errors::refused(py, format!("run_until: {t} is no time")));
        }
        self.run_to(py, |_| t)
    }

    /// Committed values of variables: a row for each testbed.
    fn read<'py>(&self, py: Python<'py>, names: Vec<String>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let variables = self.find(py, &names)?;
        matrix(py, self.members.len(), self.values(&variables))
    }

    /// The same as an array that every later step brings up to date.
    fn bind<'py>(&self, py: Python<'py>, names: Vec<String>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let variables = self.find(py, &names)?;
        let array = matrix(py, self.members.len(), self.values(&variables))?;
        locked(&self.bound).push(Followed { variables, array: array.clone().unbind() });
        Ok(array)
    }

    /// Sets variables: a row for each testbed, NaN leaves a value as it is.
    fn write(&self, py: Python<'_>, names: Vec<String>, values: PyReadonlyArray2<'_, f64>) -> PyResult<()> {
        self.find(py, &names)?;
        if values.shape() != [self.members.len(), names.len()] {
            let message =
                format!("write: an array of {} x {} numbers is wanted", self.members.len(), names.len());
            return Err(errors::refused(py, message));
        }
        let values = values.as_array();
        for (k, member) in self.members.iter().enumerate() {
            let mut member = locked(member);
            let Some(run) = member.run.as_mut() else { continue };
            write(py, run, &names, &values.row(k).to_vec())?;
        }
        Ok(())
    }

    /// Keeps the states of all; None for those that failed.
    fn snapshot(&self, py: Python<'_>) -> PyResult<Vec<Option<Snapshot>>> {
        let one = |member: &Mutex<Member>| {
            let mut member = locked(member);
            let ended = member.failed.is_some();
            let Some(run) = member.run.as_mut().filter(|_| !ended) else { return Ok(None) };
            let Some(place) = run.places.take() else {
                return Err(errors::refused(py, "a testbed keeps at most 64 snapshots: drop some of them"));
            };
            let state = run.testbed.snapshot(place).map_err(|error| errors::of(py, &error))?;
            Ok(Some(Snapshot { state, place, places: run.places.clone() }))
        };
        self.members.iter().map(one).collect()
    }

    /// Back to states that these testbeds have kept; None leaves one as it is.
    fn restore(&self, py: Python<'_>, snapshots: Vec<Option<Py<Snapshot>>>) -> PyResult<()> {
        if snapshots.len() != self.members.len() {
            return Err(errors::refused(py, format!("restore: {} snapshots are wanted", self.members.len())));
        }
        for (member, snapshot) in self.members.iter().zip(&snapshots) {
            let (mut member, Some(snapshot)) = (locked(member), snapshot) else { continue };
            let snapshot = snapshot.get();
            let Some(run) = member.run.as_mut() else { continue };
            if !Arc::ptr_eq(&run.places, &snapshot.places) {
                return Err(errors::refused(py, "a snapshot is one of another testbed"));
            }
            run.testbed.restore(&snapshot.state).map_err(|error| errors::of(py, &error))?;
        }
        self.follow(py)
    }
}
