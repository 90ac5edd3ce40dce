//! The extension module of the Python package: testbeds, batches of them and recordings, with NumPy arrays.
//!
//! Classes are frozen and guard their state by a lock, and steps are made without the interpreter's lock, so that threads of a program may
//! share a testbed. Arrays are copies of committed values: nothing in them changes while a step is made.

mod batch;
mod errors;
mod ground;
mod lock;
mod members;
mod names;
mod observe;
mod point_cloud;
mod recording;
mod run;
mod scenario;
mod snapshot;
mod testbed;

use pyo3::prelude::*;

/// The classes of the package.
#[pymodule]
fn _terraglue(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<testbed::Testbed>()?;
    module.add_class::<batch::Batch>()?;
    module.add_class::<recording::Recording>()?;
    module.add_class::<snapshot::Snapshot>()?;
    module.add_class::<observe::Observation>()?;
    module.add_function(wrap_pyfunction!(names::matching, module)?)?;
    module.add_function(wrap_pyfunction!(scenario::task, module)?)?;
    module.add_function(wrap_pyfunction!(version, module)?)
}

/// Version of the package.
#[pyfunction]
fn version() -> &'static str {
    env!("CARGO_PKG_VERSION")
}
