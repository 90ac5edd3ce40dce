//! Foreign code at work: a program in a folder of its own, ended when its time is over, and the files it leaves behind.

use crate::process::Outcome;
use rustix::process::{Pid, Signal, kill_process};
use std::fs::File;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use terraglue::host::isolation::end_group;

/// How often to look whether it has ended.
const LOOK: Duration = Duration::from_millis(5);
/// How long the system may take to bury processes that were ended.
const BURIAL: Duration = Duration::from_secs(2);

/// How a program ended.
#[derive(Debug)]
pub struct Ended {
    /// Exit code; none: by a signal, or because its time was over.
    pub code: Option<i32>,
    /// Its standard output.
    pub output: String,
    /// Its standard error.
    pub errors: String,
    /// Files in its temporary folder and processes that outlived it.
    pub left: Vec<String>,
}

impl Ended {
    /// Its error in one line.
    pub fn error(&self) -> &str {
        let last = || self.errors.lines().map(str::trim).rfind(|line| !line.is_empty());
        let error = self.errors.lines().rev().find_map(|line| line.strip_prefix("error: ")).or_else(last);
        error.unwrap_or("it ended without a word")
    }
}

/// Runs a command in `place`, which must exist; its temporary folder is `tmp` there. It is ended with all that it started.
pub fn watched(run: &mut Command, place: &Path, timeout: Duration) -> Outcome<Ended> {
    let wrong = |e: std::io::Error| format!("{}: {e}", place.display());
    let [output, errors, temporary] = ["output", "errors", "tmp"].map(|name| place.join(name));
    std::fs::create_dir_all(&temporary).map_err(wrong)?;
    run.stdin(Stdio::null());
    run.stdout(File::create(&output).map_err(wrong)?).stderr(File::create(&errors).map_err(wrong)?);
    run.current_dir(place).env("TMPDIR", &temporary).process_group(0);
    let mut child = run.spawn().map_err(|e| e.to_string())?;
    let end = Instant::now() + timeout;
    let status = loop {
        match child.try_wait().map_err(wrong)? {
            Some(status) => break Some(status),
            None if Instant::now() >= end => break None,
            None => std::thread::sleep(LOOK),
        }
    };
    let mut left = if status.is_some() { outlived(place) } else { Vec::new() };
    end_group(child.id());
    drop(child.wait());
    for entry in std::fs::read_dir(&temporary).into_iter().flatten().flatten() {
        left.push(entry.file_name().to_string_lossy().into_owned());
    }
    let read =
        |path: &Path| std::fs::read(path).map(|b| String::from_utf8_lossy(&b).into_owned()).map_err(wrong);
    Ok(Ended { code: status.and_then(|s| s.code()), output: read(&output)?, errors: read(&errors)?, left })
}

/// The processes with `place` in their environment that do not end by themselves; they are ended.
fn outlived(place: &Path) -> Vec<String> {
    let end = Instant::now() + BURIAL;
    loop {
        let found = processes(place);
        if found.is_empty() {
            return Vec::new();
        }
        if Instant::now() >= end {
            for id in &found {
                // it may have ended meanwhile
                let _ = id.parse().ok().and_then(Pid::from_raw).map(|id| kill_process(id, Signal::KILL));
            }
            return found.into_iter().map(|id| format!("process {id}")).collect();
        }
        std::thread::sleep(LOOK);
    }
}

/// Numbers of the processes with `place` in their environment.
fn processes(place: &Path) -> Vec<String> {
    let place = place.display().to_string();
    let all = std::fs::read_dir("/proc").into_iter().flatten().flatten();
    let of = |entry: std::fs::DirEntry| {
        let id = entry.file_name().to_string_lossy().into_owned();
        let environment = std::fs::read(entry.path().join("environ")).unwrap_or_default();
        let own = environment.windows(place.len()).any(|w| w == place.as_bytes());
        (own && id.bytes().all(|b| b.is_ascii_digit())).then_some(id)
    };
    all.filter_map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shell(text: &str, timeout: Duration) -> Ended {
        let folder = tempfile::tempdir().expect("a folder");
        watched(Command::new("sh").args(["-c", text]), folder.path(), timeout).expect("it ran")
    }

    #[test]
    fn what_a_program_says_and_leaves_is_told() {
        let ended = shell(
            "echo row; echo error: no >&2; echo later >&2; setsid sh -c 'touch $TMPDIR/file; kill -STOP $$' & \
             while [ ! -e $TMPDIR/file ]; do :; done; exit 3",
            Duration::from_secs(60),
        );
        assert_eq!(
            (ended.code, ended.output.as_str(), ended.error(), ended.left.len()),
            (Some(3), "row\n", "no", 2),
            "{ended:?}"
        );
        assert!(ended.left[0].starts_with("process ") && ended.left[1] == "file", "{ended:?}");
        assert_eq!(shell("exit 0", Duration::from_secs(60)).error(), "it ended without a word");
    }

    #[test]
    fn a_program_that_does_not_end_is_ended() {
        let ended = shell("sleep 97", Duration::from_millis(50));
        assert!(ended.code.is_none() && ended.left.is_empty(), "{ended:?}");
    }
}
