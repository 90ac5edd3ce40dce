//! Errors of Terraglue as exceptions of `terraglue.errors`.

use pyo3::prelude::*;
use terraglue::Error;

fn raised(py: Python<'_>, class: &str, message: String) -> PyErr {
    let made = py.import("terraglue.errors").and_then(|errors| errors.getattr(class)?.call1((message,)));
    made.map_or_else(|error| error, |value| PyErr::from_value(value))
}

/// Why something was not done. It is made where a lock is held, and becomes an exception after that: exceptions are made by Python,
/// which may run another thread meanwhile that waits for the same lock.
pub enum Refusal {
    /// An error of the simulation or of its input.
    Failed(Error),
    /// A value or a call that does not fit.
    Input(String),
    /// A name that is not there.
    Unknown(String),
    /// Something that is over.
    Ended(&'static str),
}

/// A result before it is one of Python.
pub type Refused<T = ()> = Result<T, Refusal>;

impl From<Error> for Refusal {
    fn from(error: Error) -> Self {
        Self::Failed(error)
    }
}

impl Refusal {
    /// The exception.
    pub fn raise(self, py: Python<'_>) -> PyErr {
        match self {
            Self::Failed(error) => of(py, &error),
            Self::Input(message) => raised(py, "InputError", message),
            Self::Unknown(message) => raised(py, "UnknownName", message),
            Self::Ended(which) => raised(py, "SimulationError", format!("{which} has ended")),
        }
    }

    /// The same, with the number of the testbed of a batch in front.
    pub fn of_member(self, k: usize) -> Self {
        match self {
            Self::Input(message) => Self::Input(format!("testbed {k}: {message}")),
            other => other,
        }
    }
}

/// The exception of an error.
pub fn of(py: Python<'_>, error: &Error) -> PyErr {
    match error {
        Error::Input(input) => wrong_input(py, input),
        Error::Module { .. } => raised(py, "ModuleError", error.to_string()),
        Error::File { .. } => raised(py, "Error", error.to_string()),
        _ => raised(py, "SimulationError", error.to_string()),
    }
}

/// That of wrong input: with its line and way out.
pub fn wrong_input(py: Python<'_>, input: &terraglue::scenario::InputError) -> PyErr {
    let name = input.source_code.name();
    let line = input.span.map(|span| {
        let text = input.source_code.inner();
        1 + text.get(..span.offset()).unwrap_or_default().matches('\n').count()
    });
    let place = match (name.is_empty(), line) {
        (true, _) => String::new(),
        (false, None) => format!("{name}: "),
        (false, Some(line)) => format!("{name}, line {line}: "),
    };
    let help = input.help.as_ref().map(|help| format!("; {help}")).unwrap_or_default();
    raised(py, "InputError", format!("{place}{}{help}", input.message))
}

/// Wrong input that has no file.
pub fn refused(py: Python<'_>, message: impl Into<String>) -> PyErr {
    raised(py, "InputError", message.into())
}

/// A name that is not there.
pub fn unknown(py: Python<'_>, message: String) -> PyErr {
    raised(py, "UnknownName", message)
}
