//! Limits of an instance that lives in a process of its own.

/// How an instance is kept apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IsolationSpec {
    /// Longest time to load and make it, s.
    pub load_timeout_s: f64,
    /// Longest time for any other call, s.
    pub step_timeout_s: f64,
    /// Most memory, bytes.
    pub memory_bytes: u64,
}

impl Default for IsolationSpec {
    fn default() -> Self {
        Self { load_timeout_s: 60.0, step_timeout_s: 30.0, memory_bytes: 8 << 30 }
    }
}
