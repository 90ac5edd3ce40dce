//! Why a step cannot stand after an intermediate update.

use std::ffi::c_int;

/// Why a step cannot stand.
pub(super) struct StepFault {
    pub text: String,
    /// Whether nothing of the instance may be called any more.
    pub fatal: bool,
}

impl From<String> for StepFault {
    fn from(text: String) -> Self {
        Self { text, fatal: false }
    }
}

impl StepFault {
    /// Interprets the status of a call inside the call-back; `call` names the call.
    pub fn of(status: c_int, call: impl Fn() -> String) -> std::result::Result<(), Self> {
        match status {
            0 | 1 => Ok(()),
            _ => Err(Self {
                text: format!("answered {status} to {}", call()),
                fatal: !matches!(status, 2 | 3),
            }),
        }
    }
}
