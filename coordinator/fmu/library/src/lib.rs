//! The library inside exported functional mock-up units: the functions of FMI 2.0 and 3.0 over one safe instance.
//!
//! One library serves every FMU; the simulated model is in the FMU's resources. All that is not a pointer is done
//! by [`terraglue_fmi::export::ExportedInstance`]. Here texts and arrays of the master become slices, answers become
//! statuses, lines of the log find their way to the master, and no panic crosses.
#![allow(unsafe_code)] // Pointers of the master are read and written; every function follows the standard's contract.
#![allow(missing_docs)] // The functions are those of the standards, by their names.
#![allow(clippy::missing_safety_doc)] // The contract of every function is the standard's.

mod instance;
mod three;
mod two;
