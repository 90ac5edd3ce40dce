//! Rounding mode and subnormal numbers of this thread: foreign code may change it – libraries that are linked with fast
//! mathematics do as soon as they are loaded – and everything that is computed after it would differ.
#![allow(unsafe_code)] // Reads and writes the control register of the processor.

/// The control bits of the floating-point unit, without flags of past exceptions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mode(u64);

impl Mode {
    /// That of this thread.
    #[inline(always)]
    #[must_use]
    pub fn now() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            const FLAGS: u64 = 0x3f;
            let mut control = 0_u32;
            // SAFETY: stores the register at the given place and changes nothing else.
            unsafe { std::arch::asm!("stmxcsr [{}]", in(reg) &raw mut control, options(nostack)) };
            Self(u64::from(control) & !FLAGS)
        }
        #[cfg(target_arch = "aarch64")]
        {
            let control: u64;
            // SAFETY: reads the register.
            unsafe { std::arch::asm!("mrs {}, fpcr", out(reg) control, options(nomem, nostack)) };
            Self(control)
        }
        #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
        Self(0)
    }

    /// Sets this thread back to it; whether that was needed.
    #[inline(always)]
    pub fn restore(self) -> bool {
        let changed = Self::now() != self;
        if changed {
            self.set();
        }
        changed
    }

    #[cold]
    fn set(self) {
        #[cfg(target_arch = "x86_64")]
        {
            let control = self.0 as u32;
            // SAFETY: the value was read from the register before.
            unsafe { std::arch::asm!("ldmxcsr [{}]", in(reg) &raw const control, options(nostack)) };
        }
        #[cfg(target_arch = "aarch64")]
        // SAFETY: the value was read from the register before.
        unsafe {
            std::arch::asm!("msr fpcr, {}", in(reg) self.0, options(nomem, nostack));
        }
    }
}

/// Sets this thread back to its mode when it goes.
#[derive(Debug)]
pub struct Keep(Mode);

impl Keep {
    /// From here on.
    #[must_use]
    pub fn new() -> Self {
        Self(Mode::now())
    }
}

impl Default for Keep {
    fn default() -> Self {
        Self::new()
    }
}

impl Drop for Keep {
    fn drop(&mut self) {
        self.0.restore();
    }
}

#[cfg(all(test, target_arch = "x86_64"))]
mod tests {
    use super::*;
    use std::hint::black_box;

    #[test]
    fn tiny_numbers_are_numbers_again() {
        let (keep, half) = (Keep::new(), || black_box(1e-310) * black_box(0.5));
        Mode(Mode::now().0 | 0x8040).set();
        assert_eq!(half(), 0.0);
        drop(keep);
        assert_eq!(half(), 5e-311);
        assert!(!Mode::now().restore());
    }
}
