//! System structures (SSP 1.0, Modelica Association): FMUs, how they are connected, and their parameters.
//!
//! [`Package::open`] reads an archive (`.ssp`) through the same checks as one of an FMU, or a description beside its
//! files (`.ssd`). None of the code of its FMUs runs. Features that this reader does not know are refused by name,
//! such as packages inside packages.

mod context;
mod model;
mod parameters;
mod structure;
mod transformation;
mod write;

pub use model::*;
pub use write::{NewComponent, NewConnection, describe};

use crate::archive::{Archive, Limits};
use crate::error::{Error, Result};
use crate::folder::Folder;
use std::path::{Component as Part, Path, PathBuf};

/// Name of the description in an archive.
const DESCRIPTION: &str = "SystemStructure.ssd";

/// A system structure with the files that belong to it; an extracted archive goes with it.
#[derive(Debug)]
pub struct Package {
    path: PathBuf,
    structure: Structure,
    base: PathBuf,
    // Of an archive.
    _folder: Option<Folder>,
}

impl Package {
    /// Whether a file is named like a system structure.
    pub fn is_one(path: &Path) -> bool {
        path.extension().is_some_and(|e| e.eq_ignore_ascii_case("ssp") || e.eq_ignore_ascii_case("ssd"))
    }

    /// Checks, extracts and reads a system structure.
    ///
    /// # Errors
    /// A fault of the archive or the description, with entry or line.
    pub fn open(path: &Path) -> Result<Self> {
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("ssd")) {
            let base = match path.parent() {
                Some(folder) if !folder.as_os_str().is_empty() => folder.to_owned(),
                _ => PathBuf::from("."),
            };
            let files = Files { path, base: &base };
            let structure = structure::read(&files, &files.bytes_of(path)?, "SystemStructure.ssd")?;
            return Ok(Self { path: path.into(), structure, base, _folder: None });
        }
        let mut archive = Archive::open_with(path, Limits::default(), [DESCRIPTION, "SSP"])?;
        let folder = archive.unpack()?;
        let base = folder.path().to_owned();
        let files = Files { path, base: &base };
        let structure = structure::read(&files, &files.bytes(DESCRIPTION)?, DESCRIPTION)?;
        Ok(Self { path: path.into(), structure, base, _folder: Some(folder) })
    }

    /// File that it came from.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Its system structure.
    pub fn structure(&self) -> &Structure {
        &self.structure
    }

    /// Folder that its files are relative to.
    pub fn folder(&self) -> &Path {
        &self.base
    }

    /// Whether its files lie in a temporary folder.
    pub fn is_archive(&self) -> bool {
        self._folder.is_some()
    }
}

/// The files of a structure.
struct Files<'a> {
    path: &'a Path,
    base: &'a Path,
}

impl Files<'_> {
    fn fail(&self, entry: &str, message: String) -> Error {
        Error::Archive { path: self.path.into(), entry: Some(entry.into()), message }
    }

    /// A file by its relative URI.
    fn bytes(&self, source: &str) -> Result<Vec<u8>> {
        let name = relative(source).map_err(|why| self.fail(source, why))?;
        self.bytes_of(&self.base.join(name))
    }

    fn bytes_of(&self, path: &Path) -> Result<Vec<u8>> {
        let limit = Limits::default().description;
        let fail = |message: String| self.fail(&path.display().to_string(), message);
        let meta = std::fs::metadata(path).map_err(|e| fail(format!("cannot be read: {e}")))?;
        if meta.len() > limit || !meta.is_file() {
            return Err(fail(format!("is no file of at most {limit} bytes")));
        }
        std::fs::read(path).map_err(|e| fail(format!("cannot be read: {e}")))
    }
}

/// A relative URI as a path that does not lead out of its folder.
pub(crate) fn relative(source: &str) -> std::result::Result<PathBuf, String> {
    let refuse = |why: &str| Err(format!("{why}; files of a structure lie beside it or below"));
    let mut bytes = Vec::new();
    let mut rest = source.bytes();
    while let Some(byte) = rest.next() {
        if byte != b'%' {
            bytes.push(byte);
            continue;
        }
        let digits: Vec<u8> = rest.by_ref().take(2).collect();
        let code = std::str::from_utf8(&digits).ok().and_then(|d| u8::from_str_radix(d, 16).ok());
        let Some(code) = code.filter(|_| digits.len() == 2) else { return refuse("is no URI") };
        bytes.push(code);
    }
    let Ok(text) = String::from_utf8(bytes) else { return refuse("is not UTF-8") };
    if text.contains(':') || text.contains('\\') || text.contains('\0') || text.is_empty() {
        return refuse("is no relative URI");
    }
    let path = PathBuf::from(&text);
    match path.components().all(|part| matches!(part, Part::Normal(_) | Part::CurDir)) {
        true => Ok(path),
        false => refuse("leads out of the folder"),
    }
}

#[cfg(test)]
mod tests {
    use super::relative;

    #[test]
    fn a_source_stays_below_its_folder() {
        for bad in
            ["../a.fmu", "a/../../b", "/etc/passwd", "file:///a.fmu", "%2e%2e/a", "a\\b", "", "%2", "%zz"]
        {
            assert!(relative(bad).is_err(), "{bad:?}");
        }
        assert_eq!(relative("resources/my%20unit.fmu"), Ok("resources/my unit.fmu".into()));
    }
}
