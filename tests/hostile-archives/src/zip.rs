//! Writes zip archives byte by byte, so that every field can hold a wrong value.

use flate2::{Compress, Compression, Crc, FlushCompress, Status};

/// How the bytes of an entry are kept.
const STORED: u16 = 0;
const DEFLATED: u16 = 8;
/// Version of the format that is needed to extract it.
const VERSION: u16 = 20;
/// Made on Unix: the upper half of the attributes is the mode.
const MADE_BY: u16 = 3 << 8 | VERSION;

/// An entry, with all fields of its headers.
#[derive(Clone, Debug)]
pub struct Entry {
    pub name: Vec<u8>,
    pub packed: Vec<u8>,
    pub size: u32,
    pub crc: u32,
    pub method: u16,
    pub flags: u16,
    pub mode: u32,
    /// Whether it claims the bytes of the entry before it.
    pub shared: bool,
}

impl Entry {
    /// A file as it should be.
    pub fn file(name: &str, bytes: &[u8]) -> Self {
        let mut crc = Crc::new();
        crc.update(bytes);
        Self {
            name: name.into(),
            packed: deflated(bytes),
            size: length(bytes.len()),
            crc: crc.sum(),
            method: DEFLATED,
            flags: 0,
            mode: 0o100_644,
            shared: false,
        }
    }

    /// A file of `size` times the same byte, which takes a thousandth of it; its check sum is wrong.
    pub fn blown_up(name: &str, byte: u8, size: u32) -> Self {
        let (block, closing) = (repeatable(byte), [3, 0]);
        let blocks = (size as usize).div_ceil(BLOCK);
        let packed = block.iter().copied().cycle().take(block.len() * blocks).chain(closing).collect();
        Self { packed, size: length(blocks * BLOCK), ..Self::file(name, b"") }
    }

    pub fn with(mut self, change: impl FnOnce(&mut Self)) -> Self {
        change(&mut self);
        self
    }
}

fn length(n: usize) -> u32 {
    u32::try_from(n).unwrap_or(u32::MAX)
}

fn deflated(bytes: &[u8]) -> Vec<u8> {
    let mut out = Vec::with_capacity(bytes.len() + 64 + bytes.len() / 1000);
    pack(&mut Compress::new(Compression::default(), false), bytes, &mut out, FlushCompress::Finish);
    out
}

/// Bytes of a block that can follow itself.
const BLOCK: usize = 1 << 20;

fn repeatable(byte: u8) -> Vec<u8> {
    let mut out = Vec::with_capacity(BLOCK);
    let (mut compress, bytes) = (Compress::new(Compression::best(), false), vec![byte; BLOCK]);
    pack(&mut compress, &bytes, &mut out, FlushCompress::Full);
    out
}

/// The output has room for all, so that one call does it.
fn pack(compress: &mut Compress, bytes: &[u8], out: &mut Vec<u8>, flush: FlushCompress) {
    let done = compress.compress_vec(bytes, out, flush);
    assert!(matches!(done, Ok(Status::Ok | Status::StreamEnd)), "{done:?}");
}

/// The archive of these entries.
pub fn archive(entries: &[Entry]) -> Vec<u8> {
    let (mut out, mut directory, mut at) = (Vec::new(), Vec::new(), 0);
    for entry in entries {
        if !entry.shared {
            at = length(out.len());
            out.extend(b"PK\x03\x04");
            head(entry, &mut out);
            out.extend(&entry.name);
            out.extend(&entry.packed);
        }
        directory.extend(b"PK\x01\x02");
        directory.extend(MADE_BY.to_le_bytes());
        head(entry, &mut directory);
        // comment, disk, internal attributes
        directory.extend([0; 6]);
        directory.extend((entry.mode << 16).to_le_bytes());
        directory.extend(at.to_le_bytes());
        directory.extend(&entry.name);
    }
    let (start, count) = (length(out.len()), u16::try_from(entries.len()).unwrap_or(u16::MAX));
    out.extend(&directory);
    out.extend(b"PK\x05\x06\0\0\0\0");
    out.extend([count.to_le_bytes(), count.to_le_bytes()].concat());
    out.extend(length(directory.len()).to_le_bytes());
    out.extend(start.to_le_bytes());
    out.extend([0; 2]);
    out
}

/// The common part of both headers of an entry.
fn head(entry: &Entry, out: &mut Vec<u8>) {
    for field in [VERSION, entry.flags, entry.method, 0, 0x21] {
        out.extend(field.to_le_bytes());
    }
    let packed = length(entry.packed.len());
    for field in [entry.crc, packed, entry.size] {
        out.extend(field.to_le_bytes());
    }
    let name = u16::try_from(entry.name.len()).unwrap_or(u16::MAX);
    out.extend([name, 0].map(u16::to_le_bytes).concat());
}

/// A file that is not compressed.
pub fn stored(name: &str, bytes: &[u8]) -> Entry {
    Entry { method: STORED, packed: bytes.to_vec(), ..Entry::file(name, bytes) }
}
