//! Inputs that an FMU follows within its steps: FMI 2.0 by their slopes (`fmi2SetRealInputDerivatives`, 4.2.1), FMI 3.0 by
//! the values that it asks for in its intermediate update (4.2.2).

use super::functions::{Api, Vr};
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
    /// An input whose elements `at` writes at a time, s.
    ///
    /// # Errors
    /// The FMU cannot take it.
    pub fn new(api: &Api, input: &Variable, at: impl Fn(f64, &mut [f64]) + Send + 'static) -> Result<Self> {
        let missing = |symbol| Error::Refused(format!("its library has no function `{symbol}`"));
        let setter = match (api, input.value_type) {
            (Api::Three(three), ValueType::F64) => {
                Setter::Wide(three.set_f64.ok_or_else(|| missing("fmi3SetFloat64"))?)
            }
            (Api::Three(three), ValueType::F32) => {
                let set = three.set_f32.ok_or_else(|| missing("fmi3SetFloat32"))?;
                Setter::Narrow(set, vec![f32::NAN; input.len()])
            }
            _ => return Err(Error::Refused(format!("`{}` is no Float64 or Float32 of FMI 3", input.name))),
        };
        let (name, values) = (input.name.clone(), vec![f64::NAN; input.len()]);
        Ok(Self { reference: input.reference, name, setter, at: Box::new(at), values })
    }

    /// Number in calls and values at a time, s.
    ///
    /// # Errors
    /// The input is no number then.
    pub fn values_at(&mut self, t: f64) -> Result<(Vr, Values<'_>)> {
        self.look(t).map_err(Error::Refused)?;
        let values = match &mut self.setter {
            Setter::Wide(_) => Values::F64(&self.values),
            Setter::Narrow(_, narrow) => {
                narrow.iter_mut().zip(&self.values).for_each(|(n, x)| *n = *x as f32);
                Values::F32(narrow)
            }
        };
        Ok((self.reference, values))
    }

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

/// The numbers in calls of inputs that are set at intermediate times.
pub(super) fn announced(description: &ModelDescription, names: &[String]) -> Result<Vec<Vr>> {
    let one = |name: &String| {
        let v = description.position(name).map(|k| &description.variables[k]);
        let v = v.filter(|v| description.version == crate::Version::V3 && description.follows(v));
        v.map(|v| v.reference).ok_or_else(|| {
            Error::Refused(format!("`{name}` is no input that can be set at intermediate times"))
        })
    };
    names.iter().map(one).collect()
}
