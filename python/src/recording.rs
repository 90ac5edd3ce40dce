//! `Recording`: the recorded values of a run as arrays.

use crate::errors;
use crate::ground::{Heights, Nodes, arrays};
use crate::testbed::matrix;
use numpy::ndarray::{Array2, Array3};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray3, ToPyArray};
use pyo3::prelude::*;
use std::path::PathBuf;
use terraglue::recording;

/// Times (s) and values.
type Series<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>);

/// Times (s), names, and values in each row.
type Energies<'py> = (Bound<'py, PyArray1<f64>>, Vec<String>, Bound<'py, PyArray2<f64>>);

/// Times (s) and a pose in each row.
type Poses<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<f64>>);

/// A recording, also one that was cut off.
#[pyclass(frozen, module = "terraglue")]
pub struct Recording(recording::Recording);

impl Recording {
    fn all(&self) -> impl Iterator<Item = String> + '_ {
        let of = |(subsystem, table): (&String, &recording::Table)| {
            table.names.iter().map(|name| format!("{subsystem}.{name}")).collect::<Vec<_>>()
        };
        self.0.variables.iter().flat_map(of)
    }

    fn unknown(&self, py: Python<'_>, what: &str, name: &str, known: impl Iterator<Item = String>) -> PyErr {
        let known: Vec<String> = known.collect();
        let near = terraglue::scenario::did_you_mean(name, known.iter().map(String::as_str));
        let near = near.map(|near| format!("; {near}")).unwrap_or_default();
        errors::unknown(py, format!("the recording has no {what} `{name}`{near}"))
    }
}

#[pymethods]
impl Recording {
    #[new]
    fn new(py: Python<'_>, folder: PathBuf) -> PyResult<Self> {
        let opened = py.detach(|| recording::Recording::open(&folder));
        opened.map(Self).map_err(|error| errors::of(py, &error))
    }

    /// All variables by their full names.
    #[getter]
    fn names(&self) -> Vec<String> {
        self.all().collect()
    }

    /// The scenario as text, after all edits.
    #[getter]
    fn scenario(&self) -> &str {
        self.0.header.get("scenario_text")
    }

    /// Events: times (s) and words.
    #[getter]
    fn events(&self) -> Vec<(f64, String)> {
        self.0.events.iter().map(|event| (event.t_s, event.what.clone())).collect()
    }

    /// Unit of a variable.
    fn unit(&self, name: &str) -> &str {
        self.0.unit(name)
    }

    /// Times (s) and values of a variable.
    fn series<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Series<'py>> {
        match self.0.series(name) {
            Some((t, values)) => Ok((t.to_pyarray(py), values.to_pyarray(py))),
            None => Err(self.unknown(py, "variable", name, self.all())),
        }
    }

    /// Frames whose poses are recorded, `subsystem/body`.
    #[getter]
    fn frames(&self) -> Vec<String> {
        self.0.poses.keys().cloned().collect()
    }

    /// Times (s), and x, y, z (m) with the quaternion w, x, y, z of a frame in each row.
    fn poses<'py>(&self, py: Python<'py>, frame: &str) -> PyResult<Poses<'py>> {
        let Some(poses) = self.0.poses.get(frame) else {
            return Err(self.unknown(py, "frame", frame, self.0.poses.keys().cloned()));
        };
        let rows = poses.position.iter().zip(&poses.orientation);
        let values: Vec<f64> =
            rows.flat_map(|(p, q)| p.iter().chain(q).copied().collect::<Vec<_>>()).collect();
        Ok((poses.t_s.to_pyarray(py), matrix(py, poses.t_s.len(), 7, values)?))
    }

    /// The ground at the "start" or the "end": x of the columns, y of the rows, heights (rows × columns), m.
    #[pyo3(signature = (when="end"))]
    fn ground<'py>(&self, py: Python<'py>, when: &str) -> PyResult<Heights<'py>> {
        let ground = match when {
            "start" => &self.0.initial_ground,
            "end" => &self.0.final_ground,
            _ => return Err(errors::refused(py, format!("ground: `{when}` is neither `start` nor `end`"))),
        };
        let Some(ground) = ground else {
            return Err(errors::refused(py, "the recording has no ground"));
        };
        let [columns, rows] = ground.size;
        let heights = ground.height.iter().map(|z| f64::from(*z)).collect();
        let heights = Array2::from_shape_vec((rows, columns), heights)
            .map_err(|e| errors::refused(py, format!("the ground of the recording is damaged: {e}")))?;
        Ok(arrays(py, Nodes { lattice: (ground.origin, ground.spacing), first: [0, 0], heights }))
    }

    /// Energies of all subsystems together over time: times (s), names, and a row of values (J) for each time.
    fn energies<'py>(&self, py: Python<'py>) -> PyResult<Energies<'py>> {
        let table = &self.0.energy;
        let columns: Vec<&[f64]> = table.names.iter().filter_map(|name| table.column(name)).collect();
        let values: Vec<f64> =
            (0..table.t_s.len()).flat_map(|k| columns.iter().map(move |column| column[k])).collect();
        let rows = matrix(py, table.t_s.len(), columns.len(), values)?;
        Ok((table.t_s.to_pyarray(py), table.names.clone(), rows))
    }

    /// Times at which the ground was recorded, s: the start and each change.
    #[getter]
    fn ground_times<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.0.ground_times().to_pyarray(py)
    }

    /// Heights of the ground at those times from number `first` to before `end`, (time, y, x), m.
    fn grounds<'py>(&self, py: Python<'py>, first: usize, end: usize) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let Some(ground) = &self.0.initial_ground else {
            return Err(errors::refused(py, "the recording has no ground"));
        };
        let [columns, rows] = ground.size;
        let all = py.detach(|| self.0.grounds(first..end));
        let count = all.len();
        let all = Array3::from_shape_vec((count, rows, columns), all.concat())
            .map_err(|e| errors::refused(py, format!("the ground of the recording is damaged: {e}")))?;
        Ok(all.into_pyarray(py))
    }

    /// The ground over time, (time, y, x), m, read where it is asked for.
    fn ground_series<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("terraglue.frames")?.call_method1("GroundSeries", (slf,))
    }

    /// Variables of one subsystem as a table of pandas, by time (s), with their units in `attrs["units"]`; all of them without names.
    #[pyo3(signature = (names=None))]
    fn to_pandas<'py>(slf: &Bound<'py, Self>, names: Option<Vec<String>>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("terraglue.frames")?.call_method1("to_pandas", (slf, names))
    }

    /// The same as a data set of xarray with the ground; each variable has its unit in `attrs["units"]`.
    #[pyo3(signature = (names=None))]
    fn to_xarray<'py>(slf: &Bound<'py, Self>, names: Option<Vec<String>>) -> PyResult<Bound<'py, PyAny>> {
        slf.py().import("terraglue.frames")?.call_method1("to_xarray", (slf, names))
    }
}
