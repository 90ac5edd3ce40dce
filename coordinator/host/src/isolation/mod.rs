//! `isolate = true`: an instance in a process of its own, so that a crash, a hang or `exit()` is an error of that
//! subsystem and never the end of the run.
//!
//! The worker is this program again, or for a module in Python the user's interpreter, in a process group of its own with
//! a limit of memory and a temporary folder of its own. Calls and answers cross through a shared segment; both sides sleep
//! in between, after a short look. Processes and files that a worker leaves behind are removed with it.

mod answers;
mod calls;
mod channel;
mod fork_server;
mod law;
mod messages;
mod printed;
mod proxy;
mod python;
mod sight;
mod tiles;
mod wire;
mod worker;
mod worker_channel;

pub use channel::{confine, end_group};
pub use fork_server::{FORK_SERVER, ForkServer};
pub(super) use law::IsolatedLaw;
pub use python::SDK;
pub use worker::serve;

use super::{HostServices, TeardownErrors};
use channel::Segment;
use fork_server::{Forked, WorkerProcess};
use proxy::Isolated;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use terraglue_subsystem::{Error, Host, LogLevel, NodeLaw, Result, Subsystem};

/// Limits of an instance that is kept apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Isolation {
    /// Longest time to load and make it, s.
    pub load_timeout_s: f64,
    /// Longest time for any other call, s.
    pub step_timeout_s: f64,
    /// Most memory, bytes.
    pub memory_bytes: u64,
}

impl Default for Isolation {
    fn default() -> Self {
        Self { load_timeout_s: 60.0, step_timeout_s: 30.0, memory_bytes: 8 << 30 }
    }
}

/// Object that a worker makes.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum What {
    /// A functional mock-up unit with the keys of its table.
    Fmu {
        /// File.
        path: PathBuf,
        /// Start values and keys of the host.
        parameters: serde_json::Map<String, Value>,
    },
    /// A module from a library with its configuration.
    Module {
        /// File.
        path: PathBuf,
        /// Checked parameters.
        config: Value,
    },
    /// A module in Python with its configuration.
    Python {
        /// File.
        path: PathBuf,
        /// Checked parameters.
        config: Value,
        /// Interpreter.
        python: PathBuf,
    },
    /// A law in Python with its numbers.
    Law {
        /// File.
        path: PathBuf,
        /// By name.
        numbers: serde_json::Map<String, Value>,
        /// Interpreter.
        python: PathBuf,
    },
}

/// Data that a worker receives at the start, beside the terrain.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Start {
    what: What,
    name: String,
    seed: u64,
    folder: String,
    slots: u32,
    max_nodes: u32,
    gravity: [f64; 3],
    memory_bytes: u64,
}

/// Makes an instance in a worker of its own.
///
/// # Errors
/// No worker can be started, or the instance fails while it is made.
pub fn start(
    what: What,
    host: &Arc<dyn Host>,
    services: &HostServices,
    isolation: Isolation,
) -> Result<Box<dyn Subsystem>> {
    let (link, start) = linked(what, host, services, isolation)?;
    Ok(Box::new(Isolated::start(link, &start, host.terrain())?))
}

/// Opens a law in Python in a worker of its own.
///
/// # Errors
/// As [`start`].
pub(crate) fn start_law(
    name: &str,
    what: What,
    host: &Arc<dyn Host>,
    services: &HostServices,
) -> Result<Arc<dyn NodeLaw>> {
    let (link, start) = linked(what, host, services, services.isolation)?;
    Ok(Arc::new(IsolatedLaw::start(name, link, &start)?))
}

fn linked(
    what: What,
    host: &Arc<dyn Host>,
    services: &HostServices,
    isolation: Isolation,
) -> Result<(Link, Start)> {
    let link = Link::new(&what, host.clone(), services, isolation)?;
    let start = Start {
        what,
        name: host.name().to_owned(),
        seed: host.seed(),
        folder: host.folder().to_owned(),
        slots: host.slots(),
        max_nodes: host.max_nodes(),
        gravity: host.gravity(),
        memory_bytes: isolation.memory_bytes,
    };
    Ok((link, start))
}

/// Interval at which a waiting host looks whether the worker still lives.
const LOOK: Duration = Duration::from_millis(20);
/// The longest time between two looks that counts.
const BLINK: Duration = Duration::from_millis(100);
/// Largest time of a worker for its end.
const PARTING: Duration = Duration::from_secs(2);

/// A worker and the way to it.
struct Link {
    segment: Segment,
    child: WorkerProcess,
    isolation: Isolation,
    host: Arc<dyn Host>,
    cancel: Arc<AtomicBool>,
    teardown_errors: TeardownErrors,
    /// Why nothing can be asked any more.
    gone: Option<String>,
    is_python: bool,
    // After the child, whose files it holds.
    folder: terraglue_fmi::Folder,
}

fn failed(what: &str, error: &dyn std::fmt::Display) -> Error {
    Error::Failed(format!("isolation: {what}: {error}"))
}

/// Starts a worker of its own; whether it is one of Python.
fn spawn(what: &What, folder: &Path, segment: &str) -> Result<(WorkerProcess, bool)> {
    use std::os::unix::process::CommandExt;
    let python = python::command(what, folder, segment).map_err(|e| failed("no files for a worker", &e))?;
    let is_python = python.is_some();
    let mut command = match python {
        Some(command) => command,
        None => {
            let mut command = Command::new(program()?);
            let file = || printed::file(folder).map_err(|e| failed("no file for its output", &e));
            command.args(["worker", segment]).stdin(Stdio::null()).stdout(file()?).stderr(file()?);
            command
        }
    };
    if is_python {
        command.stdout(Stdio::null());
    }
    command.env("TMPDIR", folder).process_group(0);
    let child = command.spawn().map_err(|e| match what {
        What::Python { python, .. } | What::Law { python, .. } => {
            Error::Refused(python::not_started(python, &e))
        }
        _ => failed(&command.get_program().to_string_lossy(), &e),
    })?;
    Ok((WorkerProcess::Own(child), is_python))
}

impl Link {
    fn new(what: &What, host: Arc<dyn Host>, services: &HostServices, isolation: Isolation) -> Result<Self> {
        let segment = Segment::new().map_err(|e| failed("no shared memory", &e))?;
        let folder = terraglue_fmi::Folder::new("worker");
        let folder = folder.map_err(|e| failed("no temporary folder", &e))?;
        let (cancel, teardown_errors) = (services.cancel.clone(), services.teardown_errors.clone());
        let (child, is_python) = match Forked::take(what, folder.path(), &segment.path()) {
            Some(forked) => {
                segment.never_look();
                (WorkerProcess::Forked(forked), true)
            }
            None => spawn(what, folder.path(), &segment.path())?,
        };
        Ok(Self { segment, child, isolation, host, cancel, teardown_errors, gone: None, is_python, folder })
    }

    /// One call: `write` fills the request after its number, `read` takes the answer after its status.
    fn call<T>(
        &mut self,
        call: calls::Call,
        write: impl FnOnce(&mut wire::Writer),
        read: impl FnOnce(&mut wire::Reader) -> Option<T>,
    ) -> Result<T> {
        if let Some(why) = &self.gone {
            return Err(Error::Fatal(why.clone()));
        }
        let mut writer = wire::Writer::new(self.segment.area(0));
        writer.put(&(call as u8));
        write(&mut writer);
        let Some(length) = writer.length() else {
            return Err(Error::Failed("isolation: the call does not fit into the shared memory".into()));
        };
        self.segment.post_call(length);
        let length = self.wait(call)?;
        let mut reader = wire::Reader::new(&self.segment.area(1)[..length]);
        let answer = calls::read_answer(&mut reader, read);
        let Some((lines, answer)) = answer else { return Err(self.lose("its answer is garbled".into())) };
        lines.iter().for_each(|(level, text)| self.host.log(*level, text));
        if let Err(Error::Fatal(why)) = &answer {
            self.gone = Some(why.clone());
        }
        answer
    }

    fn wait(&mut self, call: calls::Call) -> Result<usize> {
        let limit_s = if call == calls::Call::Start {
            self.isolation.load_timeout_s
        } else {
            self.isolation.step_timeout_s
        };
        let limit = Duration::from_secs_f64(limit_s.clamp(0.0, 1e7));
        let (mut seen, mut looked) = (Duration::ZERO, Instant::now());
        loop {
            if let Some(length) = self.segment.answer(LOOK.min(limit.saturating_sub(seen))) {
                return Ok(length);
            }
            // while this process does not run, the worker hardly does: a machine that stops both makes none hang
            let now = Instant::now();
            seen += (now - looked).min(BLINK);
            looked = now;
            self.segment.cancel_flag().store(self.cancel.load(Ordering::Relaxed).into(), Ordering::Relaxed);
            if let Some(status) = self.child.ended() {
                // It may have answered and then ended.
                return match self.segment.answer(Duration::ZERO) {
                    Some(length) => Ok(length),
                    None => Err(self.lose(last_words(status))),
                };
            }
            if seen >= limit {
                let key = if call == calls::Call::Start { "load_timeout_s" } else { "step_timeout_s" };
                let why = format!("it did not answer within {limit_s} s ({key}) and was ended");
                if self.is_python {
                    python::ask_where(self.child.id(), self.folder.path());
                }
                return Err(self.lose(why));
            }
        }
    }

    /// Ends a worker whose exchange has lasted longer than a call may.
    fn within(&mut self, since: Instant) -> Result {
        let limit_s = self.isolation.step_timeout_s;
        if since.elapsed().as_secs_f64() <= limit_s {
            return Ok(());
        }
        Err(self.lose(format!("it went on asking for more than {limit_s} s (step_timeout_s) and was ended")))
    }

    /// Ends the worker for good.
    #[cold]
    fn lose(&mut self, why: String) -> Error {
        self.child.end();
        let last_words = if self.is_python { python::last_words } else { printed::last_words };
        let said = last_words(self.folder.path());
        let why = format!("{}: {why}{said}", terraglue_diagnostics::error::LOST);
        self.gone = Some(why.clone());
        Error::Fatal(why)
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        if self.gone.is_none() {
            self.isolation.step_timeout_s = self.isolation.step_timeout_s.min(PARTING.as_secs_f64());
            if let Err(error) = self.call(calls::Call::Quit, |_| {}, |_| Some(())) {
                self.teardown_errors.put(format!("`{}` at its end: {error}", self.host.name()));
            }
        }
        self.child.end();
    }
}

/// Description of the end of a process.
pub fn last_words(status: ExitStatus) -> String {
    use std::os::unix::process::ExitStatusExt;
    let Some(signal) = status.signal() else {
        return format!("it ended by itself with exit code {}", status.code().unwrap_or(-1));
    };
    let name = match signal {
        libc::SIGSEGV => " (segmentation fault)",
        libc::SIGABRT => " (abort)",
        libc::SIGBUS => " (bus error)",
        libc::SIGFPE => " (arithmetic)",
        libc::SIGILL => " (illegal instruction)",
        libc::SIGKILL => " (killed)",
        libc::SIGTERM => " (terminated)",
        _ => "",
    };
    format!("it was ended by signal {signal}{name}")
}

/// The program that serves as a worker: this one, or the `terraglue` beside it.
fn program() -> Result<PathBuf> {
    let own = std::env::current_exe().map_err(|e| Error::Failed(format!("isolation: own program: {e}")))?;
    // Its file may have been replaced since it was started; the link leads to what runs.
    if own
        .file_name()
        .and_then(|n| n.to_str())
        .is_some_and(|n| n == "terraglue" || n == "terraglue (deleted)")
    {
        return Ok("/proc/self/exe".into());
    }
    let beside = |up: &str| own.parent().unwrap_or(Path::new(".")).join(up).join("terraglue");
    let found = ["", "..", "../bin"].iter().map(|up| beside(up)).find(|p| p.is_file());
    found.ok_or_else(|| {
        Error::Failed(format!("isolation needs the program `terraglue` beside {}", own.display()))
    })
}

/// A line of a worker's log.
type Line = (LogLevel, String);
