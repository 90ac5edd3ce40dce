//! Values of single elements of arrays: FMI reads and sets whole arrays only.

use super::{FmuSubsystem, error};
use terraglue_subsystem::{Result, Values, ValuesMut};

impl FmuSubsystem {
    /// Values of elements, each out of its whole array.
    pub(super) fn get_elements(&self, ids: &[u32], out: ValuesMut) -> Result {
        macro_rules! elements {
            ($variant:ident, $out:expr, $zero:expr) => {{
                for (id, out) in ids.iter().zip($out.iter_mut()) {
                    let place = *self.place(*id)?;
                    let mut whole = vec![$zero; place.count as usize];
                    self.instance.get(&[place.reference], ValuesMut::$variant(&mut whole)).map_err(error)?;
                    *out = whole.swap_remove(place.element as usize);
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

    /// New values of elements; the others of their arrays stay.
    pub(super) fn set_elements(&mut self, ids: &[u32], values: Values) -> Result {
        macro_rules! elements {
            ($variant:ident, $values:expr, $zero:expr) => {{
                for (id, value) in ids.iter().zip($values) {
                    let place = *self.place(*id)?;
                    let mut whole = vec![$zero; place.count as usize];
                    self.instance.get(&[place.reference], ValuesMut::$variant(&mut whole)).map_err(error)?;
                    whole[place.element as usize] = value.clone();
                    self.instance.set(&[place.reference], Values::$variant(&whole)).map_err(error)?;
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
