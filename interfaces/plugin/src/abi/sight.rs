//! The world as an instance sees it, its streams and its overlays; all since 3.1.
use super::constants::TgStatus;
use super::scene::{TgBodyState, TgField, TgFieldTile, TgJoint, TgMaterial, TgPose, TgScene};
use std::ffi::{c_char, c_void};

/// A body of the world.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TgBodyRef {
    /// Number of the subsystem.
    pub subsystem: u32,
    /// Index into the bodies of its scene.
    pub body: u32,
}

/// A shape of the world.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TgShapeRef {
    /// Number of the subsystem.
    pub subsystem: u32,
    /// Index of the body in its scene; UINT32_MAX: the ground.
    pub body: u32,
    /// Id of the shape; UINT32_MAX: the ground.
    pub shape: u32,
}

/// A half line that looks for the first thing in its way.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TgRay {
    /// Start, world, m.
    pub origin: [f64; 3],
    /// Direction, world, unit.
    pub direction: [f64; 3],
    /// When it looks, s, within the interval of the world.
    pub time: f64,
    /// How far it looks, m; may be inf.
    pub range: f64,
}

/// First hit of a ray.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TgRayHit {
    /// Distance from the start, m; inf: nothing was met, and the rest is meaningless.
    pub distance: f64,
    /// Unit normal of the surface, world, against the ray.
    pub normal: [f64; 3],
    /// Number of the subsystem.
    pub subsystem: u32,
    /// Index of the body in its scene; UINT32_MAX: the ground.
    pub body: u32,
    /// Id of the shape; UINT32_MAX: the ground.
    pub shape: u32,
    /// Material of the shape.
    pub material: TgMaterial,
}

/// Shapes and ground that a ray can meet.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TgRayMask {
    /// Bits TG_SEES_SHAPES and TG_SEES_GROUND.
    pub sees: u32,
    /// Bit k: material class k is met; bit 31: all classes from 31 on.
    pub classes: u32,
    /// A body that is passed by, such as the one that the sensor sits on. `body` UINT32_MAX: all of the subsystem;
    /// `subsystem` UINT32_MAX: none.
    pub skip: TgBodyRef,
}

/// The committed world at the end of a step, and within the step interpolated to the requested time; valid during
/// `observe` only, and to be called from its thread. Nothing after the step is known. An answer depends on the question and
/// the committed states alone. Called outside of `observe` it returns nothing, and the call counts as TG_FATAL.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TgWorld {
    /// sizeof(tg_world) of the host. Entries beyond it count as null.
    pub size: u32,
    /// Number of subsystems.
    pub n_subsystems: u32,
    /// Their names, in the order of their numbers; constant as long as `revision` is the same.
    pub subsystems: *const *const c_char,
    /// Changes whenever names or scenes of subsystems do.
    pub revision: u64,
    /// First and last time of a query, s: the committed step. Times outside count as the nearest end.
    pub interval: [f64; 2],
    /// First argument of the functions below.
    pub ctx: *mut c_void,
    /// The nearest hit of each of n rays, each at its own time, into n hits. Surfaces are seen from both sides.
    /// When: in `observe`. Thread: that of `observe`.
    pub cast_rays: Option<
        unsafe extern "C" fn(
            ctx: *mut c_void,
            n: usize,
            rays: *const TgRay,
            mask: *const TgRayMask,
            hits: *mut TgRayHit,
        ) -> TgStatus,
    >,
    /// Heights (m) of the ground at n points, two numbers each; NaN where there is none.
    /// When: in `observe`. Thread: that of `observe`.
    pub ground_heights: Option<
        unsafe extern "C" fn(ctx: *mut c_void, n: usize, points: *const f64, heights: *mut f64) -> TgStatus,
    >,
    /// Shapes that a sphere around three coordinates touches or contains, in ascending order: the first `room` of them into
    /// `found`. Answers how many there are.
    /// When: in `observe`. Thread: that of `observe`.
    pub overlap: Option<
        unsafe extern "C" fn(
            ctx: *mut c_void,
            centre: *const f64,
            radius: f64,
            mask: *const TgRayMask,
            room: usize,
            found: *mut TgShapeRef,
        ) -> usize,
    >,
    /// A body by the names of its subsystem and its own. TG_REFUSED: there is none.
    /// When: in `observe`. Thread: that of `observe`.
    pub body: Option<
        unsafe extern "C" fn(
            ctx: *mut c_void,
            subsystem: *const c_char,
            body: *const c_char,
            out: *mut TgBodyRef,
        ) -> TgStatus,
    >,
    /// Pose and twist of a body at a time. TG_REFUSED: there is no such body.
    /// When: in `observe`. Thread: that of `observe`.
    pub pose: Option<
        unsafe extern "C" fn(ctx: *mut c_void, body: TgBodyRef, time: f64, out: *mut TgBodyState) -> TgStatus,
    >,
    /// Bodies and shapes of a subsystem; constant as long as `revision` is the same. TG_REFUSED: there is no such subsystem.
    /// When: in `observe`. Thread: that of `observe`.
    pub scene: Option<unsafe extern "C" fn(ctx: *mut c_void, subsystem: u32, out: *mut TgScene) -> TgStatus>,
    /// Joints of a subsystem, and their number; constant as its scene.
    /// When: in `observe`. Thread: that of `observe`.
    pub scene_joints:
        Option<unsafe extern "C" fn(ctx: *mut c_void, subsystem: u32, first: *mut *const TgJoint) -> usize>,
    /// Materials of the shapes of a subsystem, in their order; constant as its scene.
    /// When: in `observe`. Thread: that of `observe`.
    pub shape_materials: Option<
        unsafe extern "C" fn(ctx: *mut c_void, subsystem: u32, first: *mut *const TgMaterial) -> usize,
    >,
    /// 1: the shape is there and not hidden.
    /// When: in `observe`. Thread: that of `observe`.
    pub is_visible: Option<unsafe extern "C" fn(ctx: *mut c_void, shape: TgShapeRef) -> i32>,
    /// Fields of a subsystem, and their number; constant as its scene.
    /// When: in `observe`. Thread: that of `observe`.
    pub fields:
        Option<unsafe extern "C" fn(ctx: *mut c_void, subsystem: u32, first: *mut *const TgField) -> usize>,
    /// Tile (a, b) of a field of a subsystem; its data are valid until the end of `observe`.
    /// When: in `observe`. Thread: that of `observe`.
    pub field_tile: Option<
        unsafe extern "C" fn(
            ctx: *mut c_void,
            subsystem: u32,
            field: usize,
            a: u32,
            b: u32,
            out: *mut TgFieldTile,
        ) -> TgStatus,
    >,
}

/// A stream of messages of one kind. Texts are UTF-8, zero-terminated.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TgStream {
    /// Dotted name, unique in the instance and different from its variables.
    pub name: *const c_char,
    /// Name of the schema of its messages, e.g. "foxglove.PointCloud".
    pub schema: *const c_char,
    /// How messages are written: "protobuf", "json" or another name that readers know.
    pub encoding: *const c_char,
    /// One line for people.
    pub help: *const c_char,
    /// Most messages per second, 1/s; 0: whenever something happens.
    pub rate_hz: f64,
    /// Most bytes of a message. Longer ones are dropped with a warning.
    pub most_bytes: u32,
    /// 0.
    pub reserved: u32,
}

/// A message of a stream.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TgMessage {
    /// Time of its content, s.
    pub time: f64,
    /// Its bytes; they stay valid until the next call that may change the committed state.
    pub bytes: *const u8,
    /// Their number.
    pub size: usize,
    /// 1: the last committed step made a message; 0: it made none, and the rest is meaningless. Comes as 0.
    pub is_there: u32,
    /// 0.
    pub reserved: u32,
}

/// A figure in a layer that people switch on and off by its name. Lengths in m.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct TgOverlay {
    /// Name of the layer.
    pub layer: *const c_char,
    /// Text of a TG_TEXT; else null.
    pub text: *const c_char,
    /// Index of the body of the own scene in whose frame the figure lies; UINT32_MAX: the world, UINT32_MAX - 1: the body that
    /// the parameter `mount` names.
    pub frame: u32,
    /// TG_LINES ... TG_TEXT.
    pub figure: u32,
    /// Red, green, blue, opacity, 0 ... 1.
    pub colour: [f32; 4],
    /// Points, three numbers each.
    pub points: *const f64,
    /// Number of points.
    pub n_points: usize,
    /// Width of lines and arrows, size of points, height of letters.
    pub size: f64,
    /// Centre and axes of an ellipse.
    pub pose: TgPose,
    /// Half lengths of an ellipse along x and y of its pose.
    pub semi_axes: [f64; 2],
}
