//! New code on its way into a run: built, copied, tested, while the old code goes on.

use super::sources::Stamp;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};
use terraglue_conformance::{Level, Options, check};
use terraglue_diagnostics::fingerprint;
use terraglue_host::is_python;

/// Code that may be exchanged.
#[derive(Debug)]
pub struct Candidate {
    /// Where it is loaded from.
    pub path: PathBuf,
    /// Its fingerprint.
    pub hash: u64,
    /// Whether it differs from the code in use.
    pub is_new: bool,
}

/// Work of a preparation, without a reference to the run.
pub struct Preparation {
    /// Folder of the scenario, where the build command runs.
    pub folder: PathBuf,
    /// The build command; None: nothing is to be built.
    pub command: Option<String>,
    /// Process group of the running build command.
    pub build: Arc<AtomicU32>,
    /// File of the module.
    pub file: PathBuf,
    /// Fingerprint of the code in use.
    pub hash: u64,
    /// Folder for the copy.
    pub copy: PathBuf,
    /// The program `terraglue`.
    pub program: PathBuf,
    /// Parameters for the tests.
    pub sets: Vec<(String, String)>,
}

/// How long a file must stay as it is to count as written.
const SETTLED: Duration = Duration::from_millis(20);
/// How long it may take to settle.
const LONGEST: Duration = Duration::from_secs(10);

impl Preparation {
    /// Builds, copies and tests. None: the same code as before.
    pub fn run(self) -> Result<Option<Candidate>, String> {
        if let Some(command) = &self.command {
            self.build(command)?;
        }
        let bytes = settled(&self.file)?;
        let hash = fingerprint(&bytes);
        let is_new = hash != self.hash;
        if !is_new && self.command.is_none() {
            return Ok(Some(Candidate { path: self.copied(&bytes)?, hash, is_new }));
        }
        let path = self.copied(&bytes)?;
        self.test(&path)?;
        if is_python(&path) && settled(&self.file)? != bytes {
            return Err("the file changed while it was tested".into());
        }
        Ok(Some(Candidate { path, hash, is_new }))
    }

    fn build(&self, command: &str) -> Result<(), String> {
        use std::os::unix::process::CommandExt;
        let folder = if self.folder.as_os_str().is_empty() { Path::new(".") } else { &self.folder };
        let mut shell = Command::new("sh");
        shell.args(["-c", command]).current_dir(folder).process_group(0).stdin(Stdio::null());
        shell.stdout(Stdio::piped()).stderr(Stdio::piped());
        let started = shell.spawn().map_err(|e| format!("`{command}` cannot be started: {e}"))?;
        self.build.store(started.id(), Ordering::Relaxed);
        let done = started.wait_with_output();
        self.build.store(0, Ordering::Relaxed);
        let done = done.map_err(|e| format!("`{command}`: {e}"))?;
        if done.status.success() {
            return Ok(());
        }
        let told = [done.stdout, done.stderr].concat();
        let told = String::from_utf8_lossy(&told);
        let lines: Vec<&str> = told.lines().collect();
        let last = lines[lines.len().saturating_sub(30)..].join("\n");
        Err(format!("`{command}` failed ({})\n{last}", done.status))
    }

    /// A library under a name that was never loaded, with the file of its check beside it. A file in Python is read afresh
    /// by every process, so it stays where its neighbours are.
    fn copied(&self, bytes: &[u8]) -> Result<PathBuf, String> {
        if is_python(&self.file) {
            return Ok(self.file.clone());
        }
        let failed = |e: std::io::Error| format!("{}: {e}", self.copy.display());
        std::fs::create_dir_all(&self.copy).map_err(failed)?;
        let copy = self.copy.join(self.file.file_name().unwrap_or_default());
        // Another inode: a library that is mapped must not change below its code.
        drop(std::fs::remove_file(&copy));
        std::fs::write(&copy, bytes).map_err(failed)?;
        let beside = self.file.with_extension("check.toml");
        if beside.is_file() {
            std::fs::copy(&beside, copy.with_extension("check.toml")).map_err(failed)?;
        }
        Ok(copy)
    }

    fn test(&self, path: &Path) -> Result<(), String> {
        let options =
            Options { level: Level::Quick, sets: self.sets.clone(), ..Options::new(self.program.clone()) };
        let report = check(path, &options)?;
        if report.is_good() {
            return Ok(());
        }
        let broken = report.rows.iter().filter(|r| r.outcome.is_broken());
        let told: String = broken.map(|r| format!("\n{}: {}", r.test, r.outcome.detail())).collect();
        Err(format!("the quick tests found: {}{told}", report.broken().join(", ")))
    }
}

/// The bytes of a file that nobody writes to any more.
fn settled(file: &Path) -> Result<Vec<u8>, String> {
    let end = Instant::now() + LONGEST;
    loop {
        let before = Stamp::of(file);
        std::thread::sleep(SETTLED);
        if let Ok(bytes) = std::fs::read(file)
            && Stamp::of(file) == before
            && !before.is_missing()
        {
            return Ok(bytes);
        }
        if Instant::now() > end {
            return Err(format!("{} is missing or still written to", file.display()));
        }
    }
}
