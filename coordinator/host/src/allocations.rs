//! Counts the allocations of one loaded library: its own references to `malloc` and relatives are redirected to
//! functions that count and pass on. Only for the process of a test.
#![allow(unsafe_code)] // Changes the table through which a library calls others.

use std::ffi::c_void;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use terraglue_fmi::elf::imported_slots;

static COUNT: AtomicUsize = AtomicUsize::new(0);
/// Addresses of `operator new` and `operator new[]`; 0: not seen.
static NEW: AtomicUsize = AtomicUsize::new(0);
static NEW_ARRAY: AtomicUsize = AtomicUsize::new(0);

fn note() {
    COUNT.fetch_add(1, Ordering::Relaxed);
}

unsafe extern "C" fn malloc(size: usize) -> *mut c_void {
    note();
    // SAFETY: passed on as it came.
    unsafe { libc::malloc(size) }
}

unsafe extern "C" fn calloc(count: usize, size: usize) -> *mut c_void {
    note();
    // SAFETY: passed on as it came.
    unsafe { libc::calloc(count, size) }
}

unsafe extern "C" fn realloc(old: *mut c_void, size: usize) -> *mut c_void {
    note();
    // SAFETY: passed on as it came.
    unsafe { libc::realloc(old, size) }
}

unsafe extern "C" fn posix_memalign(out: *mut *mut c_void, align: usize, size: usize) -> i32 {
    note();
    // SAFETY: passed on as it came.
    unsafe { libc::posix_memalign(out, align, size) }
}

unsafe extern "C" fn aligned_alloc(align: usize, size: usize) -> *mut c_void {
    note();
    // SAFETY: passed on as it came.
    unsafe { libc::aligned_alloc(align, size) }
}

/// To `operator new` of the process, so that its `operator delete` fits: a sanitizer brings its own of both. Where none can be
/// seen, to malloc: that is where the one of the system takes its memory from.
///
/// # Safety
/// `place` holds 0 or the address of a function of this signature.
unsafe fn passed_on(place: &AtomicUsize, size: usize) -> *mut c_void {
    note();
    match place.load(Ordering::Relaxed) {
        // SAFETY: passed on as it came.
        0 => unsafe { libc::malloc(size) },
        new => {
            // SAFETY: the address of a function of this signature, found by its name.
            let new: unsafe extern "C-unwind" fn(usize) -> *mut c_void = unsafe { std::mem::transmute(new) };
            // SAFETY: passed on as it came.
            unsafe { new(size) }
        }
    }
}

unsafe extern "C-unwind" fn operator_new(size: usize) -> *mut c_void {
    // SAFETY: the place of this function.
    unsafe { passed_on(&NEW, size) }
}

unsafe extern "C-unwind" fn operator_new_array(size: usize) -> *mut c_void {
    // SAFETY: the place of this function.
    unsafe { passed_on(&NEW_ARRAY, size) }
}

/// Functions that are counted.
const COUNTED: [(&str, *const c_void); 7] = [
    ("malloc", malloc as *const c_void),
    ("calloc", calloc as *const c_void),
    ("realloc", realloc as *const c_void),
    ("posix_memalign", posix_memalign as *const c_void),
    ("aligned_alloc", aligned_alloc as *const c_void),
    ("_Znwm", operator_new as *const c_void),
    ("_Znam", operator_new_array as *const c_void),
];

/// Counts the allocations of one library, for as long as the process lives.
pub struct AllocationCounter(());

impl AllocationCounter {
    /// Of a library that is loaded; None: it cannot be found in memory, or its format is another one.
    pub fn new(library: &Path) -> Option<Self> {
        let bytes = terraglue_subsystem::files::read(library).ok()?;
        for (place, name) in [(&NEW, c"_Znwm"), (&NEW_ARRAY, c"_Znam")] {
            // SAFETY: looks a name up among what the whole process sees.
            let found = unsafe { libc::dlsym(libc::RTLD_DEFAULT, name.as_ptr()) };
            place.store(found as usize, Ordering::Relaxed);
        }
        let base = base_address(&library.canonicalize().ok()?)?;
        for (name, offset) in imported_slots(&bytes)? {
            if let Some((_, function)) = COUNTED.iter().find(|(counted, _)| *counted == name) {
                // SAFETY: the slot of a function of this signature in the table of a loaded library.
                unsafe { redirect(base + offset, *function)? };
            }
        }
        Some(Self(()))
    }

    /// Allocations since the process began to count.
    pub fn count(&self) -> usize {
        COUNT.load(Ordering::Relaxed)
    }
}

/// Address of the first byte of a loaded file.
fn base_address(path: &Path) -> Option<usize> {
    let maps = std::fs::read_to_string("/proc/self/maps").ok()?;
    let wanted = path.to_string_lossy();
    let line = maps.lines().find(|l| l.ends_with(wanted.as_ref()))?;
    usize::from_str_radix(line.split('-').next()?, 16).ok()
}

/// Writes a pointer into a table that may be read-only.
///
/// # Safety
/// `slot` is the address of a function pointer of the same signature.
unsafe fn redirect(slot: usize, function: *const c_void) -> Option<()> {
    // SAFETY: asks for a constant of the system.
    let page = usize::try_from(unsafe { libc::sysconf(libc::_SC_PAGESIZE) }).ok()?;
    let start = slot / page * page;
    // SAFETY: the page holds the slot, so it is mapped; it stays readable.
    let done = unsafe { libc::mprotect(start as *mut c_void, page, libc::PROT_READ | libc::PROT_WRITE) };
    if done != 0 {
        return None;
    }
    // SAFETY: writable since the line before, aligned as tables are.
    unsafe { (slot as *mut *const c_void).write(function) };
    Some(())
}
