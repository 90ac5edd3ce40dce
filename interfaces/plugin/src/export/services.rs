//! The host as a Rust module sees it: [`Host`] on top of the host's table.

use crate::abi::*;
use crate::law::TableLaw;
use crate::text::{borrowed, c_string};
use std::any::Any;
use std::ffi::c_void;
use std::mem::offset_of;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Arc;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use terraglue_subsystem::{Error, Host, LogLevel, NodeLaw, Result, Terrain, TerrainTile};

/// Services behind a table of a foreign host.
pub(super) struct ForeignHost {
    raw: TgHost,
    name: String,
    folder: String,
    terrain: Option<ForeignTerrain>,
    law: Option<Arc<dyn NodeLaw>>,
    terrain_open: AtomicBool,
}

// SAFETY: by the ABI the host's functions may be called from any thread while the instance lives.
unsafe impl Send for ForeignHost {}
// SAFETY: as above.
unsafe impl Sync for ForeignHost {}

impl ForeignHost {
    /// # Safety
    /// `host` points at a table of `size` bytes that stays valid as long as the instance, its terrain until
    /// [`Self::close_terrain`].
    pub(super) unsafe fn new(host: *const TgHost) -> Result<Self> {
        if host.is_null() {
            return Err(Error::Fatal("the host passed no table of services".into()));
        }
        // SAFETY: size and versions are the first fields of every version.
        let (size, major) = unsafe { ((*host).size as usize, (*host).abi_major) };
        // functions of later minors may be missing
        const FIRST: usize = offset_of!(TgHost, law);
        if major != TG_ABI_MAJOR || size < FIRST {
            return Err(Error::Fatal(format!(
                "the host speaks ABI {major} with a table of {size} bytes; this module needs ABI \
                 {TG_ABI_MAJOR} and at least {FIRST} bytes"
            )));
        }
        // SAFETY: `size` bytes may be read, and zero means null; texts, terrain and law by the contract.
        unsafe {
            let mut raw: TgHost = std::mem::zeroed();
            let bytes = size.min(size_of::<TgHost>());
            std::ptr::copy_nonoverlapping(host.cast::<u8>(), (&raw mut raw).cast::<u8>(), bytes);
            let law = TableLaw::of_host(raw.law);
            let terrain = raw.terrain.as_ref().map(|t| ForeignTerrain(*t));
            let (name, folder) = (borrowed(raw.name)?.to_owned(), borrowed(raw.folder)?.to_owned());
            Ok(Self { raw, name, folder, terrain, law, terrain_open: AtomicBool::new(true) })
        }
    }

    /// The terrain may be read during `instantiate` only.
    pub(super) fn close_terrain(&self) {
        self.terrain_open.store(false, Ordering::Relaxed);
    }
}

impl Host for ForeignHost {
    fn name(&self) -> &str {
        &self.name
    }

    fn log(&self, level: LogLevel, text: &str) {
        if let Some(log) = self.raw.log {
            // SAFETY: the host's function with the host's context and a text for this call.
            unsafe { log(self.raw.ctx, level as i32, c_string(text).as_ptr()) }
        }
    }

    fn parallel_for(&self, n: usize, job: &(dyn Fn(usize) + Sync)) {
        let Some(parallel_for) = self.raw.parallel_for else {
            return (0..n).for_each(job);
        };
        let loop_ = Loop { job, panicked: Mutex::new(None) };
        let arg = (&raw const loop_).cast_mut().cast::<c_void>();
        // SAFETY: `loop_` outlives the call, and the host does not return before all jobs are done.
        let status = unsafe { parallel_for(self.raw.ctx, n, Some(run_job), arg) };
        if let Ok(Some(payload)) = loop_.panicked.into_inner() {
            resume_unwind(payload);
        }
        assert!(status == TG_OK, "the host's parallel_for failed with status {status}");
    }

    fn cancelled(&self) -> bool {
        // SAFETY: the host's function with the host's context.
        self.raw.cancelled.is_some_and(|f| unsafe { f(self.raw.ctx) } != 0)
    }

    fn seed(&self) -> u64 {
        self.raw.seed
    }

    fn folder(&self) -> &str {
        &self.folder
    }

    fn slots(&self) -> u32 {
        self.raw.slots
    }

    fn max_nodes(&self) -> u32 {
        self.raw.max_nodes
    }

    fn gravity(&self) -> [f64; 3] {
        self.raw.gravity
    }

    fn terrain(&self) -> Option<&dyn Terrain> {
        let open = self.terrain_open.load(Ordering::Relaxed);
        self.terrain.as_ref().filter(|_| open).map(|t| t as &dyn Terrain)
    }

    fn law(&self) -> Option<Arc<dyn NodeLaw>> {
        self.law.clone()
    }
}

/// A parallel loop in flight: a panic of a job is kept here and goes on in the caller.
struct Loop<'a> {
    job: &'a (dyn Fn(usize) + Sync),
    panicked: Mutex<Option<Box<dyn Any + Send>>>,
}

unsafe extern "C" fn run_job(arg: *mut c_void, index: usize) {
    // SAFETY: `arg` is the Loop of `parallel_for`, which waits for all jobs.
    let loop_ = unsafe { &*arg.cast::<Loop>() };
    if let Err(payload) = catch_unwind(AssertUnwindSafe(|| (loop_.job)(index)))
        && let Ok(mut first) = loop_.panicked.lock()
    {
        first.get_or_insert(payload);
    }
}

/// The host's terrain.
struct ForeignTerrain(TgTerrain);

// SAFETY: by the ABI the host's functions may be called from any thread during `instantiate`.
unsafe impl Send for ForeignTerrain {}
// SAFETY: as above.
unsafe impl Sync for ForeignTerrain {}

impl Terrain for ForeignTerrain {
    fn origin(&self) -> [f64; 2] {
        self.0.origin
    }

    fn spacing(&self) -> f64 {
        self.0.spacing
    }

    fn size(&self) -> [u32; 2] {
        self.0.size
    }

    fn heights(&self, i0: i64, j0: i64, ni: usize, nj: usize, out: &mut [f64]) -> TerrainTile {
        assert!(out.len() >= ni * nj, "room for {} heights, {} asked for", out.len(), ni * nj);
        // SAFETY: room for ni * nj values was checked.
        let status = self.0.heights.map(|f| unsafe { f(self.0.ctx, i0, j0, ni, nj, out.as_mut_ptr()) });
        match status {
            Some(0) => TerrainTile::Varied,
            Some(1) => TerrainTile::Uniform(out.first().copied().unwrap_or(0.0)),
            other => panic!("the host's terrain failed with status {other:?}"),
        }
    }
}
