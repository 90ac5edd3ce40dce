//! Start values of single elements of arrays: FMI sets whole arrays only, and reads nothing before the initialisation, so the other elements
//! have the start values of the description.

use super::map::element_name;
use std::collections::BTreeMap;
use terraglue_fmi::description::{Start, Variable};
use terraglue_fmi::{Error, FmuInstance, Result};

/// Elements of arrays of Float64 that were given, by the reference of the array.
#[derive(Default)]
pub struct ArrayStarts(BTreeMap<u32, Vec<Option<f64>>>);

impl ArrayStarts {
    /// Keeps the value of an element of the array with `count` elements.
    pub fn give(&mut self, reference: u32, (element, count): (usize, usize), value: f64) {
        let all = self.0.entry(reference).or_insert_with(|| vec![None; count]);
        if let Some(place) = all.get_mut(element) {
            *place = Some(value);
        }
    }

    /// Sets the arrays whole, before the initialisation.
    ///
    /// # Errors
    /// [`Error::WrongInput`]: an element is missing of an array whose shape structural parameters changed; the FMU does not take the values.
    pub fn set(self, instance: &FmuInstance) -> Result {
        let description = instance.description().clone();
        for (reference, given) in self.0 {
            let found = description.variables.iter().find(|v| v.reference == reference && !v.alias);
            let Some(v) = found else { continue };
            instance.set_f64(&[reference], &whole(v, &given)?)?;
        }
        Ok(())
    }
}

/// All elements.
fn whole(v: &Variable, given: &[Option<f64>]) -> Result<Vec<f64>> {
    if let Some(k) = given.iter().position(Option::is_none).filter(|_| v.resized) {
        return Err(Error::WrongInput(format!(
            "`{}` lacks a value: structural parameters changed the shape of `{}` and with it the start values \
             of the FMU, so give all {} or none",
            element_name(v, k),
            v.name,
            given.len()
        )));
    }
    let own = match &v.start {
        Start::Numbers(own) => own.as_slice(),
        _ => &[],
    };
    let known = |k: usize| own.get(k).or(own.first()).copied().unwrap_or(0.0);
    Ok(given.iter().enumerate().map(|(k, x)| x.unwrap_or(known(k))).collect())
}
