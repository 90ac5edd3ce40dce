//! Services for an instance: log, threads, cancel flag, seed, folder, gravity, terrain.

use super::{Isolation, Workers};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use terraglue_subsystem::bytes::{hash, hash_from};
use terraglue_subsystem::{Host, LogLevel, Terrain};

/// Takes the log lines of instances: name of the instance, severity, text.
pub type LogSink = Arc<dyn Fn(&str, LogLevel, &str) + Send + Sync>;

/// Errors of instances at their end, when nobody waits for an answer any more.
#[derive(Clone, Debug, Default)]
pub struct TeardownErrors(Arc<Mutex<Vec<String>>>);

impl TeardownErrors {
    /// Remembers one.
    pub fn put(&self, text: String) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(text);
    }

    /// Takes all of them.
    pub fn take(&self) -> Vec<String> {
        std::mem::take(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

/// Services shared by all instances of a testbed; cloned for each.
#[derive(Clone)]
pub struct HostServices {
    /// `world.seed`.
    pub world_seed: u64,
    /// Folder of the scenario.
    pub folder: PathBuf,
    /// Gravity in the world, m/s².
    pub gravity: [f64; 3],
    /// Ground at the start.
    pub terrain: Option<Arc<dyn Terrain>>,
    /// Threads of the run.
    pub workers: Arc<Workers>,
    /// Set by the user's interrupt.
    pub cancel: Arc<AtomicBool>,
    /// Destination of log lines; None: the crate `log` with target `terraglue::module`.
    pub log: Option<LogSink>,
    /// Errors of instances at their end, after the last step.
    pub teardown_errors: TeardownErrors,
    /// Numbered states that `save_state` must keep.
    pub slots: u32,
    /// Largest number of ground nodes that a step may show; a hint.
    pub max_nodes: u32,
    /// Limits of a process that an instance needs beside it: of its law in Python.
    pub isolation: Isolation,
}

impl HostServices {
    /// Services without gravity and terrain, on the caller's thread.
    pub fn new(world_seed: u64, folder: &Path) -> Self {
        Self {
            world_seed,
            folder: folder.to_path_buf(),
            gravity: [0.0; 3],
            terrain: None,
            workers: Arc::new(Workers::new(1)),
            cancel: Arc::new(AtomicBool::new(false)),
            log: None,
            teardown_errors: TeardownErrors::default(),
            slots: 8,
            max_nodes: 1 << 14,
            isolation: Isolation::default(),
        }
    }

    /// The services as an instance of this name sees them.
    pub fn for_instance(&self, name: &str) -> Arc<dyn Host> {
        Arc::new(InstanceHost {
            name: name.to_owned(),
            seed: instance_seed(self.world_seed, name),
            folder: self.folder.to_string_lossy().into_owned(),
            services: self.clone(),
        })
    }
}

/// Seed of an instance: FNV-1a (64 bit) over the eight bytes of the world's seed, least significant first, and
/// the UTF-8 of the name, finished by the mix of SplitMix64 (Steele, Lea and Flood 2014). Part of the promise
/// that a scenario gives the same bytes everywhere: it never changes.
pub fn instance_seed(world_seed: u64, name: &str) -> u64 {
    let mut hash = hash_from(hash(&world_seed.to_le_bytes()), name.as_bytes());
    hash = (hash ^ (hash >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    hash = (hash ^ (hash >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    hash ^ (hash >> 31)
}

struct InstanceHost {
    name: String,
    seed: u64,
    folder: String,
    services: HostServices,
}

impl Host for InstanceHost {
    fn name(&self) -> &str {
        &self.name
    }

    fn log(&self, level: LogLevel, text: &str) {
        if let Some(sink) = &self.services.log {
            return sink(&self.name, level, text);
        }
        let level = match level {
            LogLevel::Error => log::Level::Error,
            LogLevel::Warning => log::Level::Warn,
            LogLevel::Info => log::Level::Info,
            LogLevel::Debug => log::Level::Debug,
        };
        log::log!(target: "terraglue::module", level, "{}: {text}", self.name);
    }

    fn parallel_for(&self, n: usize, job: &(dyn Fn(usize) + Sync)) {
        self.services.workers.parallel_for(n, job);
    }

    fn cancelled(&self) -> bool {
        self.services.cancel.load(Ordering::Relaxed)
    }

    fn seed(&self) -> u64 {
        self.seed
    }

    fn folder(&self) -> &str {
        &self.folder
    }

    fn slots(&self) -> u32 {
        self.services.slots
    }

    fn max_nodes(&self) -> u32 {
        self.services.max_nodes
    }

    fn gravity(&self) -> [f64; 3] {
        self.services.gravity
    }

    fn terrain(&self) -> Option<&dyn Terrain> {
        self.services.terrain.as_deref()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seeds_differ_by_world_and_name_and_never_change() {
        assert_ne!(instance_seed(1, "soil"), instance_seed(2, "soil"));
        assert_ne!(instance_seed(1, "soil"), instance_seed(1, "soil2"));
        assert_eq!(instance_seed(1, "soil"), PROMISED);
    }

    /// Computed once by an independent implementation of the documented hash.
    const PROMISED: u64 = 0x84b2_d7ea_ddee_1dd2;

    #[test]
    fn an_instance_sees_its_own_name_and_the_shared_flag() {
        let services = HostServices::new(7, Path::new("scenarios"));
        let host = services.for_instance("robot");
        assert_eq!((host.name(), host.folder(), host.cancelled()), ("robot", "scenarios", false));
        services.cancel.store(true, Ordering::Relaxed);
        assert!(host.cancelled() && host.terrain().is_none());
    }
}
