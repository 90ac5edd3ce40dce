//! Variables, values, actions.
use std::ffi::{c_char, c_void};

/// Borrowed bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TgBytes {
    /// First byte; may be null when `size` is 0.
    pub data: *const u8,
    /// Number of bytes.
    pub size: usize,
}

/// Values of one type: the elements of the variables `ids`, one after the other (arrays row-major).
/// After `get` of strings or bytes, the module's tg_bytes stay valid until the next call of the instance.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TgValues {
    /// TG_F64 ... TG_ENUMERATION: type of what `data` points at.
    pub value_type: u32,
    /// Number of variables.
    pub n_ids: u32,
    /// Their ids.
    pub ids: *const u32,
    /// Number of elements in `data`.
    pub count: usize,
    /// Elements: read by `set`, written by `get`.
    pub data: *mut c_void,
}

/// A variable of an instance. Texts are UTF-8, zero-terminated.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TgVariable {
    /// Number used by `get` and `set`; unique in the instance.
    pub id: u32,
    /// TG_F64 ... TG_ENUMERATION.
    pub value_type: u32,
    /// TG_PARAMETER, TG_INPUT, TG_OUTPUT or TG_LOCAL.
    pub causality: u32,
    /// TG_LIVE, TG_NEEDS_RESET or TG_READ_ONLY.
    pub effect: u32,
    /// Dotted name, unique in the instance.
    pub name: *const c_char,
    /// Unit in SI symbols separated by spaces, e.g. "N m", "rad/s"; empty: a pure number.
    pub unit: *const c_char,
    /// One line for people.
    pub help: *const c_char,
    /// Smallest value that is accepted; -inf: no bound.
    pub min: f64,
    /// Largest value that is accepted; inf: no bound.
    pub max: f64,
    /// Array dimensions.
    pub dims: *const u32,
    /// Names of the values 0, 1, ... of an enumeration.
    pub names: *const *const c_char,
    /// Number of dimensions; 0: a scalar.
    pub n_dims: u32,
    /// Number of names.
    pub n_names: u32,
}

/// Something to do that is not a value.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TgAction {
    /// Dotted name, unique in the instance.
    pub name: *const c_char,
    /// One line for people.
    pub help: *const c_char,
}
