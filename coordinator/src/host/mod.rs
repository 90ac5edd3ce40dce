//! Finds, loads, instantiates and supervises subsystems.
//!
//! [`Library::find`] turns the value of `module` in a scenario into a [`LoadedModule`], by the order of
//! [`SearchPath`]; [`LoadedModule::instantiate`] makes an [`Instance`], which checks every answer of the
//! subsystem and gives every failure its name, function and time. Loaded libraries are never unloaded.

mod check;
mod elf;
mod error;
pub mod exit_guard;
mod instance;
pub mod isolation;
mod library;
mod search;
mod services;
#[cfg(test)]
mod tests;
mod workers;

pub use elf::Description;
pub use error::LoadError;
pub use instance::{Instance, Progress, Reply};
pub use isolation::Isolation;
pub use library::{AvailableModule, Library, LoadedModule, available_modules};
pub use search::SearchPath;
pub use services::{HostServices, LogSink, Partings, instance_seed};
pub use workers::Workers;
