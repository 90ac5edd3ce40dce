//! A run, live or recorded, on a port: the page of `terraglue-page` and every client of the Foxglove WebSocket protocol see it,
//! change it while it runs, and go back in it.
//!
//! The run stays on its own thread ([`Live`], [`Replay`]): commands are taken between two steps. The server ([`Server`]) has threads
//! of its own. Both meet in the [`Hub`], which no client can hold up.

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod access;
mod beside;
mod catalog;
mod changes;
mod clock;
mod command;
mod connection;
mod feed;
mod ground;
mod ground_mesh;
mod hub;
mod listener;
mod live;
mod page_host;
mod past;
mod pick;
mod protocol;
mod replay;
mod server;
mod shared_recorder;
mod snapshots;
mod tail;
mod topics;

pub use access::{Access, token};
pub use beside::Beside;
pub use changes::{Change, Changes, Kind};
pub use command::{Command, Request};
pub use hub::Hub;
pub use live::{Ended, Live, Mission};
pub use page_host::{PageHost, Posted};
pub use protocol::Welcome;
pub use replay::Replay;
pub use server::Server;
pub use shared_recorder::SharedRecorder;
