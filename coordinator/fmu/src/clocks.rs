//! Clocks of FMUs in a scenario: truth values. An output clock is true where it ticked in the last step, a triggered input clock
//! ticks when the next step begins; inputs of a clock take their values then.

use super::map::ValueLocation;
use terraglue_fmi::{Error as FmiError, FmuInstance, ForeignInstance, Result as FmiResult};
use terraglue_subsystem::{Error, Result, Values, ValuesMut};

/// How an error of an FMU becomes one of the subsystem.
type Fail = fn(FmiError) -> Error;

/// Whether any of the variables needs this module.
pub fn concerned(places: &[ValueLocation]) -> bool {
    places.iter().any(|p| p.clock || p.clocked)
}

/// Truth values of which some are clocks; answers whether there are such.
pub fn get(
    instance: &FmuInstance,
    places: &[&ValueLocation],
    out: &mut ValuesMut,
    fail: Fail,
) -> Result<bool> {
    let ValuesMut::Bool(out) = out else { return Ok(false) };
    if !places.iter().any(|p| p.clock) {
        return Ok(false);
    }
    for (place, out) in places.iter().zip(out.iter_mut()) {
        *out = if place.clock {
            instance.clocks().ticks(place.reference)
        } else {
            let mut whole = vec![false; place.count as usize];
            instance.get(&[place.reference], ValuesMut::Bool(&mut whole)).map_err(fail)?;
            whole[place.element as usize]
        };
    }
    Ok(true)
}

/// Sets clocks, and keeps inputs of clocks for their next tick; answers whether all of them were such.
pub fn set(
    instance: &mut FmuInstance,
    places: &[&ValueLocation],
    values: &Values,
    fail: Fail,
) -> Result<bool> {
    if let (Values::Bool(values), true) = (values, places.iter().all(|p| p.clock)) {
        for (place, on) in places.iter().zip(*values) {
            let clock = instance.description().variables[place.variable as usize].clone();
            instance.trigger(&clock, *on).map_err(fail)?;
        }
        return Ok(true);
    }
    if !places.iter().all(|p| p.clocked && p.count == 1) {
        return mixed(places);
    }
    macro_rules! held {
        ($variant:ident, $all:expr) => {
            for (place, value) in places.iter().zip($all.iter().cloned()) {
                let reference = place.reference;
                instance.clocks_mut().hold(reference, move |instance: &ForeignInstance| -> FmiResult {
                    instance.set(&[reference], Values::$variant(std::slice::from_ref(&value)))
                });
            }
        };
    }
    match values {
        Values::F64(all) => held!(F64, all),
        Values::F32(all) => held!(F32, all),
        Values::I8(all) => held!(I8, all),
        Values::I16(all) => held!(I16, all),
        Values::I32(all) => held!(I32, all),
        Values::I64(all) => held!(I64, all),
        Values::U8(all) => held!(U8, all),
        Values::U16(all) => held!(U16, all),
        Values::U32(all) => held!(U32, all),
        Values::U64(all) => held!(U64, all),
        Values::Bool(all) => held!(Bool, all),
        Values::String(all) => held!(String, all),
        Values::Binary(all) => held!(Binary, all),
        Values::Enumeration(all) => {
            let items = |place: &ValueLocation, k: i64| {
                let items = &instance.description().variables[place.variable as usize].items;
                usize::try_from(k).ok().and_then(|k| items.get(k)).map_or(k, |(_, own)| *own)
            };
            let own: Vec<i64> = places.iter().zip(*all).map(|(place, k)| items(place, *k)).collect();
            held!(Enumeration, own);
        }
    }
    Ok(true)
}

/// Answer for values that are not all single inputs of a clock: false, or an error for elements of an array of a clock.
fn mixed(places: &[&ValueLocation]) -> Result<bool> {
    match places.iter().any(|p| p.clocked && p.count > 1) {
        true => {
            Err(Error::Refused("an array that belongs to a clock cannot be set element by element".into()))
        }
        false => Ok(false),
    }
}
