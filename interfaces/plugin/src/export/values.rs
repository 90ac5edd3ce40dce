//! `get` and `set`: typed arrays of values.

use super::{Exported, Scratch, change, look_status};
use crate::abi::*;
use crate::text::{slice, slice_mut};
use std::ffi::c_void;
use terraglue_subsystem::{Error, Result, Values, ValuesMut};

pub(super) unsafe extern "C" fn get(instance: *mut c_void, values: *const TgValues) -> TgStatus {
    // SAFETY: the host passes a live instance and `count` elements of the type that it names.
    unsafe { look_status(instance, |e| get_values(e, &*values)) }
}

/// # Safety
/// `v.data` points at `v.count` elements of type `v.value_type`, `v.ids` at `v.n_ids` ids.
unsafe fn get_values(e: &Exported, v: &TgValues) -> Result {
    let n = v.count;
    // SAFETY: by the contract.
    unsafe {
        let ids = slice(v.ids, v.n_ids as usize);
        let into = match v.value_type {
            TG_F64 => ValuesMut::F64(slice_mut(v.data.cast(), n)),
            TG_F32 => ValuesMut::F32(slice_mut(v.data.cast(), n)),
            TG_I8 => ValuesMut::I8(slice_mut(v.data.cast(), n)),
            TG_I16 => ValuesMut::I16(slice_mut(v.data.cast(), n)),
            TG_I32 => ValuesMut::I32(slice_mut(v.data.cast(), n)),
            TG_I64 => ValuesMut::I64(slice_mut(v.data.cast(), n)),
            TG_U8 => ValuesMut::U8(slice_mut(v.data.cast(), n)),
            TG_U16 => ValuesMut::U16(slice_mut(v.data.cast(), n)),
            TG_U32 => ValuesMut::U32(slice_mut(v.data.cast(), n)),
            TG_U64 => ValuesMut::U64(slice_mut(v.data.cast(), n)),
            TG_ENUMERATION => ValuesMut::Enumeration(slice_mut(v.data.cast(), n)),
            TG_BOOL => {
                // Zeros first: the bytes left by the host need not be bools.
                slice_mut::<u8>(v.data.cast(), n).fill(0);
                ValuesMut::Bool(slice_mut(v.data.cast(), n))
            }
            TG_STRING => return get_strings(e, ids, slice_mut(v.data.cast(), n)),
            TG_BINARY => return get_binaries(e, ids, slice_mut(v.data.cast(), n)),
            other => return Err(unknown(other)),
        };
        e.subsystem.get(ids, into)
    }
}

fn get_strings(e: &Exported, ids: &[u32], out: &mut [TgBytes]) -> Result {
    let Scratch { strings, .. } = &mut *e.scratch.borrow_mut();
    strings.resize_with(out.len(), String::new);
    e.subsystem.get(ids, ValuesMut::String(strings))?;
    for (to, from) in out.iter_mut().zip(strings.iter()) {
        *to = TgBytes { data: from.as_ptr(), size: from.len() };
    }
    Ok(())
}

fn get_binaries(e: &Exported, ids: &[u32], out: &mut [TgBytes]) -> Result {
    let Scratch { binaries, .. } = &mut *e.scratch.borrow_mut();
    binaries.resize_with(out.len(), Vec::new);
    e.subsystem.get(ids, ValuesMut::Binary(binaries))?;
    for (to, from) in out.iter_mut().zip(binaries.iter()) {
        *to = TgBytes { data: from.as_ptr(), size: from.len() };
    }
    Ok(())
}

pub(super) unsafe extern "C" fn set(instance: *mut c_void, values: *const TgValues) -> TgStatus {
    // SAFETY: the host passes a live instance and `count` elements of the type that it names.
    unsafe { change(instance, |e| set_values(e, &*values)) }
}

/// # Safety
/// `v.data` points at `v.count` elements of type `v.value_type`, `v.ids` at `v.n_ids` ids.
unsafe fn set_values(e: &mut Exported, v: &TgValues) -> Result {
    let n = v.count;
    // SAFETY: by the contract.
    unsafe {
        let ids = slice(v.ids, v.n_ids as usize);
        let from = match v.value_type {
            TG_F64 => Values::F64(slice(v.data.cast(), n)),
            TG_F32 => Values::F32(slice(v.data.cast(), n)),
            TG_I8 => Values::I8(slice(v.data.cast(), n)),
            TG_I16 => Values::I16(slice(v.data.cast(), n)),
            TG_I32 => Values::I32(slice(v.data.cast(), n)),
            TG_I64 => Values::I64(slice(v.data.cast(), n)),
            TG_U8 => Values::U8(slice(v.data.cast(), n)),
            TG_U16 => Values::U16(slice(v.data.cast(), n)),
            TG_U32 => Values::U32(slice(v.data.cast(), n)),
            TG_U64 => Values::U64(slice(v.data.cast(), n)),
            TG_ENUMERATION => Values::Enumeration(slice(v.data.cast(), n)),
            TG_BOOL => Values::Bool(bools(slice(v.data.cast(), n))?),
            TG_STRING => return set_strings(e, ids, slice(v.data.cast(), n)),
            TG_BINARY => return set_binaries(e, ids, slice(v.data.cast(), n)),
            other => return Err(unknown(other)),
        };
        e.subsystem.set(ids, from)
    }
}

fn bools(bytes: &[u8]) -> Result<&[bool]> {
    if let Some(wrong) = bytes.iter().find(|b| **b > 1) {
        return Err(Error::Refused(format!("a bool is {wrong}, neither 0 nor 1")));
    }
    // SAFETY: every byte is 0 or 1, the two representations of bool.
    Ok(unsafe { slice(bytes.as_ptr().cast(), bytes.len()) })
}

/// # Safety
/// Every element points at its bytes.
unsafe fn set_strings(e: &mut Exported, ids: &[u32], from: &[TgBytes]) -> Result {
    let mut strings = Vec::with_capacity(from.len());
    for bytes in from {
        // SAFETY: by the contract.
        let bytes = unsafe { slice(bytes.data, bytes.size) };
        let text = str::from_utf8(bytes).map_err(|_| Error::Refused("a text is not UTF-8".into()))?;
        strings.push(text.to_owned());
    }
    e.subsystem.set(ids, Values::String(&strings))
}

/// # Safety
/// Every element points at its bytes.
unsafe fn set_binaries(e: &mut Exported, ids: &[u32], from: &[TgBytes]) -> Result {
    // SAFETY: by the contract.
    let binaries: Vec<Vec<u8>> = from.iter().map(|b| unsafe { slice(b.data, b.size) }.to_vec()).collect();
    e.subsystem.set(ids, Values::Binary(&binaries))
}

fn unknown(value_type: u32) -> Error {
    Error::Refused(format!("values of the unknown type {value_type}"))
}
