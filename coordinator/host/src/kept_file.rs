//! A file that is written while foreign code runs in this process. Such code may close descriptors that are not its own, and
//! the number may mean another file afterwards: before each write it is looked at, and where it is ours no more, the file is
//! opened again and goes on where it was.

use std::fs::{File, Metadata};
use std::io::{Error, ErrorKind, Read, Result, Seek, SeekFrom, Write};
use std::os::fd::IntoRawFd;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};

/// A file that stays ours.
pub struct KeptFile {
    file: Option<File>,
    path: PathBuf,
    identity: (u64, u64),
    told: bool,
    /// Once a write has failed no other is tried: what is there ends with a whole part.
    failed: bool,
    /// Bytes ahead that are there already: what is written is compared with them.
    ahead: u64,
}

/// Of a file that has lost what a checkpoint counts on.
pub fn shorter() -> Error {
    Error::new(ErrorKind::UnexpectedEof, "it is shorter than it was when the checkpoint was written")
}

impl KeptFile {
    /// Creates the file, or empties it, and locks it. Writers that gather what they write keep the look before each write cheap.
    ///
    /// # Errors
    /// The file cannot be created.
    pub fn create(path: &Path) -> Result<Self> {
        let path = std::path::absolute(path)?;
        terraglue_subsystem::files::can_create(&path)?;
        let file = File::create(&path)?;
        Self::of(file, path, 0)
    }

    /// Opens a file of an earlier process to write its first `length` bytes once more, which must be the same; what comes
    /// behind them is cut off then.
    ///
    /// # Errors
    /// The file cannot be opened.
    pub fn repeat(path: &Path, length: u64) -> Result<Self> {
        let path = std::path::absolute(path)?;
        let file = File::options().read(true).write(true).open(&path)?;
        Self::of(file, path, length)
    }

    /// Opens a file of an earlier process to go on behind its first `length` bytes.
    ///
    /// # Errors
    /// The file cannot be opened, or is shorter than that.
    pub fn go_on(path: &Path, length: u64) -> Result<Self> {
        let mut kept = Self::repeat(path, 0)?;
        if let Some(file) = &mut kept.file {
            if file.metadata()?.len() < length {
                return Err(shorter());
            }
            file.set_len(length)?;
            file.seek(SeekFrom::End(0))?;
        }
        Ok(kept)
    }

    fn of(file: File, path: PathBuf, ahead: u64) -> Result<Self> {
        // Where the file system knows no locks, two runs into one folder are not noticed.
        drop(file.try_lock());
        let identity = identity(&file.metadata()?);
        Ok(Self { file: Some(file), path, identity, told: false, failed: false, ahead })
    }

    /// Compares with what is there; the last byte of it cuts off the rest.
    fn compare(&mut self, bytes: &[u8]) -> Result<usize> {
        let count = bytes.len().min(usize::try_from(self.ahead).unwrap_or(usize::MAX));
        let mut there = vec![0; count];
        let file = self.ours()?;
        file.read_exact(&mut there)?;
        if there != bytes[..count] {
            return Err(Error::new(ErrorKind::InvalidData, "it is not as the run has left it"));
        }
        self.ahead -= count as u64;
        if self.ahead == 0 {
            let file = self.ours()?;
            let end = file.stream_position()?;
            file.set_len(end)?;
        }
        Ok(count)
    }

    fn is_ours(&self) -> bool {
        let now = self.file.as_ref().and_then(|file| file.metadata().ok());
        now.is_some_and(|now| identity(&now) == self.identity)
    }

    fn ours(&mut self) -> Result<&mut File> {
        if !self.is_ours() {
            self.forget();
            let again = File::options().append(true).open(&self.path)?;
            self.identity = identity(&again.metadata()?);
            if !std::mem::replace(&mut self.told, true) {
                let name = self.path.display();
                log::warn!(
                    "`{name}` was closed by a module or FMU and is opened again; `isolate = true` keeps such a one apart"
                );
            }
            self.file = Some(again);
        }
        self.file.as_mut().ok_or_else(|| std::io::Error::other("it is closed"))
    }

    /// Leaves the descriptor to whom it belongs now.
    fn forget(&mut self) {
        let _ = self.file.take().map(IntoRawFd::into_raw_fd);
    }
}

impl Write for KeptFile {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        if self.failed {
            return Err(std::io::Error::other("an earlier write failed"));
        }
        let written = match self.ahead {
            0 => self.ours()?.write(bytes),
            _ => self.compare(bytes),
        };
        self.failed = written.as_ref().is_err_and(|e| e.kind() != ErrorKind::Interrupted);
        written
    }

    fn flush(&mut self) -> Result<()> {
        Ok(())
    }
}

impl Drop for KeptFile {
    fn drop(&mut self) {
        if !self.is_ours() {
            self.forget();
        }
    }
}

fn identity(of: &Metadata) -> (u64, u64) {
    (of.dev(), of.ino())
}
