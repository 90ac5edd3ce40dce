//! An FMU on disk: its archive extracted into a folder of its own, its description read.

use crate::archive::{Archive, Limits};
use crate::binary::{self, Loaded};
use crate::description::{self, ModelDescription};
use crate::error::Result;
use crate::folder::Folder;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError, Weak};

/// A checked and extracted FMU. Its folder goes when the last instance and this handle are gone.
#[derive(Debug)]
pub struct Fmu {
    path: PathBuf,
    description: Arc<ModelDescription>,
    loaded: Mutex<Weak<Loaded>>,
    // After everything that may use the folder.
    folder: Folder,
}

impl Fmu {
    /// Checks, reads and extracts an FMU. None of its code runs.
    ///
    /// # Errors
    /// A fault of the archive or the description, with entry or line.
    pub fn open(path: &Path) -> Result<Arc<Self>> {
        Self::open_within(path, Limits::default())
    }

    /// The same with other limits.
    ///
    /// # Errors
    /// As [`Fmu::open`].
    pub fn open_within(path: &Path, limits: Limits) -> Result<Arc<Self>> {
        let mut archive = Archive::open(path, limits)?;
        let description = Self::describe(path, &mut archive)?;
        let folder = archive.unpack()?;
        let description = Arc::new(description);
        Ok(Arc::new(Self { path: path.into(), description, loaded: Mutex::default(), folder }))
    }

    /// Reads the description alone; nothing is written.
    ///
    /// # Errors
    /// As [`Fmu::open`].
    pub fn inspect(path: &Path) -> Result<(ModelDescription, Vec<String>)> {
        let mut archive = Archive::open(path, Limits::default())?;
        let description = Self::describe(path, &mut archive)?;
        let mut names: Vec<String> = archive.names().map(str::to_owned).collect();
        names.sort();
        Ok((description, names))
    }

    /// Why its library for this platform cannot be loaded, as far as the bytes show; none where they can be, or where there is none.
    ///
    /// # Errors
    /// [`Error::Archive`](crate::Error::Archive): it cannot be unpacked.
    pub fn library_defect(path: &Path, description: &ModelDescription) -> Result<Option<String>> {
        let entry = binary::library_entry(description);
        let bytes = Archive::open(path, Limits::default())?.bytes(&entry)?;
        let why = bytes.and_then(|bytes| binary::inspect(&bytes).err());
        Ok(why.map(|why| format!("`{entry}` cannot be loaded: {why}")))
    }

    fn describe(path: &Path, archive: &mut Archive) -> Result<ModelDescription> {
        let bytes = archive.text("modelDescription.xml")?.unwrap_or_default();
        let terminals = match archive.text("terminalsAndIcons/terminalsAndIcons.xml")? {
            None => archive.text("icons/terminalsAndIcons.xml")?,
            found => found,
        };
        description::read(path, &bytes, terminals.as_deref())
    }

    /// File that it came from.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Its description.
    pub fn description(&self) -> &Arc<ModelDescription> {
        &self.description
    }

    /// Folder that it was extracted into.
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// Its library, loaded at the first call and unloaded with the last instance.
    pub(crate) fn library(&self) -> Result<Arc<Loaded>> {
        let mut slot = self.loaded.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(loaded) = slot.upgrade() {
            return Ok(loaded);
        }
        let loaded = Arc::new(binary::load(&self.path, &self.description, self.folder())?);
        *slot = Arc::downgrade(&loaded);
        Ok(loaded)
    }
}
