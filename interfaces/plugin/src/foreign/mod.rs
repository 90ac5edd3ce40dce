//! The host's side of the border: a foreign table as a module that makes [`Subsystem`]s.

mod descriptions;
mod raw;
mod services;
mod sight;
mod subsystem;
mod values;

use crate::abi::*;
use crate::convert;
use crate::law::TableLaw;
use crate::text::{borrowed, c_string};
use std::mem::offset_of;
use std::sync::Arc;
use terraglue_subsystem::{Config, Error, Host, Kind, NodeLaw, Result, Schema};

pub use subsystem::ForeignSubsystem;

/// Why a table cannot be used. Found before any function of it is called.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum TableError {
    /// `terraglue_subsystem` returned null.
    Null,
    /// Too small to hold its own size and version.
    Truncated {
        /// Size that the table states, bytes.
        size: u32,
        /// Smallest size of this ABI, bytes.
        needed: u32,
    },
    /// Another major version.
    Version {
        /// Major and minor version of the module.
        found: [u32; 2],
    },
    /// A required function is null.
    Missing(&'static str),
    /// A kind that this host does not know.
    Kind(u32),
    /// A law without functions that can be used.
    Law(String),
}

impl std::fmt::Display for TableError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Null => write!(f, "`terraglue_subsystem` returned null instead of a table of functions"),
            Self::Truncated { size, needed } => {
                write!(
                    f,
                    "its table of functions has {size} bytes, ABI {TG_ABI_MAJOR} needs at least {needed}"
                )
            }
            Self::Version { found: [major, minor] } => write!(
                f,
                "it was built for ABI {major}.{minor}, this program speaks ABI {TG_ABI_MAJOR}.{TG_ABI_MINOR}; \
                 build the module again with the header or the crate of this version"
            ),
            Self::Missing(name) => write!(f, "the required function `{name}` of its table is null"),
            Self::Kind(kind) => write!(f, "its kind is the unknown number {kind}"),
            Self::Law(why) => f.write_str(why),
        }
    }
}

impl std::error::Error for TableError {}

/// A module behind a C table.
#[derive(Clone, Debug)]
pub struct ForeignModule {
    table: TgSubsystem,
    kind: Kind,
}

// SAFETY: a table is constant, and the functions before `instantiate` may be called from any thread.
unsafe impl Send for ForeignModule {}
// SAFETY: as above.
unsafe impl Sync for ForeignModule {}

impl ForeignModule {
    /// Checks size, version, required functions and kind, in this order, without calling anything.
    ///
    /// # Errors
    /// [`TableError`]: the first check that fails.
    ///
    /// # Safety
    /// `table` is null or points at a table that states its size truly and lives as long as the process, and
    /// its functions keep to the contract of `terraglue.h`.
    pub unsafe fn new(table: *const TgSubsystem) -> std::result::Result<Self, TableError> {
        const REQUIRED: u32 = offset_of!(TgSubsystem, set_ports) as u32;
        if table.is_null() {
            return Err(TableError::Null);
        }
        // SAFETY: size and versions come first in every version of the table.
        let (size, found) = unsafe { ((*table).size, [(*table).abi_major, (*table).abi_minor]) };
        if found[0] != TG_ABI_MAJOR {
            return Err(TableError::Version { found });
        }
        if size < REQUIRED {
            return Err(TableError::Truncated { size, needed: REQUIRED });
        }
        // SAFETY: `size` bytes may be read, and all zero is a valid table (null pointers).
        let table = unsafe {
            let mut whole: TgSubsystem = std::mem::zeroed();
            let bytes = (size as usize).min(size_of::<TgSubsystem>());
            std::ptr::copy_nonoverlapping(table.cast::<u8>(), (&raw mut whole).cast::<u8>(), bytes);
            whole
        };
        let is_law = table.kind == TG_LAW;
        for (name, missing) in [
            ("schema", table.schema.is_none()),
            ("instantiate", !is_law && table.instantiate.is_none()),
            ("free", !is_law && table.free.is_none()),
            ("capabilities", !is_law && table.capabilities.is_none()),
            ("advance", !is_law && table.advance.is_none()),
            ("last_error", !is_law && table.last_error.is_none()),
        ] {
            if missing {
                return Err(TableError::Missing(name));
            }
        }
        let kind = convert::kind(table.kind).ok_or(TableError::Kind(table.kind))?;
        if is_law {
            // SAFETY: the module keeps to the contract of its table.
            unsafe { TableLaw::new("", table.law, Vec::new()) }.map_err(TableError::Law)?;
        }
        Ok(Self { table, kind })
    }

    /// Kind of the instances.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// Asks the module for its schema.
    ///
    /// # Errors
    /// [`Error::Failed`]: the module gives none, it cannot be read, or it names another kind than the table.
    pub fn schema(&self) -> Result<Schema> {
        let schema = self.table.schema.ok_or(Error::Unsupported)?;
        // SAFETY: a required function, checked in `new`; the text is constant.
        let json = unsafe { schema() };
        if json.is_null() {
            return Err(Error::Failed(self.failure()));
        }
        // SAFETY: not null, zero-terminated by contract.
        let json = unsafe { borrowed(json)? };
        let schema: Schema = serde_json::from_str(json)
            .map_err(|e| Error::Failed(format!("its schema is not what terraglue.h asks for: {e}")))?;
        if schema.kind == self.kind {
            return Ok(schema);
        }
        Err(Error::Failed(format!(
            "its schema says {:?} and its table {:?}; both must name the same kind",
            schema.kind, self.kind
        )))
    }

    /// A law with these numbers, in the order of its schema.
    ///
    /// # Errors
    /// [`Error::Failed`]: the table has no law that can be used.
    pub fn law(&self, name: &str, numbers: Vec<f64>) -> Result<Arc<dyn NodeLaw>> {
        // SAFETY: the table was checked in `new` and lives as long as the process.
        let law = unsafe { TableLaw::new(name, self.table.law, numbers) };
        law.map(|law| Arc::new(law) as Arc<dyn NodeLaw>).map_err(Error::Failed)
    }

    /// Makes an instance; `config` is complete (`Config::with_defaults`).
    ///
    /// # Errors
    /// Errors of the module. [`Error::Refused`]: it is a law. [`Error::Fatal`]: it reports success and made no
    /// instance.
    pub fn instantiate(&self, config: &Config, host: Arc<dyn Host>) -> Result<ForeignSubsystem> {
        let Some(instantiate) = self.table.instantiate else {
            let text = "it is a law, not a subsystem: name it in `[soil.law] plugin` of a soil";
            return Err(Error::Refused(text.into()));
        };
        let services = services::Services::new(host);
        let config = c_string(&config.to_json());
        let mut instance = std::ptr::null_mut();
        // SAFETY: a required function; services are boxed and live as long as the instance.
        let status = unsafe { instantiate(services.table(), config.as_ptr(), &raw mut instance) };
        services.close_terrain();
        if status != TG_OK {
            return Err(convert::error(status, services.said(self.failure()), f64::NAN));
        }
        if instance.is_null() {
            return Err(Error::Fatal("answered TG_OK but made no instance".into()));
        }
        ForeignSubsystem::new(self.table, instance, services)
    }

    /// Why the last call without an instance failed.
    fn failure(&self) -> String {
        // SAFETY: a required function; null asks for the failure of this thread.
        let text = self.table.last_error.map(|f| unsafe { borrowed(f(std::ptr::null_mut())) });
        match text {
            Some(Ok(text)) if !text.is_empty() => text.to_owned(),
            Some(Err(error)) => error.to_string(),
            _ => "no reason given".to_owned(),
        }
    }
}
