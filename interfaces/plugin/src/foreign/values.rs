//! `get` and `set` of a foreign instance.

use super::subsystem::ForeignSubsystem;
use crate::abi::*;
use crate::text::slice;
use std::ffi::c_void;
use terraglue_subsystem::{Error, Result, Values, ValuesMut};

impl ForeignSubsystem {
    pub(super) fn get_values(&self, ids: &[u32], out: ValuesMut) -> Result {
        match out {
            ValuesMut::F64(d) => self.get_plain(TG_F64, ids, d),
            ValuesMut::F32(d) => self.get_plain(TG_F32, ids, d),
            ValuesMut::I8(d) => self.get_plain(TG_I8, ids, d),
            ValuesMut::I16(d) => self.get_plain(TG_I16, ids, d),
            ValuesMut::I32(d) => self.get_plain(TG_I32, ids, d),
            ValuesMut::I64(d) => self.get_plain(TG_I64, ids, d),
            ValuesMut::U8(d) => self.get_plain(TG_U8, ids, d),
            ValuesMut::U16(d) => self.get_plain(TG_U16, ids, d),
            ValuesMut::U32(d) => self.get_plain(TG_U32, ids, d),
            ValuesMut::U64(d) => self.get_plain(TG_U64, ids, d),
            ValuesMut::Enumeration(d) => self.get_plain(TG_ENUMERATION, ids, d),
            ValuesMut::Bool(d) => self.get_bools(ids, d),
            ValuesMut::String(d) => self.get_bytes(TG_STRING, ids, d.len(), |k, bytes| {
                let text = str::from_utf8(bytes).map_err(|_| Error::Failed("a text is not UTF-8".into()))?;
                d[k].clear();
                d[k].push_str(text);
                Ok(())
            }),
            ValuesMut::Binary(d) => self.get_bytes(TG_BINARY, ids, d.len(), |k, bytes| {
                d[k].clear();
                d[k].extend_from_slice(bytes);
                Ok(())
            }),
        }
    }

    pub(super) fn set_values(&mut self, ids: &[u32], values: Values) -> Result {
        match values {
            Values::F64(d) => self.set_plain(TG_F64, ids, d),
            Values::F32(d) => self.set_plain(TG_F32, ids, d),
            Values::I8(d) => self.set_plain(TG_I8, ids, d),
            Values::I16(d) => self.set_plain(TG_I16, ids, d),
            Values::I32(d) => self.set_plain(TG_I32, ids, d),
            Values::I64(d) => self.set_plain(TG_I64, ids, d),
            Values::U8(d) => self.set_plain(TG_U8, ids, d),
            Values::U16(d) => self.set_plain(TG_U16, ids, d),
            Values::U32(d) => self.set_plain(TG_U32, ids, d),
            Values::U64(d) => self.set_plain(TG_U64, ids, d),
            Values::Bool(d) => self.set_plain(TG_BOOL, ids, d),
            Values::Enumeration(d) => self.set_plain(TG_ENUMERATION, ids, d),
            Values::String(d) => self.set_bytes(TG_STRING, ids, d.iter().map(|s| s.as_bytes())),
            Values::Binary(d) => self.set_bytes(TG_BINARY, ids, d.iter().map(Vec::as_slice)),
        }
    }

    fn get_raw(&self, value_type: u32, ids: &[u32], data: *mut c_void, count: usize) -> Result {
        let f = self.raw.table.get.ok_or(Error::Unsupported)?;
        let values = TgValues { value_type, n_ids: ids.len() as u32, ids: ids.as_ptr(), count, data };
        // SAFETY: a live instance and `count` elements of the named type.
        self.raw.check(unsafe { f(self.raw.instance, &raw const values) }, f64::NAN)
    }

    fn get_plain<T>(&self, value_type: u32, ids: &[u32], out: &mut [T]) -> Result {
        self.get_raw(value_type, ids, out.as_mut_ptr().cast(), out.len())
    }

    fn get_bools(&self, ids: &[u32], out: &mut [bool]) -> Result {
        let first: *mut u8 = out.as_mut_ptr().cast();
        let result = self.get_raw(TG_BOOL, ids, first.cast(), out.len());
        for k in 0..out.len() {
            // SAFETY: inside `out`, as bytes: the bytes written by the module need not be bools yet.
            unsafe { *first.add(k) = u8::from(*first.add(k) != 0) }
        }
        result
    }

    fn get_bytes(
        &self,
        value_type: u32,
        ids: &[u32],
        count: usize,
        mut take: impl FnMut(usize, &[u8]) -> Result,
    ) -> Result {
        let mut scratch = self.scratch.borrow_mut();
        scratch.clear();
        scratch.resize(count, TgBytes { data: std::ptr::null(), size: 0 });
        self.get_raw(value_type, ids, scratch.as_mut_ptr().cast(), count)?;
        for (k, bytes) in scratch.iter().enumerate() {
            // SAFETY: valid until the next call of the instance.
            take(k, unsafe { slice(bytes.data, bytes.size) })?;
        }
        Ok(())
    }

    fn set_raw(&self, value_type: u32, ids: &[u32], data: *const c_void, count: usize) -> Result {
        let f = self.raw.table.set.ok_or(Error::Unsupported)?;
        let data = data.cast_mut();
        let values = TgValues { value_type, n_ids: ids.len() as u32, ids: ids.as_ptr(), count, data };
        // SAFETY: a live instance; `set` only reads the elements.
        self.raw.check(unsafe { f(self.raw.instance, &raw const values) }, f64::NAN)
    }

    fn set_plain<T>(&mut self, value_type: u32, ids: &[u32], from: &[T]) -> Result {
        self.set_raw(value_type, ids, from.as_ptr().cast(), from.len())
    }

    fn set_bytes<'a>(
        &mut self,
        value_type: u32,
        ids: &[u32],
        from: impl Iterator<Item = &'a [u8]>,
    ) -> Result {
        let mut scratch = self.scratch.borrow_mut();
        scratch.clear();
        scratch.extend(from.map(|b| TgBytes { data: b.as_ptr(), size: b.len() }));
        self.set_raw(value_type, ids, scratch.as_ptr().cast(), scratch.len())
    }
}
