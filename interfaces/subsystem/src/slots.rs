//! States in numbered slots, as [`crate::Subsystem::save_state`] and [`crate::Subsystem::restore_state`] keep them.

use crate::error::{Error, Result};

/// Slots of an instance.
///
/// ```
/// use terraglue_subsystem::Slots;
/// let mut slots = Slots::new(2);
/// slots.save(1, "here")?;
/// assert_eq!(slots.saved(1)?, "here");
/// assert!(slots.saved(0).is_err() && slots.save(2, "there").is_err());
/// # Ok::<(), terraglue_subsystem::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Slots<T>(Vec<Option<T>>);

impl<T: Clone> Slots<T> {
    /// `count` empty slots: as many as [`crate::Host::slots`].
    pub fn new(count: u32) -> Self {
        Self(vec![None; count as usize])
    }

    /// Keeps a state.
    ///
    /// # Errors
    /// [`Error::Refused`]: there is no such slot.
    pub fn save(&mut self, slot: u32, state: T) -> Result {
        let none = || Error::Refused(format!("there is no slot {slot}"));
        *self.0.get_mut(slot as usize).ok_or_else(none)? = Some(state);
        Ok(())
    }

    /// The state that was kept last.
    ///
    /// # Errors
    /// [`Error::Refused`]: nothing was.
    pub fn saved(&self, slot: u32) -> Result<T> {
        let saved = self.0.get(slot as usize).cloned().flatten();
        saved.ok_or_else(|| Error::Refused(format!("nothing was saved in slot {slot}")))
    }
}
