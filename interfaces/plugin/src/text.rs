//! Texts, slices and panics at the border.

use std::any::Any;
use std::ffi::{CStr, CString, c_char};
use terraglue_subsystem::{Error, Result};

/// A zero-terminated copy; a zero byte inside becomes U+FFFD.
pub(crate) fn c_string(text: &str) -> CString {
    CString::new(text.replace('\0', "\u{FFFD}")).unwrap_or_default()
}

/// A foreign text; null counts as empty.
///
/// # Safety
/// `text` is null or points at a zero-terminated text that outlives `'a`.
pub(crate) unsafe fn borrowed<'a>(text: *const c_char) -> Result<&'a str> {
    if text.is_null() {
        return Ok("");
    }
    // SAFETY: not null, the rest by the contract of this function.
    unsafe { CStr::from_ptr(text) }.to_str().map_err(|_| Error::Failed("a text is not UTF-8".into()))
}

/// A foreign array; null or no elements give an empty slice.
///
/// # Safety
/// `first` is null or points at `count` initialised elements that nobody writes during `'a`.
pub(crate) unsafe fn slice<'a, T>(first: *const T, count: usize) -> &'a [T] {
    if first.is_null() || count == 0 {
        return &[];
    }
    // SAFETY: not null, the rest by the contract of this function.
    unsafe { std::slice::from_raw_parts(first, count) }
}

/// A foreign array to write to; null or no elements give an empty slice.
///
/// # Safety
/// `first` is null or points at `count` initialised elements that nobody else touches during `'a`.
pub(crate) unsafe fn slice_mut<'a, T>(first: *mut T, count: usize) -> &'a mut [T] {
    if first.is_null() || count == 0 {
        return &mut [];
    }
    // SAFETY: not null, the rest by the contract of this function.
    unsafe { std::slice::from_raw_parts_mut(first, count) }
}

/// Message of a caught panic.
pub(crate) fn panic_text(payload: &(dyn Any + Send)) -> String {
    let said = payload.downcast_ref::<&str>().copied();
    let said = said.or_else(|| payload.downcast_ref::<String>().map(String::as_str));
    format!("panicked: {}", said.unwrap_or("(no text)"))
}
