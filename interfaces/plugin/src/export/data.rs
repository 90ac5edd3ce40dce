//! State, descriptions, scene, fields and energy.

use super::{Exported, change, look, look_status};
use crate::abi::*;
use crate::field_table::tile_out;
use crate::text::{borrowed, slice, slice_mut};
use std::ffi::{c_char, c_void};
use terraglue_subsystem::Energy;

pub(super) unsafe extern "C" fn capabilities(instance: *mut c_void) -> u32 {
    // SAFETY: the host passes a live instance.
    unsafe { look(instance, 0, |e| e.subsystem.capabilities().0) }
}

pub(super) unsafe extern "C" fn save_state(instance: *mut c_void, slot: u32) -> TgStatus {
    // SAFETY: the host passes a live instance.
    unsafe { change(instance, |e| e.subsystem.save_state(slot)) }
}

pub(super) unsafe extern "C" fn restore_state(instance: *mut c_void, slot: u32) -> TgStatus {
    // SAFETY: the host passes a live instance.
    unsafe { change(instance, |e| e.subsystem.restore_state(slot)) }
}

pub(super) unsafe extern "C" fn serialize(instance: *mut c_void, out: *mut TgBytes) -> TgStatus {
    // SAFETY: the host passes a live instance and a place for the answer.
    unsafe {
        look_status(instance, |e| {
            let mut scratch = e.scratch.borrow_mut();
            scratch.bytes = e.subsystem.serialize()?;
            *out = TgBytes { data: scratch.bytes.as_ptr(), size: scratch.bytes.len() };
            Ok(())
        })
    }
}

pub(super) unsafe extern "C" fn deserialize(instance: *mut c_void, bytes: TgBytes) -> TgStatus {
    // SAFETY: the host passes a live instance and bytes for this call.
    unsafe { change(instance, |e| e.subsystem.deserialize(slice(bytes.data, bytes.size))) }
}

/// # Safety
/// `instance` is live, `first` a place for a pointer.
pub(super) unsafe fn list<T>(
    instance: *mut c_void,
    first: *mut *const T,
    items: impl FnOnce(&Exported) -> &[T],
) -> usize {
    // SAFETY: by the contract; the list lives in the instance and never changes.
    unsafe {
        look(instance, 0, |e| {
            let items = items(e);
            *first = items.as_ptr();
            items.len()
        })
    }
}

pub(super) unsafe extern "C" fn variables(instance: *mut c_void, first: *mut *const TgVariable) -> usize {
    // SAFETY: the host passes a live instance and a place for a pointer.
    unsafe { list(instance, first, |e| &e.descriptions.variables) }
}

pub(super) unsafe extern "C" fn actions(instance: *mut c_void, first: *mut *const TgAction) -> usize {
    // SAFETY: the host passes a live instance and a place for a pointer.
    unsafe { list(instance, first, |e| &e.descriptions.actions) }
}

pub(super) unsafe extern "C" fn fields(instance: *mut c_void, first: *mut *const TgField) -> usize {
    // SAFETY: the host passes a live instance and a place for a pointer.
    unsafe { list(instance, first, |e| &e.descriptions.fields) }
}

pub(super) unsafe extern "C" fn act(
    instance: *mut c_void,
    action: *const c_char,
    arguments: *const c_char,
) -> TgStatus {
    // SAFETY: the host passes a live instance and texts for this call.
    unsafe { change(instance, |e| e.subsystem.act(borrowed(action)?, borrowed(arguments)?)) }
}

pub(super) unsafe extern "C" fn next_event_time(instance: *mut c_void) -> f64 {
    // SAFETY: the host passes a live instance.
    unsafe { look(instance, f64::NAN, |e| e.subsystem.next_event_time()) }
}

pub(super) unsafe extern "C" fn scene(instance: *mut c_void, out: *mut TgScene) -> TgStatus {
    // SAFETY: the host passes a live instance and a place for the answer.
    unsafe {
        look_status(instance, |e| {
            *out = e.descriptions.scene.scene();
            Ok(())
        })
    }
}

pub(super) unsafe extern "C" fn body_states(
    instance: *mut c_void,
    n: usize,
    out: *mut TgBodyState,
) -> TgStatus {
    // SAFETY: the host passes a live instance and n states, laid out as ours (`abi::layout`).
    unsafe { look_status(instance, |e| e.subsystem.body_states(slice_mut(out.cast(), n))) }
}

pub(super) unsafe extern "C" fn field_tile(
    instance: *mut c_void,
    field: usize,
    a: u32,
    b: u32,
    out: *mut TgFieldTile,
) -> TgStatus {
    // SAFETY: the host passes a live instance and a place for the answer.
    unsafe {
        look_status(instance, |e| {
            *out = tile_out(&e.subsystem.field_tile(field, a, b)?);
            Ok(())
        })
    }
}

pub(super) unsafe extern "C" fn energy(instance: *mut c_void, out: *mut TgEnergy) -> TgStatus {
    // SAFETY: the host passes a live instance and a place for the answer, laid out as ours (`abi::layout`).
    unsafe {
        look_status(instance, |e| {
            *out.cast::<Energy>() = e.subsystem.energy();
            Ok(())
        })
    }
}
