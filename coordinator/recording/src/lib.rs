//! Recordings of a run: written while it goes, read back, summed up and turned into a report.
//!
//! [`Recorder`] follows a testbed as an [`Observer`](terraglue_engine::observer::Observer) and fills one folder:
//!
//! | file | what |
//! |---|---|
//! | `recording.mcap` | everything simulated, in the schemas that robotics viewers read; equal bytes for equal runs |
//! | `summary.json` | the figures of the run ([`Summary`]) |
//! | `variables.csv` | on request: all variables in one table, arrays by their elements |
//! | `timing.csv` | what a clock measured, apart from everything else |
//! | `exchange.json` | how values went round: order, connections with their delays, loops |
//! | `viewer_layout.json` | a layout of this run for Foxglove and Lichtblick |
//! | `final_ground.asc` | the ground at the end as ESRI ASCII grid |
//! | `checkpoint.bin` | on request, while a run goes on: what `terraglue_checkpoint::Checkpoint` goes on from |
//!
//! `docs/recording.md` describes the topics, the message types and how each viewer shows them.
//!
//! A metadata record `terraglue` at the head holds the scenario's text after all edits, fingerprints of the files that it
//! names, strategy and modules.
//!
//! [`Recording`] reads any recording, also one that was cut off ([`mend`] gives such a file its footer);
//! [`report::write`] makes the report from it;
//! the crate `terraglue-compare` puts several runs side by side.

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod body_track;
mod chunk_file;
mod column_reader;
mod columns;
mod csv;
mod descriptor;
mod energies;
mod energy_message;
mod exchange;
mod force_message;
mod gluing_message;
mod ground_grid;
mod ground_points;
mod inputs;
mod joint_message;
mod keep;
mod layout;
mod mcap_writer;
mod mend;
mod messages;
mod motor_work;
mod overlays;
mod point_cloud;
mod prints;
mod reader;
mod recorder;
mod records;
mod scene_message;
mod selection;
mod snapshot;
mod solids;
mod space;
mod stream_topics;
mod summary;
mod summary_observer;
mod table;
mod tap;
mod topics;
mod trace;
mod viewer_layout;
mod visibility;

pub mod report;

#[cfg(test)]
#[path = "../tests/unit/mod.rs"]
mod tests;

pub use chunk_file::{ChunkFile, Stored};
pub use column_reader::ColumnReader;
pub use csv::{TimingRow, write_timing};
pub use energies::Energies;
pub use exchange::write_exchange;
pub use inputs::fingerprints;
pub use layout::{CHECKPOINT, FINAL_GROUND, RECORDING, REPORT, SUMMARY, TIMING, VARIABLES, VIEWER_LAYOUT};
pub use layout::{at, nanoseconds, other_at, replace};
pub use mend::{has_end, mend};
pub use messages::{GluingRecord, PortRecord, WindowRecord};
pub use reader::{GroundRecord, Header, PoseSeries, Recording, ground_cloud, ground_grid};
pub use recorder::{Recorder, RecorderOptions, RecorderState};
pub use solids::Solid;
pub use summary::{
    EnergySummary, FailureRecord, GluingSummary, MotionSummary, PrintDepth, RunTimes, Stall, Status, Summary,
};
pub use summary_observer::SummaryObserver;
pub use table::Table;
pub use tap::{Tap, TopicInfo};
pub use topics::STREAM;
pub use trace::Trace;
