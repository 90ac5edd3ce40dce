//! The threads of a run: modules make none of their own, they ask for `parallel_for`.
//!
//! A pool of our own, because the step loop must not allocate: queues of general pools take memory block by
//! block. A thread that wakes late delays nobody: the caller takes the pieces itself until none is left. Waking one
//! takes longer than many a loop, so threads look for the next loop for some microseconds before they sleep
//! ([`AdaptiveSpin`]); looking for ever would cost the more the busier the machine is.
#![allow(unsafe_code)] // The pieces of a loop borrow from the caller, who waits for all threads.

use super::adaptive_spin::AdaptiveSpin;
use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError, TryLockError};
use std::thread::JoinHandle;

/// A pool of a fixed number of threads; one thread means the caller's own.
pub struct Workers {
    shared: Arc<Shared>,
    threads: Vec<JoinHandle<()>>,
    /// Held during a loop: a loop inside a loop, or from another thread meanwhile, runs on its caller alone. How long the
    /// caller spins for the others to leave one.
    busy: Mutex<AdaptiveSpin>,
}

struct Shared {
    state: Mutex<State>,
    begun: Condvar,
    ended: Condvar,
    /// The next piece to take.
    next: AtomicUsize,
    /// `State::number`, `State::inside` and `State::stop`, to be looked at without the lock.
    announced: AtomicU64,
    inside: AtomicUsize,
    stopping: AtomicBool,
    /// Whether there is a processor for each thread: looking is in the way otherwise.
    roomy: bool,
}

/// Start of a list whose items go to one thread each.
struct Items<T>(*mut T);

// SAFETY: items that can be sent are handed to one thread each.
unsafe impl<T: Send> Sync for Items<T> {}

impl<T> Items<T> {
    /// Address of item k.
    ///
    /// # Safety
    /// The list has an item k.
    unsafe fn at(&self, k: usize) -> *mut T {
        // SAFETY: by the caller.
        unsafe { self.0.add(k) }
    }
}

#[derive(Default)]
struct State {
    /// The loop in flight.
    current: Option<Loop>,
    /// Grows with every loop, so that no thread enters one twice.
    number: u64,
    /// Threads inside the loop.
    inside: usize,
    /// Threads that sleep until the next one.
    asleep: usize,
    /// Whether the caller sleeps until they have left it.
    awaited: bool,
    stop: bool,
    panicked: Option<Box<dyn Any + Send>>,
}

#[derive(Clone, Copy)]
struct Loop {
    job: *const (dyn Fn(usize) + Sync),
    n: usize,
}

// SAFETY: the job is Sync; the pointer is used only while `parallel_for` waits.
unsafe impl Send for Loop {}

impl Workers {
    /// `threads` = 0 takes one per processor.
    pub fn new(threads: usize) -> Self {
        let processors = || std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
        let threads = if threads == 0 { processors() } else { threads };
        let shared = Arc::new(Shared {
            state: Mutex::default(),
            begun: Condvar::new(),
            ended: Condvar::new(),
            next: AtomicUsize::new(0),
            announced: AtomicU64::new(0),
            inside: AtomicUsize::new(0),
            stopping: AtomicBool::new(false),
            roomy: threads <= processors(),
        });
        let spawn = |k: usize| {
            let shared = shared.clone();
            std::thread::Builder::new().name(format!("terraglue {k}")).spawn(move || shared.work()).ok()
        };
        let threads = (1..threads).filter_map(spawn).collect();
        let spin = AdaptiveSpin::new(shared.roomy);
        Self { shared, threads, busy: Mutex::new(spin) }
    }

    /// Number of threads, the caller's included.
    pub fn threads(&self) -> usize {
        self.threads.len() + 1
    }

    /// Runs job(0) … job(n − 1) in any order; returns when all are done. A panic of a job goes on in the caller.
    pub fn parallel_for(&self, n: usize, job: &(dyn Fn(usize) + Sync)) {
        let alone = self.threads.is_empty() || n < 2;
        let Some(mut spin) = (!alone).then(|| self.enter()).flatten() else {
            return (0..n).for_each(job);
        };
        // SAFETY: only the lifetime is erased; `finish` does not return before every thread has left the loop.
        let job: &'static (dyn Fn(usize) + Sync) = unsafe { std::mem::transmute(job) };
        self.shared.next.store(0, Ordering::Relaxed);
        let this = Loop { job, n };
        let sleepers = {
            let mut state = self.shared.lock();
            state.current = Some(this);
            state.number += 1;
            self.shared.announced.store(state.number, Ordering::Release);
            state.asleep > 0
        };
        if sleepers {
            self.shared.begun.notify_all();
        }
        self.shared.take_pieces(this);
        self.shared.finish(&mut spin);
    }
}

impl Workers {
    /// Runs job(a, b) for each pair of items of two lists of one length, on any thread.
    pub fn for_each_pair<A: Send, B: Send>(
        &self,
        a: &mut [A],
        b: &mut [B],
        job: &(dyn Fn(&mut A, &mut B) + Sync),
    ) {
        let n = a.len().min(b.len());
        let (a, b) = (Items(a.as_mut_ptr()), Items(b.as_mut_ptr()));
        self.parallel_for(n, &|k| {
            // SAFETY: k is below both lengths, and `parallel_for` runs each k once, so no item is lent twice.
            let (a, b) = unsafe { (&mut *a.at(k), &mut *b.at(k)) };
            job(a, b);
        });
    }

    /// The right to run a loop on all threads; None: one is running.
    fn enter(&self) -> Option<MutexGuard<'_, AdaptiveSpin>> {
        match self.busy.try_lock() {
            Ok(guard) => Some(guard),
            // A job panicked; its loop was finished before the panic went on.
            Err(TryLockError::Poisoned(poisoned)) => Some(poisoned.into_inner()),
            Err(TryLockError::WouldBlock) => None,
        }
    }
}

impl Drop for Workers {
    fn drop(&mut self) {
        self.shared.lock().stop = true;
        self.shared.stopping.store(true, Ordering::Release);
        self.shared.begun.notify_all();
        for thread in self.threads.drain(..) {
            // A thread ends by `stop` alone; its jobs' panics were handed to their callers.
            let _ = thread.join();
        }
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Life of a thread.
    fn work(&self) {
        let (mut last, mut spin) = (0, AdaptiveSpin::new(self.roomy));
        let mut state = self.lock();
        while !state.stop {
            let fresh = state.number != last;
            last = state.number;
            if let Some(current) = state.current.filter(|_| fresh) {
                self.count(&mut state, 1);
                drop(state);
                self.take_pieces(current);
                state = self.lock();
                self.count(&mut state, -1);
                if state.inside == 0 && state.awaited {
                    self.ended.notify_one();
                }
            }
            if fresh {
                drop(state);
                let begun = || self.announced.load(Ordering::Acquire) != last;
                spin.wait(|| begun() || self.stopping.load(Ordering::Acquire));
                state = self.lock();
            } else {
                state.asleep += 1;
                state = self.begun.wait(state).unwrap_or_else(PoisonError::into_inner);
                state.asleep -= 1;
            }
        }
    }

    /// One thread more, or one less, is inside the loop.
    fn count(&self, state: &mut State, change: isize) {
        state.inside = state.inside.saturating_add_signed(change);
        self.inside.store(state.inside, Ordering::Release);
    }

    /// Takes pieces until none is left; after a panic of its own a thread takes no more.
    fn take_pieces(&self, current: Loop) {
        // SAFETY: the caller of `parallel_for` keeps the job alive until every thread has left the loop.
        let job = unsafe { &*current.job };
        let pieces = || {
            loop {
                let k = self.next.fetch_add(1, Ordering::Relaxed);
                if k >= current.n {
                    return;
                }
                job(k);
            }
        };
        if let Err(payload) = catch_unwind(AssertUnwindSafe(pieces)) {
            self.lock().panicked.get_or_insert(payload);
        }
    }

    /// Closes the loop to threads that wake late, waits for those inside, and passes a panic on.
    fn finish(&self, spin: &mut AdaptiveSpin) {
        let mut state = self.lock();
        state.current = None;
        if state.inside > 0 {
            drop(state);
            spin.wait(|| self.inside.load(Ordering::Acquire) == 0);
            state = self.lock();
        }
        state.awaited = true;
        while state.inside > 0 {
            state = self.ended.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        state.awaited = false;
        let panicked = state.panicked.take();
        drop(state);
        if let Some(payload) = panicked {
            resume_unwind(payload);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_index_runs_once_on_any_number_of_threads() {
        for threads in [1, 2, 3] {
            let workers = Workers::new(threads);
            assert_eq!(workers.threads(), threads);
            let runs: Vec<AtomicUsize> = (0..1000).map(|_| AtomicUsize::new(0)).collect();
            for round in 1..=50 {
                workers.parallel_for(runs.len(), &|k| {
                    runs[k].fetch_add(1, Ordering::Relaxed);
                });
                assert!(runs.iter().all(|r| r.load(Ordering::Relaxed) == round));
            }
        }
    }

    #[test]
    fn pairs_are_lent_to_one_thread_each() {
        let workers = Workers::new(3);
        let (mut a, mut b): (Vec<usize>, Vec<usize>) = ((0..500).collect(), vec![0; 500]);
        workers.for_each_pair(&mut a, &mut b, &|a, b| *b = std::mem::take(a) + 1);
        assert!(a.iter().all(|a| *a == 0) && b.iter().enumerate().all(|(k, b)| *b == k + 1));
    }

    #[test]
    fn pieces_run_beside_each_other() {
        let workers = Workers::new(2);
        let met = std::sync::Barrier::new(2);
        // Ends only if two threads are in the loop at once.
        workers.parallel_for(2, &|_| {
            met.wait();
        });
    }

    #[test]
    fn a_loop_inside_a_loop_runs_on_its_thread() {
        let workers = Workers::new(3);
        let sum = AtomicUsize::new(0);
        workers.parallel_for(10, &|a| {
            workers.parallel_for(10, &|b| {
                sum.fetch_add(10 * a + b, Ordering::Relaxed);
            });
        });
        assert_eq!(sum.into_inner(), (0..100).sum::<usize>());
    }

    #[test]
    fn a_panic_reaches_the_caller_and_the_pool_goes_on() {
        let workers = Workers::new(2);
        for bad in [0, 57, 99] {
            let caught = catch_unwind(AssertUnwindSafe(|| {
                workers.parallel_for(100, &|k| assert!(k != bad, "piece {k}"));
            }));
            let text = caught.expect_err("a panic").downcast_ref::<String>().cloned();
            assert_eq!(text, Some(format!("piece {bad}")));
        }
        let met = std::sync::Barrier::new(2);
        workers.parallel_for(2, &|_| {
            met.wait();
        });
    }
}
