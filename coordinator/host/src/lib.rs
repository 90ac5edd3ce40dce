//! Finds, loads, instantiates and supervises subsystems.
//!
//! [`Library::find`] turns the value of `module` in a scenario into a [`LoadedModule`], by the order of
//! [`SearchPath`]; [`LoadedModule::instantiate`] makes an [`Instance`], which checks every answer of the
//! subsystem and gives every failure its name, function and time. Loaded libraries are never unloaded.

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod adaptive_spin;
mod allocations;
mod check;
pub mod crash;
pub mod descendants;
mod description;
mod elements;
mod error;
pub mod exit_guard;
mod instance;
pub mod isolation;
pub mod kept_file;
pub mod law;
mod library;
mod probe;
mod process;
mod process_state;
mod python;
mod search;
mod services;
mod supervision;
#[cfg(test)]
mod tests;
mod workers;

pub use allocations::AllocationCounter;
pub use description::Description;
pub use error::LoadError;
pub use instance::{By, Instance, Progress, Reply, message, observe, shape_visibility};
pub use isolation::Isolation;
pub use library::{
    AvailableModule, FmuFactory, Library, ListedModule, LoadedModule, available_modules, described,
    listed_file, listed_modules,
};
pub use probe::{TableFacts, probe_odd_calls, table_of};
pub use process::{Process, adopt_locale, has_locale, heap_in_use};
pub use process_state::ProcessState;
pub use python::{describes_module, interpreter, is_python, value_of};
pub use search::{SearchPath, is_path};
pub use services::{HostServices, LogSink, TeardownErrors, instance_seed};
pub use workers::Workers;
