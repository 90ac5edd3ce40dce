//! Memory behind arrays of C structures that point at texts and lists.

use crate::text::c_string;
use std::ffi::{CString, c_char};

/// Data behind pointers of C structures; moved or dropped only with them.
#[derive(Default)]
pub(crate) struct Keep {
    texts: Vec<CString>,
    dims: Vec<Box<[u32]>>,
    names: Vec<Box<[*const c_char]>>,
    points: Vec<Box<[f64]>>,
}

impl Keep {
    pub(crate) fn text(&mut self, text: &str) -> *const c_char {
        let text = c_string(text);
        let pointer = text.as_ptr();
        self.texts.push(text);
        pointer
    }

    pub(crate) fn numbers(&mut self, numbers: Vec<u32>) -> *const u32 {
        let numbers = numbers.into_boxed_slice();
        let pointer = numbers.as_ptr();
        self.dims.push(numbers);
        pointer
    }

    /// The coordinates of points, one after the other.
    pub(crate) fn points(&mut self, points: &[[f64; 3]]) -> *const f64 {
        let coordinates: Box<[f64]> = points.iter().flatten().copied().collect();
        let pointer = coordinates.as_ptr();
        self.points.push(coordinates);
        pointer
    }

    pub(crate) fn names(&mut self, names: Box<[*const c_char]>) -> *const *const c_char {
        let pointer = names.as_ptr();
        self.names.push(names);
        pointer
    }
}
