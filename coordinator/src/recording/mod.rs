//! Recordings of a run: written while it goes, read back, summed up, turned into a report and compared.
//!
//! [`Recorder`] follows a testbed as an [`Observer`](crate::observer::Observer) and fills one folder:
//!
//! | file | what |
//! |---|---|
//! | `recording.mcap` | everything simulated, in the schemas that robotics viewers read; equal bytes for equal runs |
//! | `summary.json` | the figures of the run ([`Summary`]) |
//! | `variables.csv` | on request: all scalar variables in one table |
//! | `timing.csv` | what a clock measured, apart from everything else |
//! | `final_ground.asc` | the ground at the end as ESRI ASCII grid |
//!
//! [`Recording`] reads any recording, also one that was cut off ([`mend`] gives such a file its footer);
//! [`report::write`] makes the report from it, [`compare::write`] puts several runs side by side.

mod csv;
mod ground_grid;
mod json;
mod layout;
mod mcap_writer;
mod mend;
mod messages;
mod reader;
mod recorder;
mod scene_message;
mod schemas;
mod snapshot;
mod summary;
mod summary_observer;
mod table;

pub mod compare;
pub mod report;

#[cfg(test)]
mod tests;

pub use csv::{TimingRow, write_timing};
pub use layout::{FINAL_GROUND, RECORDING, REPORT, SUMMARY, TIMING, VARIABLES};
pub use mend::mend;
pub use messages::{GluingRecord, PortRecord, WindowRecord};
pub use reader::{GroundRecord, Header, PoseSeries, Recording};
pub use recorder::{Recorder, RecorderOptions};
pub use summary::{FailureRecord, Status, Summary};
pub use summary_observer::SummaryObserver;
pub use table::Table;
