//! Services of the host at `instantiate`.
use super::constants::TgStatus;
use super::law::TgOpenLaw;
use std::ffi::{c_char, c_void};

/// One piece of a parallel loop.
pub type TgJob = Option<unsafe extern "C" fn(arg: *mut c_void, index: usize)>;

/// Ground at the start of the run: nodes (i, j) lie at origin + (i, j) * spacing.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TgTerrain {
    /// World x, y of node (0, 0), m.
    pub origin: [f64; 2],
    /// Distance of neighbouring nodes, m.
    pub spacing: f64,
    /// Number of nodes along x and y.
    pub size: [u32; 2],
    /// First argument of `heights`.
    pub ctx: *mut c_void,
    /// Heights (m) of nodes (i0 ... i0 + ni - 1) x (j0 ... j0 + nj - 1), x fastest, into `out` (ni * nj
    /// values). Nodes outside repeat the nearest node of the edge. Answers 1 when all are equal, 0 when not,
    /// a negative status on failure.
    /// When: in `instantiate`. Thread: any.
    pub heights: Option<
        unsafe extern "C" fn(
            ctx: *mut c_void,
            i0: i64,
            j0: i64,
            ni: usize,
            nj: usize,
            out: *mut f64,
        ) -> TgStatus,
    >,
}

/// Services of the host; valid from `instantiate` to `free` of the instance, `terrain` during
/// `instantiate` only. Every call may come from any thread.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TgHost {
    /// sizeof(tg_host) of the host. Fields beyond it do not exist.
    pub size: u32,
    /// TG_ABI_MAJOR of the host.
    pub abi_major: u32,
    /// TG_ABI_MINOR of the host.
    pub abi_minor: u32,
    /// How many numbered states `save_state` must keep.
    pub slots: u32,
    /// First argument of the functions below.
    pub ctx: *mut c_void,
    /// A line for the run's log; level is TG_LOG_ERROR ... TG_LOG_DEBUG.
    /// When: from `instantiate` to `free`. Thread: any.
    pub log: Option<unsafe extern "C" fn(ctx: *mut c_void, level: i32, text: *const c_char)>,
    /// Runs job(arg, 0) ... job(arg, n - 1), possibly on several threads; returns when all are done. Results
    /// must not depend on the order. A job must not throw or unwind. No module makes threads of its own.
    /// When: in a call of the instance. Thread: that of the call, or of a job.
    pub parallel_for:
        Option<unsafe extern "C" fn(ctx: *mut c_void, n: usize, job: TgJob, arg: *mut c_void) -> TgStatus>,
    /// 1: the user requested a stop; long calls poll it.
    /// When: from `instantiate` to `free`. Thread: any.
    pub cancelled: Option<unsafe extern "C" fn(ctx: *mut c_void) -> i32>,
    /// Seed for everything random in this instance.
    pub seed: u64,
    /// Name of the instance in the scenario.
    pub name: *const c_char,
    /// Folder to which relative paths of the parameters refer.
    pub folder: *const c_char,
    /// Gravity in the world, m/s^2.
    pub gravity: [f64; 3],
    /// The ground at the start; null: the scenario has none.
    pub terrain: *const TgTerrain,
    /// Largest number of ground nodes that a step may show; a hint for the memory to reserve.
    pub max_nodes: u32,
    /// 0.
    pub reserved: u32,
    /// The law that the scenario names in the parameter `law.plugin` of this subsystem, valid until
    /// `free`; null: none.
    pub law: *const TgOpenLaw,
}
