//! The call-back of FMI 3.0 for intermediate updates: finds the instance that is meant, and answers.

use super::log::meant;
use std::ffi::c_void;
use std::sync::atomic::Ordering;

/// `fmi3IntermediateUpdateCallback`.
///
/// # Safety
/// Both places are null or may be written.
pub unsafe extern "C" fn update(
    environment: *mut c_void,
    t: f64,
    set_requested: bool,
    get_allowed: bool,
    finished: bool,
    can_return: bool,
    early: *mut bool,
    early_time: *mut f64,
) {
    // A panic must not cross; nothing here is left half done.
    let answer = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
        let instance_log = meant(environment as usize, "")?;
        match instance_log.updates.take(t, [set_requested, get_allowed, finished, can_return]) {
            Ok(end) => end,
            Err(why) => {
                if !instance_log.updates.said.swap(true, Ordering::Relaxed) {
                    instance_log.note(&format!("called its intermediate update {why}"));
                }
                None
            }
        }
    }));
    let end = answer.unwrap_or(None);
    // SAFETY: by the caller.
    unsafe {
        if !early.is_null() {
            *early = end.is_some();
        }
        if let Some(end) = end.filter(|_| !early_time.is_null()) {
            *early_time = end;
        }
    }
}
