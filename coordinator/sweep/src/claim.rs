//! Who runs a case: a lock beside its folder, so that two processes on one folder, or one file system, share the work.

use crate::folder::{Case, Sweep};
use std::fs::{File, TryLockError};
use std::io::ErrorKind;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use terraglue_diagnostics::error::Result;
use terraglue_recording::at;

/// A case that no other process runs while this lives.
#[derive(Debug)]
pub struct Claim {
    path: PathBuf,
    _lock: File,
}

impl Claim {
    /// Takes a case; none: another process runs it.
    ///
    /// # Errors
    /// The lock cannot be made.
    pub fn take(sweep: &Sweep, case: &Case) -> Result<Option<Self>> {
        let path = sweep.case_folder(case).with_extension("lock");
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).map_err(at(folder))?;
        }
        loop {
            let lock = File::create(&path).map_err(at(&path))?;
            match lock.try_lock() {
                Ok(()) if is_at(&path, &lock).map_err(at(&path))? => {
                    return Ok(Some(Self { path, _lock: lock }));
                }
                // whoever had it has removed the file that was opened: others see a new one
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => return Ok(None),
                Err(TryLockError::Error(e)) => return Err(at(&path)(e)),
            }
        }
    }
}

/// Whether an open file still is the one at a path.
fn is_at(path: &Path, file: &File) -> std::io::Result<bool> {
    let own = file.metadata()?;
    match std::fs::metadata(path) {
        Ok(there) => Ok((there.dev(), there.ino()) == (own.dev(), own.ino())),
        Err(e) if e.kind() == ErrorKind::NotFound => Ok(false),
        Err(e) => Err(e),
    }
}

impl Drop for Claim {
    fn drop(&mut self) {
        // whoever waits for it finds the outcome, and a file without a lock does no harm
        let _ = std::fs::remove_file(&self.path);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Points, Settings};
    use std::sync::atomic::{AtomicUsize, Ordering};

    #[test]
    fn a_case_is_run_by_one_at_a_time() {
        let place = tempfile::tempdir().expect("folder");
        let points = Points { keys: vec!["a".into()], rows: vec![vec!["1".into()], vec!["2".into()]] };
        let sweep = Sweep::create(&place.path().join("sweep"), Settings::default(), points).expect("made");
        let first = Claim::take(&sweep, &sweep.cases[0]).expect("a lock");
        assert!(first.is_some());
        assert!(Claim::take(&sweep, &sweep.cases[0]).expect("a look").is_none());
        assert!(Claim::take(&sweep, &sweep.cases[1]).expect("another one").is_some());
        drop(first);
        assert!(Claim::take(&sweep, &sweep.cases[0]).expect("free again").is_some());
    }

    #[test]
    fn of_many_that_take_and_leave_a_case_one_has_it_at_a_time() {
        let place = tempfile::tempdir().expect("folder");
        let points = Points { keys: vec!["a".into()], rows: vec![vec!["1".into()]] };
        let sweep = Sweep::create(&place.path().join("sweep"), Settings::default(), points).expect("made");
        let holders = AtomicUsize::new(0);
        std::thread::scope(|scope| {
            for _ in 0..8 {
                scope.spawn(|| {
                    for _ in 0..2000 {
                        if let Some(claim) = Claim::take(&sweep, &sweep.cases[0]).expect("a look") {
                            assert_eq!(holders.fetch_add(1, Ordering::SeqCst), 0);
                            std::thread::yield_now();
                            holders.fetch_sub(1, Ordering::SeqCst);
                            drop(claim);
                        }
                    }
                });
            }
        });
    }
}
