//! Saved states of an instance, their bytes, and directional derivatives.

use super::FmuInstance;
use super::functions::{Api, StateHandle};
use crate::error::{Error, Result};

/// Largest state that is taken as bytes.
const LARGEST_STATE: usize = 4 << 30;

/// A saved state; belongs to the instance that made it and is given back to it.
#[derive(Debug)]
pub struct FmuState {
    handle: StateHandle,
    /// Schedule of the clocks whose intervals the FMU reports.
    schedule: Vec<f64>,
}

// SAFETY: a handle that only its instance looks into.
unsafe impl Send for FmuState {}

impl Default for FmuState {
    fn default() -> Self {
        Self { handle: std::ptr::null_mut(), schedule: Vec::new() }
    }
}

impl FmuState {
    /// Whether nothing was saved yet.
    pub fn is_empty(&self) -> bool {
        self.handle.is_null()
    }
}

/// Refuses a capability that the FMU does not offer.
fn offered(what: bool, name: &str) -> Result {
    if what { Ok(()) } else { Err(Error::Refused(format!("the FMU does not offer {name}"))) }
}

impl FmuInstance {
    /// Saves the state; the memory of an earlier one in `state` is used again.
    ///
    /// # Errors
    /// [`Error::Refused`] where the FMU cannot; it is unharmed then and goes on.
    pub fn save(&self, state: &mut FmuState) -> Result {
        offered(self.description.capabilities.state, "to save its state")?;
        let place = &raw mut state.handle;
        // SAFETY: `state` is null or a state of this instance, here and below.
        match self.foreign.api {
            Api::Two(two) => {
                self.foreign.call("fmi2GetFMUstate", two.get_state, |f, c| unsafe { f(c, place) })?
            }
            Api::Three(three) => {
                self.foreign.call("fmi3GetFMUState", three.get_state, |f, c| unsafe { f(c, place) })?;
            }
        }
        if state.handle.is_null() {
            return Err(Error::Refused(
                "getFMUState saved nothing (its state is NULL), although the description says that it can"
                    .into(),
            ));
        }
        self.clocks.told.schedule(&mut state.schedule);
        Ok(())
    }

    /// Back to a saved state.
    ///
    /// # Errors
    /// [`Error::Refused`]: nothing was saved. [`Error::Call`]: the FMU failed.
    pub fn restore(&self, state: &FmuState) -> Result {
        if state.is_empty() {
            return Err(Error::Refused("no state was saved".into()));
        }
        self.clocks.told.reschedule(&state.schedule);
        let state = state.handle;
        match self.foreign.api {
            Api::Two(two) => {
                self.foreign.call_after_error("fmi2SetFMUstate", two.set_state, |f, c| unsafe { f(c, state) })
            }
            Api::Three(three) => {
                self.foreign
                    .call_after_error("fmi3SetFMUState", three.set_state, |f, c| unsafe { f(c, state) })
            }
        }
    }

    /// Gives a saved state back.
    ///
    /// # Errors
    /// [`Error::Call`]: the FMU failed.
    pub fn release(&self, state: &mut FmuState) -> Result {
        if state.is_empty() || self.foreign.is_dead() {
            return Ok(());
        }
        let place = &raw mut state.handle;
        let done = match self.foreign.api {
            Api::Two(two) => {
                self.foreign
                    .call_after_error("fmi2FreeFMUstate", two.free_state, |f, c| unsafe { f(c, place) })
            }
            Api::Three(three) => {
                self.foreign
                    .call_after_error("fmi3FreeFMUState", three.free_state, |f, c| unsafe { f(c, place) })
            }
        };
        state.handle = std::ptr::null_mut();
        done
    }

    /// A saved state as bytes.
    ///
    /// # Errors
    /// [`Error::Refused`]: the FMU cannot. [`Error::Call`]: it failed.
    pub fn serialize(&self, state: &FmuState) -> Result<Vec<u8>> {
        offered(self.description.capabilities.serialize, "to serialise its state")?;
        let (state, schedule) = (state.handle, &state.schedule);
        let mut size = 0_usize;
        let place = &raw mut size;
        match self.foreign.api {
            Api::Two(two) => {
                self.foreign.call("fmi2SerializedFMUstateSize", two.state_size, |f, c| unsafe {
                    f(c, state, place)
                })?
            }
            Api::Three(three) => {
                self.foreign.call("fmi3SerializedFMUStateSize", three.state_size, |f, c| unsafe {
                    f(c, state, place)
                })?
            }
        }
        if size > LARGEST_STATE {
            let text = format!("says that its state has {size} bytes");
            return Err(self.foreign.lied("SerializedFMUStateSize", text));
        }
        let mut bytes = vec![0_u8; size];
        let out = bytes.as_mut_ptr();
        match self.foreign.api {
            Api::Two(two) => self.foreign.call("fmi2SerializeFMUstate", two.serialize, |f, c| unsafe {
                f(c, state, out.cast(), size)
            })?,
            Api::Three(three) => {
                self.foreign.call("fmi3SerializeFMUState", three.serialize, |f, c| unsafe {
                    f(c, state, out, size)
                })?
            }
        }
        // the part of the state that lies with the master goes behind it
        bytes.extend(schedule.iter().flat_map(|x| x.to_le_bytes()));
        Ok(bytes)
    }

    /// A state from bytes.
    ///
    /// # Errors
    /// [`Error::Refused`]: the FMU cannot, or the bytes are too few. [`Error::Call`]: it failed.
    pub fn deserialize(&self, bytes: &[u8], state: &mut FmuState) -> Result {
        offered(self.description.capabilities.serialize, "to serialise its state")?;
        let schedule = 8 * self.clocks.told.schedule_len();
        let Some((bytes, schedule)) = bytes.len().checked_sub(schedule).map(|n| bytes.split_at(n)) else {
            return Err(Error::Refused("the bytes of a state are too few for the clocks of the FMU".into()));
        };
        let number = |b: &[u8]| b.try_into().map_or(f64::INFINITY, f64::from_le_bytes);
        state.schedule = schedule.chunks_exact(8).map(number).collect();
        let (place, data, n) = (&raw mut state.handle, bytes.as_ptr(), bytes.len());
        match self.foreign.api {
            Api::Two(two) => self.foreign.call("fmi2DeSerializeFMUstate", two.deserialize, |f, c| unsafe {
                f(c, data.cast(), n, place)
            }),
            Api::Three(three) => {
                self.foreign.call("fmi3DeserializeFMUState", three.deserialize, |f, c| unsafe {
                    f(c, data, n, place)
                })
            }
        }
    }

    /// d(unknowns)/d(knowns)·seed, all of type f64 and no arrays; from adjoint derivatives row by row where the FMU
    /// offers no directional ones.
    ///
    /// # Errors
    /// [`Error::Refused`]: the FMU does not offer them. [`Error::Call`]: it failed.
    pub fn directional_derivative(
        &self,
        unknowns: &[u32],
        knowns: &[u32],
        seed: &[f64],
        out: &mut [f64],
    ) -> Result {
        let c = self.description.capabilities;
        if c.adjoint_derivatives && !c.directional_derivatives {
            let mut row = vec![f64::NAN; knowns.len()];
            for (unknown, out) in unknowns.iter().zip(out) {
                self.adjoint_derivative(&[*unknown], knowns, &[1.0], &mut row)?;
                *out = row.iter().zip(seed).map(|(a, b)| a * b).sum();
            }
            return Ok(());
        }
        offered(c.directional_derivatives, "directional derivatives")?;
        let (z, n_z, v, n_v) = (unknowns.as_ptr(), unknowns.len(), knowns.as_ptr(), knowns.len());
        let (s, n_s, o, n_o) = (seed.as_ptr(), seed.len(), out.as_mut_ptr(), out.len());
        match self.foreign.api {
            Api::Two(two) => {
                self.foreign.call("fmi2GetDirectionalDerivative", two.directional, |f, c| unsafe {
                    f(c, z, n_z, v, n_v, s, o)
                })
            }
            Api::Three(three) => {
                self.foreign.call("fmi3GetDirectionalDerivative", three.directional, |f, c| unsafe {
                    f(c, z, n_z, v, n_v, s, n_s, o, n_o)
                })
            }
        }
    }

    /// First derivatives of outputs by time, per second; of f64 that are no arrays.
    ///
    /// # Errors
    /// [`Error::Refused`]: the FMU does not offer them, or there are not as many places as references. [`Error::Call`]: it failed.
    pub fn output_derivatives(&self, references: &[u32], out: &mut [f64]) -> Result {
        offered(self.description.capabilities.output_derivatives, "derivatives of outputs")?;
        if references.len() != out.len() {
            let (n, m) = (references.len(), out.len());
            return Err(Error::Refused(format!("{n} references but {m} derivatives")));
        }
        let orders = vec![1; references.len()];
        let (r, n, o, x) = (references.as_ptr(), references.len(), orders.as_ptr(), out.as_mut_ptr());
        match self.foreign.api {
            Api::Two(two) => {
                // SAFETY: as many orders and values as references.
                self.foreign
                    .call("fmi2GetRealOutputDerivatives", two.get_slopes, |f, c| unsafe { f(c, r, n, o, x) })
            }
            Api::Three(three) => {
                // SAFETY: as above.
                self.foreign
                    .call("fmi3GetOutputDerivatives", three.get_slopes, |f, c| unsafe { f(c, r, n, o, x, n) })
            }
        }
    }

    /// seedᵀ·d(unknowns)/d(knowns): a number for each known (FMI 3.0, 2.2.11).
    ///
    /// # Errors
    /// [`Error::Refused`]: the FMU does not offer them. [`Error::Call`]: it failed.
    pub fn adjoint_derivative(
        &self,
        unknowns: &[u32],
        knowns: &[u32],
        seed: &[f64],
        out: &mut [f64],
    ) -> Result {
        offered(self.description.capabilities.adjoint_derivatives, "adjoint derivatives")?;
        let Api::Three(three) = self.foreign.api else {
            return Err(Error::Refused("FMI 2.0 has no adjoint derivatives".into()));
        };
        let (z, n_z, v, n_v) = (unknowns.as_ptr(), unknowns.len(), knowns.as_ptr(), knowns.len());
        let (s, n_s, o, n_o) = (seed.as_ptr(), seed.len(), out.as_mut_ptr(), out.len());
        // SAFETY: so many references and values.
        self.foreign.call("fmi3GetAdjointDerivative", three.adjoint, |f, c| unsafe {
            f(c, z, n_z, v, n_v, s, n_s, o, n_o)
        })
    }
}
