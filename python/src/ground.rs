//! Heights of the ground as arrays.

use crate::errors::{Refusal, Refused};
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray1, PyArray2, ToPyArray};
use pyo3::prelude::*;
use terraglue::Testbed;
use terraglue::subsystem::{FieldInfo, TileValues};

/// World x of the columns and y of the rows, m, and the heights, m.
pub type Heights<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<f64>>);

/// A rectangle of nodes.
pub struct Nodes {
    /// World x, y of the first node of the lattice, and the distance of neighbours, m.
    pub lattice: ([f64; 2], f64),
    /// First column and row of the rectangle.
    pub first: [usize; 2],
    /// Row by row, m.
    pub heights: Array2<f64>,
}

/// Arrays of a rectangle of nodes.
pub fn arrays<'py>(
    py: Python<'py>,
    Nodes { lattice: (origin, spacing), first, heights }: Nodes,
) -> Heights<'py> {
    let axis = |axis: usize, count: usize| -> Vec<f64> {
        (0..count).map(|k| origin[axis] + spacing * (first[axis] + k) as f64).collect()
    };
    let (rows, columns) = heights.dim();
    (axis(0, columns).to_pyarray(py), axis(1, rows).to_pyarray(py), heights.into_pyarray(py))
}

/// The nodes of the committed ground within x0 … x1 and y0 … y1, m.
pub fn heights(testbed: &Testbed, x: [f64; 2], y: [f64; 2]) -> Refused<Nodes> {
    for (instance, number, field) in testbed.instances().iter().flat_map(|instance| {
        instance.fields().iter().enumerate().map(move |(number, field)| (instance, number, field))
    }) {
        if field.name != "height" {
            continue;
        }
        let [columns, rows] = [(x, 0), (y, 1)].map(|(range, axis)| within(field, axis, range));
        if columns.is_empty() || rows.is_empty() {
            let message = format!("there is no node of the ground in x = {x:?}, y = {y:?} m");
            return Err(Refusal::Input(message));
        }
        let mut out = Array2::from_elem((rows.len(), columns.len()), f64::NAN);
        let edge = field.tile_edge.max(1) as usize;
        for b in rows.start / edge..=(rows.end - 1) / edge {
            for a in columns.start / edge..=(columns.end - 1) / edge {
                let tile = instance.field_tile(number, a as u32, b as u32)?;
                for j in rows.start.max(b * edge)..rows.end.min((b + 1) * edge) {
                    for i in columns.start.max(a * edge)..columns.end.min((a + 1) * edge) {
                        let node = (j - b * edge) * edge + i - a * edge;
                        out[[j - rows.start, i - columns.start]] = value(&tile.values, node);
                    }
                }
            }
        }
        let first = [columns.start, rows.start];
        return Ok(Nodes { lattice: (field.origin, field.spacing), first, heights: out });
    }
    Err(Refusal::Input("no subsystem shows a ground".into()))
}

fn value(values: &TileValues, node: usize) -> f64 {
    match values {
        TileValues::Uniform(value) => *value,
        TileValues::F64(all) => all.get(node).copied().unwrap_or(f64::NAN),
        TileValues::F32(all) => all.get(node).map_or(f64::NAN, |x| f64::from(*x)),
        TileValues::Fixed { data, unit } => data.get(node).map_or(f64::NAN, |x| f64::from(*x) * unit),
    }
}

/// Nodes along an axis within a range, m.
fn within(field: &FieldInfo, axis: usize, [low, high]: [f64; 2]) -> std::ops::Range<usize> {
    let place = |x: f64| (x - field.origin[axis]) / field.spacing;
    let count = field.size[axis] as usize;
    let first = (place(low) - 1e-9).ceil().max(0.0) as usize;
    let last = (place(high) + 1e-9).floor();
    if last < 0.0 { 0..0 } else { first..count.min(last as usize + 1).max(first) }
}
