//! Sight of an instance: a [`World`] of the host behind a table of the C ABI.

use crate::abi::*;
use crate::field_table::{field_out, tile_out};
use crate::keep::Keep;
use crate::scene_table::{SceneTable, pose_in};
use crate::text::{borrowed, c_string, slice, slice_mut};
use std::cell::{Cell, OnceCell, Ref, RefCell};
use std::ffi::{CString, c_char, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};
use terraglue_subsystem::{BodyRef, BodyState, Error, Figure, Overlay, RayMask, Result, ShapeRef, World};

/// The world of one instance. It stays at one place as long as the instance: a module that keeps a pointer to it and asks outside of
/// `observe` gets no answer, and its next call reports it.
pub(super) struct Shown {
    table: Cell<TgWorld>,
    copies: RefCell<Copies>,
    /// The world during a call.
    open: Cell<Option<*const (dyn World + 'static)>>,
    /// Whether it was called while it was closed.
    misused: Cell<bool>,
}

/// Names and scenes in the form of the ABI; made once for each revision of the world.
#[derive(Default)]
struct Copies {
    revision: Option<u64>,
    _names: Vec<CString>,
    pointers: Vec<*const c_char>,
    subsystems: Vec<ForeignOthers>,
}

/// Another subsystem, made on demand.
#[derive(Default)]
struct ForeignOthers {
    scene: OnceCell<Option<SceneTable>>,
    fields: OnceCell<(Vec<TgField>, Keep)>,
}

impl Default for Shown {
    fn default() -> Self {
        let table = TgWorld {
            size: size_of::<TgWorld>() as u32,
            n_subsystems: 0,
            subsystems: std::ptr::null(),
            revision: 0,
            interval: [f64::NAN; 2],
            ctx: std::ptr::null_mut(),
            cast_rays: Some(cast_rays),
            ground_heights: Some(ground_heights),
            overlap: Some(overlap),
            body: Some(body),
            pose: Some(pose),
            scene: Some(scene),
            scene_joints: Some(scene_joints),
            shape_materials: Some(shape_materials),
            is_visible: Some(is_visible),
            fields: Some(fields),
            field_tile: Some(field_tile),
        };
        Self {
            table: Cell::new(table),
            copies: RefCell::default(),
            open: Cell::new(None),
            misused: Cell::new(false),
        }
    }
}

impl Shown {
    /// Calls with the table of the world.
    pub(super) fn with(&self, world: &dyn World, call: impl FnOnce(*const TgWorld) -> Result) -> Result {
        self.check()?;
        let stale = {
            let copies = self.copies.borrow();
            copies.revision != Some(world.revision()) || copies.pointers.len() != world.subsystems().len()
        };
        if stale {
            *self.copies.borrow_mut() = Copies::of(world);
        }
        let copies = self.copies.borrow();
        self.table.set(TgWorld {
            n_subsystems: copies.pointers.len() as u32,
            subsystems: copies.pointers.as_ptr(),
            revision: world.revision(),
            interval: world.interval(),
            ctx: std::ptr::from_ref(self).cast_mut().cast(),
            ..self.table.get()
        });
        drop(copies);
        // SAFETY: only the lifetime changes; the pointer is taken away before this call returns.
        let world: &'static dyn World = unsafe { std::mem::transmute(world) };
        self.open.set(Some(world));
        let done = call(self.table.as_ptr());
        self.open.set(None);
        done.and_then(|()| self.check())
    }

    /// Refuses an instance that has called it while the world was closed.
    pub(super) fn check(&self) -> Result {
        if !self.misused.get() {
            return Ok(());
        }
        let text = "it asked the world outside of `observe`; a pointer to it holds during this call only";
        Err(Error::Fatal(text.into()))
    }
}

impl Copies {
    fn of(world: &dyn World) -> Self {
        let names: Vec<CString> = world.subsystems().iter().map(|name| c_string(name)).collect();
        Self {
            revision: Some(world.revision()),
            pointers: names.iter().map(|name| name.as_ptr()).collect(),
            subsystems: names.iter().map(|_| ForeignOthers::default()).collect(),
            _names: names,
        }
    }
}

/// The world during a call, with the parts copied so far.
struct Open<'a> {
    world: &'a dyn World,
    copies: Ref<'a, Copies>,
}

impl Open<'_> {
    fn scene(&self, subsystem: u32) -> Option<&SceneTable> {
        let others = self.copies.subsystems.get(subsystem as usize)?;
        others.scene.get_or_init(|| self.world.scene(subsystem).map(SceneTable::of)).as_ref()
    }

    fn fields(&self, subsystem: u32) -> &[TgField] {
        let Some(others) = self.copies.subsystems.get(subsystem as usize) else { return &[] };
        let made = others.fields.get_or_init(|| {
            let mut keep = Keep::default();
            (self.world.fields(subsystem).iter().map(|f| field_out(f, &mut keep)).collect(), keep)
        });
        &made.0
    }
}

/// Answers a question; a panic of the host, and a world that is closed, give the fallback.
///
/// # Safety
/// `ctx` is the context of a world whose instance lives.
unsafe fn answer<T>(ctx: *mut c_void, fallback: T, f: impl FnOnce(&Open) -> T) -> T {
    // SAFETY: by the contract; it is reached through shared references only.
    let shown = unsafe { &*ctx.cast::<Shown>() };
    let Some(world) = shown.open.get() else {
        shown.misused.set(true);
        return fallback;
    };
    // SAFETY: open during `observe` only, which borrows the world.
    let open = Open { world: unsafe { &*world }, copies: shown.copies.borrow() };
    catch_unwind(AssertUnwindSafe(|| f(&open))).unwrap_or(fallback)
}

/// # Safety
/// `mask` is null, which sees all, or points at a mask.
unsafe fn mask_of(mask: *const TgRayMask) -> RayMask {
    // SAFETY: by the contract; the layout is that of ours (`abi::layout`).
    unsafe { mask.cast::<RayMask>().as_ref() }.copied().unwrap_or(RayMask::ALL)
}

unsafe extern "C" fn cast_rays(
    ctx: *mut c_void,
    n: usize,
    rays: *const TgRay,
    mask: *const TgRayMask,
    hits: *mut TgRayHit,
) -> TgStatus {
    // SAFETY: the module passes our context and arrays of n, laid out as ours (`abi::layout`).
    unsafe {
        answer(ctx, TG_ERROR, |open| {
            open.world.cast_rays(slice(rays.cast(), n), &mask_of(mask), slice_mut(hits.cast(), n));
            TG_OK
        })
    }
}

unsafe extern "C" fn ground_heights(
    ctx: *mut c_void,
    n: usize,
    points: *const f64,
    heights: *mut f64,
) -> TgStatus {
    // SAFETY: the module passes our context and arrays of n; a pair of doubles is laid out as an array of two.
    unsafe {
        answer(ctx, TG_ERROR, |open| {
            open.world.ground_heights(slice(points.cast(), n), slice_mut(heights, n));
            TG_OK
        })
    }
}

unsafe extern "C" fn overlap(
    ctx: *mut c_void,
    centre: *const f64,
    radius: f64,
    mask: *const TgRayMask,
    room: usize,
    found: *mut TgShapeRef,
) -> usize {
    // SAFETY: the module passes our context, three coordinates and that much room.
    unsafe {
        answer(ctx, 0, |open| {
            let [x, y, z] = slice(centre, 3) else { return 0 };
            let mut all: Vec<ShapeRef> = Vec::new();
            open.world.overlap([*x, *y, *z], radius, &mask_of(mask), &mut all);
            let out: &mut [ShapeRef] = slice_mut(found.cast(), room);
            out.iter_mut().zip(&all).for_each(|(out, shape)| *out = *shape);
            all.len()
        })
    }
}

unsafe extern "C" fn body(
    ctx: *mut c_void,
    subsystem: *const c_char,
    body: *const c_char,
    out: *mut TgBodyRef,
) -> TgStatus {
    // SAFETY: the module passes our context, texts for this call and a place for the answer.
    unsafe {
        answer(ctx, TG_ERROR, |open| {
            let (Ok(subsystem), Ok(body)) = (borrowed(subsystem), borrowed(body)) else { return TG_REFUSED };
            let Some(found) = open.world.body(subsystem, body) else { return TG_REFUSED };
            *out.cast::<BodyRef>() = found;
            TG_OK
        })
    }
}

unsafe extern "C" fn pose(ctx: *mut c_void, body: TgBodyRef, time: f64, out: *mut TgBodyState) -> TgStatus {
    // SAFETY: the module passes our context and a place for the answer.
    unsafe {
        answer(ctx, TG_ERROR, |open| {
            let body = BodyRef { subsystem: body.subsystem, body: body.body };
            let Some(state) = open.world.pose(body, time) else { return TG_REFUSED };
            *out.cast::<BodyState>() = state;
            TG_OK
        })
    }
}

unsafe extern "C" fn scene(ctx: *mut c_void, subsystem: u32, out: *mut TgScene) -> TgStatus {
    // SAFETY: the module passes our context and a place for the answer.
    unsafe {
        answer(ctx, TG_ERROR, |open| {
            let Some(table) = open.scene(subsystem) else { return TG_REFUSED };
            *out = table.scene();
            TG_OK
        })
    }
}

unsafe extern "C" fn scene_joints(ctx: *mut c_void, subsystem: u32, first: *mut *const TgJoint) -> usize {
    // SAFETY: the module passes our context and a place for a pointer.
    unsafe {
        answer(ctx, 0, |open| {
            let joints = open.scene(subsystem).map_or(&[][..], |table| &table.joints);
            *first = joints.as_ptr();
            joints.len()
        })
    }
}

unsafe extern "C" fn shape_materials(
    ctx: *mut c_void,
    subsystem: u32,
    first: *mut *const TgMaterial,
) -> usize {
    // SAFETY: the module passes our context and a place for a pointer.
    unsafe {
        answer(ctx, 0, |open| {
            let materials = open.scene(subsystem).map_or(&[][..], |table| &table.materials);
            *first = materials.as_ptr();
            materials.len()
        })
    }
}

unsafe extern "C" fn is_visible(ctx: *mut c_void, shape: TgShapeRef) -> i32 {
    let shape = ShapeRef { subsystem: shape.subsystem, body: shape.body, shape: shape.shape };
    // SAFETY: the module passes our context.
    unsafe { answer(ctx, 0, |open| i32::from(open.world.is_visible(shape))) }
}

unsafe extern "C" fn fields(ctx: *mut c_void, subsystem: u32, first: *mut *const TgField) -> usize {
    // SAFETY: the module passes our context and a place for a pointer.
    unsafe {
        answer(ctx, 0, |open| {
            let fields = open.fields(subsystem);
            *first = fields.as_ptr();
            fields.len()
        })
    }
}

unsafe extern "C" fn field_tile(
    ctx: *mut c_void,
    subsystem: u32,
    field: usize,
    a: u32,
    b: u32,
    out: *mut TgFieldTile,
) -> TgStatus {
    // SAFETY: the module passes our context and a place for the answer.
    unsafe {
        answer(ctx, TG_ERROR, |open| match open.world.field_tile(subsystem, field, a, b) {
            Ok(tile) => {
                *out = tile_out(&tile);
                TG_OK
            }
            Err(error) => crate::convert::status(error).0,
        })
    }
}

/// A figure of a foreign instance; none where it cannot be read.
///
/// # Safety
/// The pointers of `o` are valid.
pub(super) unsafe fn overlay_in(o: &TgOverlay) -> Option<Overlay> {
    // SAFETY: by the contract; three doubles are laid out as an array of three.
    let (layer, text, points): (&str, &str, &[[f64; 3]]) =
        unsafe { (borrowed(o.layer).ok()?, borrowed(o.text).ok()?, slice(o.points.cast(), o.n_points)) };
    let all = || points.to_vec();
    let figure = match o.figure {
        TG_LINES => Figure::Lines { points: all(), width: o.size },
        TG_POINTS => Figure::Points { points: all(), size: o.size },
        TG_ARROWS => Figure::Arrows { points: all(), width: o.size },
        TG_ELLIPSE => Figure::Ellipse { pose: pose_in(&o.pose), semi_axes: o.semi_axes },
        TG_TEXT => Figure::Text { at: *points.first()?, height: o.size, text: text.to_owned() },
        _ => return None,
    };
    Some(Overlay { layer: layer.to_owned(), frame: o.frame, colour: o.colour, figure })
}
