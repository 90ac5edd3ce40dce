//! The log of an FMU: kept for errors, handed on with a limit, because some FMUs log without end.

use super::intermediate::Updates;
use std::collections::{BTreeMap, VecDeque};
use std::ffi::{c_char, c_int, c_void};
use std::fmt::Display;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use terraglue_subsystem::LogLevel;

/// A line of an FMU.
#[derive(Clone, Debug, PartialEq)]
pub struct LogLine {
    /// Severity by its status.
    pub level: LogLevel,
    /// Text with its category.
    pub text: String,
}

/// Takes the lines that are let through.
pub type Sink = Box<dyn Fn(&LogLine) + Send + Sync>;

/// Takes a line for each call.
pub type Trace = Arc<dyn Fn(&str) + Send + Sync>;

/// Lines of one call that are handed on.
const PER_CALL: u32 = 20;
/// Lines of one run that are handed on.
const PER_RUN: u64 = 1000;
/// Lines kept for an error.
const KEPT: usize = 5;
/// Characters of a line.
const LENGTH: usize = 1000;

/// The log of an instance; its address is the environment of the call-backs.
pub struct InstanceLog {
    sink: Sink,
    /// Takes a line for each call of the FMU, where they are traced.
    trace: Option<Trace>,
    lines: Mutex<LogState>,
    /// Whether anything was logged since the last call began; most calls log nothing and need no lock.
    said: AtomicBool,
    /// State of the intermediate updates, which come with the same environment.
    pub(super) updates: Updates,
}

#[derive(Default)]
struct LogState {
    kept: VecDeque<String>,
    this_call: u32,
    handed_on: u64,
    held_back: u64,
}

/// All logs of living instances by address, with the name of the instance. An FMU may hand anything to its logger, or
/// call it after its end; only an address listed here is taken for a log.
static LOGS: Mutex<BTreeMap<usize, (String, Weak<InstanceLog>)>> = Mutex::new(BTreeMap::new());

fn logs() -> MutexGuard<'static, BTreeMap<usize, (String, Weak<InstanceLog>)>> {
    LOGS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The log that a call of the logger means: that of the environment, or else of the instance's name, or the only one.
pub(super) fn meant(environment: usize, name: &str) -> Option<Arc<InstanceLog>> {
    let known = logs();
    let named = || {
        let mut found = known.values().filter(|(n, _)| n == name);
        found.next().filter(|_| found.next().is_none())
    };
    let only = || known.values().next().filter(|_| known.len() == 1);
    known.get(&environment).or_else(named).or_else(only)?.1.upgrade()
}

impl Drop for InstanceLog {
    fn drop(&mut self) {
        logs().remove(&(&raw const *self as usize));
    }
}

impl InstanceLog {
    /// A log of the instance `name`.
    pub fn new(sink: Sink, trace: Option<Trace>, name: &str) -> Arc<Self> {
        let instance_log = Arc::new(Self {
            sink,
            trace,
            lines: Mutex::default(),
            said: AtomicBool::new(false),
            updates: Updates::default(),
        });
        logs().insert(Arc::as_ptr(&instance_log) as usize, (name.to_owned(), Arc::downgrade(&instance_log)));
        instance_log
    }

    /// Whether calls are traced.
    #[inline]
    pub fn is_traced(&self) -> bool {
        self.trace.is_some()
    }

    /// Writes a call to the trace.
    #[cold]
    pub fn trace(&self, text: &dyn Display) {
        if let Some(trace) = &self.trace {
            trace(&text.to_string());
        }
    }

    /// A call begins: its lines count anew.
    #[inline]
    pub fn begin(&self) {
        if self.said.load(Ordering::Relaxed) {
            self.forget();
        }
    }

    #[cold]
    fn forget(&self) {
        self.said.store(false, Ordering::Relaxed);
        let mut lines = self.lines.lock().unwrap_or_else(PoisonError::into_inner);
        lines.this_call = 0;
        lines.kept.clear();
    }

    /// A warning of ours about the FMU.
    pub fn note(&self, text: &str) {
        (self.sink)(&LogLine { level: LogLevel::Warning, text: text.to_owned() });
    }

    /// Lines logged by the call that failed.
    pub fn last(&self) -> Vec<String> {
        let lines = self.lines.lock().unwrap_or_else(PoisonError::into_inner);
        lines.kept.iter().cloned().collect()
    }

    /// Lines that were not handed on.
    #[cfg(test)]
    pub fn held_back(&self) -> u64 {
        self.lines.lock().unwrap_or_else(PoisonError::into_inner).held_back
    }

    fn take(&self, status: c_int, category: &str, text: &str) {
        self.said.store(true, Ordering::Relaxed);
        let mut lines = self.lines.lock().unwrap_or_else(PoisonError::into_inner);
        let trimmed: String = text.trim().chars().take(LENGTH).collect();
        let text: String = trimmed.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
        let text = if category.is_empty() { text } else { format!("[{category}] {text}") };
        if lines.kept.len() == KEPT {
            lines.kept.pop_front();
        }
        lines.kept.push_back(text.clone());
        if lines.this_call >= PER_CALL || lines.handed_on >= PER_RUN {
            lines.held_back += 1;
            return;
        }
        lines.this_call += 1;
        lines.handed_on += 1;
        let last = lines.this_call == PER_CALL || lines.handed_on == PER_RUN;
        drop(lines);
        let level = match status {
            0 => LogLevel::Info,
            1 | 2 => LogLevel::Warning,
            _ => LogLevel::Error,
        };
        let note = if last { " (further lines are held back)" } else { "" };
        (self.sink)(&LogLine { level, text: format!("{text}{note}") });
    }
}

/// Text of an FMU, however broken; at most some thousand bytes are read.
///
/// # Safety
/// `text` is null or points at bytes up to a zero.
unsafe fn foreign(text: *const c_char) -> String {
    if text.is_null() {
        return String::new();
    }
    let mut bytes = Vec::new();
    for k in 0..4 * LENGTH {
        // SAFETY: no byte beyond the zero is read.
        let byte = unsafe { *text.add(k) } as u8;
        if byte == 0 {
            break;
        }
        bytes.push(byte);
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// The logger of FMI 3.0.
///
/// # Safety
/// Texts are null or end in a zero.
pub unsafe extern "C" fn log_3(
    environment: *mut c_void,
    status: c_int,
    category: *const c_char,
    text: *const c_char,
) {
    // SAFETY: by the caller.
    unsafe { terraglue_fmi_log(environment, std::ptr::null(), status, category, text) };
}

/// Called by the C part of the logger of FMI 2.0.
///
/// # Safety
/// Texts are null or end in a zero.
// SAFETY: a name of our own; logger.c calls it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn terraglue_fmi_log(
    environment: *mut c_void,
    instance: *const c_char,
    status: c_int,
    category: *const c_char,
    text: *const c_char,
) {
    // A panic must not cross; nothing here is left half done.
    let done = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
        // SAFETY: by the caller.
        let (instance, category, text) = unsafe { (foreign(instance), foreign(category), foreign(text)) };
        if let Some(instance_log) = meant(environment as usize, &instance) {
            instance_log.take(status, &category, &text);
        }
    }));
    drop(done);
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::ffi::CStr;
    use std::sync::atomic::AtomicU32;

    #[test]
    fn a_flood_is_held_back_and_the_end_is_kept() {
        let count = Arc::new(AtomicU32::new(0));
        let seen = count.clone();
        let sink = Box::new(move |_: &LogLine| {
            seen.fetch_add(1, Ordering::Relaxed);
        });
        let instance_log = InstanceLog::new(sink, None, "flood");
        for call in 0..100 {
            instance_log.begin();
            for k in 0..1000 {
                instance_log.take(3, "x", &format!("line {k} of {call}"));
            }
        }
        assert_eq!(u64::from(count.load(Ordering::Relaxed)), PER_RUN);
        assert_eq!(instance_log.last().last().map(String::as_str), Some("[x] line 999 of 99"));
        assert_eq!(instance_log.held_back(), 100_000 - PER_RUN);
    }

    #[test]
    fn what_is_no_book_is_found_by_name_or_not_at_all() {
        let instance_log = InstanceLog::new(Box::new(|_| {}), None, "an instance of this test");
        let log = |environment: usize, name: &CStr| {
            // SAFETY: texts with a zero.
            unsafe {
                terraglue_fmi_log(environment as *mut c_void, name.as_ptr(), 0, c"c".as_ptr(), c"t".as_ptr())
            };
            instance_log.last().len()
        };
        assert_eq!(log(1, c"an instance of this test"), 1);
        assert_eq!(log(Arc::as_ptr(&instance_log) as usize, c"another"), 2);
        let other = InstanceLog::new(Box::new(|_| {}), None, "another instance of this test");
        let gone = Arc::as_ptr(&other) as usize;
        drop(other);
        let third = InstanceLog::new(Box::new(|_| {}), None, "a third instance of this test");
        if Arc::as_ptr(&third) as usize != gone {
            assert_eq!(log(gone, c"nobody"), 2);
        }
    }
}
