//! Recordings of a run: written while it goes, read back, summed up, turned into a report and compared.
//!
//! [`Recorder`] follows a testbed as an [`Observer`](crate::observer::Observer) and fills one folder:
//!
//! | file | what |
//! |---|---|
//! | `recording.mcap` | everything simulated, in the schemas that robotics viewers read; equal bytes for equal runs |
//! | `summary.json` | the figures of the run ([`Summary`]) |
//! | `variables.csv` | on request: all variables in one table, arrays by their elements |
//! | `timing.csv` | what a clock measured, apart from everything else |
//! | `exchange.json` | how values went round: order, connections with their delays, loops |
//! | `final_ground.asc` | the ground at the end as ESRI ASCII grid |
//!
//! Topics of the recording; all messages are JSON, log times are simulated nanoseconds:
//!
//! | topic | schema | what |
//! |---|---|---|
//! | `/<subsystem>` | its own, with units | `t` and all variables by name, arrays by their elements; `null` where one has no bound |
//! | `/tf` | `foxglove.FrameTransforms` | pose of every body, frame `subsystem/body` in `world` |
//! | `/scene` | `foxglove.SceneUpdate` | shapes, once, locked to the frames |
//! | `/ground` | `foxglove.Grid` | `height` and `sinkage` as f32: all at the start and the end, in between what changed |
//! | `/energy` | `terraglue.Energy` | energies and works, the sum and each subsystem, J |
//! | `/gluing` | `terraglue.StepReport` | the recorded step with its ports, and `since_last`: extremes of all steps between |
//! | `/events` | `foxglove.Log` | what happened (`t_s`, `what`) |
//!
//! A metadata record `terraglue` at the head holds the scenario's text after all edits, fingerprints of the files that it
//! names, strategy and modules.
//!
//! [`Recording`] reads any recording, also one that was cut off ([`mend`] gives such a file its footer);
//! [`report::write`] makes the report from it, [`compare::write`] puts several runs side by side.

mod body_track;
mod csv;
mod energies;
mod exchange;
mod ground_grid;
mod inputs;
mod json;
mod kept_file;
mod layout;
mod mcap_writer;
mod mend;
mod messages;
mod reader;
mod recorder;
mod records;
mod scene_message;
mod schemas;
mod snapshot;
mod solids;
mod space;
mod summary;
mod summary_observer;
mod table;
mod trace;

pub mod compare;
pub mod report;

#[cfg(test)]
mod tests;

pub use csv::{TimingRow, write_timing};
pub use energies::Energies;
pub use exchange::write_exchange;
pub use kept_file::KeptFile;
pub use layout::{FINAL_GROUND, RECORDING, REPORT, SUMMARY, TIMING, VARIABLES};
pub use mend::mend;
pub use messages::{GluingRecord, PortRecord, WindowRecord};
pub use reader::{GroundRecord, Header, PoseSeries, Recording};
pub use recorder::{Recorder, RecorderOptions};
pub use solids::Solid;
pub use summary::{FailureRecord, Stall, Status, Summary};
pub use summary_observer::SummaryObserver;
pub use table::Table;
pub use trace::Trace;
