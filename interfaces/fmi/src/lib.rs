//! Functional mock-up units (FMUs) of FMI 2.0 and 3.0, co-simulation.
//!
//! [`Fmu::open`] checks an archive, extracts it into a folder that is gone afterwards, and reads its description;
//! none of its code runs. [`FmuInstance`] is an instance of it, driven through the C interface of its version. The types
//! and functions of the C interfaces are declared here from the text of the standards (Modelica Association, FMI
//! 2.0.4 and 3.0.2).
//!
//! [`ssp::Package`] reads a system structure, several FMUs with their connections and parameters.
//!
//! Every status of every call is checked. Any failure becomes an [`Error`] that names the file, the function, the
//! time and the last lines of the FMU's log; after `fatal` nothing of the instance is called again.

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod archive;
mod binary;
pub mod description;
pub mod elf;
mod error;
pub mod export;
pub mod floating_point;
mod fmu;
mod folder;
pub mod instance;
pub mod overview;
pub mod references;
pub mod ssp;

pub use archive::Limits;
pub use binary::{library_entry, platform, platforms};
pub use description::{ModelDescription, Version};
pub use error::{Error, Result};
pub use fmu::Fmu;
pub use folder::{Folder, remove_folders};
pub use instance::{
    Advance, Clocks, FmuInstance, FmuState, ForeignInstance, InstanceOptions, IntermediateRow, LogLine,
    Stepped,
};
