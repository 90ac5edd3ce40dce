//! Disks that are full: room kept for the figures of a run, and an error that says what is kept and where room is lacking.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use terraglue_diagnostics::error::Error;

/// Name of the file that holds room until the run ends.
pub(crate) const RESERVE: &str = ".reserve";
/// Bytes of it: `summary.json` with a long list of events, and the messages of the last step.
const ROOM: usize = 128 << 10;

/// Room on the disk that can be given back.
#[derive(Debug, Default)]
pub(crate) struct Reserve(Option<PathBuf>);

impl Reserve {
    /// Keeps room in a folder, where there is some.
    pub fn take(folder: &Path) -> Self {
        let path = folder.join(RESERVE);
        // where nothing can be written the recording says so
        let _ = std::fs::write(&path, vec![0; ROOM]);
        Self(Some(path))
    }

    /// Gives it back.
    pub fn release(&mut self) {
        if let Some(path) = self.0.take() {
            // it is empty room, missed by nobody
            let _ = std::fs::remove_file(path);
        }
    }
}

impl Drop for Reserve {
    fn drop(&mut self) {
        self.release();
    }
}

/// Explains a failed write of a run: where there was no room, the error says how much there is and up to when the run is
/// kept, `kept_s`.
pub(crate) fn explain(error: Error, kept_s: f64) -> Error {
    match error {
        Error::File { path, source } if is_full(source.kind()) => {
            let folder = Path::new(&path).parent().filter(|p| !p.as_os_str().is_empty());
            let free = free(folder.unwrap_or(Path::new(".")));
            Error::Full { free, path, source, kept_s }
        }
        other => other,
    }
}

fn is_full(kind: ErrorKind) -> bool {
    matches!(kind, ErrorKind::StorageFull | ErrorKind::QuotaExceeded | ErrorKind::FileTooLarge)
}

fn free(folder: &Path) -> String {
    match rustix::fs::statvfs(folder) {
        Ok(disk) => format!("{:.1} MiB", disk.f_bavail as f64 * disk.f_frsize as f64 / f64::from(1 << 20)),
        Err(_) => "an unknown number of MiB".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn room_is_given_back() {
        let folder = tempfile::tempdir().expect("folder");
        let mut reserve = Reserve::take(folder.path());
        assert_eq!(std::fs::metadata(folder.path().join(RESERVE)).expect("there").len(), ROOM as u64);
        reserve.release();
        assert!(!folder.path().join(RESERVE).exists());
    }

    #[test]
    fn a_full_disk_is_told_with_the_file_the_room_and_the_time() {
        let source = || std::io::Error::from(ErrorKind::StorageFull);
        let error = explain(Error::File { path: "/dev/full".into(), source: source() }, 1.25);
        let text = error.to_string();
        for word in ["/dev/full", "MiB are free", "up to t = 1.25 s"] {
            assert!(text.contains(word), "{text}");
        }
        let other = Error::File { path: "a".into(), source: ErrorKind::NotFound.into() };
        assert!(matches!(explain(other, 0.0), Error::File { .. }));
    }
}
