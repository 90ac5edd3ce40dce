//! One number of an FMU: a variable, or an element of an array.

use super::Fail;
use terraglue_fmi::FmuInstance;
use terraglue_subsystem::Result;

/// Where a component lies in the FMU.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    /// Number in calls.
    pub reference: u32,
    /// Element, row by row.
    pub element: usize,
    /// Elements of the whole variable.
    pub count: usize,
}

/// Elements of an array that fit without asking for memory.
const SMALL: usize = 48;

impl Axis {
    /// Runs `look` on all elements, as they are now.
    fn whole<R>(self, instance: &FmuInstance, fail: Fail, look: impl FnOnce(&mut [f64]) -> R) -> Result<R> {
        let (mut few, mut many) = ([f64::NAN; SMALL], Vec::new());
        let all = match few.get_mut(..self.count) {
            Some(few) => few,
            None => {
                many.resize(self.count, f64::NAN);
                &mut many[..]
            }
        };
        instance.get_f64(&[self.reference], all).map_err(fail)?;
        Ok(look(all))
    }

    /// Its value.
    pub fn get(self, instance: &FmuInstance, fail: Fail) -> Result<f64> {
        self.whole(instance, fail, |all| all[self.element])
    }

    /// A new value.
    pub fn set(self, instance: &FmuInstance, value: f64, fail: Fail) -> Result {
        if self.count == 1 {
            return instance.set_f64(&[self.reference], &[value]).map_err(fail);
        }
        self.whole(instance, fail, |all| {
            all[self.element] = value;
            instance.set_f64(&[self.reference], all).map_err(fail)
        })?
    }
}
