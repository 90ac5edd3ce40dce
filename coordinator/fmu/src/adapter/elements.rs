//! Values of elements of arrays: FMI reads and sets whole arrays only, so neighbours of one array pass in one call.

use super::{FmuSubsystem, error};
use terraglue_subsystem::{Error, Result, Values, ValuesMut};

impl FmuSubsystem {
    /// Runs of neighbouring numbers that belong to one array each.
    fn runs<'a>(&'a self, ids: &'a [u32]) -> impl Iterator<Item = &'a [u32]> {
        let reference = |id: &u32| self.places.get(*id as usize).map(|p| p.reference);
        ids.chunk_by(move |a, b| reference(a) == reference(b))
    }

    /// Of a run: the reference of its array, its first element where the others follow in their order, and the elements of
    /// the whole array.
    fn array(&self, run: &[u32]) -> Result<(u32, Option<usize>, usize)> {
        let place = *self.place(run[0])?;
        let (first, count) = (place.element as usize, place.count as usize);
        // numbers of the elements of an array follow each other
        let ordered = run.windows(2).all(|w| w[0].checked_add(1) == Some(w[1])) && first + run.len() <= count;
        Ok((place.reference, ordered.then_some(first), count))
    }

    /// Values of elements, out of their whole arrays.
    pub(super) fn get_elements(&self, ids: &[u32], out: ValuesMut) -> Result {
        macro_rules! elements {
            ($variant:ident, $out:expr, $zero:expr) => {{
                let mut whole = Vec::new();
                let mut rest = &mut $out[..];
                for run in self.runs(ids) {
                    let (reference, first, count) = self.array(run)?;
                    let (out, others) = rest.split_at_mut(run.len());
                    rest = others;
                    whole.resize(count, $zero);
                    self.instance.get(&[reference], ValuesMut::$variant(&mut whole)).map_err(error)?;
                    match first {
                        Some(first) => out.clone_from_slice(&whole[first..first + run.len()]),
                        None => {
                            for (id, out) in run.iter().zip(out) {
                                *out = whole[self.place(*id)?.element as usize].clone();
                            }
                        }
                    }
                }
                Ok(())
            }};
        }
        match out {
            ValuesMut::F64(out) => {
                let done: Result = elements!(F64, out, 0.0);
                done.and_then(|()| self.check_numbers(ids, out))
            }
            ValuesMut::F32(out) => {
                let done: Result = elements!(F32, out, 0.0);
                done.and_then(|()| self.check_numbers(ids, out))
            }
            ValuesMut::I8(out) => elements!(I8, out, 0),
            ValuesMut::I16(out) => elements!(I16, out, 0),
            ValuesMut::I32(out) => elements!(I32, out, 0),
            ValuesMut::I64(out) => elements!(I64, out, 0),
            ValuesMut::U8(out) => elements!(U8, out, 0),
            ValuesMut::U16(out) => elements!(U16, out, 0),
            ValuesMut::U32(out) => elements!(U32, out, 0),
            ValuesMut::U64(out) => elements!(U64, out, 0),
            ValuesMut::Bool(out) => elements!(Bool, out, false),
            ValuesMut::String(out) => elements!(String, out, String::new()),
            ValuesMut::Binary(out) => elements!(Binary, out, Vec::new()),
            ValuesMut::Enumeration(out) => elements!(Enumeration, out, 0),
        }
    }

    /// New values of elements; the others of their arrays stay. An array whose elements all come is set in one call.
    pub(super) fn set_elements(&mut self, ids: &[u32], values: Values) -> Result {
        macro_rules! elements {
            ($variant:ident, $values:expr, $zero:expr) => {{
                let mut whole = Vec::new();
                let mut rest = $values;
                for run in self.runs(ids) {
                    let (reference, first, count) = self.array(run)?;
                    let (own, others) = rest.split_at(run.len());
                    rest = others;
                    if first == Some(0) && own.len() == count {
                        self.instance.set(&[reference], Values::$variant(own)).map_err(error)?;
                        continue;
                    }
                    whole.resize(count, $zero);
                    self.instance.get(&[reference], ValuesMut::$variant(&mut whole)).map_err(error)?;
                    for (id, value) in run.iter().zip(own) {
                        whole[self.place(*id)?.element as usize] = value.clone();
                    }
                    self.instance.set(&[reference], Values::$variant(&whole)).map_err(error)?;
                }
                Ok(())
            }};
        }
        match values {
            Values::F64(v) if self.instance.is_instantiated() => {
                ids.iter().zip(v).try_for_each(|(id, value)| self.start_element(*id, *value))
            }
            Values::F64(v) => elements!(F64, v, 0.0),
            Values::F32(v) => elements!(F32, v, 0.0),
            Values::I8(v) => elements!(I8, v, 0),
            Values::I16(v) => elements!(I16, v, 0),
            Values::I32(v) => elements!(I32, v, 0),
            Values::I64(v) => elements!(I64, v, 0),
            Values::U8(v) => elements!(U8, v, 0),
            Values::U16(v) => elements!(U16, v, 0),
            Values::U32(v) => elements!(U32, v, 0),
            Values::U64(v) => elements!(U64, v, 0),
            Values::Bool(v) => elements!(Bool, v, false),
            Values::String(v) => elements!(String, v, String::new()),
            Values::Binary(v) => elements!(Binary, v, Vec::new()),
            Values::Enumeration(v) => elements!(Enumeration, v, 0),
        }
    }
}

/// Whether derivatives of all outputs by all inputs are known; adjoint ones alone are asked for scalars only.
pub(super) fn knows_directional(of: &FmuSubsystem) -> bool {
    let c = of.instance.description().capabilities;
    c.directional_derivatives || c.adjoint_derivatives && of.places.iter().all(|place| place.count == 1)
}

/// Directional derivatives among elements, by those of their whole arrays.
pub(super) fn derivatives_of_arrays(
    of: &FmuSubsystem,
    unknowns: &[u32],
    knowns: &[u32],
    seed: &[f64],
    out: &mut [f64],
) -> Result {
    if !of.instance.description().capabilities.directional_derivatives {
        return Err(Error::Unsupported);
    }
    let (mut v, mut seeds) = (Vec::new(), Vec::new());
    let mut rest = seed;
    for run in of.runs(knowns) {
        let (own, others) = rest.split_at(run.len());
        rest = others;
        let (reference, _, count) = of.array(run)?;
        let first = seeds.len();
        v.push(reference);
        seeds.resize(first + count, 0.0);
        for (id, value) in run.iter().zip(own) {
            seeds[first + of.place(*id)?.element as usize] = *value;
        }
    }
    let arrays = of.runs(unknowns).map(|run| of.array(run)).collect::<Result<Vec<_>>>()?;
    let z: Vec<u32> = arrays.iter().map(|(reference, _, _)| *reference).collect();
    let mut all = vec![f64::NAN; arrays.iter().map(|(_, _, count)| count).sum()];
    of.instance.directional_derivative(&z, &v, &seeds, &mut all).map_err(error)?;
    let (mut rest, mut out) = (&all[..], out.iter_mut());
    for (run, (_, _, count)) in of.runs(unknowns).zip(arrays) {
        let (whole, others) = rest.split_at(count);
        rest = others;
        for (id, out) in run.iter().zip(&mut out) {
            *out = whole[of.place(*id)?.element as usize];
        }
    }
    Ok(())
}
