//! A foreign instance as its table and an opaque pointer.

use super::services::Services;
use crate::abi::*;
use crate::convert;
use crate::text::borrowed;
use std::ffi::c_void;
use terraglue_subsystem::{Error, Result};

/// Table and opaque pointer; frees the instance.
pub(super) struct Raw {
    pub(super) table: TgSubsystem,
    pub(super) instance: *mut c_void,
    // Outlives the instance, which may call its services until it is freed.
    pub(super) services: Box<Services>,
}

impl Drop for Raw {
    fn drop(&mut self) {
        if let Some(free) = self.table.free {
            // SAFETY: the last call of this instance.
            unsafe { free(self.instance) }
        }
    }
}

impl Raw {
    /// Turns a status into a result.
    #[inline]
    pub(super) fn check(&self, status: TgStatus, reached: f64) -> Result {
        if status == TG_OK { Ok(()) } else { Err(self.error(status, reached)) }
    }

    #[cold]
    fn error(&self, status: TgStatus, reached: f64) -> Error {
        // SAFETY: a required function with the live instance; the text is copied at once.
        let text = self.table.last_error.map(|f| unsafe { borrowed(f(self.instance)) });
        let text = match text {
            Some(Ok(text)) if !text.is_empty() => text.to_owned(),
            Some(Err(error)) => error.to_string(),
            _ => "no reason given".to_owned(),
        };
        convert::error(status, self.services.said(text), reached)
    }
}
