//! Thousands of lives of an FMU in one process: nothing grows.

use super::{built, fmus};
use crate::process::Outcome;
use crate::{Figure, Limit};
use std::path::Path;

pub fn figures(folder: &Path, quick: bool) -> Outcome<Vec<Figure>> {
    fmus::build(folder, "life", &[("u", 'i', 1.0), ("y", 'o', 0.0)], "", "v[1] += h * v[0];")?;
    let cycles = if quick { 300 } else { 2000 };
    let text = "[time]\nstep_s = 0.1\nduration_s = 1.0\n[life]\nfmu = \"life.fmu\"\n";
    let mut early = None;
    for cycle in 0..cycles {
        let mut testbed = built(folder, text)?;
        testbed.step().map_err(|e| e.to_string())?;
        testbed.close().map_err(|e| e.to_string())?;
        if cycle == cycles / 4 {
            early = Some(Holdings::now());
        }
    }
    let (now, early) = (Holdings::now(), early.unwrap_or_default());
    let grown = |a: f64, b: f64| (a - b).max(0.0);
    let what = |name: &str| format!("{name} gained over the last three quarters of {cycles} lives of an FMU");
    Ok(vec![
        Figure::new(
            "fmi.cycles.descriptors",
            grown(now.files, early.files),
            Limit::Equal(0.0),
            what("descriptors"),
        ),
        Figure::new(
            "fmi.cycles.threads",
            grown(now.threads, early.threads),
            Limit::Equal(0.0),
            what("threads"),
        ),
        Figure::new(
            "fmi.cycles.folders",
            grown(now.folders, early.folders),
            Limit::Equal(0.0),
            what("folders"),
        ),
        Figure::new(
            "fmi.cycles.memory",
            grown(now.memory, early.memory),
            Limit::AtMost(1.0),
            what("MiB of memory"),
        )
        .noisy(),
    ])
}

/// Resources of a process.
#[derive(Default)]
struct Holdings {
    files: f64,
    threads: f64,
    folders: f64,
    memory: f64,
}

impl Holdings {
    fn now() -> Self {
        let count = |path: &str| std::fs::read_dir(path).map_or(0, Iterator::count) as f64;
        // Folders of FMUs that no process holds: those in use are locked, by this or by another process.
        let left = |e: &std::fs::DirEntry| {
            let named = e.file_name().to_string_lossy().starts_with("terraglue-fmu-");
            let lock = std::fs::File::open(e.path().join(".terraglue-lock"));
            named && e.path().is_dir() && lock.is_ok_and(|file| file.try_lock().is_ok())
        };
        let held = std::fs::read_dir(std::env::temp_dir()).into_iter().flatten().flatten().filter(left);
        let pages = std::fs::read_to_string("/proc/self/statm").unwrap_or_default();
        let pages: f64 = pages.split_whitespace().nth(1).and_then(|p| p.parse().ok()).unwrap_or(f64::NAN);
        Self {
            files: count("/proc/self/fd"),
            threads: count("/proc/self/task"),
            folders: held.count() as f64,
            memory: pages * 4096.0 / f64::from(1 << 20),
        }
    }
}
