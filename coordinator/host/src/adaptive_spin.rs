//! Time for which a thread spins before it sleeps.

use std::time::{Duration, Instant};

/// Cost of waking a sleeping thread on a virtual machine; waiting longer would cost more than it saves.
const LONGEST: Duration = Duration::from_micros(50);
/// Time that is always worth it: from one loop of a step to the next.
const SHORTEST: Duration = Duration::from_micros(3);
/// Looks between two readings of the clock.
const LOOKS: u32 = 16;

/// The time that a thread spins: as long as waking costs where that was worth it the last time, half as long after
/// every time that it was not, so a thread without work, or on a busy machine, soon waits no more.
#[derive(Debug)]
pub struct AdaptiveSpin {
    allowed: bool,
    now: Duration,
}

impl AdaptiveSpin {
    /// With `allowed` = false it never waits.
    pub fn new(allowed: bool) -> Self {
        Self { allowed, now: LONGEST }
    }

    /// Waits until `done`, or no longer than is worth it. Whether it came to that.
    pub fn wait(&mut self, done: impl Fn() -> bool) -> bool {
        if done() {
            return true;
        }
        if !self.allowed {
            return false;
        }
        let start = Instant::now();
        loop {
            for _ in 0..LOOKS {
                std::hint::spin_loop();
                if done() {
                    self.now = LONGEST;
                    return true;
                }
            }
            if start.elapsed() >= self.now {
                self.now = (self.now / 2).max(SHORTEST);
                return false;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    #[test]
    fn it_shrinks_with_every_wait_in_vain_and_recovers() {
        let mut spin = AdaptiveSpin::new(true);
        for _ in 0..40 {
            assert!(!spin.wait(|| false));
        }
        assert_eq!(spin.now, SHORTEST);
        let looks = Cell::new(0);
        assert!(spin.wait(|| looks.replace(looks.get() + 1) == 3));
        assert_eq!(spin.now, LONGEST);
    }

    #[test]
    fn where_it_is_not_allowed_it_looks_once() {
        let looks = Cell::new(0);
        assert!(!AdaptiveSpin::new(false).wait(|| looks.replace(looks.get() + 1) > 0));
        assert_eq!(looks.get(), 1);
    }
}
