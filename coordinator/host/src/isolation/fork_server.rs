//! Interpreters that wait with everything loaded that a worker in Python needs: a worker is a copy of one of them.
//!
//! The checker keeps a fork server, because each of its tests makes workers: a copy costs a millisecond, a start fifty. A
//! fork server has several interpreters, each with its own seed of hashes and its own addresses, and workers come from them in
//! turn: what depends on either is found as if every worker were started afresh. Where there is none, or it does not
//! answer, workers are started.

use super::What;
use super::python::{FILES, TAKE_FILES};
use std::fs::File;
use std::io::{self, PipeWriter, Read, Write};
use std::os::fd::{AsRawFd, OwnedFd};
use std::os::unix::ffi::OsStrExt;
use std::os::unix::net::{UnixListener, UnixStream};
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

/// Environment variable with the folder of the fork server that a process may use.
pub const FORK_SERVER: &str = "TERRAGLUE_FORK_SERVER";
/// Interpreters of a fork server.
const INTERPRETERS: usize = 2;
/// File that names the interpreter.
const NAME: &str = "interpreter";
/// Longest time that a copy may take, an interpreter that has just been started included.
const TIMEOUT: Duration = Duration::from_secs(20);

/// Interpreters that wait; they end with this.
pub struct ForkServer {
    children: Vec<Child>,
    folder: tempfile::TempDir,
}

impl ForkServer {
    /// Starts the interpreters.
    ///
    /// # Errors
    /// No temporary folder, no sockets in it, or the interpreter does not start.
    pub fn open(python: &Path) -> io::Result<Self> {
        let folder = tempfile::Builder::new().prefix("terraglue-fork-server-").tempdir()?;
        for (name, text) in FILES {
            std::fs::write(folder.path().join(name), text)?;
        }
        std::fs::write(folder.path().join(NAME), python.as_os_str().as_bytes())?;
        let mut fork_server = Self { children: Vec::new(), folder };
        for k in 0..INTERPRETERS {
            let listener = UnixListener::bind(socket(fork_server.folder.path(), k))?;
            let mut command = Command::new(python);
            let program = format!("{TAKE_FILES} import terraglue_fork_server; terraglue_fork_server.serve()");
            command.arg("-B").args(["-c", &program]).arg(fork_server.folder.path());
            if std::env::var_os("PYTHONHASHSEED").is_none() {
                command.env("PYTHONHASHSEED", (k + 1).to_string());
            }
            // The connections that wait are answered when the interpreter is there; if it ends, they are closed.
            command.stdin(OwnedFd::from(listener)).stdout(Stdio::piped()).stderr(Stdio::null());
            fork_server.children.push(command.process_group(0).spawn()?);
        }
        Ok(fork_server)
    }

    /// Environment variable of the processes that may use it.
    pub fn variable(&self) -> (String, String) {
        (FORK_SERVER.into(), self.folder.path().to_string_lossy().into_owned())
    }
}

impl Drop for ForkServer {
    fn drop(&mut self) {
        for child in &mut self.children {
            // It may have ended by itself.
            drop(child.kill());
            drop(child.wait());
        }
    }
}

fn socket(folder: &Path, k: usize) -> PathBuf {
    folder.join(format!("{k}.socket"))
}

/// The process of a worker: one that was started here, or a copy that a fork server made.
pub enum WorkerProcess {
    /// Started here.
    Own(Child),
    /// From a fork server.
    Forked(Forked),
}

/// A copy that a fork server made.
pub struct Forked {
    id: u32,
    fork_server: UnixStream,
    // The worker ends when this does.
    _stdin: PipeWriter,
}

impl WorkerProcess {
    /// Its number, which is that of its group of processes.
    pub fn id(&self) -> u32 {
        match self {
            Self::Own(child) => child.id(),
            Self::Forked(forked) => forked.id,
        }
    }

    /// Its exit status, if it has ended.
    pub fn ended(&mut self) -> Option<ExitStatus> {
        match self {
            Self::Own(child) => child.try_wait().ok().flatten(),
            Self::Forked(forked) => forked.ended(),
        }
    }

    /// Ends it with all that it has started.
    pub fn end(&mut self) {
        super::channel::end_group(self.id());
        if let Self::Own(child) = self {
            drop(child.wait());
        }
    }
}

impl Forked {
    /// From the fork server of this process's environment, if there is one with this interpreter; None: start one.
    pub fn take(what: &What, folder: &Path, segment: &str) -> Option<Self> {
        static NEXT: AtomicUsize = AtomicUsize::new(0);
        let (What::Python { python, .. } | What::Law { python, .. }) = what else { return None };
        let home = PathBuf::from(std::env::var_os(FORK_SERVER)?);
        if std::fs::read(home.join(NAME)).ok()? != python.as_os_str().as_bytes() {
            return None;
        }
        let k = NEXT.fetch_add(1, Ordering::Relaxed) % INTERPRETERS;
        let mut fork_server = UnixStream::connect(socket(&home, k)).ok()?;
        let (stdin, theirs) = stdin().ok()?;
        let path = format!("/proc/{}/fd/{}", std::process::id(), theirs.as_raw_fd());
        fork_server.write_all(format!("{segment}\n{}\n{path}\n", folder.display()).as_bytes()).ok()?;
        fork_server.set_read_timeout(Some(TIMEOUT)).ok()?;
        let id = number(&mut fork_server)?;
        fork_server.set_nonblocking(true).ok()?;
        Some(Self { id: u32::try_from(id).ok().filter(|id| *id > 1)?, fork_server, _stdin: stdin })
    }

    fn ended(&mut self) -> Option<ExitStatus> {
        match number(&mut self.fork_server) {
            Some(status) => Some(ExitStatus::from_raw(status)),
            // If the fork server is gone the exit status of the worker is unknown.
            None if Path::new(&format!("/proc/{}", self.id)).exists() => None,
            None => Some(ExitStatus::from_raw(libc::SIGKILL)),
        }
    }
}

/// Standard input of a worker: our end, and its.
fn stdin() -> io::Result<(PipeWriter, File)> {
    let (theirs, ours) = io::pipe()?;
    Ok((ours, File::from(OwnedFd::from(theirs))))
}

/// A line with a number.
fn number(from: &mut UnixStream) -> Option<i32> {
    let (mut line, mut byte) = (String::new(), [0]);
    while from.read(&mut byte).ok()? == 1 {
        match byte[0] {
            b'\n' => return line.parse().ok(),
            digit => line.push(digit.into()),
        }
    }
    None
}
