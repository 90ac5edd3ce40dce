//! A host with a terrain and a number of threads.

use terraglue::host::Workers;
use terraglue_subsystem::{Host, LogLevel, Terrain};

/// Earth, a terrain, threads as in a run.
pub struct Machine {
    terrain: Box<dyn Terrain>,
    workers: Workers,
}

impl Machine {
    /// `threads` threads, the caller's included.
    pub fn new(terrain: Box<dyn Terrain>, threads: usize) -> Self {
        Self { terrain, workers: Workers::new(threads) }
    }
}

impl Host for Machine {
    fn name(&self) -> &str {
        "soil"
    }
    fn log(&self, _: LogLevel, _: &str) {}
    fn parallel_for(&self, n: usize, job: &(dyn Fn(usize) + Sync)) {
        self.workers.parallel_for(n, job);
    }
    fn seed(&self) -> u64 {
        1
    }
    fn folder(&self) -> &str {
        ""
    }
    fn slots(&self) -> u32 {
        2
    }
    fn max_nodes(&self) -> u32 {
        4096
    }
    fn gravity(&self) -> [f64; 3] {
        [0.0, 0.0, -9.81]
    }
    fn terrain(&self) -> Option<&dyn Terrain> {
        Some(&*self.terrain)
    }
}
