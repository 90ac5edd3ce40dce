//! `Testbed`: a running scenario.

use crate::ground::{self, Heights};
use crate::run::{MOST_SNAPSHOTS, Run};
use crate::scenario::{load, module_paths, value_of};
use crate::snapshot::Snapshot;
use crate::{errors, names};
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, ToPyArray};
use pyo3::prelude::*;
use pyo3::sync::MutexExt;
use pyo3::types::PyDict;
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use terraglue::Result;

/// Wall time after which Python checks for signals such as Ctrl-C.
const SLICE: Duration = Duration::from_millis(50);

/// A running scenario: a file, the name of one that comes with the package, or a dictionary.
#[pyclass(frozen, module = "terraglue")]
pub struct Testbed(Mutex<Option<Run>>);

impl Testbed {
    fn lock(&self) -> MutexGuard<'_, Option<Run>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The same, while the interpreter goes on with other threads until it is free.
    fn attached<'a>(&'a self, py: Python<'_>) -> MutexGuard<'a, Option<Run>> {
        self.0.lock_py_attached(py).unwrap_or_else(PoisonError::into_inner)
    }

    /// Does something with the run without holding the interpreter while another thread steps it.
    fn with<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(Python<'_>, &mut Run) -> PyResult<T>,
    ) -> PyResult<T> {
        let mut run = self.attached(py);
        match run.as_mut() {
            Some(run) => work(py, run),
            None => Err(errors::ended(py, "the testbed")),
        }
    }

    /// Steps in slices of wall time, between which Python checks for signals, until all are done.
    fn in_slices(
        &self,
        py: Python<'_>,
        mut slice: impl FnMut(&mut Run) -> Result<bool> + Send,
    ) -> PyResult<()> {
        loop {
            match py.detach(|| self.lock().as_mut().map(&mut slice)) {
                None => return Err(errors::ended(py, "the testbed")),
                Some(Err(error)) => return Err(errors::of(py, &error)),
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
        set: Option<&Bound<'_, PyDict>>,
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
        self.with(py, |_, run| Ok(run.testbed.t_s()))
    }

    /// Communication step, s.
    #[getter]
    fn step_s(&self, py: Python<'_>) -> PyResult<f64> {
        self.with(py, |_, run| Ok(run.scenario.time.step_s))
    }

    /// Simulated time of the scenario, s.
    #[getter]
    fn duration_s(&self, py: Python<'_>) -> PyResult<f64> {
        self.with(py, |_, run| Ok(run.scenario.time.duration_s))
    }

    /// All variables by their full names.
    #[getter]
    fn names(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        self.with(py, |_, run| Ok(run.testbed.signals().directory.names().to_vec()))
    }

    /// All streams by their full names.
    #[getter]
    fn streams(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        self.with(py, |_, run| Ok(run.testbed.signals().directory.streams().to_vec()))
    }

    /// Unit of a variable.
    fn unit(&self, py: Python<'_>, name: &str) -> PyResult<String> {
        self.with(py, |py, run| Ok(names::describe(py, &run.testbed, name)?.unit.clone()))
    }

    /// Meaning of a variable.
    fn help(&self, py: Python<'_>, name: &str) -> PyResult<String> {
        self.with(py, |py, run| Ok(names::describe(py, &run.testbed, name)?.help.clone()))
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
        self.in_slices(py, |run| run.run_until(t, SLICE))
    }

    /// Committed values of variables, in their units.
    fn read<'py>(&self, py: Python<'py>, names: Vec<String>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let values = self.with(py, |py, run| {
            let variables = names::find_all(py, &run.testbed, &names)?;
            let mut out = vec![0.0; variables.len()];
            names::values(&run.testbed, &variables, &mut out);
            Ok(out)
        })?;
        Ok(values.to_pyarray(py))
    }

    /// Sets variables to numbers, which take effect in the next step; NaN leaves a value as it is.
    fn write(&self, py: Python<'_>, names: Vec<String>, values: PyReadonlyArray1<'_, f64>) -> PyResult<()> {
        let values = values.as_array().to_vec();
        self.with(py, |py, run| write(py, run, &names, &values))
    }

    fn __getitem__(&self, py: Python<'_>, name: &str) -> PyResult<f64> {
        self.with(py, |py, run| {
            let variable = names::find(py, &run.testbed, name)?;
            variable.number(run.testbed.instances()).map_err(|_| {
                errors::refused(py, format!("`{name}` is no number, or its subsystem has none now"))
            })
        })
    }

    fn __setitem__(&self, py: Python<'_>, name: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
        let value = value_of(value)?;
        self.with(py, |py, run| {
            names::find(py, &run.testbed, name)?;
            run.testbed.set(name, &value).map_err(|error| match error {
                terraglue::Error::Simulation { message, .. } => errors::refused(py, message),
                other => errors::of(py, &other),
            })
        })
    }

    fn __contains__(&self, py: Python<'_>, name: &str) -> PyResult<bool> {
        self.with(py, |_, run| Ok(run.testbed.signals().directory.find(name).is_some()))
    }

    /// Does an action, `subsystem.action`, with its arguments.
    #[pyo3(signature = (action, **arguments))]
    fn act(&self, py: Python<'_>, action: &str, arguments: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        let arguments = match arguments {
            Some(arguments) => value_of(arguments.as_any())?.to_string(),
            None => "{}".to_owned(),
        };
        self.with(py, |py, run| run.testbed.act(action, &arguments).map_err(|error| errors::of(py, &error)))
    }

    /// Keeps the whole state; [`restore`] goes back to it.
    fn snapshot(&self, py: Python<'_>) -> PyResult<Snapshot> {
        self.with(py, |py, run| {
            let Some(place) = run.places.take() else {
                let message =
                    format!("a testbed keeps at most {MOST_SNAPSHOTS} snapshots: drop some of them");
                return Err(errors::refused(py, message));
            };
            let kept = run.testbed.snapshot(place);
            let state = kept.map_err(|error| errors::of(py, &error))?;
            Ok(Snapshot { state, place, places: run.places.clone() })
        })
    }

    /// Back to a state that this testbed has kept, exactly.
    fn restore(&self, py: Python<'_>, snapshot: &Bound<'_, Snapshot>) -> PyResult<()> {
        let snapshot = snapshot.get();
        self.with(py, |py, run| {
            if !std::sync::Arc::ptr_eq(&run.places, &snapshot.places) {
                return Err(errors::refused(py, "the snapshot is one of another testbed"));
            }
            if run.is_recorded() {
                return Err(errors::refused(
                    py,
                    "a testbed that is recorded cannot go back: leave `out` away",
                ));
            }
            run.testbed.restore(&snapshot.state).map_err(|error| errors::of(py, &error))
        })
    }

    /// Poses of all bodies by `subsystem.body`: x, y, z (m), quaternion w, x, y, z, velocity (m/s) and rotation rate (rad/s), world
    /// axes: thirteen numbers each.
    fn bodies<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let all = self.with(py, |_, run| {
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
        let mut run = self.attached(py);
        match run.as_mut() {
            Some(run) => ground::heights(py, &run.testbed, [x0, x1], [y0, y1]),
            None => Err(errors::ended(py, "the testbed")),
        }
    }

    /// The newest message of a stream in the last step: time (s) and bytes; None: the step made none.
    fn message(&self, py: Python<'_>, stream: &str) -> PyResult<Option<(f64, Vec<u8>)>> {
        self.with(py, |py, run| {
            let found = run.testbed.view(|view| {
                let own = view.streams.iter().find(|s| s.name == stream);
                own.map(|s| s.messages.last().cloned())
            });
            found.ok_or_else(|| errors::unknown(py, format!("there is no stream `{stream}`")))
        })
    }

    /// Energies of all subsystems together, J.
    fn energy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let e = self.with(py, |_, run| Ok(run.testbed.energy()))?;
        let out = PyDict::new(py);
        for (name, value) in [
            ("kinetic", e.kinetic),
            ("potential", e.potential),
            ("dissipated", e.dissipated),
            ("port_work", e.port_work),
            ("actuator_work", e.actuator_work),
            ("electrical", e.electrical),
        ] {
            out.set_item(name, value)?;
        }
        Ok(out)
    }

    /// Ends the run; the summary where it was recorded.
    fn finish<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let Some(run) = py.detach(|| self.lock().take()) else { return Ok(None) };
        let summary = py.detach(|| run.finish()).map_err(|error| errors::of(py, &error))?;
        let Some(summary) = summary else { return Ok(None) };
        let text = serde_json::to_string(&summary).unwrap_or_default();
        py.import("json")?.call_method1("loads", (text,)).map(Some)
    }

    fn __enter__(slf: Py<Self>) -> Py<Self> {
        slf
    }

    #[pyo3(signature = (*_error))]
    fn __exit__(&self, py: Python<'_>, _error: &Bound<'_, pyo3::types::PyTuple>) -> PyResult<()> {
        self.finish(py).map(drop)
    }
}

/// Sets variables of a run.
pub fn write(py: Python<'_>, run: &mut Run, names: &[String], values: &[f64]) -> PyResult<()> {
    if names.len() != values.len() {
        let message = format!("write: {} numbers are wanted, one for each name", names.len());
        return Err(errors::refused(py, message));
    }
    names::find_all(py, &run.testbed, names)?;
    for (name, value) in names.iter().zip(values).filter(|(_, value)| !value.is_nan()) {
        run.testbed.set(name, &serde_json::Value::from(*value)).map_err(|error| match error {
            terraglue::Error::Simulation { message, .. } => errors::refused(py, message),
            other => errors::of(py, &other),
        })?;
    }
    Ok(())
}

fn numbers(state: &terraglue::subsystem::BodyState) -> Vec<f64> {
    let pose = &state.world_from_body;
    let parts: [&[f64]; 4] =
        [&pose.position, &pose.orientation, &state.linear_velocity, &state.angular_velocity];
    parts.concat()
}

/// A new array of n rows.
pub fn matrix(py: Python<'_>, rows: usize, values: Vec<f64>) -> PyResult<Bound<'_, PyArray2<f64>>> {
    let columns = values.len().checked_div(rows).unwrap_or(0);
    values.to_pyarray(py).reshape([rows, columns])
}
