//! `Batch`: many testbeds of one scenario, stepped on all cores without the interpreter's lock.
//!
//! Each testbed is stepped by one thread at a time and shares nothing with the others, so its bits are those of a testbed alone, whatever the
//! number of threads. One that fails is listed while the others go on; its values are NaN.
//!
//! The lock of a testbed is taken without the interpreter's, and nothing of Python happens while one is held: neither waits for the other.

use crate::errors::{self, Refusal, Refused};
use crate::lock::locked;
use crate::members::{Member, Members, Plan};
use crate::names;
use crate::run::Run;
use crate::scenario::{edits, load, module_paths};
use crate::snapshot::Snapshot;
use crate::testbed::{LEDGER, as_python, ledger, matrix};
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods, ToPyArray};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyMapping, PyTuple, PyWeakrefMethods, PyWeakrefReference};
use std::path::PathBuf;
use std::sync::{Arc, Mutex};
use terraglue::signals::VariableRef;

/// Variables whose values an array follows.
struct Followed {
    variables: Vec<VariableRef>,
    /// It is followed as long as somebody holds it.
    array: Py<PyWeakrefReference>,
}

/// Many testbeds of one scenario.
#[pyclass(frozen, module = "terraglue")]
pub struct Batch {
    members: Members,
    bound: Mutex<Vec<Arc<Followed>>>,
}

impl Batch {
    /// Steps each up to a time of its own; after a signal, arrays show how far it came.
    fn run_to(&self, py: Python<'_>, until_s: Vec<f64>) -> PyResult<()> {
        loop {
            let all_there = py.detach(|| self.members.step_towards(&until_s));
            let heard = if all_there { Ok(()) } else { py.check_signals() };
            if all_there || heard.is_err() {
                return heard.and(self.follow(py));
            }
        }
    }

    /// Values of all, row by row; NaN of those that failed.
    fn values(&self, py: Python<'_>, variables: &[VariableRef]) -> Vec<f64> {
        let row = |_: usize, member: &mut Member| {
            let mut row = vec![f64::NAN; variables.len()];
            if let Some(run) = member.alive() {
                names::values(&run.testbed, variables, &mut row);
            }
            row
        };
        py.detach(|| self.members.map(row)).concat()
    }

    /// Brings the arrays that are bound up to date; those that nobody else holds are dropped.
    fn follow(&self, py: Python<'_>) -> PyResult<()> {
        let bound = locked(&self.bound).clone();
        let mut gone = Vec::new();
        for followed in bound {
            let Some(array) = followed.array.bind(py).upgrade() else {
                gone.push(followed);
                continue;
            };
            let values = self.values(py, &followed.variables);
            let new = matrix(py, self.members.len(), followed.variables.len(), values)?;
            new.copy_to(array.cast::<PyArray2<f64>>()?)?;
        }
        let is_gone = |one: &Arc<Followed>| gone.iter().any(|other| Arc::ptr_eq(one, other));
        locked(&self.bound).retain(|one| !is_gone(one));
        Ok(())
    }

    /// Finds variables; all testbeds have the same.
    fn find(&self, py: Python<'_>, names: &[String]) -> PyResult<Vec<VariableRef>> {
        let found = py.detach(|| self.members.first(|run| names::find_all(run, names)));
        found.unwrap_or(Err(Refusal::Ended("the batch"))).map_err(|refusal| refusal.raise(py))
    }

    /// Does something with each, and raises the first refusal.
    fn try_each<T: Send>(
        &self,
        py: Python<'_>,
        work: impl Fn(usize, &mut Member) -> Refused<T> + Sync,
    ) -> PyResult<Vec<T>> {
        let all: Vec<Refused<T>> = py.detach(|| self.members.map(&work));
        let numbered =
            all.into_iter().enumerate().map(|(k, one)| one.map_err(|refusal| refusal.of_member(k)));
        numbered.collect::<Refused<Vec<T>>>().map_err(|refusal| refusal.raise(py))
    }

    /// Builds those that have no run, and raises the first refusal.
    fn build(&self, py: Python<'_>) -> PyResult<()> {
        while !py.detach(|| self.members.build()) {
            if let Err(signal) = py.check_signals() {
                py.detach(|| self.members.forget());
                return Err(signal);
            }
        }
        self.try_each(py, |_, member| member.refusal.take().map_or(Ok(()), |error| Err(error.into())))
            .map(drop)
    }
}

/// A value for each of n, from a list of them or one for all.
fn one_each<'py>(
    what: &str,
    given: Option<&Bound<'py, PyAny>>,
    n: usize,
) -> PyResult<Vec<Option<Bound<'py, PyAny>>>> {
    let Some(given) = given.filter(|given| !given.is_none()) else { return Ok(vec![None; n]) };
    if given.cast::<PyMapping>().is_ok() || !given.hasattr("__len__")? {
        return Ok(vec![Some(given.clone()); n]);
    }
    let all = given.try_iter()?.map(|one| one.map(Some)).collect::<PyResult<Vec<_>>>()?;
    match all.len() == n {
        true => Ok(all),
        false => {
            let message = format!(
                "{what}: a list of {n} is wanted, one for each testbed, or one for all; not {}",
                all.len()
            );
            Err(errors::refused(given.py(), message))
        }
    }
}

#[pymethods]
impl Batch {
    #[new]
    #[pyo3(signature = (scenario, n, *, seeds=None, set=None, threads=0, module_path=Vec::new(), out=None))]
    fn new(
        scenario: &Bound<'_, PyAny>,
        n: usize,
        seeds: Option<Vec<u64>>,
        set: Option<&Bound<'_, PyAny>>,
        threads: usize,
        module_path: Vec<PathBuf>,
        out: Option<PathBuf>,
    ) -> PyResult<Self> {
        let py = scenario.py();
        if n == 0 {
            return Err(errors::refused(py, "a batch has at least one testbed"));
        }
        if seeds.as_ref().is_some_and(|seeds| seeds.len() != n) {
            return Err(errors::refused(py, format!("seeds: {n} numbers are wanted, one for each testbed")));
        }
        let sets = one_each("set", set, n)?;
        let mut plans = Vec::with_capacity(n);
        for (k, set) in sets.iter().enumerate() {
            let scenario = load(scenario, set.as_ref(), seeds.as_ref().map(|seeds| seeds[k]))?;
            plans.push(Plan { scenario, out: out.as_ref().map(|out| out.join(k.to_string())) });
        }
        let members = Members::new(plans, threads, module_paths(py, module_path)?);
        let batch = Self { members, bound: Mutex::default() };
        batch.build(py)?;
        Ok(batch)
    }

    fn __len__(&self) -> usize {
        self.members.len()
    }

    /// Simulated times, s.
    #[getter]
    fn t<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let time =
            |_: usize, member: &mut Member| member.run.as_ref().map_or(f64::NAN, |run| run.testbed.t_s());
        py.detach(|| self.members.map(time)).to_pyarray(py)
    }

    /// Communication step of the first, s.
    #[getter]
    fn step_s(&self, py: Python<'_>) -> PyResult<f64> {
        let step_s = py.detach(|| self.members.first(|run| run.scenario.time.step_s));
        step_s.ok_or_else(|| Refusal::Ended("the batch").raise(py))
    }

    /// Why those that failed did so, by their numbers.
    #[getter]
    fn failed<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let out = PyDict::new(py);
        let all = py.detach(|| self.members.map(|_, member| member.failed.clone()));
        let failed = all.into_iter().enumerate().filter_map(|(k, why)| Some((k, why?)));
        failed.into_iter().try_for_each(|(k, why)| out.set_item(k, why))?;
        Ok(out)
    }

    /// Makes n communication steps in each.
    #[pyo3(signature = (n=1))]
    fn step(&self, py: Python<'_>, n: u32) -> PyResult<()> {
        let ahead = |run: &Run| run.testbed.t_s() + f64::from(n) * run.scenario.time.step_s;
        let until_s = |_: usize, member: &mut Member| member.run.as_ref().map_or(f64::NAN, ahead);
        let until_s = py.detach(|| self.members.map(until_s));
        self.run_to(py, until_s)
    }

    /// Steps all up to a time, s, or each up to one of its own; NaN leaves one where it is.
    fn run_until(&self, py: Python<'_>, t: &Bound<'_, PyAny>) -> PyResult<()> {
        let times: Vec<f64> = match t.extract::<f64>() {
            Ok(time) if !time.is_finite() => {
                return Err(errors::refused(py, format!("run_until: {time} is no time")));
            }
            Ok(time) => vec![time; self.members.len()],
            Err(_) => t.extract().map_err(|_| {
                errors::refused(py, "run_until: a time in s is wanted, or one for each testbed")
            })?,
        };
        if times.len() != self.members.len() {
            let message = format!("run_until: {} times are wanted, not {}", self.members.len(), times.len());
            return Err(errors::refused(py, message));
        }
        if times.contains(&f64::INFINITY) {
            return Err(errors::refused(py, "run_until: inf is no time"));
        }
        self.run_to(py, times)
    }

    /// Committed values of variables: a row for each testbed.
    fn read<'py>(&self, py: Python<'py>, names: Vec<String>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let variables = self.find(py, &names)?;
        matrix(py, self.members.len(), variables.len(), self.values(py, &variables))
    }

    /// The same as an array that every later step brings up to date.
    fn bind<'py>(&self, py: Python<'py>, names: Vec<String>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let variables = self.find(py, &names)?;
        let array = matrix(py, self.members.len(), variables.len(), self.values(py, &variables))?;
        let weak = PyWeakrefReference::new(array.as_any())?.unbind();
        let followed = Arc::new(Followed { variables, array: weak });
        locked(&self.bound).push(followed);
        Ok(array)
    }

    /// Sets variables: a row for each testbed, NaN leaves a value as it is. All are set, or none.
    fn write(&self, py: Python<'_>, names: Vec<String>, values: PyReadonlyArray2<'_, f64>) -> PyResult<()> {
        self.find(py, &names)?;
        if values.shape() != [self.members.len(), names.len()] {
            let message =
                format!("write: an array of {} x {} numbers is wanted", self.members.len(), names.len());
            return Err(errors::refused(py, message));
        }
        let rows: Vec<Vec<f64>> = values.as_array().rows().into_iter().map(|row| row.to_vec()).collect();
        let object = |k: usize, member: &mut Member| {
            member.alive().map_or(Ok(()), |run| names::object(run, &names, &rows[k]))
        };
        self.try_each(py, object)?;
        let write = |k: usize, member: &mut Member| {
            member.alive().map_or(Ok(()), |run| names::write(run, &names, &rows[k]))
        };
        self.try_each(py, write).map(drop)
    }

    /// Energies of all subsystems of each testbed together, J; NaN of those that failed.
    fn energy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let of = |_: usize, member: &mut Member| {
            member.alive().map_or([f64::NAN; LEDGER.len()], |run| ledger(&run.testbed.energy()))
        };
        let all = py.detach(|| self.members.map(of));
        let out = PyDict::new(py);
        for (part, name) in LEDGER.iter().enumerate() {
            let column: Vec<f64> = all.iter().map(|one| one[part]).collect();
            out.set_item(name, column.to_pyarray(py))?;
        }
        Ok(out)
    }

    /// Builds testbed k, or each of a list of them, anew from its start, with another seed or further edits where they are given; the
    /// others stay as they are.
    #[pyo3(signature = (k, *, seed=None, set=None))]
    fn restart(
        &self,
        py: Python<'_>,
        k: &Bound<'_, PyAny>,
        seed: Option<&Bound<'_, PyAny>>,
        set: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let which: Vec<usize> = match k.extract::<usize>() {
            Ok(one) => vec![one],
            Err(_) => k.extract().map_err(|_| {
                errors::refused(py, "restart: the number of a testbed is wanted, or a list of them")
            })?,
        };
        if let Some(wrong) = which.iter().find(|k| **k >= self.members.len()) {
            let message =
                format!("restart: there is no testbed {wrong}: they are 0 to {}", self.members.len() - 1);
            return Err(errors::refused(py, message));
        }
        let (seeds, sets) = (one_each("seed", seed, which.len())?, one_each("set", set, which.len())?);
        let edit = |(seed, set): (&Option<Bound<'_, PyAny>>, &Option<Bound<'_, PyAny>>)| {
            edits(set.as_ref(), seed.as_ref().map(|seed| seed.extract()).transpose()?)
        };
        let edited = seeds.iter().zip(&sets).map(edit).collect::<PyResult<Vec<_>>>()?;
        let planned = py.detach(|| self.members.plan_again(&which, &edited));
        planned.map_err(|refusal| refusal.raise(py))?;
        self.build(py)?;
        self.follow(py)
    }

    /// Keeps the states of all; None for those that failed.
    fn snapshot(&self, py: Python<'_>) -> PyResult<Vec<Option<Snapshot>>> {
        self.try_each(py, |_, member| member.alive().map(Run::snapshot).transpose())
    }

    /// Back to states that these testbeds have kept, also after a failure; None leaves one as it is.
    fn restore(&self, py: Python<'_>, snapshots: Vec<Option<Py<Snapshot>>>) -> PyResult<()> {
        if snapshots.len() != self.members.len() {
            return Err(errors::refused(py, format!("restore: {} snapshots are wanted", self.members.len())));
        }
        self.try_each(py, |k, member| {
            let (Some(run), Some(snapshot)) = (member.run.as_mut(), &snapshots[k]) else { return Ok(()) };
            run.restore(snapshot.get())?;
            member.failed = None;
            Ok(())
        })?;
        self.follow(py)
    }

    /// Ends all runs; the summary of each that was recorded.
    fn finish<'py>(&self, py: Python<'py>) -> PyResult<Vec<Option<Bound<'py, PyAny>>>> {
        let summaries =
            self.try_each(py, |_, member| Ok(member.run.take().map(Run::finish).transpose()?.flatten()))?;
        summaries.into_iter().map(|one| one.map(|summary| as_python(py, &summary)).transpose()).collect()
    }

    fn __enter__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    #[pyo3(signature = (*_error))]
    fn __exit__(&self, py: Python<'_>, _error: &Bound<'_, PyTuple>) -> PyResult<()> {
        self.finish(py).map(drop)
    }
}
