//! The host's table of services on top of a Rust [`Host`].

use crate::abi::*;
use crate::convert;
use crate::hosted_law::HostedLaw;
use crate::law::TableLaw;
use crate::text::{borrowed, c_string, panic_text, slice_mut};
use std::ffi::{CString, c_char, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use terraglue_subsystem::{Host, LogLevel, NodeLaw, TerrainTile};

/// The services of one instance. Boxed: the table points at it.
pub(super) struct Services {
    host: Arc<dyn Host>,
    terrain_open: AtomicBool,
    _name: CString,
    _folder: CString,
    terrain: TgTerrain,
    _law: Option<Arc<dyn NodeLaw>>,
    hosted_law: Option<HostedLaw>,
    open_law: Option<TgOpenLaw>,
    table: TgHost,
}

impl Services {
    pub(super) fn new(host: Arc<dyn Host>) -> Box<Self> {
        let (name, folder) = (c_string(host.name()), c_string(host.folder()));
        let terrain = host.terrain();
        let terrain = TgTerrain {
            origin: terrain.map_or([0.0; 2], |t| t.origin()),
            spacing: terrain.map_or(0.0, |t| t.spacing()),
            size: terrain.map_or([0; 2], |t| t.size()),
            ctx: std::ptr::null_mut(),
            heights: Some(heights),
        };
        let table = TgHost {
            size: size_of::<TgHost>() as u32,
            abi_major: TG_ABI_MAJOR,
            abi_minor: TG_ABI_MINOR,
            slots: host.slots(),
            ctx: std::ptr::null_mut(),
            log: Some(log),
            parallel_for: Some(parallel_for),
            cancelled: Some(cancelled),
            seed: host.seed(),
            name: name.as_ptr(),
            folder: folder.as_ptr(),
            gravity: host.gravity(),
            terrain: std::ptr::null(),
            max_nodes: host.max_nodes(),
            reserved: 0,
            law: std::ptr::null(),
        };
        let law = host.law();
        let own = law.as_ref().and_then(|law| law.as_any().downcast_ref()).map(TableLaw::open);
        let hosted_law = law.clone().filter(|_| own.is_none()).and_then(HostedLaw::new);
        let open_law = own.or_else(|| hosted_law.as_ref().map(HostedLaw::open));
        let has_terrain = host.terrain().is_some();
        let terrain_open = AtomicBool::new(true);
        let mut this = Box::new(Self {
            host,
            terrain_open,
            _name: name,
            _folder: folder,
            terrain,
            _law: law,
            hosted_law,
            open_law,
            table,
        });
        let ctx = (&raw const *this).cast_mut().cast();
        this.table.ctx = ctx;
        this.terrain.ctx = ctx;
        if has_terrain {
            this.table.terrain = &raw const this.terrain;
        }
        this.table.law = this.open_law.as_ref().map_or(std::ptr::null(), |open| &raw const *open);
        this
    }

    pub(super) fn table(&self) -> *const TgHost {
        &raw const self.table
    }

    /// Message of a law of the host since the last call; `text`, the module's own words, if there is none.
    pub(super) fn said(&self, text: String) -> String {
        self.hosted_law.as_ref().and_then(HostedLaw::words).unwrap_or(text)
    }

    /// After `instantiate` the terrain answers with an error.
    pub(super) fn close_terrain(&self) {
        self.terrain_open.store(false, Ordering::Relaxed);
    }
}

/// Runs a service; a panic of the host becomes a line of the log and the fallback.
///
/// # Safety
/// `ctx` is the context of a live table of services.
unsafe fn serve<T>(ctx: *mut c_void, fallback: T, f: impl FnOnce(&Services) -> T) -> T {
    // SAFETY: by the contract.
    let services = unsafe { &*ctx.cast::<Services>() };
    catch_unwind(AssertUnwindSafe(|| f(services))).unwrap_or_else(|payload| {
        let text = format!("a service of the host {}", panic_text(payload.as_ref()));
        let _ = catch_unwind(AssertUnwindSafe(|| services.host.log(LogLevel::Error, &text)));
        fallback
    })
}

unsafe extern "C" fn log(ctx: *mut c_void, level: i32, text: *const c_char) {
    // SAFETY: the module passes our context and a text for this call.
    unsafe {
        serve(ctx, (), |s| {
            let text = borrowed(text).unwrap_or("(a line that is not UTF-8)");
            s.host.log(convert::log_level(level), text);
        });
    }
}

/// The argument of a foreign job; the module guarantees that its jobs may run on several threads.
struct Arg(*mut c_void);
// SAFETY: terraglue.h asks for jobs that may run on any thread.
unsafe impl Sync for Arg {}

impl Arg {
    fn get(&self) -> *mut c_void {
        self.0
    }
}

unsafe extern "C" fn parallel_for(ctx: *mut c_void, n: usize, job: TgJob, arg: *mut c_void) -> TgStatus {
    let Some(job) = job else { return TG_ERROR };
    let arg = Arg(arg);
    // SAFETY: the module passes our context and a job with its argument, valid until we return.
    unsafe {
        serve(ctx, TG_ERROR, |s| {
            s.host.parallel_for(n, &|index| job(arg.get(), index));
            TG_OK
        })
    }
}

unsafe extern "C" fn cancelled(ctx: *mut c_void) -> i32 {
    // SAFETY: the module passes our context.
    unsafe { serve(ctx, 0, |s| i32::from(s.host.cancelled())) }
}

unsafe extern "C" fn heights(
    ctx: *mut c_void,
    i0: i64,
    j0: i64,
    ni: usize,
    nj: usize,
    out: *mut f64,
) -> TgStatus {
    let Some(count) = ni.checked_mul(nj) else { return TG_ERROR };
    // SAFETY: the module passes our context and room for ni * nj values.
    unsafe {
        serve(ctx, TG_ERROR, |s| {
            let open = s.terrain_open.load(Ordering::Relaxed);
            match s.host.terrain().filter(|_| open) {
                Some(terrain) => match terrain.heights(i0, j0, ni, nj, slice_mut(out, count)) {
                    TerrainTile::Uniform(_) => 1,
                    TerrainTile::Varied => 0,
                },
                None => TG_ERROR,
            }
        })
    }
}
