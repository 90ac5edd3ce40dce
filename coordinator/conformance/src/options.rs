//! How the tests are run.

use super::scope::Level;
use std::path::PathBuf;

/// How the tests are run.
#[derive(Clone, Debug)]
pub struct Options {
    /// The program `terraglue`, which is started once per test.
    pub program: PathBuf,
    /// How much is tried.
    pub level: Level,
    /// Seed of everything random.
    pub seed: u64,
    /// Only these tests; empty: all of the level.
    pub only: Vec<String>,
    /// Parameters of the module, as `--set`.
    pub sets: Vec<(String, String)>,
    /// Processes at a time.
    pub jobs: usize,
    /// Time that a test may take, s.
    pub limit_s: f64,
    /// Variables of the environment of every test; `{test}` is replaced by its name.
    pub environment: Vec<(String, String)>,
}

impl Options {
    /// Everything once, seed 1, two processes at a time, 30 s for each test.
    pub fn new(program: PathBuf) -> Self {
        Self {
            program,
            level: Level::Standard,
            seed: 1,
            only: Vec::new(),
            sets: Vec::new(),
            jobs: std::thread::available_parallelism().map_or(2, usize::from),
            limit_s: 30.0,
            environment: Vec::new(),
        }
    }
}
