//! Integers of the border to the enumerations of the interface, each through a `match`, and statuses to errors.

use crate::abi::*;
use terraglue_subsystem::{Causality, Effect, Error, Kind, Level, LogLevel, ValueType};

/// Kind of a module.
pub(crate) fn kind(number: u32) -> Option<Kind> {
    match number {
        TG_SOIL => Some(Kind::Soil),
        TG_ROBOT => Some(Kind::Robot),
        TG_CONTROLLER => Some(Kind::Controller),
        TG_LAW => Some(Kind::Law),
        TG_SENSOR => Some(Kind::Sensor),
        _ => None,
    }
}

/// Level of a derivative.
pub(crate) fn level(number: u32) -> Option<Level> {
    match number {
        TG_POSITION => Some(Level::Position),
        TG_VELOCITY => Some(Level::Velocity),
        TG_ACCELERATION => Some(Level::Acceleration),
        _ => None,
    }
}

/// Severity of a log line; unknown ones are information.
pub(crate) fn log_level(number: i32) -> LogLevel {
    match number {
        TG_LOG_ERROR => LogLevel::Error,
        TG_LOG_WARNING => LogLevel::Warning,
        TG_LOG_DEBUG => LogLevel::Debug,
        _ => LogLevel::Info,
    }
}

/// Type of a variable.
pub(crate) fn value_type(number: u32) -> Option<ValueType> {
    Some(match number {
        TG_F64 => ValueType::F64,
        TG_F32 => ValueType::F32,
        TG_I8 => ValueType::I8,
        TG_I16 => ValueType::I16,
        TG_I32 => ValueType::I32,
        TG_I64 => ValueType::I64,
        TG_U8 => ValueType::U8,
        TG_U16 => ValueType::U16,
        TG_U32 => ValueType::U32,
        TG_U64 => ValueType::U64,
        TG_BOOL => ValueType::Bool,
        TG_STRING => ValueType::String,
        TG_BINARY => ValueType::Binary,
        TG_ENUMERATION => ValueType::Enumeration,
        TG_CLOCK => ValueType::Clock,
        _ => return None,
    })
}

/// Role of a variable.
pub(crate) fn causality(number: u32) -> Option<Causality> {
    match number {
        TG_PARAMETER => Some(Causality::Parameter),
        TG_INPUT => Some(Causality::Input),
        TG_OUTPUT => Some(Causality::Output),
        TG_LOCAL => Some(Causality::Local),
        _ => None,
    }
}

/// Effect of a change of a variable.
pub(crate) fn effect(number: u32) -> Option<Effect> {
    match number {
        TG_LIVE => Some(Effect::Live),
        TG_NEEDS_RESET => Some(Effect::NeedsReset),
        TG_READ_ONLY => Some(Effect::ReadOnly),
        _ => None,
    }
}

/// Status and text of an error. The text of `Discard` is its time, which also goes through `reached`.
pub(crate) fn status(error: Error) -> (TgStatus, String) {
    match error {
        Error::Unsupported => (TG_UNSUPPORTED, error.to_string()),
        Error::Discard { .. } => (TG_DISCARD, error.to_string()),
        Error::Refused(text) => (TG_REFUSED, text),
        Error::Fatal(text) => (TG_FATAL, text),
        Error::Failed(text) => (TG_ERROR, text),
        other => (TG_ERROR, other.to_string()),
    }
}

/// The error of a status that is not `TG_OK`.
pub(crate) fn error(status: TgStatus, text: String, reached: f64) -> Error {
    match status {
        TG_DISCARD => Error::Discard { reached },
        TG_REFUSED => Error::Refused(text),
        TG_ERROR => Error::Failed(text),
        TG_UNSUPPORTED => Error::Unsupported,
        TG_FATAL => Error::Fatal(text),
        unknown => Error::Fatal(format!("answered with the unknown status {unknown}: {text}")),
    }
}
