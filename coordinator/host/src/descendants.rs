//! Processes that modules and FMUs leave behind end with the program.

use rustix::process::{
    Pid, Signal, WaitId, WaitIdOptions, WaitOptions, getpid, kill_process, set_child_subreaper, waitid,
    waitpid,
};
use std::time::{Duration, Instant};

/// Largest time for the end of a child that is ending already.
const GRACE: Duration = Duration::from_millis(100);
const LOOK: Duration = Duration::from_millis(2);
/// Children of children come to light when those end.
const GENERATIONS: usize = 100;

/// From here on processes whose parents end become children of this one, sessions and groups of their own included.
pub fn adopt() {
    // On systems without this call, such processes go to the first process of the system.
    let _ = set_child_subreaper(Some(getpid()));
}

/// Ends all children of this process; how many had to be ended.
pub fn end_all() -> usize {
    let end = Instant::now() + GRACE;
    while has_children() && Instant::now() < end {
        reap();
        std::thread::sleep(LOOK);
    }
    let mut ended = 0;
    for _ in 0..GENERATIONS {
        if !has_children() {
            break;
        }
        for child in children() {
            let leaves = is_ending(child);
            ended += usize::from(kill_process(child, Signal::KILL).is_ok() && !leaves);
            // It may be gone already.
            let _ = waitpid(Some(child), WaitOptions::empty());
        }
    }
    ended
}

fn has_children() -> bool {
    // nothing is taken from whom else waits for a child
    let look = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
    waitid(WaitId::All, look).is_ok()
}

/// Whether a process has ended, or was ended and has not been given the processor since: on a busy machine that takes its time.
fn is_ending(process: Pid) -> bool {
    let path = format!("/proc/{}/status", process.as_raw_nonzero());
    let Ok(status) = std::fs::read_to_string(path) else { return true };
    let of = |key: &str| status.lines().find_map(|line| line.strip_prefix(key)).map(str::trim);
    let gone = of("State:").is_some_and(|state| state.starts_with(['Z', 'X']));
    let told = |key: &str| of(key).and_then(|mask| u64::from_str_radix(mask, 16).ok()).unwrap_or(0);
    let kill = 1 << (Signal::KILL.as_raw() - 1);
    gone || (told("ShdPnd:") | told("SigPnd:")) & kill != 0
}

/// Buries children that have ended.
fn reap() {
    while let Ok(Some(_)) = waitpid(None, WaitOptions::NOHANG) {}
}

/// By the list of processes: the kernel's own list of children is optional.
fn children() -> Vec<Pid> {
    let own = getpid().as_raw_nonzero().to_string();
    let all = std::fs::read_dir("/proc").into_iter().flatten().flatten();
    let child = |entry: std::fs::DirEntry| {
        let id: i32 = entry.file_name().to_str()?.parse().ok()?;
        let stat = std::fs::read_to_string(entry.path().join("stat")).ok()?;
        // behind the name in brackets, which may hold anything: state, parent
        let parent = stat.rsplit_once(')')?.1.split_whitespace().nth(1)? == own;
        parent.then(|| Pid::from_raw(id))?
    };
    all.filter_map(child).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::process::{Command, Stdio};

    #[test]
    fn what_was_ended_already_is_not_left_behind() {
        let mut child = Command::new("sleep").arg("100").stdin(Stdio::null()).spawn().expect("sleep");
        let id = Pid::from_child(&child);
        assert!(!is_ending(id));
        child.kill().expect("ended");
        // it stays until somebody asks how it ended
        while std::fs::read_to_string(format!("/proc/{}/stat", child.id())).is_ok_and(|s| !s.contains(") Z "))
        {
            assert!(is_ending(id), "the signal is on its way");
        }
        assert!(is_ending(id));
        child.wait().expect("its end");
        assert!(is_ending(id));
    }
}
