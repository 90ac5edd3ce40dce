//! A subsystem as a functional mock-up unit: its variables as those of FMI 2.0 or 3.0, its description, its life.
//!
//! Everything here is safe Rust and knows no pointer. [`ExportedInstance`] is an instance as the standards see it: phases,
//! value references, saved states, the log. [`describe`] writes `modelDescription.xml` from the variables, and
//! [`pack`] the archive. The functions of the C interfaces, which wrap an [`ExportedInstance`], are in the library that goes
//! into the archive.

mod describe;
mod exported_instance;
mod layout;
mod pack;
mod states;
mod terminals;
mod values;
mod xml;

pub use describe::{About, Origin, describe, identifier};
pub use exported_instance::{ExportedInstance, Mailbox, Open, Opened, Opening, Phase, Reached};
pub use layout::{Entry, Layout};
pub use pack::{Compression, Content, pack};
pub use states::Handle;
pub use terminals::{JointTerminal, terminals};
pub use values::FmiType;
pub(crate) use xml::Xml;

/// A call that an FMU refused or failed, with the status that the standards give it.
#[derive(Clone, Debug, PartialEq)]
pub struct Wrong {
    /// Status.
    pub status: Status,
    /// Why, for the log.
    pub text: String,
}

/// Status of a call; the numbers are those of both standards.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// Done.
    Ok = 0,
    /// Done, but look at the log.
    Warning = 1,
    /// The step was not done to its end.
    Discard = 2,
    /// Not done.
    Error = 3,
    /// Not done; nothing of the instance may be called any more.
    Fatal = 4,
}

/// Outcome of a call.
pub type Answer<T = ()> = std::result::Result<T, Wrong>;

/// A call that was not done, for this reason.
///
/// # Errors
/// Always: [`Wrong`] with the status `error`.
pub fn wrong<T>(text: impl Into<String>) -> Answer<T> {
    Err(Wrong { status: Status::Error, text: text.into() })
}

impl From<terraglue_subsystem::Error> for Wrong {
    fn from(error: terraglue_subsystem::Error) -> Self {
        let status = match &error {
            terraglue_subsystem::Error::Fatal(_) => Status::Fatal,
            terraglue_subsystem::Error::Discard { .. } => Status::Discard,
            _ => Status::Error,
        };
        Self { status, text: error.to_string() }
    }
}
