//! Messages `foxglove.PointCloud` of scanners as structured arrays.

use crate::errors;
use foxglove::messages::PointCloud;
use foxglove::messages::packed_element_field::NumericType;
use prost::Message;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

/// Name of the schema of its messages.
pub const SCHEMA: &str = "foxglove.PointCloud";

/// The points of a message of a stream at a time, s: `terraglue.PointCloud`.
pub fn array<'py>(py: Python<'py>, (stream, t_s): (&str, f64), bytes: &[u8]) -> PyResult<Bound<'py, PyAny>> {
    let Ok(cloud) = PointCloud::decode(bytes) else {
        return Err(errors::refused(py, format!("`{stream}`: the message at t = {t_s} s is no {SCHEMA}")));
    };
    let of = |kind: i32| match NumericType::try_from(kind) {
        Ok(NumericType::Uint8) => Some("u1"),
        Ok(NumericType::Int8) => Some("i1"),
        Ok(NumericType::Uint16) => Some("<u2"),
        Ok(NumericType::Int16) => Some("<i2"),
        Ok(NumericType::Uint32) => Some("<u4"),
        Ok(NumericType::Int32) => Some("<i4"),
        Ok(NumericType::Float32) => Some("<f4"),
        Ok(NumericType::Float64) => Some("<f8"),
        Ok(NumericType::Unknown) | Err(_) => None,
    };
    let known = cloud.fields.iter().filter_map(|f| Some((f.name.as_str(), of(f.r#type)?, f.offset)));
    let fields: Vec<(&str, &str, u32)> = known.collect();
    let pose = cloud.pose.unwrap_or_default();
    let p = pose.position.unwrap_or_default();
    let q = pose.orientation.map_or([1.0, 0.0, 0.0, 0.0], |q| [q.w, q.x, q.y, q.z]);
    let parts = (
        (t_s, cloud.frame_id.as_str(), [p.x, p.y, p.z], q),
        fields,
        cloud.point_stride,
        PyBytes::new(py, &cloud.data),
    );
    py.import("terraglue.frames")?.getattr("PointCloud")?.call_method1("_of", parts)
}
