//! A shared segment with room for one call and one answer, and two counters that either side sleeps on.
#![allow(unsafe_code)] // Memory that two processes map.

use std::cell::Cell;
use std::fs::File;
use std::io;
use std::os::fd::{AsRawFd, FromRawFd};
use std::path::Path;
use std::ptr::NonNull;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, Instant};

/// Room for a call, and the same for an answer, bytes. Pages that are never touched cost nothing.
pub const AREA: usize = 64 << 20;
const HEAD: usize = 4096;
const LENGTH: usize = HEAD + 2 * AREA;

/// Header of a segment.
#[repr(C)]
struct Head {
    call: AtomicU32,
    answer: AtomicU32,
    call_length: AtomicU32,
    answer_length: AtomicU32,
    cancel: AtomicU32,
}

/// A mapped segment.
pub struct Segment {
    memory: NonNull<u8>,
    file: File,
    luck: Cell<i32>,
}

/// Time for which either side looks for the other before it sleeps. Longer than it takes to wake the other, so that two
/// sides that both sleep come to look at each other again.
const LOOK: Duration = Duration::from_micros(150);
/// Number of waits without a look after looks in vain: a slow worker or a busy machine is not worth them.
const PAUSE: i32 = 256;

// SAFETY: the memory is reached through `&self` by atomics only, and else through `&mut self`.
unsafe impl Send for Segment {}

impl Segment {
    /// A new one, without a name.
    pub fn new() -> io::Result<Self> {
        // SAFETY: the name ends in a zero; the descriptor is new and ours.
        let file = unsafe {
            let descriptor = libc::memfd_create(c"terraglue".as_ptr(), libc::MFD_CLOEXEC);
            if descriptor < 0 {
                return Err(io::Error::last_os_error());
            }
            File::from_raw_fd(descriptor)
        };
        file.set_len(LENGTH as u64)?;
        Self::map(file)
    }

    /// The one that the host made.
    pub fn open(path: &Path) -> io::Result<Self> {
        let file = File::options().read(true).write(true).open(path)?;
        if file.metadata()?.len() != LENGTH as u64 {
            return Err(io::Error::other("this is no segment of a host"));
        }
        Self::map(file)
    }

    fn map(file: File) -> io::Result<Self> {
        let protection = libc::PROT_READ | libc::PROT_WRITE;
        // SAFETY: a fresh mapping of a file of that length.
        let memory = unsafe {
            libc::mmap(std::ptr::null_mut(), LENGTH, protection, libc::MAP_SHARED, file.as_raw_fd(), 0)
        };
        match NonNull::new(memory.cast()) {
            Some(found) if memory != libc::MAP_FAILED => {
                let several = std::thread::available_parallelism().is_ok_and(|n| n.get() > 1);
                Ok(Self { memory: found, file, luck: Cell::new(if several { 1 } else { i32::MIN }) })
            }
            _ => Err(io::Error::last_os_error()),
        }
    }

    /// Path under which a child of this process opens it.
    pub fn path(&self) -> String {
        format!("/proc/{}/fd/{}", std::process::id(), self.file.as_raw_fd())
    }

    fn head(&self) -> &Head {
        // SAFETY: the head lies at the start of the mapping, which is aligned to a page; it is made of atomics.
        unsafe { self.memory.cast().as_ref() }
    }

    /// Room for a call (0) or an answer (1).
    pub fn area(&mut self, which: usize) -> &mut [u8] {
        // SAFETY: inside the mapping; the other process leaves this area alone until it is notified.
        unsafe { std::slice::from_raw_parts_mut(self.memory.as_ptr().add(HEAD + which * AREA), AREA) }
    }

    /// Notifies the worker of a call of that length.
    pub fn post_call(&self, length: usize) {
        self.head().call_length.store(length as u32, Ordering::Relaxed);
        self.head().call.fetch_add(1, Ordering::Release);
        wake(&self.head().call);
    }

    /// Notifies the host of the answer.
    pub fn post_answer(&self, length: usize) {
        self.head().answer_length.store(length as u32, Ordering::Relaxed);
        self.head().answer.store(self.head().call.load(Ordering::Relaxed), Ordering::Release);
        wake(&self.head().answer);
    }

    /// Sleeps at every wait: where more processes want to run than there are processors, looking takes the place of
    /// the one that is waited for.
    pub fn never_look(&self) {
        self.luck.set(i32::MIN);
    }

    /// Waits for the answer to the last call; its length, or nothing when that took longer than `timeout`.
    pub fn answer(&self, timeout: Duration) -> Option<usize> {
        let wanted = self.head().call.load(Ordering::Relaxed);
        self.look_for(wanted);
        let found = self.head().answer.load(Ordering::Acquire);
        if found != wanted {
            wait(&self.head().answer, found, Some(timeout));
        }
        let done = self.head().answer.load(Ordering::Acquire) == wanted;
        done.then(|| (self.head().answer_length.load(Ordering::Relaxed) as usize).min(AREA))
    }

    /// Looks for an answer for a moment, unless that was in vain lately.
    fn look_for(&self, wanted: u32) {
        let luck = self.luck.get();
        if luck <= 0 {
            return self.luck.set(luck.saturating_add(i32::from(luck != i32::MIN)));
        }
        let start = Instant::now();
        while start.elapsed() < LOOK {
            for _ in 0..50 {
                if self.head().answer.load(Ordering::Acquire) == wanted {
                    return self.luck.set((luck + 1).min(8));
                }
                std::hint::spin_loop();
            }
        }
        self.luck.set(if luck > 4 { luck - 4 } else { -PAUSE });
    }

    /// Waits for the next call after number `last`; its number and length.
    pub fn call_after(&self, last: u32) -> (u32, usize) {
        loop {
            let found = self.head().call.load(Ordering::Acquire);
            if found != last {
                return (found, (self.head().call_length.load(Ordering::Relaxed) as usize).min(AREA));
            }
            wait(&self.head().call, last, None);
        }
    }

    /// Asks the worker to stop early, or asks whether that was asked.
    pub fn cancel_flag(&self) -> &AtomicU32 {
        &self.head().cancel
    }
}

impl Drop for Segment {
    fn drop(&mut self) {
        // SAFETY: the mapping is ours and nothing borrows from it any more.
        unsafe { libc::munmap(self.memory.as_ptr().cast(), LENGTH) };
    }
}

/// Sleeps while `word` is `value`, at most for `timeout`; may wake early.
fn wait(word: &AtomicU32, value: u32, timeout: Option<Duration>) {
    let time = timeout.map(|p| libc::timespec {
        tv_sec: p.as_secs() as libc::time_t,
        tv_nsec: libc::c_long::from(p.subsec_nanos() as i32),
    });
    let time = time.as_ref().map_or(std::ptr::null(), std::ptr::from_ref);
    // SAFETY: the word lives in mapped memory; the time lives as long as the call.
    unsafe { libc::syscall(libc::SYS_futex, word.as_ptr(), libc::FUTEX_WAIT, value, time) };
}

fn wake(word: &AtomicU32) {
    // SAFETY: the word lives in mapped memory.
    unsafe { libc::syscall(libc::SYS_futex, word.as_ptr(), libc::FUTEX_WAKE, 1) };
}

/// Makes this process small and short-lived: limits its memory, leaves no core file, ends with its parent.
pub fn confine(memory_bytes: u64) {
    let limit = |bytes: u64| libc::rlimit { rlim_cur: bytes, rlim_max: bytes };
    // SAFETY: plain system calls on our own process.
    unsafe {
        libc::setrlimit(libc::RLIMIT_CORE, &limit(0));
        let all = memory_bytes.saturating_add(LENGTH as u64);
        libc::setrlimit(libc::RLIMIT_AS, &limit(all));
    }
}

/// Number of the process that started this one.
pub fn parent() -> i32 {
    // SAFETY: a plain system call.
    unsafe { libc::getppid() }
}

/// Asks a worker in Python to write down where its main thread stands, which makes the calls: a signal to the whole process
/// may reach another one.
pub fn ask(worker: u32) {
    if worker > 1 {
        // SAFETY: a plain system call; the process is a child that was not waited for yet. Its main thread has its number.
        unsafe { libc::syscall(libc::SYS_tgkill, worker, worker, libc::SIGUSR1) };
    }
}

/// Ends a whole group of processes at once.
pub fn end_group(leader: u32) {
    if leader > 1 {
        // SAFETY: a plain system call; the group is the one that we made for a worker.
        unsafe { libc::kill(-(leader as i32), libc::SIGKILL) };
    }
}
