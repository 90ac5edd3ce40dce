//! Temporary folders that are gone when their process is, however it ends.

use std::collections::BTreeSet;
use std::fs::{File, Metadata, TryLockError};
use std::os::fd::IntoRawFd;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use tempfile::TempDir;

/// Beginning of the names of our folders below the system's temporary folder.
const PREFIX: &str = "terraglue-";
/// File in such a folder that its process holds locked.
const LOCK: &str = ".terraglue-lock";

/// Folders of this process that are there.
static FOLDERS: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// Removes all folders of this process, before it ends in the middle of its work.
pub fn remove_folders() {
    for folder in std::mem::take(&mut *FOLDERS.lock().unwrap_or_else(PoisonError::into_inner)) {
        // Folders that cannot be removed now are removed by the next process that makes one.
        drop(std::fs::remove_dir_all(folder));
    }
}

/// A temporary folder that is locked while its process lives.
#[derive(Debug)]
pub struct Folder {
    folder: TempDir,
    lock: Option<File>,
}

impl Folder {
    /// Makes one for a purpose that its name shows, and removes those of processes that were killed.
    ///
    /// # Errors
    /// No temporary folder can be made.
    pub fn new(purpose: &str) -> std::io::Result<Self> {
        sweep();
        loop {
            let folder = tempfile::Builder::new().prefix(&format!("{PREFIX}{purpose}-")).tempdir()?;
            let path = folder.path().join(LOCK);
            let lock = File::create(&path)?;
            lock.lock()?;
            // Another process may have swept it between these two lines.
            if path.exists() {
                FOLDERS.lock().unwrap_or_else(PoisonError::into_inner).insert(folder.path().into());
                return Ok(Self { folder, lock: Some(lock) });
            }
        }
    }

    /// Where it is.
    #[must_use]
    pub fn path(&self) -> &Path {
        self.folder.path()
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        FOLDERS.lock().unwrap_or_else(PoisonError::into_inner).remove(self.folder.path());
        let identity = |of: Metadata| (of.dev(), of.ino());
        let own = std::fs::metadata(self.folder.path().join(LOCK)).ok().map(identity);
        let now = self.lock.as_ref().and_then(|lock| lock.metadata().ok()).map(identity);
        if own.is_none() || own != now {
            // The FMU closed a descriptor that is not its own; the number may be another file's by now.
            let _ = self.lock.take().map(IntoRawFd::into_raw_fd);
        }
    }
}

/// Removes the folders of processes that were killed before they could.
fn sweep() {
    let Ok(entries) = std::fs::read_dir(std::env::temp_dir()) else { return };
    for entry in entries.flatten() {
        if !entry.file_name().to_string_lossy().starts_with(PREFIX) {
            continue;
        }
        let Ok(lock) = File::open(entry.path().join(LOCK)) else { continue };
        match lock.try_lock() {
            Ok(()) => drop(std::fs::remove_dir_all(entry.path())),
            Err(TryLockError::WouldBlock | TryLockError::Error(_)) => {}
        }
    }
}
