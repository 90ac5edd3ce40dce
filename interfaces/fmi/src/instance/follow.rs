//! Inputs that an FMU follows within its steps: FMI 2.0 by their slopes (`fmi2SetRealInputDerivatives`, 4.2.1), FMI 3.0 by
//! the values that it asks for in its intermediate update (4.2.2).

use super::FmuInstance;
use super::call::CallStatus;
use super::functions::{Api, Vr};
use super::goes_on;
use super::step_fault::StepFault;
use crate::description::{ModelDescription, Variable};
use crate::error::{Error, Result};
use std::ffi::{c_int, c_void};
use terraglue_subsystem::{ValueType, Values};

type Set<T> = unsafe extern "C" fn(*mut c_void, *const Vr, usize, *const T, usize) -> c_int;

/// Writes an input's elements at a time, s; NaN where there is no number.
type At = Box<dyn Fn(f64, &mut [f64]) + Send>;

/// How an input is set.
enum Setter {
    Wide(Set<f64>),
    Narrow(Set<f32>, Vec<f32>),
}

/// An input whose values are known at any time.
pub(super) struct Followed {
    reference: Vr,
    name: String,
    setter: Setter,
    at: At,
    values: Vec<f64>,
}

impl Followed {
    fn look(&mut self, t: f64) -> std::result::Result<(), String> {
        (self.at)(t, &mut self.values);
        match self.values.iter().all(|x| x.is_finite()) {
            true => Ok(()),
            false => Err(format!("the input `{}` is no number at t = {t} s", self.name)),
        }
    }

    /// In the call-back of the FMU: sets it to its values at t, s.
    pub fn set(&mut self, component: usize, t: f64) -> std::result::Result<(), StepFault> {
        self.look(t)?;
        let (instance, r, values) = (component as *mut c_void, &raw const self.reference, &self.values);
        // SAFETY: a live instance inside its own call-back, one reference and its values.
        let (function, status) = match &mut self.setter {
            Setter::Wide(set) => {
                ("fmi3SetFloat64", unsafe { set(instance, r, 1, values.as_ptr(), values.len()) })
            }
            Setter::Narrow(set, narrow) => {
                narrow.iter_mut().zip(values).for_each(|(n, x)| *n = *x as f32);
                ("fmi3SetFloat32", unsafe { set(instance, r, 1, narrow.as_ptr(), narrow.len()) })
            }
        };
        StepFault::of(status, || {
            format!("{function} of the input `{}` in its intermediate update at t = {t} s", self.name)
        })
    }
}

impl FmuInstance {
    /// The numbers in calls of inputs that are set at intermediate times.
    pub(super) fn followed_between(description: &ModelDescription, names: &[String]) -> Result<Vec<Vr>> {
        let one = |name: &String| {
            let v = description.position(name).map(|k| &description.variables[k]);
            let v = v.filter(|v| description.version == crate::Version::V3 && description.follows(v));
            v.map(|v| v.reference).ok_or_else(|| {
                Error::Refused(format!("`{name}` is no input that can be set at intermediate times"))
            })
        };
        names.iter().map(one).collect()
    }

    /// Tells what an input is at any time inside a step (FMI 3): `at` writes its elements at a time, s, and leaves NaN where
    /// there is no number. The FMU asks for it in its intermediate update, if it does; where a step has parts – an event,
    /// a clock, an early return – it is set between them too.
    ///
    /// # Errors
    /// An input that was not announced ([`super::InstanceOptions::followed`]).
    pub fn follow(&mut self, input: &Variable, at: impl Fn(f64, &mut [f64]) + Send + 'static) -> Result {
        let missing = |symbol| Error::Refused(format!("its library has no function `{symbol}`"));
        let setter = match (&self.api, input.value_type) {
            (Api::Three(three), ValueType::F64) => {
                Setter::Wide(three.set_f64.ok_or_else(|| missing("fmi3SetFloat64"))?)
            }
            (Api::Three(three), ValueType::F32) => {
                let set = three.set_f32.ok_or_else(|| missing("fmi3SetFloat32"))?;
                Setter::Narrow(set, vec![f32::NAN; input.len()])
            }
            _ => return Err(Error::Refused(format!("`{}` is no Float64 or Float32 of FMI 3", input.name))),
        };
        if !self.announced.contains(&input.reference) {
            return Err(Error::Refused(format!("`{}` was not announced as an input to follow", input.name)));
        }
        let (name, values) = (input.name.clone(), vec![f64::NAN; input.len()]);
        let followed = Followed { reference: input.reference, name, setter, at: Box::new(at), values };
        self.log.updates.inner().followed.push(followed);
        Ok(())
    }

    pub(super) fn forget_followed(&self) {
        self.log.updates.inner().followed.clear();
    }

    /// Between two parts of a step: what the FMU asked for last may be of another time.
    pub(super) fn set_followed(&self, t: f64) -> Result {
        let mut inner = self.log.updates.inner();
        for input in &mut inner.followed {
            input.look(t).map_err(Error::Refused)?;
            match &mut input.setter {
                Setter::Wide(_) => self.set_f64(&[input.reference], &input.values)?,
                Setter::Narrow(_, narrow) => {
                    narrow.iter_mut().zip(&input.values).for_each(|(n, x)| *n = *x as f32);
                    self.set(&[input.reference], Values::F32(narrow))?;
                }
            }
        }
        Ok(())
    }

    /// The error of a step in which an intermediate update went wrong.
    #[cold]
    pub(super) fn stopped_between(
        &self,
        function: &'static str,
        wrong: StepFault,
        status: CallStatus,
    ) -> Error {
        let dead = wrong.fatal || !goes_on(status) && status != CallStatus::Error;
        let error = self.lied(function, wrong.text);
        if dead {
            self.die();
        }
        error
    }

    /// Slopes of inputs over the coming step, in their units per s (FMI 2.0); values are set before.
    ///
    /// # Errors
    /// [`Error::Refused`]: FMI 3.0, or not as many slopes as references. [`Error::Call`]: the FMU refuses them.
    pub fn set_slopes(&self, references: &[u32], slopes: &[f64]) -> Result {
        const NAME: &str = "fmi2SetRealInputDerivatives";
        let Api::Two(two) = &self.api else {
            return Err(Error::Refused("FMI 3.0 takes no derivatives of inputs".into()));
        };
        if references.len() != slopes.len() {
            return Err(Error::Refused(format!(
                "{} references but {} slopes",
                references.len(),
                slopes.len()
            )));
        }
        let orders = vec![1; references.len()];
        let (r, n, o, p) = (references.as_ptr(), references.len(), orders.as_ptr(), slopes.as_ptr());
        // SAFETY: as many orders and values as references.
        self.call(NAME, two.set_slopes, |f, c| unsafe { f(c, r, n, o, p) })
    }
}
