//! Values of variables, in the types of both versions.

use super::foreign::ForeignInstance;
use super::functions::Api;
use crate::description::Variable;
use crate::error::{Error, Result};
use std::ffi::{CStr, CString, c_char};
use terraglue_subsystem::{ValueType, Values, ValuesMut};

macro_rules! plain {
    ($self:ident, $name:literal, $f:expr, $references:ident, $values:ident . $pointer:ident) => {{
        let (r, n) = ($references.as_ptr(), $references.len());
        let (p, m) = ($values.$pointer(), $values.len());
        // SAFETY: so many references and values, by the standard.
        $self.call($name, $f, |f, c| unsafe { f(c, r, n, p, m) })
    }};
}

impl ForeignInstance {
    /// Values of f64 variables.
    ///
    /// # Errors
    /// [`Error::Refused`]: fewer values than references. [`Error::Call`]: the FMU failed.
    #[inline(always)]
    pub fn get_f64(&self, references: &[u32], out: &mut [f64]) -> Result {
        self.read_f64(references, out)?;
        self.trace(format_args!("  {references:?}: {out:?}"));
        Ok(())
    }

    #[inline(always)]
    fn read_f64(&self, references: &[u32], out: &mut [f64]) -> Result {
        match &self.api {
            Api::Two(two) => {
                if out.len() < references.len() {
                    return Err(wrong_length(references, out.len()));
                }
                let (r, n, p) = (references.as_ptr(), references.len(), out.as_mut_ptr());
                // SAFETY: as many values as references.
                self.call("fmi2GetReal", two.get_real, |f, c| unsafe { f(c, r, n, p) })
            }
            Api::Three(three) => plain!(self, "fmi3GetFloat64", three.get_f64, references, out.as_mut_ptr),
        }
    }

    /// New values of f64 variables.
    ///
    /// # Errors
    /// [`Error::Refused`]: fewer values than references. [`Error::Call`]: the FMU refuses a value or failed.
    #[inline(always)]
    pub fn set_f64(&self, references: &[u32], values: &[f64]) -> Result {
        self.trace(format_args!("{references:?} = {values:?}"));
        match &self.api {
            Api::Two(two) => {
                if values.len() < references.len() {
                    return Err(wrong_length(references, values.len()));
                }
                let (r, n, p) = (references.as_ptr(), references.len(), values.as_ptr());
                // SAFETY: as many values as references.
                self.call("fmi2SetReal", two.set_real, |f, c| unsafe { f(c, r, n, p) })
            }
            Api::Three(three) => plain!(self, "fmi3SetFloat64", three.set_f64, references, values.as_ptr),
        }
    }

    /// Values of variables of the type of `out`, arrays one after the other.
    ///
    /// # Errors
    /// [`Error::Refused`]: a type that this version of FMI does not have. [`Error::Call`]: the FMU failed.
    pub fn get(&self, references: &[u32], mut out: ValuesMut) -> Result {
        if let ValuesMut::F64(out) = out {
            return self.get_f64(references, out);
        }
        match self.api {
            Api::Two(..) => self.get_2(references, &mut out),
            Api::Three(..) => self.get_3(references, &mut out),
        }?;
        self.trace(format_args!("  {references:?}: {out:?}"));
        Ok(())
    }

    /// New values.
    ///
    /// # Errors
    /// [`Error::Refused`]: a type that this version of FMI does not have, or a value that its type cannot hold.
    /// [`Error::Call`]: the FMU refuses a value or failed.
    pub fn set(&self, references: &[u32], values: Values) -> Result {
        if let Values::F64(values) = values {
            return self.set_f64(references, values);
        }
        self.trace(format_args!("{references:?} = {values:?}"));
        match self.api {
            Api::Two(..) => self.set_2(references, values),
            Api::Three(..) => self.set_3(references, values),
        }
    }

    fn get_2(&self, references: &[u32], out: &mut ValuesMut) -> Result {
        let Api::Two(two) = self.api else { return Err(Error::Refused("not of FMI 2.0".into())) };
        let (r, n) = (references.as_ptr(), references.len());
        let mut integers = vec![0_i32; n];
        let p = integers.as_mut_ptr();
        match out {
            ValuesMut::Bool(out) => {
                // SAFETY: as many values as references, here and below.
                self.call("fmi2GetBoolean", two.get_boolean, |f, c| unsafe { f(c, r, n, p) })?;
                out.iter_mut().zip(&integers).for_each(|(o, i)| *o = *i != 0);
                Ok(())
            }
            ValuesMut::I32(out) => {
                self.call("fmi2GetInteger", two.get_integer, |f, c| unsafe { f(c, r, n, p) })?;
                out.iter_mut().zip(&integers).for_each(|(o, i)| *o = *i);
                Ok(())
            }
            ValuesMut::Enumeration(out) => {
                self.call("fmi2GetInteger", two.get_integer, |f, c| unsafe { f(c, r, n, p) })?;
                out.iter_mut().zip(&integers).for_each(|(o, i)| *o = i64::from(*i));
                Ok(())
            }
            ValuesMut::String(out) => {
                let mut texts = vec![std::ptr::null::<c_char>(); n];
                let p = texts.as_mut_ptr();
                self.call("fmi2GetString", two.get_string, |f, c| unsafe { f(c, r, n, p) })?;
                self.copy_texts("fmi2GetString", &texts, out)
            }
            _ => Err(Error::Refused("FMI 2.0 knows no values of this type".into())),
        }
    }

    fn set_2(&self, references: &[u32], values: Values) -> Result {
        let Api::Two(two) = self.api else { return Err(Error::Refused("not of FMI 2.0".into())) };
        let (r, n) = (references.as_ptr(), references.len());
        let fits = |len: usize| if len == n { Ok(()) } else { Err(wrong_length(references, len)) };
        match values {
            Values::Bool(values) => {
                fits(values.len())?;
                let integers: Vec<i32> = values.iter().map(|b| i32::from(*b)).collect();
                let p = integers.as_ptr();
                // SAFETY: as many values as references, here and below.
                self.call("fmi2SetBoolean", two.set_boolean, |f, c| unsafe { f(c, r, n, p) })
            }
            Values::I32(values) => {
                fits(values.len())?;
                let p = values.as_ptr();
                self.call("fmi2SetInteger", two.set_integer, |f, c| unsafe { f(c, r, n, p) })
            }
            Values::Enumeration(values) => {
                fits(values.len())?;
                let narrow =
                    values.iter().map(|v| i32::try_from(*v)).collect::<std::result::Result<Vec<_>, _>>();
                let integers =
                    narrow.map_err(|_| Error::Refused("a value is too large for FMI 2.0".into()))?;
                let p = integers.as_ptr();
                self.call("fmi2SetInteger", two.set_integer, |f, c| unsafe { f(c, r, n, p) })
            }
            Values::String(values) => {
                fits(values.len())?;
                let texts = texts(values)?;
                let pointers: Vec<*const c_char> = texts.iter().map(|t| t.as_ptr()).collect();
                let p = pointers.as_ptr();
                self.call("fmi2SetString", two.set_string, |f, c| unsafe { f(c, r, n, p) })
            }
            _ => Err(Error::Refused("FMI 2.0 knows no values of this type".into())),
        }
    }

    fn get_3(&self, references: &[u32], out: &mut ValuesMut) -> Result {
        let Api::Three(three) = self.api else { return Err(Error::Refused("not of FMI 3.0".into())) };
        match out {
            ValuesMut::F64(out) => self.get_f64(references, out),
            ValuesMut::F32(out) => plain!(self, "fmi3GetFloat32", three.get_f32, references, out.as_mut_ptr),
            ValuesMut::I8(out) => plain!(self, "fmi3GetInt8", three.get_i8, references, out.as_mut_ptr),
            ValuesMut::U8(out) => plain!(self, "fmi3GetUInt8", three.get_u8, references, out.as_mut_ptr),
            ValuesMut::I16(out) => plain!(self, "fmi3GetInt16", three.get_i16, references, out.as_mut_ptr),
            ValuesMut::U16(out) => plain!(self, "fmi3GetUInt16", three.get_u16, references, out.as_mut_ptr),
            ValuesMut::I32(out) => plain!(self, "fmi3GetInt32", three.get_i32, references, out.as_mut_ptr),
            ValuesMut::U32(out) => plain!(self, "fmi3GetUInt32", three.get_u32, references, out.as_mut_ptr),
            ValuesMut::I64(out) | ValuesMut::Enumeration(out) => {
                plain!(self, "fmi3GetInt64", three.get_i64, references, out.as_mut_ptr)
            }
            ValuesMut::U64(out) => plain!(self, "fmi3GetUInt64", three.get_u64, references, out.as_mut_ptr),
            ValuesMut::Bool(out) => {
                // An FMU may write any byte; a bool of ours may hold 0 and 1 only.
                let mut bytes = vec![0_u8; out.len()];
                plain!(self, "fmi3GetBoolean", three.get_bool, references, bytes.as_mut_ptr)?;
                out.iter_mut().zip(&bytes).for_each(|(o, b)| *o = *b != 0);
                Ok(())
            }
            ValuesMut::String(out) => {
                let mut texts = vec![std::ptr::null::<c_char>(); out.len()];
                plain!(self, "fmi3GetString", three.get_string, references, texts.as_mut_ptr)?;
                self.copy_texts("fmi3GetString", &texts, out)
            }
            ValuesMut::Binary(out) => self.get_binary(references, out),
        }
    }

    fn get_binary(&self, references: &[u32], out: &mut [Vec<u8>]) -> Result {
        const NAME: &str = "fmi3GetBinary";
        let Api::Three(three) = self.api else { return Err(Error::Refused("not of FMI 3.0".into())) };
        let (r, n, m) = (references.as_ptr(), references.len(), out.len());
        let mut sizes = vec![0_usize; m];
        let mut places = vec![std::ptr::null::<u8>(); m];
        let (s, p) = (sizes.as_mut_ptr(), places.as_mut_ptr());
        // SAFETY: so many references and values.
        self.call(NAME, three.get_binary, |f, c| unsafe { f(c, r, n, s, p, m) })?;
        for ((out, size), place) in out.iter_mut().zip(sizes).zip(places) {
            out.clear();
            if place.is_null() && size > 0 || size > 1 << 30 {
                return Err(self.lied(NAME, format!("answered {size} bytes that are not there")));
            }
            if size > 0 {
                // SAFETY: the FMU declares that so many bytes lie there until the next call.
                out.extend_from_slice(unsafe { std::slice::from_raw_parts(place, size) });
            }
        }
        Ok(())
    }

    fn set_3(&self, references: &[u32], values: Values) -> Result {
        let Api::Three(three) = self.api else { return Err(Error::Refused("not of FMI 3.0".into())) };
        match values {
            Values::F64(v) => self.set_f64(references, v),
            Values::F32(v) => plain!(self, "fmi3SetFloat32", three.set_f32, references, v.as_ptr),
            Values::I8(v) => plain!(self, "fmi3SetInt8", three.set_i8, references, v.as_ptr),
            Values::U8(v) => plain!(self, "fmi3SetUInt8", three.set_u8, references, v.as_ptr),
            Values::I16(v) => plain!(self, "fmi3SetInt16", three.set_i16, references, v.as_ptr),
            Values::U16(v) => plain!(self, "fmi3SetUInt16", three.set_u16, references, v.as_ptr),
            Values::I32(v) => plain!(self, "fmi3SetInt32", three.set_i32, references, v.as_ptr),
            Values::U32(v) => plain!(self, "fmi3SetUInt32", three.set_u32, references, v.as_ptr),
            Values::I64(v) | Values::Enumeration(v) => {
                plain!(self, "fmi3SetInt64", three.set_i64, references, v.as_ptr)
            }
            Values::U64(v) => plain!(self, "fmi3SetUInt64", three.set_u64, references, v.as_ptr),
            Values::Bool(v) => plain!(self, "fmi3SetBoolean", three.set_bool, references, v.as_ptr),
            Values::String(v) => {
                let texts = texts(v)?;
                let pointers: Vec<*const c_char> = texts.iter().map(|t| t.as_ptr()).collect();
                plain!(self, "fmi3SetString", three.set_string, references, pointers.as_ptr)
            }
            Values::Binary(v) => {
                let (r, n, m) = (references.as_ptr(), references.len(), v.len());
                let sizes: Vec<usize> = v.iter().map(Vec::len).collect();
                let places: Vec<*const u8> = v.iter().map(|b| b.as_ptr()).collect();
                let (s, p) = (sizes.as_ptr(), places.as_ptr());
                // SAFETY: so many references and values.
                self.call("fmi3SetBinary", three.set_binary, |f, c| unsafe { f(c, r, n, s, p, m) })
            }
        }
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
            let (n, m) = (references.len(), slopes.len());
            return Err(Error::Refused(format!("{n} references but {m} slopes")));
        }
        let orders = vec![1; references.len()];
        let (r, n, o, p) = (references.as_ptr(), references.len(), orders.as_ptr(), slopes.as_ptr());
        // SAFETY: as many orders and values as references.
        self.call(NAME, two.set_slopes, |f, c| unsafe { f(c, r, n, o, p) })
    }

    /// A whole number into a variable of any type that holds some.
    ///
    /// # Errors
    /// [`Error::WrongInput`]: out of the range of the type. [`Error::Call`]: the FMU refuses it.
    pub(super) fn set_whole(&self, v: &Variable, value: i128) -> Result {
        macro_rules! narrow {
            ($variant:ident) => {{
                let own = value.try_into().map_err(|_| Error::WrongInput("it is out of range".into()))?;
                self.set(&[v.reference], Values::$variant(&[own]))
            }};
        }
        match v.value_type {
            ValueType::I8 => narrow!(I8),
            ValueType::I16 => narrow!(I16),
            ValueType::I32 => narrow!(I32),
            ValueType::U8 => narrow!(U8),
            ValueType::U16 => narrow!(U16),
            ValueType::U32 => narrow!(U32),
            ValueType::U64 => narrow!(U64),
            ValueType::Enumeration => narrow!(Enumeration),
            _ => narrow!(I64),
        }
    }

    fn copy_texts(&self, function: &'static str, from: &[*const c_char], to: &mut [String]) -> Result {
        for (text, out) in from.iter().zip(to) {
            out.clear();
            if text.is_null() {
                return Err(self.lied(function, "answered NULL instead of a text".into()));
            }
            // SAFETY: a text of the FMU, valid until its next call.
            out.push_str(&unsafe { CStr::from_ptr(*text) }.to_string_lossy());
        }
        Ok(())
    }
}

fn texts(values: &[String]) -> Result<Vec<CString>> {
    let text = |v: &String| CString::new(v.as_str());
    let all: std::result::Result<Vec<_>, _> = values.iter().map(text).collect();
    all.map_err(|_| Error::WrongInput("a text has a zero in it".into()))
}

#[cold]
fn wrong_length(references: &[u32], values: usize) -> Error {
    Error::Refused(format!("{} references but {values} values", references.len()))
}
