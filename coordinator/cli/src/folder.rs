//! The folder for results: an earlier run is renamed, never overwritten, and what is no run is left alone.

use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};
use terraglue_compare::COMPARE_JSON;
use terraglue_diagnostics::{Error, Result};
use terraglue_recording::{RECORDING, SUMMARY};
use terraglue_scenario::InputError;

/// The folder of `--out`, or `runs/<name>`, after an earlier run there was renamed to `.1`, `.2`, …, as standard error reports.
pub fn results_folder(out: Option<&Path>, name: &str) -> Result<PathBuf> {
    let folder = out.map_or_else(|| Path::new("runs").join(name), Path::to_owned);
    // without a slash at its end, which would lead into it
    let folder: PathBuf = folder.components().collect();
    free(&folder)?;
    if holds_a_run(&folder)? {
        set_aside(&folder)?;
    }
    std::fs::create_dir_all(&folder).map_err(|e| at(&folder, e))?;
    Ok(folder)
}

/// Files that identify the results of a run or of a comparison.
const RESULTS: [&str; 3] = [RECORDING, SUMMARY, COMPARE_JSON];

/// Whether there are results in the folder; one with other files only is refused.
fn holds_a_run(folder: &Path) -> Result<bool> {
    if RESULTS.iter().any(|file| folder.join(file).exists()) {
        return Ok(true);
    }
    let mut entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let Some(first) = entries.next() else { return Ok(false) };
    let message = format!(
        "`{}` holds files that are no run, `{}` among them: results would mix with them",
        folder.display(),
        first.file_name().to_string_lossy()
    );
    let help = "name a new or an empty folder with --out, or one with an earlier run, which is renamed then";
    Err(InputError::plain(message, Some(help.into())).into())
}

/// Refuses a folder that another run is writing into.
pub fn free(folder: &Path) -> Result {
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
    std::fs::rename(folder, &free).map_err(|e| at(folder, e))?;
    eprintln!("note: the earlier results in {} are in {} now", folder.display(), free.display());
    Ok(())
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
    fn earlier_results_are_renamed_and_other_files_refused() {
        let temporary = tempfile::tempdir().expect("folder");
        let out = temporary.path().join("out/");
        for file in [RECORDING, COMPARE_JSON] {
            results_folder(Some(&out), "walk").expect("made");
            std::fs::write(out.join(file), "earlier").expect("written");
        }
        results_folder(Some(&out), "walk").expect("made");
        assert_eq!(std::fs::read_dir(&out).expect("there").count(), 0);
        assert!(temporary.path().join("out.1").join(RECORDING).is_file());
        assert!(temporary.path().join("out.2").join(COMPARE_JSON).is_file());
        std::fs::write(out.join("thesis.tex"), "text").expect("written");
        let error = results_folder(Some(&out), "walk").expect_err("refused");
        assert!(error.to_string().contains("`thesis.tex`"), "{error}");
        assert!(out.join("thesis.tex").is_file());
    }

    #[test]
    fn a_folder_that_a_run_writes_into_is_refused() {
        let temporary = tempfile::tempdir().expect("folder");
        let running =
            terraglue_host::kept_file::KeptFile::create(&temporary.path().join(RECORDING)).expect("file");
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
