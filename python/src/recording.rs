//! `Recording`: the recorded values of a run as arrays.

use crate::errors;
use crate::ground::{Heights, arrays};
use crate::testbed::matrix;
use numpy::ndarray::Array2;
use numpy::{PyArray1, PyArray2, ToPyArray};
use pyo3::prelude::*;
use std::path::PathBuf;
use terraglue::recording;

/// Times (s) and values.
type Series<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>);

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
        Ok((poses.t_s.to_pyarray(py), matrix(py, poses.t_s.len(), values)?))
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
        Ok(arrays(py, (ground.origin, ground.spacing), [0, 0], heights))
    }
}
