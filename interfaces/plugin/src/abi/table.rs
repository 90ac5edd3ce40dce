//! The table of functions that a module hands out.
use super::constants::TgStatus;
use super::host::TgHost;
use super::law::TgNodeLaw;
use super::scene::{TgBodyState, TgEnergy, TgField, TgFieldTile, TgJoint, TgMaterial, TgScene};
use super::sight::{TgMessage, TgOverlay, TgStream, TgWorld};
use super::step::{TgEstimate, TgInput, TgLaw, TgMotion, TgResponse, TgStep};
use super::variable::{TgAction, TgBytes, TgValues, TgVariable};
use std::ffi::{c_char, c_void};

/// A module: what `terraglue_subsystem()` returns. Constant; lives as long as the process.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TgSubsystem {
    /// sizeof(tg_subsystem) of the module. Entries beyond it count as null.
    pub size: u32,
    /// TG_ABI_MAJOR of the module.
    pub abi_major: u32,
    /// TG_ABI_MINOR of the module.
    pub abi_minor: u32,
    /// TG_SOIL, TG_ROBOT, TG_CONTROLLER, TG_LAW or TG_SENSOR.
    pub kind: u32,
    /// Module name, e.g. "soil-bekker".
    pub id: *const c_char,
    /// The text of the section .terraglue (see TG_DESCRIBE), or null.
    pub description: *const c_char,
    /// JSON: {"name", "kind": "soil"|"robot"|"controller"|"law"|"sensor", "help", "parameters": [{"name", "type":
    /// "number"|"integer"|"bool"|"text"|"path"|"numbers"|"number-table", "unit", "help", "default", "optional",
    /// "min", "max", "above_min", "choices"}]}. Constant; null on failure.
    /// When: at any time. Thread: any thread, several at once.
    pub schema: Option<unsafe extern "C" fn() -> *const c_char>,
    /// Makes an instance. `config` is a JSON object with a value for every parameter of the schema that the
    /// scenario sets or that has a default. May allocate, read files below host->folder and read the terrain.
    /// On failure *instance stays null and last_error(NULL) has the reason.
    /// When: at any time. Thread: any thread, several at once.
    pub instantiate: Option<
        unsafe extern "C" fn(
            host: *const TgHost,
            config: *const c_char,
            instance: *mut *mut c_void,
        ) -> TgStatus,
    >,
    /// Ends an instance.
    /// When: once, last. Thread: that of the instance.
    pub free: Option<unsafe extern "C" fn(instance: *mut c_void)>,
    /// Bits TG_CAN_...: the capabilities of this instance.
    /// When: at any time after `instantiate`. Thread: that of the instance.
    pub capabilities: Option<unsafe extern "C" fn(instance: *mut c_void) -> u32>,
    /// Paper, steps 3 and 4. A trial from the committed state; without ports, a plain step.
    /// When: in a step, after `set_ports`, any number of times. Thread: that of the instance.
    pub advance: Option<
        unsafe extern "C" fn(
            instance: *mut c_void,
            step: *const TgStep,
            input: *const TgInput,
            out: *mut TgResponse,
        ) -> TgStatus,
    >,
    /// Why the last call failed; UTF-8, valid until the next call of the instance. NULL: why `instantiate`
    /// or `schema` failed on this thread.
    /// When: directly after a call that failed. Thread: that of this call.
    pub last_error: Option<unsafe extern "C" fn(instance: *mut c_void) -> *const c_char>,

    /// Required up to here; below, null means: not offered.
    ///
    /// Paper, step 1. The ports of this step (grounds come first). Returns the committed X, V and,
    /// for a soil, t = the wrench of its law at that X. A ground may narrow `laws` (mu = tan phi, t_max), one
    /// per port; a ground's x along n is its own surface x2 under the body.
    /// When: in a step, before its trials; again when the step is repeated. Thread: that of the instance.
    pub set_ports: Option<
        unsafe extern "C" fn(
            instance: *mut c_void,
            step: *const TgStep,
            laws: *mut TgLaw,
            now: *mut TgResponse,
        ) -> TgStatus,
    >,
    /// Paper, step 2. If the other side of every contact were rigid and stood at `partner` at t + h: which
    /// wrenches? Solved, not applied.
    /// When: in a step, after `set_ports`, any number of times. Thread: that of the instance.
    pub estimate_forces: Option<
        unsafe extern "C" fn(
            instance: *mut c_void,
            step: *const TgStep,
            partner: *const TgMotion,
            out: *mut TgEstimate,
        ) -> TgStatus,
    >,
    /// Paper, step 3. Given the estimate: out->t = T1, out->x = own surface under it. A trial.
    /// When: in a step, after `set_ports`, any number of times. Thread: that of the instance.
    pub solve_compatibility: Option<
        unsafe extern "C" fn(
            instance: *mut c_void,
            step: *const TgStep,
            estimate: *const TgEstimate,
            out: *mut TgResponse,
        ) -> TgStatus,
    >,
    /// Derivatives at the last trial, n x n, column-major. After TG_FORCE: dX/d(wrench on itself) at `level`.
    /// After TG_MOTION: d(wrench on itself)/dX (TG_POSITION) or /dV (TG_VELOCITY), sign as for a spring.
    /// After TG_FORCE with x and v: column n of a port is dX_n/dT_n and dT_t/dT_n, columns t and m as after
    /// TG_MOTION.
    /// When: directly after a trial. Thread: that of the instance.
    pub interface_jacobian: Option<
        unsafe extern "C" fn(
            instance: *mut c_void,
            step: *const TgStep,
            level: u32,
            out: *mut f64,
        ) -> TgStatus,
    >,
    /// Paper, step 5. The last trial is accepted under t; the other side has moved to `partner`.
    /// When: once per step, after its trials. Thread: that of the instance.
    pub commit: Option<
        unsafe extern "C" fn(
            instance: *mut c_void,
            step: *const TgStep,
            t: *const f64,
            partner: *const TgMotion,
        ) -> TgStatus,
    >,
    /// The committed state, exactly, into slot 0 ... host->slots - 1.
    /// When: between steps. Thread: that of the instance.
    pub save_state: Option<unsafe extern "C" fn(instance: *mut c_void, slot: u32) -> TgStatus>,
    /// Back to the state of a slot.
    /// When: between steps. Thread: that of the instance.
    pub restore_state: Option<unsafe extern "C" fn(instance: *mut c_void, slot: u32) -> TgStatus>,
    /// The committed state as bytes with a version; they stay valid until the next call of the instance.
    /// When: between steps. Thread: that of the instance.
    pub serialize: Option<unsafe extern "C" fn(instance: *mut c_void, out: *mut TgBytes) -> TgStatus>,
    /// Back to a state made by `serialize`.
    /// When: between steps. Thread: that of the instance.
    pub deserialize: Option<unsafe extern "C" fn(instance: *mut c_void, bytes: TgBytes) -> TgStatus>,
    /// All variables in ascending order of id, and their number; valid and constant until `free`.
    /// When: at any time after `instantiate`. Thread: that of the instance.
    pub variables:
        Option<unsafe extern "C" fn(instance: *mut c_void, first: *mut *const TgVariable) -> usize>,
    /// Committed values.
    /// When: at any time. Thread: that of the instance.
    pub get: Option<unsafe extern "C" fn(instance: *mut c_void, values: *const TgValues) -> TgStatus>,
    /// New values, effective from the next step on.
    /// When: between steps. Thread: that of the instance.
    pub set: Option<unsafe extern "C" fn(instance: *mut c_void, values: *const TgValues) -> TgStatus>,
    /// All actions, and their number; valid and constant until `free`.
    /// When: at any time after `instantiate`. Thread: that of the instance.
    pub actions: Option<unsafe extern "C" fn(instance: *mut c_void, first: *mut *const TgAction) -> usize>,
    /// Does an action; `arguments` is a JSON object.
    /// When: between steps. Thread: that of the instance.
    pub act: Option<
        unsafe extern "C" fn(
            instance: *mut c_void,
            action: *const c_char,
            arguments: *const c_char,
        ) -> TgStatus,
    >,
    /// Time of the next event known beforehand, s; inf: none.
    /// When: between steps. Thread: that of the instance.
    pub next_event_time: Option<unsafe extern "C" fn(instance: *mut c_void) -> f64>,
    /// Bodies and shapes; valid and constant until `free`.
    /// When: at any time after `instantiate`. Thread: that of the instance.
    pub scene: Option<unsafe extern "C" fn(instance: *mut c_void, out: *mut TgScene) -> TgStatus>,
    /// Committed states of the scene's n bodies, in its order.
    /// When: at any time. Thread: that of the instance.
    pub body_states:
        Option<unsafe extern "C" fn(instance: *mut c_void, n: usize, out: *mut TgBodyState) -> TgStatus>,
    /// All fields, and their number; valid and constant until `free`.
    /// When: at any time after `instantiate`. Thread: that of the instance.
    pub fields: Option<unsafe extern "C" fn(instance: *mut c_void, first: *mut *const TgField) -> usize>,
    /// Tile (a, b) of a field: nodes (a * tile_edge ..., b * tile_edge ...).
    /// When: at any time. Thread: that of the instance.
    pub field_tile: Option<
        unsafe extern "C" fn(
            instance: *mut c_void,
            field: usize,
            a: u32,
            b: u32,
            out: *mut TgFieldTile,
        ) -> TgStatus,
    >,
    /// Energies of the committed state. Null: all are unknown.
    /// When: at any time. Thread: that of the instance.
    pub energy: Option<unsafe extern "C" fn(instance: *mut c_void, out: *mut TgEnergy) -> TgStatus>,

    /// Null: kept for the layout of ABI 2.0; see `law`.
    pub pressure: Option<
        unsafe extern "C" fn(
            instance: *mut c_void,
            n: usize,
            sinkage: *const f64,
            b: f64,
            state: *mut f64,
            pressure: *mut f64,
            tangent: *mut f64,
        ) -> TgStatus,
    >,
    /// Null: kept for the layout of ABI 2.0; see `law`.
    pub shear: Option<
        unsafe extern "C" fn(
            instance: *mut c_void,
            n: usize,
            pressure: *const f64,
            displacement: *const f64,
            state: *mut f64,
            stress: *mut f64,
            tangent: *mut f64,
        ) -> TgStatus,
    >,
    /// 0: kept for the layout of ABI 2.0.
    pub law_state_doubles: u32,
    /// 0.
    pub reserved: u32,
    /// Modules of kind TG_LAW: their functions; required, while `instantiate`, `free`,
    /// `capabilities`, `advance` and `last_error` are not. Null for the other kinds.
    pub law: *const TgNodeLaw,

    /// Since 3.1, as all below. Looks at the committed world: with the capability TG_CAN_SEE, after all instances have
    /// committed the step, which `step` shows without ports. Observations belong to the committed state: variables,
    /// streams and `save_state` contain it from t + h on. `world` is valid for the call only. When: once per step,
    /// after `commit`; at the start of a run with h = 0. Thread: that of the instance.
    pub observe: Option<
        unsafe extern "C" fn(instance: *mut c_void, step: *const TgStep, world: *const TgWorld) -> TgStatus,
    >,
    /// All joints of the scene, and their number; valid and constant until `free`. Null: none.
    /// When: at any time after `instantiate`. Thread: that of the instance.
    pub scene_joints:
        Option<unsafe extern "C" fn(instance: *mut c_void, first: *mut *const TgJoint) -> usize>,
    /// Materials of all shapes of the scene, in their order, and their number; valid and constant until `free`. Null: all
    /// are unknown.
    /// When: at any time after `instantiate`. Thread: that of the instance.
    pub shape_materials:
        Option<unsafe extern "C" fn(instance: *mut c_void, first: *mut *const TgMaterial) -> usize>,
    /// For each of the scene's n shapes 1 where it is shown, 0 where it is hidden; it belongs to the committed state. Asked with
    /// the capability TG_CAN_HIDE; without it all are shown.
    /// When: at any time. Thread: that of the instance.
    pub shape_visibility:
        Option<unsafe extern "C" fn(instance: *mut c_void, n: usize, out: *mut u8) -> TgStatus>,
    /// All streams, and their number; valid and constant until `free`.
    /// When: at any time after `instantiate`. Thread: that of the instance.
    pub streams: Option<unsafe extern "C" fn(instance: *mut c_void, first: *mut *const TgStream) -> usize>,
    /// The message that the last committed step made on a stream; may be called any number of times.
    /// When: at any time. Thread: that of the instance.
    pub stream:
        Option<unsafe extern "C" fn(instance: *mut c_void, stream: usize, out: *mut TgMessage) -> TgStatus>,
    /// Overlays to show with the bodies, and their number; valid until the next call of the instance. Called only when
    /// they are displayed or recorded. When: at any time. Thread: that of the instance.
    pub overlays: Option<unsafe extern "C" fn(instance: *mut c_void, first: *mut *const TgOverlay) -> usize>,
}

/// The function that a module exports as `terraglue_subsystem`.
pub type TgEntry = unsafe extern "C" fn() -> *const TgSubsystem;
