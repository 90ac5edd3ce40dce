//! Reads the section `.terraglue` of a shared library without running it: 64-bit little-endian ELF, as on the
//! platforms that are supported (x86-64, aarch64).

use std::path::Path;

/// What a module says about itself in its section.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Description {
    /// Name of its package.
    pub name: String,
    /// Version of its package.
    pub version: String,
    /// MAJOR.MINOR of the ABI that it was built for.
    pub abi: String,
}

/// Whether the bytes are an ELF file at all.
pub(super) fn is_elf(bytes: &[u8]) -> bool {
    bytes.starts_with(b"\x7fELF")
}

impl Description {
    /// From a file; None: unreadable, no such section, or not of our form.
    pub fn read(path: &Path) -> Option<Self> {
        Self::of(&std::fs::read(path).ok()?)
    }

    /// From the bytes of a library.
    pub(super) fn of(bytes: &[u8]) -> Option<Self> {
        let section = section(bytes, terraglue_plugin::SECTION)?;
        let text = str::from_utf8(section.split(|b| *b == 0).next()?).ok()?;
        let mut lines = text.lines();
        if lines.next() != Some("terraglue module") {
            return None;
        }
        let mut out = Self::default();
        for (key, value) in lines.filter_map(|l| l.split_once('=')) {
            match key {
                "name" => out.name = value.into(),
                "version" => out.version = value.into(),
                "abi" => out.abi = value.into(),
                _ => {}
            }
        }
        Some(out)
    }

    /// The major version of the ABI.
    pub(super) fn abi_major(&self) -> Option<u32> {
        self.abi.split('.').next()?.parse().ok()
    }
}

/// Bytes of a section by name. Offsets after the ELF-64 specification, section header table.
fn section<'a>(bytes: &'a [u8], name: &str) -> Option<&'a [u8]> {
    const CLASS_64: u8 = 2;
    const LITTLE_ENDIAN: u8 = 1;
    if !is_elf(bytes) || bytes.get(4) != Some(&CLASS_64) || bytes.get(5) != Some(&LITTLE_ENDIAN) {
        return None;
    }
    let table = number::<8>(bytes, 0x28)?;
    let size = number::<2>(bytes, 0x3a)?;
    let count = number::<2>(bytes, 0x3c)?;
    let names = number::<2>(bytes, 0x3e)?;
    let header = |k: usize| table.checked_add(k.checked_mul(size)?);
    let content = |at: usize| {
        let (offset, length) = (number::<8>(bytes, at + 0x18)?, number::<8>(bytes, at + 0x20)?);
        bytes.get(offset..offset.checked_add(length)?)
    };
    let names = content(header(names)?)?;
    for k in 0..count {
        let at = header(k)?;
        let own = names.get(number::<4>(bytes, at)?..)?;
        if own.strip_prefix(name.as_bytes()).is_some_and(|rest| rest.first() == Some(&0)) {
            return content(at);
        }
    }
    None
}

/// A little-endian number of N ≤ 8 bytes.
fn number<const N: usize>(bytes: &[u8], at: usize) -> Option<usize> {
    let own = bytes.get(at..at.checked_add(N)?)?;
    let value = own.iter().rev().fold(0u64, |sum, b| sum << 8 | u64::from(*b));
    usize::try_from(value).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_that_are_cut_or_no_library_have_no_description() {
        assert_eq!(Description::of(b""), None);
        assert_eq!(Description::of(b"#!/bin/sh\n"), None);
        let own = std::fs::read(std::env::current_exe().expect("own path")).expect("own file");
        assert!(section(&own, ".text").is_some_and(|s| !s.is_empty()));
        assert_eq!(section(&own, ".terraglue"), None);
        for length in [4, 0x3f, 0x40, 200] {
            assert_eq!(section(&own[..length], ".text"), None);
        }
    }
}
