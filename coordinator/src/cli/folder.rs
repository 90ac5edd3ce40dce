//! The folder for results: an earlier run is renamed, never overwritten.

use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};
use terraglue::recording::RECORDING;
use terraglue::scenario::InputError;
use terraglue::{Error, Result};

/// The folder of `--out`, or `runs/<name>` after an earlier run there was renamed to `.1`, `.2`, …
pub fn results_folder(out: Option<&Path>, name: &str) -> Result<PathBuf> {
    let usual = Path::new("runs").join(name);
    free(out.unwrap_or(&usual))?;
    let folder = match out {
        Some(folder) => folder.to_owned(),
        None => {
            set_aside(&usual)?;
            usual
        }
    };
    std::fs::create_dir_all(&folder).map_err(|e| at(&folder, e))?;
    Ok(folder)
}

/// Refuses a folder that another run is writing into.
fn free(folder: &Path) -> Result {
    let locked = File::open(folder.join(RECORDING))
        .is_ok_and(|file| matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)));
    if !locked {
        return Ok(());
    }
    let message = format!("another run is writing into `{}`", folder.display());
    Err(InputError::plain(message, Some("name another folder with --out, or wait for its end".into())).into())
}

/// Renames a folder to the first free of `folder.1`, `folder.2`, …
fn set_aside(folder: &Path) -> Result {
    if !folder.exists() {
        return Ok(());
    }
    let numbered = |n: u32| PathBuf::from(format!("{}.{n}", folder.display()));
    let free = (1..).map(numbered).find(|f| !f.exists()).unwrap_or_else(|| numbered(u32::MAX));
    std::fs::rename(folder, &free).map_err(|e| at(folder, e))
}

fn at(path: &Path, source: std::io::Error) -> Error {
    let message = format!("`{}` cannot be made the folder for the results: {source}", path.display());
    InputError::plain(message, Some("name another folder with --out".into())).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_that_cannot_be_made_is_wrong_input() {
        let temporary = tempfile::tempdir().expect("folder");
        let file = temporary.path().join("taken");
        std::fs::write(&file, "text").expect("written");
        for out in [file.clone(), file.join("below")] {
            let error = results_folder(Some(&out), "walk").expect_err("refused");
            assert!(matches!(error, Error::Input(_)), "{error}");
            assert!(error.to_string().contains(&out.display().to_string()), "{error}");
        }
        assert_eq!(std::fs::read_to_string(&file).expect("there"), "text");
    }

    #[test]
    fn a_folder_that_a_run_writes_into_is_refused() {
        let temporary = tempfile::tempdir().expect("folder");
        let running =
            terraglue::recording::KeptFile::create(&temporary.path().join(RECORDING)).expect("file");
        let error = results_folder(Some(temporary.path()), "walk").expect_err("refused");
        assert!(error.to_string().contains("another run"), "{error}");
        drop(running);
        results_folder(Some(temporary.path()), "walk").expect("free");
    }

    #[test]
    fn earlier_runs_get_numbers() {
        let temporary = tempfile::tempdir().expect("folder");
        let folder = temporary.path().join("walk");
        for text in ["a", "b", "c"] {
            set_aside(&folder).expect("renamed");
            std::fs::create_dir(&folder).expect("made");
            std::fs::write(folder.join("x"), text).expect("written");
        }
        let read =
            |name: &str| std::fs::read_to_string(temporary.path().join(name).join("x")).expect("there");
        assert_eq!([read("walk"), read("walk.1"), read("walk.2")], ["c", "a", "b"]);
    }
}
