//! Reads sections and symbols of a shared library without running it: 64-bit little-endian ELF, as on the
//! platforms that are supported (x86-64, aarch64).

/// Whether the bytes are an ELF file at all.
pub fn is_elf(bytes: &[u8]) -> bool {
    bytes.starts_with(b"\x7fELF")
}

/// Number of the kind of machine in the file header, where it is not this one.
pub fn foreign_machine(bytes: &[u8]) -> Option<usize> {
    const OWN: usize = if cfg!(target_arch = "aarch64") { 183 } else { 62 };
    number::<2>(bytes, 0x12).filter(|machine| *machine != OWN)
}

/// Length that the file must have for its sections and loaded segments, or None: not a 64-bit little-endian ELF
/// file with complete headers. A shorter file must not be loaded: the system maps the segments without looking,
/// and the first touch beyond the end is a bus error.
pub fn needed_length(bytes: &[u8]) -> Option<usize> {
    let header = Header::of(bytes)?;
    let sections = header.sections.checked_add(header.section_count.checked_mul(header.section_size)?)?;
    Some(sections.max(mapped_length(bytes)?))
}

/// The same for its loaded segments alone, which is all that the system looks at.
pub fn mapped_length(bytes: &[u8]) -> Option<usize> {
    const LOADED: usize = 1;
    let header = Header::of(bytes)?;
    let mut end = 0_usize;
    for k in 0..header.segment_count {
        let at = header.segments.checked_add(k.checked_mul(header.segment_size)?)?;
        if number::<4>(bytes, at)? != LOADED {
            continue;
        }
        let (offset, size) =
            (number::<8>(bytes, at.checked_add(0x08)?)?, number::<8>(bytes, at.checked_add(0x20)?)?);
        end = end.max(offset.checked_add(size)?);
    }
    Some(end)
}

/// Where the tables of a file lie. Offsets after the ELF-64 specification, file header.
struct Header {
    segments: usize,
    segment_size: usize,
    segment_count: usize,
    sections: usize,
    section_size: usize,
    section_count: usize,
    section_names: usize,
}

impl Header {
    fn of(bytes: &[u8]) -> Option<Self> {
        const CLASS_64: u8 = 2;
        const LITTLE_ENDIAN: u8 = 1;
        if !is_elf(bytes) || bytes.get(4) != Some(&CLASS_64) || bytes.get(5) != Some(&LITTLE_ENDIAN) {
            return None;
        }
        Some(Self {
            segments: number::<8>(bytes, 0x20)?,
            segment_size: number::<2>(bytes, 0x36)?,
            segment_count: number::<2>(bytes, 0x38)?,
            sections: number::<8>(bytes, 0x28)?,
            section_size: number::<2>(bytes, 0x3a)?,
            section_count: number::<2>(bytes, 0x3c)?,
            section_names: number::<2>(bytes, 0x3e)?,
        })
    }

    /// Offset of the header of section k.
    fn section(&self, k: usize) -> Option<usize> {
        self.sections.checked_add(k.checked_mul(self.section_size)?)
    }
}

/// Bytes of a section by name. Offsets after the ELF-64 specification, section header.
pub fn section<'a>(bytes: &'a [u8], name: &str) -> Option<&'a [u8]> {
    let header = Header::of(bytes)?;
    let content = |at: usize| {
        let (offset, size) =
            (number::<8>(bytes, at.checked_add(0x18)?)?, number::<8>(bytes, at.checked_add(0x20)?)?);
        bytes.get(offset..offset.checked_add(size)?)
    };
    let names = content(header.section(header.section_names)?)?;
    for k in 0..header.section_count {
        let at = header.section(k)?;
        let own = names.get(number::<4>(bytes, at)?..)?;
        if own.strip_prefix(name.as_bytes()).is_some_and(|rest| rest.first() == Some(&0)) {
            return content(at);
        }
    }
    None
}

/// Names of the functions and data that a library offers to others; None: it has no table of them. Weak symbols are
/// left out: compilers of C++ emit them for templates, and any definition will do.
pub fn exported_symbols(bytes: &[u8]) -> Option<Vec<String>> {
    const ENTRY: usize = 24;
    const MADE_BY_THE_LINKER: [&str; 5] = ["_init", "_fini", "__bss_start", "_edata", "_end"];
    let (table, names) = (section(bytes, ".dynsym")?, section(bytes, ".dynstr")?);
    let mut out = Vec::new();
    for symbol in table.chunks_exact(ENTRY) {
        let (binding, visibility) = (symbol[4] >> 4, symbol[5] & 3);
        let is_defined = number::<2>(symbol, 6)? != 0;
        let is_global = binding == 1 && (visibility == 0 || visibility == 3);
        if is_defined && is_global {
            let name = names.get(number::<4>(symbol, 0)?..)?.split(|b| *b == 0).next()?;
            out.push(String::from_utf8_lossy(name).into_owned());
        }
    }
    out.retain(|name| !MADE_BY_THE_LINKER.contains(&name.as_str()));
    Some(out)
}

/// Names of the symbols that a library imports, each with the place of the pointer to it, relative to where the
/// library is loaded.
pub fn imported_slots(bytes: &[u8]) -> Option<Vec<(String, usize)>> {
    const RELOCATION: usize = 24;
    const SYMBOL: usize = 24;
    // A pointer to a function by name: R_X86_64_64, GLOB_DAT, JUMP_SLOT; R_AARCH64_ABS64, GLOB_DAT, JUMP_SLOT.
    const POINTERS: [usize; 6] = [1, 6, 7, 257, 1025, 1026];
    let (table, names) = (section(bytes, ".dynsym")?, section(bytes, ".dynstr")?);
    let mut out = Vec::new();
    for relocations in [".rela.dyn", ".rela.plt"].into_iter().filter_map(|name| section(bytes, name)) {
        for one in relocations.chunks_exact(RELOCATION) {
            let (offset, kind, symbol) = (number::<8>(one, 0)?, number::<4>(one, 8)?, number::<4>(one, 12)?);
            if symbol == 0 || !POINTERS.contains(&kind) {
                continue;
            }
            let entry = table.get(symbol.checked_mul(SYMBOL)?..)?;
            let name = names.get(number::<4>(entry, 0)?..)?.split(|b| *b == 0).next()?;
            out.push((String::from_utf8_lossy(name).into_owned(), offset));
        }
    }
    Some(out)
}

/// A little-endian number of N ≤ 8 bytes.
fn number<const N: usize>(bytes: &[u8], at: usize) -> Option<usize> {
    let own = bytes.get(at..at.checked_add(N)?)?;
    let value = own.iter().rev().fold(0u64, |sum, b| sum << 8 | u64::from(*b));
    usize::try_from(value).ok()
}

/// The newest version of glibc that a library asks for, as `2.34`; none where it asks for none, as with another C library.
pub fn needed_glibc(bytes: &[u8]) -> Option<String> {
    let names = section(bytes, ".dynstr")?.split(|byte| *byte == 0);
    let minor = |name: &[u8]| -> Option<u32> {
        let version = std::str::from_utf8(name).ok()?.strip_prefix("GLIBC_2.")?;
        version.split('.').next()?.parse().ok()
    };
    names.filter_map(minor).max().map(|minor| format!("2.{minor}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_that_are_cut_have_no_sections() {
        let own = std::fs::read(std::env::current_exe().expect("own path")).expect("own file");
        assert!(section(&own, ".text").is_some_and(|s| !s.is_empty()));
        assert_eq!(section(&own, ".terraglue"), None);
        for length in [4, 0x3f, 0x40, 200] {
            assert_eq!(section(&own[..length], ".text"), None);
        }
        let needed = needed_length(&own).expect("an ELF file");
        assert!(needed <= own.len() && needed > own.len() / 2, "{needed} of {}", own.len());
        assert_eq!(needed_length(&own[..0x30]), None);
    }
}
