//! Checks the archive of an FMU before anything of it is written, and extracts it.
//!
//! An FMU is foreign: names that lead out of the folder, links, devices, bombs and lies about sizes are refused
//! with the name of the entry. Sizes are counted while reading, whatever the archive declares.

use crate::error::{Error, Result};
use crate::folder::Folder;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use zip::ZipArchive;
use zip::read::ZipFile;
use zip::result::ZipError;

/// How much an archive may hold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// Entries.
    pub entries: usize,
    /// All files together, bytes.
    pub total: u64,
    /// `modelDescription.xml`, bytes.
    pub description: u64,
    /// Smallest share of their extracted size that large files take in the archive.
    pub ratio: f64,
}

impl Default for Limits {
    fn default() -> Self {
        Self { entries: 100_000, total: 4 << 30, description: 256 << 20, ratio: 1.0 / 200.0 }
    }
}

/// Up to this size nothing counts as a bomb: tables of one number may shrink to a thousandth.
const SMALL: u64 = 256 << 20;

/// A zip archive that was checked as a whole.
pub struct Archive {
    path: PathBuf,
    /// File that must lie at its top, and the name of that kind of archive.
    top: [&'static str; 2],
    zip: ZipArchive<File>,
    limits: Limits,
}

impl Archive {
    /// Opens the archive of an FMU and checks the names, kinds and stated sizes of all entries.
    pub fn open(path: &Path, limits: Limits) -> Result<Self> {
        Self::open_with(path, limits, ["modelDescription.xml", "FMU"])
    }

    /// The same for another kind of archive: the file that must lie at its top, and the name of the kind.
    pub fn open_with(path: &Path, limits: Limits, top: [&'static str; 2]) -> Result<Self> {
        let fail = |message: String| Error::Archive { path: path.into(), entry: None, message };
        let meta = std::fs::metadata(path).map_err(|e| fail(format!("cannot be read: {e}")))?;
        if !meta.is_file() {
            return Err(fail("is not a file".into()));
        }
        let mut file =
            terraglue_subsystem::files::open(path).map_err(|e| fail(format!("cannot be read: {e}")))?;
        let stated = stated_entries(&mut file).map_err(|e| fail(format!("cannot be read: {e}")))?;
        if let Some(n) = stated.filter(|n| *n > limits.entries as u64) {
            return Err(fail(format!("has {n} entries; {} are accepted", limits.entries)));
        }
        let twins = twins_are_equal(&mut file).map_err(|e| fail(format!("cannot be read: {e}")))?;
        let zip = ZipArchive::new(file).map_err(|e| {
            fail(match e {
                ZipError::InvalidArchive(_) => "is no zip archive, as FMUs are, or was cut off".into(),
                other => format!("is no readable zip archive: {other}"),
            })
        })?;
        if let Some(n) = stated.filter(|n| *n != zip.len() as u64 && !twins) {
            let found = zip.len();
            return Err(fail(format!(
                "states {n} entries but has {found} different names: one occurs twice"
            )));
        }
        let mut archive = Self { path: path.into(), top, zip, limits };
        archive.check()?;
        Ok(archive)
    }

    fn fail(&self, entry: &str, message: impl Into<String>) -> Error {
        Error::Archive { path: self.path.clone(), entry: Some(printable(entry)), message: message.into() }
    }

    fn check(&mut self) -> Result {
        let mut kinds: BTreeMap<String, bool> = BTreeMap::new();
        let (mut total, mut packed) = (0_u64, 0_u64);
        let length = std::fs::metadata(&self.path).map_or(u64::MAX, |m| m.len());
        for k in 0..self.zip.len() {
            let raw = self.zip.by_index_raw(k);
            let facts = raw.map(|e| Facts::of(&e)).map_err(|e| Error::Archive {
                path: self.path.clone(),
                entry: self.zip.name_for_index(k).map(printable),
                message: format!("cannot be read: {e}"),
            })?;
            let parts = self.check_entry(&facts)?;
            total = total.saturating_add(facts.size);
            packed = packed.saturating_add(facts.packed);
            if packed > length {
                return Err(self.fail(&facts.name, "shares its bytes with other entries: a bomb"));
            }
            if let Some(bomb) = self.bomb(packed, total) {
                return Err(self.fail(&facts.name, bomb));
            }
            if total > self.limits.total {
                return Err(self.fail(&facts.name, too_large(self.limits.total)));
            }
            self.check_clash(&facts, &parts, &mut kinds)?;
        }
        let [file, kind] = self.top;
        if !kinds.contains_key(file) {
            let message = format!("has no {file} at its top: it is no {kind}");
            return Err(Error::Archive { path: self.path.clone(), entry: None, message });
        }
        Ok(())
    }

    /// Parts of the name of an entry that may be extracted.
    fn check_entry(&self, facts: &Facts) -> Result<Vec<String>> {
        if facts.encrypted {
            return Err(self.fail(&facts.name, "is encrypted"));
        }
        if !facts.known_method {
            return Err(self.fail(&facts.name, "is compressed by a method other than store and deflate"));
        }
        let parts = safe_parts(&facts.name).map_err(|why| self.fail(&facts.name, why))?;
        match facts.file_type {
            None | Some(0o100_000 | 0o040_000 | 0) => {}
            Some(0o120_000) => return Err(self.fail(&facts.name, "is a symbolic link")),
            Some(_) => return Err(self.fail(&facts.name, "is neither a file nor a folder")),
        }
        Ok(parts)
    }

    /// The complaint about an entry, or files up to it, with too few `packed` bytes for `size`; none: no bomb.
    fn bomb(&self, packed: u64, size: u64) -> Option<String> {
        let blown_up = size > SMALL && (packed as f64) < size as f64 * self.limits.ratio;
        blown_up.then(|| format!("brings {packed} bytes to the claim to hold {size}: a bomb"))
    }

    /// A name may stand for one thing only: no file that is a folder too.
    fn check_clash(&self, facts: &Facts, parts: &[String], kinds: &mut BTreeMap<String, bool>) -> Result {
        let mut below = String::new();
        for (k, part) in parts.iter().enumerate() {
            if k > 0 {
                below.push('/');
            }
            below.push_str(part);
            let is_folder = k + 1 < parts.len() || facts.is_folder;
            match kinds.insert(below.clone(), is_folder) {
                Some(before) if before != is_folder => {
                    return Err(self.fail(&facts.name, format!("`{below}` is a file and a folder")));
                }
                Some(false) => return Err(self.fail(&facts.name, "occurs twice")),
                _ => {}
            }
        }
        Ok(())
    }

    /// Text of `modelDescription.xml` or another file at the top.
    pub fn text(&mut self, name: &str) -> Result<Option<Vec<u8>>> {
        self.read(name, self.limits.description)
    }

    /// The bytes of an entry that is no longer than all together may be; none where there is no such entry.
    ///
    /// # Errors
    /// [`Error::Archive`]: damaged, or too large.
    pub fn bytes(&mut self, name: &str) -> Result<Option<Vec<u8>>> {
        self.read(name, self.limits.total)
    }

    fn read(&mut self, name: &str, limit: u64) -> Result<Option<Vec<u8>>> {
        let (path, entry) = (self.path.clone(), Some(name.to_owned()));
        let fail = |message: String| Error::Archive { path: path.clone(), entry: entry.clone(), message };
        let file = match self.zip.by_name(name) {
            Ok(file) => file,
            Err(zip::result::ZipError::FileNotFound) => return Ok(None),
            Err(e) => return Err(fail(format!("cannot be read: {e}"))),
        };
        let mut bytes = Vec::new();
        file.take(limit + 1).read_to_end(&mut bytes).map_err(|e| fail(format!("cannot be unpacked: {e}")))?;
        if bytes.len() as u64 > limit {
            return Err(fail(too_large(limit)));
        }
        Ok(Some(bytes))
    }

    /// Names of all entries.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.zip.file_names()
    }

    /// Writes all files into a new temporary folder, which goes when it is dropped.
    pub fn unpack(&mut self) -> Result<Folder> {
        let folder = Folder::new("fmu").map_err(|e| Error::Archive {
            path: self.path.clone(),
            entry: None,
            message: format!("no temporary folder can be made: {e}"),
        })?;
        self.extract(folder.path())?;
        Ok(folder)
    }

    fn extract(&mut self, folder: &Path) -> Result {
        let mut left = self.limits.total;
        for k in 0..self.zip.len() {
            let path = self.path.clone();
            let name = self.zip.name_for_index(k).unwrap_or_default().to_owned();
            let fail = |message: String| Error::Archive {
                path: path.clone(),
                entry: Some(printable(&name)),
                message,
            };
            let mut file = self.zip.by_index(k).map_err(|e| fail(format!("cannot be read: {e}")))?;
            let parts = safe_parts(&name).map_err(&fail)?;
            let target = parts.iter().fold(folder.to_path_buf(), |p, part| p.join(part));
            let written = write_entry(&mut file, &target, left).map_err(&fail)?;
            left -= written;
        }
        Ok(())
    }
}

/// Writes one entry, at most `left` bytes; answers how many there were.
fn write_entry(file: &mut ZipFile<'_, File>, target: &Path, left: u64) -> std::result::Result<u64, String> {
    let io = |e: std::io::Error| format!("cannot be extracted to {}: {e}", target.display());
    if file.is_dir() {
        return std::fs::create_dir_all(target).map(|()| 0).map_err(io);
    }
    if let Some(parent) = target.parent() {
        std::fs::create_dir_all(parent).map_err(io)?;
    }
    let mut out = File::create_new(target).map_err(io)?;
    let stated = file.size();
    let mut buffer = [0_u8; 1 << 16];
    let mut written = 0_u64;
    loop {
        let n = file.read(&mut buffer).map_err(|e| format!("cannot be unpacked: {e}"))?;
        if n == 0 {
            break;
        }
        written += n as u64;
        if written > stated {
            return Err(format!("holds more than the {stated} bytes that it states"));
        }
        if written > left {
            return Err("makes the archive larger than is accepted".into());
        }
        out.write_all(&buffer[..n]).map_err(io)?;
    }
    if written != stated {
        return Err(format!("holds {written} bytes but states {stated}"));
    }
    Ok(written)
}

/// An entry as the archive declares it.
struct Facts {
    name: String,
    size: u64,
    packed: u64,
    is_folder: bool,
    encrypted: bool,
    known_method: bool,
    file_type: Option<u32>,
}

impl Facts {
    fn of(entry: &ZipFile<'_, File>) -> Self {
        let known = [zip::CompressionMethod::Stored, zip::CompressionMethod::Deflated];
        Self {
            name: entry.name().to_owned(),
            size: entry.size(),
            packed: entry.compressed_size(),
            is_folder: entry.is_dir(),
            encrypted: entry.encrypted(),
            known_method: known.contains(&entry.compression()),
            file_type: entry.unix_mode().map(|m| m & 0o170_000),
        }
    }
}

/// The parts of a relative name that stays below its folder.
fn safe_parts(name: &str) -> std::result::Result<Vec<String>, String> {
    if name.is_empty() || name.contains('\0') {
        return Err("has no usable name".into());
    }
    if name.starts_with('/') || name.starts_with('\\') || name.as_bytes().get(1) == Some(&b':') {
        return Err("has an absolute path".into());
    }
    let parts: Vec<&str> = name.split(['/', '\\']).filter(|p| !p.is_empty() && *p != ".").collect();
    if parts.contains(&"..") {
        return Err("leads out of the folder of the FMU".into());
    }
    // `./` names the folder of the FMU itself
    if parts.is_empty() && !name.ends_with('/') || parts.iter().any(|p| p.len() > 255) || parts.len() > 64 {
        return Err("has no usable name".into());
    }
    Ok(parts.into_iter().map(str::to_owned).collect())
}

fn too_large(limit: u64) -> String {
    format!("makes more than {limit} bytes, which is not accepted")
}

/// A name without control characters, for messages.
fn printable(name: &str) -> String {
    name.chars().take(200).map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect()
}

/// Number of entries that the end record states; none: zip64, or no such record.
fn stated_entries(file: &mut File) -> std::io::Result<Option<u64>> {
    let count = end_record(file)?.map(|r| u16::from_le_bytes([r[10], r[11]]));
    Ok(count.filter(|n| *n != u16::MAX).map(u64::from))
}

/// Whether every name that the directory lists twice stands for the same content both times: some build tools add a
/// file again. Anything odd is no.
fn twins_are_equal(file: &mut File) -> std::io::Result<bool> {
    const HEADER: usize = 46;
    let Some(end) = end_record(file)? else { return Ok(false) };
    let word = |bytes: &[u8], at: usize| {
        u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
    };
    let (size, start) = (word(&end, 12), word(&end, 16));
    file.seek(SeekFrom::Start(u64::from(start)))?;
    let mut directory = Vec::new();
    file.take(u64::from(size)).read_to_end(&mut directory)?;
    file.seek(SeekFrom::Start(0))?;
    let mut seen: BTreeMap<&[u8], [u32; 2]> = BTreeMap::new();
    let mut rest = directory.as_slice();
    while rest.len() >= HEADER && rest.starts_with(b"PK\x01\x02") {
        let length = |at: usize| usize::from(u16::from_le_bytes([rest[at], rest[at + 1]]));
        let (name, all) = (length(28), HEADER + length(28) + length(30) + length(32));
        let (Some(name), Some(next)) = (rest.get(HEADER..HEADER + name), rest.get(all..)) else {
            return Ok(false);
        };
        let content = [word(rest, 16), word(rest, 24)];
        if seen.insert(name, content).is_some_and(|before| before != content) {
            return Ok(false);
        }
        rest = next;
    }
    Ok(rest.is_empty())
}

/// The end record of an archive.
fn end_record(file: &mut File) -> std::io::Result<Option<[u8; 22]>> {
    const RECORD: usize = 22;
    let length = file.seek(SeekFrom::End(0))?;
    let tail = length.min((RECORD + 0xffff) as u64);
    file.seek(SeekFrom::Start(length - tail))?;
    let mut bytes = Vec::new();
    file.take(tail).read_to_end(&mut bytes)?;
    file.seek(SeekFrom::Start(0))?;
    let starts = (0..(bytes.len() + 1).saturating_sub(RECORD)).rev();
    let mut records = starts.filter_map(|k| bytes[k..k + RECORD].try_into().ok());
    Ok(records.find(|r: &[u8; RECORD]| r.starts_with(b"PK\x05\x06")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_lead_elsewhere_are_refused() {
        for bad in ["../x", "a/../../x", "/etc/passwd", "C:\\x", "\\x", "a\\..\\..\\x", "", "a\0b"] {
            assert!(safe_parts(bad).is_err(), "{bad:?}");
        }
        assert_eq!(safe_parts("./a//b/").expect("good"), ["a", "b"]);
    }
}
