//! `Testbed`: a running scenario.

use crate::errors::{Refusal, Refused};
use crate::ground::{self, Heights};
use crate::lock::locked;
use crate::observe::{self, Observation};
use crate::point_cloud;
use crate::run::Run;
use crate::scenario::{load, module_paths, value_of};
use crate::snapshot::Snapshot;
use crate::{errors, names};
use numpy::{
    PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods, ToPyArray,
};
use pyo3::prelude::*;
use pyo3::sync::MutexExt;
use pyo3::types::{PyBytes, PyDict};
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use terraglue::recording::Summary;
use terraglue::scenario::did_you_mean;
use terraglue::subsystem::Energy;

/// Wall time after which Python checks for signals such as Ctrl-C.
const SLICE: Duration = Duration::from_millis(50);

/// A running scenario: a file, the name of one that comes with the package, or a dictionary.
#[pyclass(frozen, module = "terraglue")]
pub struct Testbed(Mutex<Option<Run>>);

impl Testbed {
    fn lock(&self) -> MutexGuard<'_, Option<Run>> {
        locked(&self.0)
    }

    /// The same, while the interpreter goes on with other threads until it is free.
    fn attached<'a>(&'a self, py: Python<'_>) -> MutexGuard<'a, Option<Run>> {
        self.0.lock_py_attached(py).unwrap_or_else(PoisonError::into_inner)
    }

    /// Does something with the run; nothing of Python is made before the lock is free again.
    fn with<T>(&self, py: Python<'_>, work: impl FnOnce(&mut Run) -> Refused<T>) -> PyResult<T> {
        let done = match self.attached(py).as_mut() {
            Some(run) => work(run),
            None => Err(Refusal::Ended("the testbed")),
        };
        done.map_err(|refusal| refusal.raise(py))
    }

    /// The newest message of a stream whose schema is accepted.
    fn newest(
        &self,
        py: Python<'_>,
        stream: &str,
        accepts: impl Fn(&str) -> Refused<()>,
    ) -> PyResult<Option<(f64, Vec<u8>)>> {
        self.with(py, |run| {
            let found = run.testbed.view(|view| {
                let own = view.streams.iter().find(|s| s.name == stream);
                own.map(|s| accepts(&s.info.schema).map(|()| s.messages.last().cloned()))
            });
            found.unwrap_or_else(|| {
                let near = did_you_mean(
                    stream,
                    run.testbed.signals().directory.streams().iter().map(String::as_str),
                );
                let near = near.map(|near| format!("; {near}")).unwrap_or_default();
                Err(Refusal::Unknown(format!("there is no stream `{stream}`{near}")))
            })
        })
    }

    /// Steps in slices of wall time, between which Python checks for signals, until all are done.
    fn in_slices(
        &self,
        py: Python<'_>,
        mut slice: impl FnMut(&mut Run) -> Refused<bool> + Send,
    ) -> PyResult<()> {
        loop {
            match py.detach(|| self.lock().as_mut().map(&mut slice)) {
                None => return Err(Refusal::Ended("the testbed").raise(py)),
                Some(Err(refusal)) => return Err(refusal.raise(py)),
                Some(Ok(true)) => return Ok(()),
                Some(Ok(false)) => py.check_signals()?,
            }
        }
    }
}

#[pymethods]
impl Testbed {
    #[new]
    #[pyo3(signature = (scenario, *, set=None, seed=None, threads=1, module_path=Vec::new(), out=None))]
    fn new(
        scenario: &Bound<'_, PyAny>,
        set: Option<&Bound<'_, PyAny>>,
        seed: Option<u64>,
        threads: usize,
        module_path: Vec<PathBuf>,
        out: Option<PathBuf>,
    ) -> PyResult<Self> {
        let py = scenario.py();
        let loaded = load(scenario, set, seed)?;
        let modules = module_paths(py, module_path)?;
        let run = py.detach(|| Run::new(loaded, threads, &modules, out.as_deref()));
        Ok(Self(Mutex::new(Some(run.map_err(|error| errors::of(py, &error))?))))
    }

    /// Simulated time, s.
    #[getter]
    fn t(&self, py: Python<'_>) -> PyResult<f64> {
        self.with(py, |run| Ok(run.testbed.t_s()))
    }

    /// Communication step, s.
    #[getter]
    fn step_s(&self, py: Python<'_>) -> PyResult<f64> {
        self.with(py, |run| Ok(run.scenario.time.step_s))
    }

    /// Simulated time of the scenario, s.
    #[getter]
    fn duration_s(&self, py: Python<'_>) -> PyResult<f64> {
        self.with(py, |run| Ok(run.scenario.time.duration_s))
    }

    /// All variables by their full names.
    #[getter]
    fn names(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        self.with(py, |run| Ok(run.testbed.signals().directory.names().to_vec()))
    }

    /// All streams by their full names.
    #[getter]
    fn streams(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        self.with(py, |run| Ok(run.testbed.signals().directory.streams().to_vec()))
    }

    /// Unit of a variable.
    fn unit(&self, py: Python<'_>, name: &str) -> PyResult<String> {
        self.with(py, |run| Ok(names::describe(run, name)?.unit.clone()))
    }

    /// Units of variables.
    fn units(&self, py: Python<'_>, names: Vec<String>) -> PyResult<Vec<String>> {
        let unit = |run: &Run, name: &String| Ok(names::describe(run, name)?.unit.clone());
        self.with(py, |run| names.iter().map(|name| unit(run, name)).collect())
    }

    /// All actions of `act`: help by full name.
    #[getter]
    fn actions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let out = PyDict::new(py);
        let all = self.with(py, |run| Ok(names::actions(&run.testbed)))?;
        all.into_iter().try_for_each(|(name, help)| out.set_item(name, help))?;
        Ok(out)
    }

    /// Follows variables from the next step on: a row of values after each `every` steps.
    #[pyo3(signature = (names, *, every=1))]
    fn observe(&self, py: Python<'_>, names: Vec<String>, every: u64) -> PyResult<Observation> {
        self.with(py, |run| {
            let (observation, follower) = observe::begin(run, names, every)?;
            run.followers.push(follower);
            Ok(observation)
        })
    }

    /// Meaning of a variable.
    fn help(&self, py: Python<'_>, name: &str) -> PyResult<String> {
        self.with(py, |run| Ok(names::describe(run, name)?.help.clone()))
    }

    /// Makes n communication steps; of several threads each makes its own.
    #[pyo3(signature = (n=1))]
    fn step(&self, py: Python<'_>, n: u32) -> PyResult<()> {
        let mut left = n;
        self.in_slices(py, |run| {
            left = run.make_steps(left, SLICE)?;
            Ok(left == 0)
        })
    }

    /// Steps up to a time, s.
    fn run_until(&self, py: Python<'_>, t: f64) -> PyResult<()> {
        if !t.is_finite() {
            return Err(errors::refused(py, format!("run_until: {t} is no time")));
        }
        self.in_slices(py, |run| Ok(run.run_until(t, SLICE)?))
    }

    /// Committed values of variables, in their units.
    fn read<'py>(&self, py: Python<'py>, names: Vec<String>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let values = self.with(py, |run| {
            let variables = names::find_all(run, &names)?;
            let mut out = vec![0.0; variables.len()];
            names::values(&run.testbed, &variables, &mut out);
            Ok(out)
        })?;
        Ok(values.to_pyarray(py))
    }

    /// Sets variables to numbers, which take effect in the next step; NaN leaves a value as it is.
    fn write(&self, py: Python<'_>, names: Vec<String>, values: PyReadonlyArray1<'_, f64>) -> PyResult<()> {
        let values = values.as_array().to_vec();
        self.with(py, |run| names::write(run, &names, &values))
    }

    /// For each row of `values`: sets the variables `inputs` to it, makes a step, and reads `outputs`; those in a row for each step.
    fn drive<'py>(
        &self,
        py: Python<'py>,
        inputs: Vec<String>,
        values: PyReadonlyArray2<'_, f64>,
        outputs: Vec<String>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let [rows, columns] = [values.shape()[0], values.shape()[1]];
        if columns != inputs.len() {
            let message = format!("drive: {} numbers in each row are wanted, not {columns}", inputs.len());
            return Err(errors::refused(py, message));
        }
        let all: Vec<f64> = values.as_array().iter().copied().collect();
        let found = self.with(py, |run| names::find_all(run, &outputs))?;
        let mut out = vec![f64::NAN; rows * found.len()];
        let mut next = 0;
        self.in_slices(py, |run| {
            let begin = Instant::now();
            while next < rows && begin.elapsed() < SLICE {
                names::write(run, &inputs, &all[next * columns..(next + 1) * columns])?;
                run.make_steps(1, Duration::MAX)?;
                names::values(&run.testbed, &found, &mut out[next * found.len()..(next + 1) * found.len()]);
                next += 1;
            }
            Ok(next == rows)
        })?;
        matrix(py, rows, outputs.len(), out)
    }

    fn __getitem__(&self, py: Python<'_>, name: &str) -> PyResult<f64> {
        self.with(py, |run| {
            let variable = names::find(run, name)?;
            let none = || Refusal::Input(format!("`{name}` is no number, or its subsystem has none now"));
            variable.number(run.testbed.instances()).map_err(|_| none())
        })
    }

    fn __setitem__(&self, py: Python<'_>, name: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
        let value = value_of(value)?;
        self.with(py, |run| names::set(run, name, &value))
    }

    fn __contains__(&self, py: Python<'_>, name: &str) -> PyResult<bool> {
        self.with(py, |run| Ok(run.testbed.signals().directory.find(name).is_some()))
    }

    /// Does one of `actions`, `subsystem.action`, with arguments where its module takes some.
    #[pyo3(signature = (action, **arguments))]
    fn act(&self, py: Python<'_>, action: &str, arguments: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        let arguments = match arguments {
            Some(arguments) => value_of(arguments.as_any())?.to_string(),
            None => "{}".to_owned(),
        };
        self.with(py, |run| names::act(run, action, &arguments))
    }

    /// Keeps the whole state; `restore` goes back to it.
    fn snapshot(&self, py: Python<'_>) -> PyResult<Snapshot> {
        self.with(py, Run::snapshot)
    }

    /// Back to a state that this testbed has kept, exactly.
    fn restore(&self, py: Python<'_>, snapshot: &Bound<'_, Snapshot>) -> PyResult<()> {
        self.with(py, |run| run.restore(snapshot.get()))
    }

    /// The whole state as bytes, for a testbed of the same scenario, here or in another process.
    fn serialize<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = self.with(py, Run::serialize)?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Into the state of bytes that `serialize` has made, exactly.
    fn deserialize(&self, py: Python<'_>, state: &[u8]) -> PyResult<()> {
        self.with(py, |run| run.deserialize(state))
    }

    /// Poses of all bodies by `subsystem.body`: x, y, z (m), quaternion w, x, y, z, velocity (m/s) and rotation rate (rad/s), world
    /// axes: thirteen numbers each.
    fn bodies<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = self.with(py, |run| {
            Ok(run.testbed.view(|view| {
                let of = |s: &terraglue::observer::SubsystemView| {
                    let named = s.scene.bodies.iter().zip(s.body_states);
                    named
                        .map(|(body, state)| (format!("{}.{}", s.name, body.name), numbers(state)))
                        .collect::<Vec<_>>()
                };
                view.subsystems.iter().flat_map(of).collect::<Vec<_>>()
            }))
        })?;
        let out = PyDict::new(py);
        all.into_iter().try_for_each(|(name, state)| out.set_item(name, state.to_pyarray(py)))?;
        Ok(out)
    }

    /// The ground within x0 … x1 and y0 … y1, m: x of the columns, y of the rows, heights (rows × columns), m.
    fn heights<'py>(&self, py: Python<'py>, x0: f64, x1: f64, y0: f64, y1: f64) -> PyResult<Heights<'py>> {
        let nodes = self.with(py, |run| ground::heights(&run.testbed, [x0, x1], [y0, y1]))?;
        Ok(ground::arrays(py, nodes))
    }

    /// The newest message of a stream in the last step: time (s) and bytes; None: the step made none.
    fn message(&self, py: Python<'_>, stream: &str) -> PyResult<Option<(f64, Vec<u8>)>> {
        self.newest(py, stream, |_| Ok(()))
    }

    /// The same of a stream of `foxglove.PointCloud`, as an array with a field for each number of a point.
    fn points<'py>(&self, py: Python<'py>, stream: &str) -> PyResult<Option<Bound<'py, PyAny>>> {
        let message = self.newest(py, stream, |schema| match schema {
            point_cloud::SCHEMA => Ok(()),
            _ => Err(Refusal::Input(format!("`{stream}` has no points: its messages are {schema}"))),
        })?;
        message.map(|(t_s, bytes)| point_cloud::array(py, (stream, t_s), &bytes)).transpose()
    }

    /// Energies of all subsystems together, J.
    fn energy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let energy = self.with(py, |run| Ok(run.testbed.energy()))?;
        let out = PyDict::new(py);
        LEDGER.iter().zip(ledger(&energy)).try_for_each(|(name, value)| out.set_item(name, value))?;
        Ok(out)
    }

    /// Ends the run; the summary where it was recorded.
    fn finish<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let Some(run) = py.detach(|| self.lock().take()) else { return Ok(None) };
        let summary = py.detach(|| run.finish()).map_err(|error| errors::of(py, &error))?;
        summary.map(|summary| as_python(py, &summary)).transpose()
    }

    fn __enter__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    #[pyo3(signature = (*_error))]
    fn __exit__(&self, py: Python<'_>, _error: &Bound<'_, pyo3::types::PyTuple>) -> PyResult<()> {
        self.finish(py).map(drop)
    }
}

/// Parts of a ledger of energies.
pub const LEDGER: [&str; 6] =
    ["kinetic", "potential", "dissipated", "port_work", "actuator_work", "electrical"];

/// Their values, J.
pub fn ledger(e: &Energy) -> [f64; 6] {
    [e.kinetic, e.potential, e.dissipated, e.port_work, e.actuator_work, e.electrical]
}

/// A summary as a dictionary.
pub fn as_python<'py>(py: Python<'py>, summary: &Summary) -> PyResult<Bound<'py, PyAny>> {
    let text = serde_json::to_string(summary).unwrap_or_default();
    py.import("json")?.call_method1("loads", (text,))
}

fn numbers(state: &terraglue::subsystem::BodyState) -> Vec<f64> {
    let pose = &state.world_from_body;
    let parts: [&[f64]; 4] =
        [&pose.position, &pose.orientation, &state.linear_velocity, &state.angular_velocity];
    parts.concat()
}

/// A new array of rows and columns.
pub fn matrix(
    py: Python<'_>,
    rows: usize,
    columns: usize,
    values: Vec<f64>,
) -> PyResult<Bound<'_, PyArray2<f64>>> {
    values.to_pyarray(py).reshape([rows, columns])
}
