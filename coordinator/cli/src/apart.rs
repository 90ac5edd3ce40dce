//! Commands in a process of their own. `terraglue fmu run --isolate`: the same command in a process of its own.
//!
//! Its rows come through a pipe of their own, in the place of its standard input; all else that it writes goes to standard
//! error, within bounds. It notes the time of each row in a file, so the process that waits knows how far it has come and
//! whether it goes on.

use super::Exit;
use super::arguments::FmuRunArguments;
use super::interrupt::Interrupt;
use super::standard_output;
use rustix::process::{Pid, Signal, getppid, set_parent_process_death_signal};
use std::fs::File;
use std::io::{PipeReader, PipeWriter, Read, Write};
use std::os::unix::fs::FileExt;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use terraglue_diagnostics::{Error, Result};
use terraglue_fmi::Folder;
use terraglue_host::isolation::{end_group, last_words};
use terraglue_scenario::InputError;

/// How often to look whether it has ended.
const LOOK: Duration = Duration::from_millis(5);

/// Variable with the file that a command writes when it has done all of its work.
const DONE: &str = "TERRAGLUE_DONE";

/// Variable with the number of the process that waits for the command.
const PARENT: &str = "TERRAGLUE_PARENT";

/// Whether another process waits for this one and reports how it ended.
pub fn is_child() -> bool {
    std::env::var_os(DONE).is_some()
}

/// The file of this program; where it was replaced or removed since, what runs.
pub fn own_program() -> PathBuf {
    let own = std::env::current_exe().ok().filter(|program| program.is_file());
    own.unwrap_or_else(|| "/proc/self/exe".into())
}

/// Ends with the process `parent` that waits for this one, whatever ends it; false: it has ended already.
#[must_use]
pub fn end_with_parent(parent: Option<Pid>) -> bool {
    // Where the system does not know it, a signal to the group ends both.
    let _ = set_parent_process_death_signal(Some(Signal::KILL));
    // a parent that ended before the call above sends no signal
    getppid() == parent
}

/// The process that waits for this one, where another one does.
pub fn parent() -> Option<Pid> {
    std::env::var(PARENT).ok()?.parse().ok().and_then(Pid::from_raw)
}

/// Notifies the process that waits for this one, if there is one, that all work and output is done, with this exit code.
pub fn done(code: u8) {
    if let Some(path) = std::env::var_os(DONE) {
        // Where it cannot be written, the process counts as lost.
        drop(std::fs::write(path, code.to_string()));
    }
}

/// Bytes of what a process writes beside its rows that are shown, of each of its two outputs.
const MOST_OUTPUT: usize = 1 << 20;

/// Why a process failed that has said nothing.
const UNHEARD: &str = "it failed, and its message did not arrive: has the FMU closed standard error?";

/// File with the time of the last row.
const REACHED: &str = "reached";

/// Report of a process to the one that waits for it. It owns no descriptor: an FMU may close those of others.
pub struct Report {
    reached: PathBuf,
    /// Rows so far: a change means that it goes on.
    count: u64,
}

impl Report {
    /// Of this process, where another one waits for it.
    pub fn of_child() -> Option<Self> {
        let reached = Path::new(&std::env::var_os(DONE)?).with_file_name(REACHED);
        Some(Self { reached, count: 0 })
    }

    /// Writes a row, to the table of the command or not, and how far it has come.
    ///
    /// # Errors
    /// Nobody reads any more.
    pub fn row(&mut self, text: &str, shows: bool) -> std::io::Result<()> {
        if shows {
            let line = format!("{text}\n");
            let mut rest = line.as_bytes();
            while !rest.is_empty() {
                let written = rustix::io::write(std::io::stdin(), rest)?;
                rest = &rest[written..];
            }
        }
        self.count += 1;
        let time = text.split(',').next().filter(|t| t.parse::<f64>().is_ok()).unwrap_or_default();
        let file = File::options().write(true).create(true).truncate(false).open(&self.reached)?;
        file.write_all_at(format!("{time:<40}{:<20}", self.count).as_bytes(), 0)
    }
}

/// Sends on what a process writes, to standard error, up to a bound. Answers with how many bytes there were.
fn send_on(mut from: impl Read + Send + 'static) -> JoinHandle<usize> {
    std::thread::spawn(move || {
        let mut written = 0;
        let mut bytes = [0; 8192];
        // a process that is gone writes no more
        while let Ok(count @ 1..) = from.read(&mut bytes) {
            let shown = count.min(MOST_OUTPUT.saturating_sub(written));
            drop(std::io::stderr().write_all(&bytes[..shown]));
            if shown < count && written <= MOST_OUTPUT {
                eprintln!("\nwarning: the FMU has written {} kB; the rest is left out", MOST_OUTPUT >> 10);
            }
            written += count;
        }
        written
    })
}

/// Sends rows on to standard output; sets `unread` when nobody reads them any more, as after `head`.
fn send_rows(mut from: PipeReader, unread: Arc<AtomicBool>) -> JoinHandle<()> {
    std::thread::spawn(move || {
        let mut out = standard_output::own();
        let sent = std::io::copy(&mut from, &mut out).and_then(|_| out.flush());
        unread.store(sent.is_err(), Ordering::Relaxed);
    })
}

/// The command again without `--isolate`, with a folder of its own and a pipe for its rows.
fn started(folder: &Path, rows: PipeWriter) -> std::io::Result<Child> {
    Command::new(own_program())
        .args(std::env::args_os().skip(1).filter(|word| word != "--isolate"))
        .env("TMPDIR", folder)
        .env(DONE, folder.join(DONE))
        .env(PARENT, std::process::id().to_string())
        .stdin(rows)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .process_group(0)
        .spawn()
}

/// Runs the command again without `--isolate` and says how it ended.
pub fn run(arguments: &FmuRunArguments) -> Result<Exit> {
    let failed =
        |what: &dyn std::fmt::Display| Error::from(InputError::plain(format!("isolation: {what}"), None));
    let interrupt = Interrupt::listen();
    interrupt.run();
    let stopped = interrupt.flag();
    let folder = Folder::new("worker").map_err(|e| failed(&e))?;
    let (rows, theirs) = std::io::pipe().map_err(|e| failed(&e))?;
    let mut child = started(folder.path(), theirs).map_err(|e| failed(&e))?;
    let unread = Arc::<AtomicBool>::default();
    let rows = send_rows(rows, Arc::clone(&unread));
    let outputs = [child.stdout.take().map(send_on), child.stderr.take().map(send_on)];
    let mut row_wait = RowWait::new(folder.path().join(REACHED), arguments.timeout);
    let status = loop {
        match child.try_wait().map_err(|e| failed(&e))? {
            Some(status) => break Some(status),
            None if stopped.load(Ordering::Relaxed) => {
                end_group(child.id());
                drop(child.wait());
                return Ok(Exit::Interrupted);
            }
            None if unread.load(Ordering::Relaxed) => {
                end_group(child.id());
                drop(child.wait());
                return Ok(Exit::Done);
            }
            None if row_wait.is_over() => break None,
            None => std::thread::sleep(LOOK),
        }
    };
    end_group(child.id());
    drop(child.wait());
    drop(rows.join());
    let written = outputs.map(|output| output.and_then(|output| output.join().ok()).unwrap_or(0));
    let lost = |why: &str| {
        let reached = std::fs::read_to_string(folder.path().join(REACHED)).unwrap_or_default();
        let reached = reached.get(..40).map(|t| t.trim().to_owned()).filter(|t| !t.is_empty());
        let when = reached.map_or_else(|| "before its first row".to_owned(), |t| format!("after t = {t} s"));
        eprintln!("error: {}: its process was lost {when}: {why}", arguments.fmu.display());
        Exit::Failed
    };
    let Some(status) = status else {
        let why = format!(
            "no row came within {} s (--timeout S lets it wait longer) and it was ended",
            arguments.timeout
        );
        return Ok(lost(&why));
    };
    // The exit code is trusted where the command itself has written it: its errors are reported then.
    let said = std::fs::read_to_string(folder.path().join(DONE)).ok().and_then(|t| t.parse().ok());
    Ok(match status.code().filter(|code| said == Some(*code)) {
        Some(0) => Exit::Done,
        Some(1 | 2) if written[1] == 0 => lost(UNHEARD),
        Some(1) => Exit::Failed,
        Some(2) => Exit::WrongInput,
        Some(130) => Exit::Interrupted,
        _ => lost(&last_words(status)),
    })
}

/// How long the next row is waited for.
struct RowWait {
    path: PathBuf,
    limit: Duration,
    seen: Vec<u8>,
    since: Instant,
    looked: Instant,
}

impl RowWait {
    fn new(path: PathBuf, limit_s: f64) -> Self {
        let now = Instant::now();
        let limit = Duration::from_secs_f64(limit_s.min(1e7));
        Self { path, limit, seen: Vec::new(), since: now, looked: now }
    }

    /// Whether no row has come for too long.
    fn is_over(&mut self) -> bool {
        if self.looked.elapsed() < self.limit.min(Duration::from_millis(100)) {
            return false;
        }
        self.looked = Instant::now();
        let now = std::fs::read(&self.path).unwrap_or_default();
        if now != self.seen {
            (self.seen, self.since) = (now, self.looked);
        }
        self.since.elapsed() >= self.limit
    }
}
