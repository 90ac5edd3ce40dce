//! State that a library can change in the process that loads it: floating-point mode, signals, locale, folder,
//! environment, threads, files, memory.
#![allow(unsafe_code)] // The registers of the processor and the C library are asked.

use std::fs;

/// The state of this process and, for the floating-point mode, of the calling thread.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Process {
    /// Rounding, flush-to-zero and trap bits of the floating-point unit.
    pub floating_point: String,
    /// Caught and ignored signals, as bit sets.
    pub signals: String,
    /// Names of all locale categories.
    pub locale: String,
    /// Working directory.
    pub directory: String,
    /// Environment variables and the mask for new files.
    pub environment: String,
    /// Names of the threads.
    pub threads: String,
    /// Targets of the open file descriptors.
    pub files: String,
}

impl Process {
    /// As it is now.
    pub fn now() -> Self {
        let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
        let line = |key: &str| status.lines().find(|l| l.starts_with(key)).unwrap_or_default().to_owned();
        let mut variables: Vec<String> = std::env::vars_os()
            .map(|(k, v)| format!("{}={}", k.to_string_lossy(), v.to_string_lossy()))
            .collect();
        variables.sort();
        Self {
            floating_point: floating_point_mode(),
            signals: format!("{}, {}", line("SigIgn:"), line("SigCgt:")),
            locale: locale(),
            directory: std::env::current_dir().map(|d| d.display().to_string()).unwrap_or_default(),
            environment: format!("{}, {}", line("Umask:"), variables.join(" ")),
            threads: entries("/proc/self/task", |p| {
                fs::read_to_string(p.join("comm")).ok().map(|n| n.trim().into())
            }),
            files: entries("/proc/self/fd", |p| fs::read_link(p).ok().map(|t| t.display().to_string())),
        }
    }
}

/// Descriptions of the entries of a folder, sorted; the folder itself, open for reading, is left out.
fn entries(folder: &str, say: impl Fn(&std::path::Path) -> Option<String>) -> String {
    let all = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut told: Vec<String> =
        all.filter_map(|e| say(&e.path())).filter(|t| !t.starts_with("/proc/")).collect();
    told.sort();
    format!("{} ({})", told.len(), told.join(", "))
}

/// Control bits of the vector unit: flags of past exceptions are left out.
fn floating_point_mode() -> String {
    #[cfg(target_arch = "x86_64")]
    {
        let (mut vector, mut x87) = (0u32, 0u16);
        // SAFETY: both store a control register to the given place and change nothing else.
        unsafe {
            std::arch::asm!("stmxcsr [{}]", in(reg) &raw mut vector, options(nostack));
            std::arch::asm!("fnstcw [{}]", in(reg) &raw mut x87, options(nostack));
        }
        let flags = [(1 << 15, "flush-to-zero"), (1 << 6, "denormals-are-zero")];
        let set: Vec<&str> =
            flags.iter().filter(|(bit, _)| vector & bit != 0).map(|(_, name)| *name).collect();
        let rounding = (vector >> 13) & 3;
        let traps = !(vector >> 7) & 0x3f;
        format!("[{}] rounding {rounding} traps {traps:#x} x87 {x87:#x}", set.join(", "))
    }
    #[cfg(target_arch = "aarch64")]
    {
        let control: u64;
        // SAFETY: reads a control register.
        unsafe { std::arch::asm!("mrs {}, fpcr", out(reg) control, options(nomem, nostack)) };
        format!("fpcr {control:#x}")
    }
    #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
    String::new()
}

fn locale() -> String {
    // SAFETY: a null second argument only asks; the text is copied at once.
    let text = unsafe {
        let text = libc::setlocale(libc::LC_ALL, std::ptr::null());
        if text.is_null() {
            return String::new();
        }
        std::ffi::CStr::from_ptr(text)
    };
    text.to_string_lossy().into_owned()
}

/// Bytes of the heap that are in use, by the C library's own count; None where it does not count.
pub fn heap_in_use() -> Option<usize> {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        // SAFETY: only reads counters.
        let info = unsafe { libc::mallinfo2() };
        Some(info.uordblks + info.hblkhd)
    }
    #[cfg(not(all(target_os = "linux", target_env = "gnu")))]
    None
}

/// Takes the locale of the environment, as programs in C do; a program in Rust does not by itself.
pub fn adopt_locale() {
    // SAFETY: both texts are constant; called before any thread of ours reads the locale.
    unsafe { libc::setlocale(libc::LC_ALL, c"".as_ptr()) };
}

/// Whether a locale is installed.
pub fn has_locale(name: &str) -> bool {
    let Ok(name) = std::ffi::CString::new(name) else { return false };
    // SAFETY: a name that ends with zero; the new locale is freed at once.
    unsafe {
        let made = libc::newlocale(libc::LC_ALL_MASK, name.as_ptr(), std::ptr::null_mut());
        let found = !made.is_null();
        if found {
            libc::freelocale(made);
        }
        found
    }
}
