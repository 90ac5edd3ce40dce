//! Sight of Rust modules: [`World`] on top of the host's table; and their streams and overlays.

use super::data::list;
use super::steps::step_of;
use super::{change, look, look_status};
use crate::abi::*;
use crate::field_table::{NO_TILE, field_in, tile_in};
use crate::keep::Keep;
use crate::scene_table::{pose_out, scene_in};
use crate::text::{borrowed, c_string, slice, slice_mut};
use std::cell::OnceCell;
use std::ffi::c_void;
use terraglue_subsystem::{
    BodyRef, BodyState, Error, FieldInfo, FieldTile, Figure, Overlay, Ray, RayHit, RayMask, Result, Scene,
    ShapeRef, World,
};

/// Copies of a host's names and scenes; made once for each revision of the world.
#[derive(Default)]
pub(super) struct Known {
    revision: Option<u64>,
    names: Vec<String>,
    subsystems: Vec<CopiedOthers>,
}

/// Another subsystem, copied on demand.
#[derive(Default)]
struct CopiedOthers {
    scene: OnceCell<Option<Scene>>,
    fields: OnceCell<Vec<FieldInfo>>,
}

impl Known {
    /// # Safety
    /// `raw` is the table of a world whose `observe` has not returned.
    unsafe fn refresh(&mut self, raw: &TgWorld) -> Result {
        if self.revision == Some(raw.revision) && self.names.len() == raw.n_subsystems as usize {
            return Ok(());
        }
        // SAFETY: by the contract.
        let names = unsafe { slice(raw.subsystems, raw.n_subsystems as usize) };
        // SAFETY: by the contract.
        let names = names.iter().map(|name| unsafe { borrowed(*name) }.map(str::to_owned));
        let names: Vec<String> = names.collect::<Result<_>>()?;
        let subsystems = names.iter().map(|_| CopiedOthers::default()).collect();
        *self = Self { revision: Some(raw.revision), names, subsystems };
        Ok(())
    }
}

/// The world of a foreign host.
struct ForeignWorld<'a> {
    raw: TgWorld,
    known: &'a Known,
}

impl ForeignWorld<'_> {
    /// # Safety
    /// `world` points at a table of `size` bytes.
    unsafe fn table(world: *const TgWorld) -> Result<TgWorld> {
        if world.is_null() {
            return Err(Error::Failed("the host passed no world to look at".into()));
        }
        // SAFETY: `size` bytes may be read, and zero means null.
        unsafe {
            let mut raw: TgWorld = std::mem::zeroed();
            let bytes = ((*world).size as usize).min(size_of::<TgWorld>());
            std::ptr::copy_nonoverlapping(world.cast::<u8>(), (&raw mut raw).cast::<u8>(), bytes);
            Ok(raw)
        }
    }

    fn copied(&self, subsystem: u32) -> Option<Scene> {
        let mut s = TgScene { bodies: std::ptr::null(), shapes: std::ptr::null(), n_bodies: 0, n_shapes: 0 };
        // SAFETY: the host's functions with the host's context; their answers are constant for this revision.
        unsafe {
            let status = (self.raw.scene?)(self.raw.ctx, subsystem, &raw mut s);
            let (mut joints, mut materials) = (std::ptr::null(), std::ptr::null());
            let n_joints = self.raw.scene_joints.map_or(0, |f| f(self.raw.ctx, subsystem, &raw mut joints));
            let n_materials =
                self.raw.shape_materials.map_or(0, |f| f(self.raw.ctx, subsystem, &raw mut materials));
            (status == TG_OK)
                .then(|| scene_in(&s, slice(joints, n_joints), slice(materials, n_materials)).ok())
                .flatten()
        }
    }
}

impl World for ForeignWorld<'_> {
    fn revision(&self) -> u64 {
        self.raw.revision
    }

    fn interval(&self) -> [f64; 2] {
        self.raw.interval
    }

    fn subsystems(&self) -> &[String] {
        &self.known.names
    }

    fn scene(&self, subsystem: u32) -> Option<&Scene> {
        let others = self.known.subsystems.get(subsystem as usize)?;
        others.scene.get_or_init(|| self.copied(subsystem)).as_ref()
    }

    fn is_visible(&self, shape: ShapeRef) -> bool {
        let shape = TgShapeRef { subsystem: shape.subsystem, body: shape.body, shape: shape.shape };
        // SAFETY: the host's function with the host's context.
        self.raw.is_visible.is_some_and(|f| unsafe { f(self.raw.ctx, shape) } != 0)
    }

    fn body(&self, subsystem: &str, body: &str) -> Option<BodyRef> {
        let (subsystem, body) = (c_string(subsystem), c_string(body));
        let mut out = BodyRef::NONE;
        // SAFETY: the host's function, texts for this call, and a place laid out as ours (`abi::layout`).
        let status = unsafe {
            (self.raw.body?)(self.raw.ctx, subsystem.as_ptr(), body.as_ptr(), (&raw mut out).cast())
        };
        (status == TG_OK).then_some(out)
    }

    fn pose(&self, body: BodyRef, time: f64) -> Option<BodyState> {
        let mut out = BodyState::REST;
        let body = TgBodyRef { subsystem: body.subsystem, body: body.body };
        // SAFETY: the host's function and a place laid out as ours (`abi::layout`).
        let status = unsafe { (self.raw.pose?)(self.raw.ctx, body, time, (&raw mut out).cast()) };
        (status == TG_OK).then_some(out)
    }

    fn cast_rays(&self, rays: &[Ray], mask: &RayMask, hits: &mut [RayHit]) {
        let n = rays.len().min(hits.len());
        hits[..n].fill(RayHit::MISS);
        if let Some(f) = self.raw.cast_rays {
            let (rays, mask) = (rays.as_ptr().cast(), std::ptr::from_ref(mask).cast());
            // SAFETY: the host's function and arrays of n, laid out as ours (`abi::layout`).
            unsafe { f(self.raw.ctx, n, rays, mask, hits.as_mut_ptr().cast()) };
        }
    }

    fn ground_heights(&self, points: &[[f64; 2]], heights: &mut [f64]) {
        let n = points.len().min(heights.len());
        heights[..n].fill(f64::NAN);
        if let Some(f) = self.raw.ground_heights {
            // SAFETY: the host's function and arrays of n.
            unsafe { f(self.raw.ctx, n, points.as_ptr().cast(), heights.as_mut_ptr()) };
        }
    }

    fn overlap(&self, centre: [f64; 3], radius: f64, mask: &RayMask, found: &mut Vec<ShapeRef>) {
        found.clear();
        let Some(f) = self.raw.overlap else { return };
        let none = ShapeRef { subsystem: u32::MAX, body: u32::MAX, shape: u32::MAX };
        let mut room = 16;
        loop {
            found.resize(room, none);
            let mask = std::ptr::from_ref(mask).cast();
            // SAFETY: the host's function, three coordinates and that much room.
            let count =
                unsafe { f(self.raw.ctx, centre.as_ptr(), radius, mask, room, found.as_mut_ptr().cast()) };
            if count <= room {
                return found.truncate(count);
            }
            room = count;
        }
    }

    fn fields(&self, subsystem: u32) -> &[FieldInfo] {
        let Some(others) = self.known.subsystems.get(subsystem as usize) else { return &[] };
        others.fields.get_or_init(|| {
            let Some(f) = self.raw.fields else { return Vec::new() };
            let mut first = std::ptr::null();
            // SAFETY: the host's function with the host's context.
            unsafe {
                let count = f(self.raw.ctx, subsystem, &raw mut first);
                slice(first, count).iter().map(|f| field_in(f)).collect::<Result<_>>().unwrap_or_default()
            }
        })
    }

    fn field_tile(&self, subsystem: u32, field: usize, a: u32, b: u32) -> Result<FieldTile<'_>> {
        let f = self.raw.field_tile.ok_or(Error::Unsupported)?;
        let no_field = || Error::Refused(format!("no field number {field}"));
        let info = self.fields(subsystem).get(field).ok_or_else(no_field)?;
        let mut out = NO_TILE;
        // SAFETY: the host's function and a place for the answer.
        match unsafe { f(self.raw.ctx, subsystem, field, a, b, &raw mut out) } {
            // SAFETY: the data are valid until `observe` returns, after this world.
            TG_OK => unsafe { tile_in(&out, info) },
            status => Err(crate::convert::error(status, format!("no tile ({a}, {b})"), f64::NAN)),
        }
    }
}

pub(super) unsafe extern "C" fn observe(
    instance: *mut c_void,
    step: *const TgStep,
    world: *const TgWorld,
) -> TgStatus {
    // SAFETY: the host passes a live instance, a step and a world for this call.
    unsafe {
        change(instance, |e| {
            let raw = ForeignWorld::table(world)?;
            e.known.refresh(&raw)?;
            e.subsystem.observe(&step_of(step), &ForeignWorld { raw, known: &e.known })
        })
    }
}

pub(super) unsafe extern "C" fn scene_joints(instance: *mut c_void, first: *mut *const TgJoint) -> usize {
    // SAFETY: the host passes a live instance and a place for a pointer.
    unsafe { list(instance, first, |e| &e.descriptions.scene.joints) }
}

pub(super) unsafe extern "C" fn shape_materials(
    instance: *mut c_void,
    first: *mut *const TgMaterial,
) -> usize {
    // SAFETY: the host passes a live instance and a place for a pointer.
    unsafe { list(instance, first, |e| &e.descriptions.scene.materials) }
}

pub(super) unsafe extern "C" fn streams(instance: *mut c_void, first: *mut *const TgStream) -> usize {
    // SAFETY: the host passes a live instance and a place for a pointer.
    unsafe { list(instance, first, |e| &e.descriptions.streams) }
}

pub(super) unsafe extern "C" fn shape_visibility(instance: *mut c_void, n: usize, out: *mut u8) -> TgStatus {
    // SAFETY: the host passes a live instance and room for n; a bool is a byte that is 0 or 1, which we write first.
    unsafe {
        look_status(instance, |e| {
            slice_mut(out, n).fill(1);
            e.subsystem.shape_visibility(slice_mut(out.cast::<bool>(), n))
        })
    }
}

pub(super) unsafe extern "C" fn stream(
    instance: *mut c_void,
    stream: usize,
    out: *mut TgMessage,
) -> TgStatus {
    // SAFETY: the host passes a live instance and a place for the answer.
    unsafe {
        look_status(instance, |e| {
            if let Some(message) = e.subsystem.stream(stream)? {
                *out = TgMessage {
                    time: message.time,
                    bytes: message.bytes.as_ptr(),
                    size: message.bytes.len(),
                    is_there: 1,
                    reserved: 0,
                };
            }
            Ok(())
        })
    }
}

pub(super) unsafe extern "C" fn overlays(instance: *mut c_void, first: *mut *const TgOverlay) -> usize {
    // SAFETY: the host passes a live instance and a place for a pointer; the figures are kept until the next call.
    unsafe {
        look(instance, 0, |e| {
            let mut shown = Vec::new();
            e.subsystem.overlays(&mut shown);
            let mut keep = Keep::default();
            let figures: Vec<TgOverlay> = shown.iter().map(|o| overlay(o, &mut keep)).collect();
            *first = figures.as_ptr();
            let count = figures.len();
            e.scratch.borrow_mut().overlays = Some((figures, keep));
            count
        })
    }
}

fn overlay(o: &Overlay, keep: &mut Keep) -> TgOverlay {
    let mut out = TgOverlay {
        layer: keep.text(&o.layer),
        text: std::ptr::null(),
        frame: o.frame,
        figure: TG_LINES,
        colour: o.colour,
        points: std::ptr::null(),
        n_points: 0,
        size: 0.0,
        pose: pose_out(&terraglue_subsystem::Pose::IDENTITY),
        semi_axes: [0.0; 2],
    };
    let mut points = |points: &[[f64; 3]]| (keep.points(points), points.len());
    match &o.figure {
        Figure::Lines { points: p, width } => {
            (out.figure, out.size, (out.points, out.n_points)) = (TG_LINES, *width, points(p));
        }
        Figure::Points { points: p, size } => {
            (out.figure, out.size, (out.points, out.n_points)) = (TG_POINTS, *size, points(p));
        }
        Figure::Arrows { points: p, width } => {
            (out.figure, out.size, (out.points, out.n_points)) = (TG_ARROWS, *width, points(p));
        }
        Figure::Ellipse { pose, semi_axes } => {
            (out.figure, out.pose, out.semi_axes) = (TG_ELLIPSE, pose_out(pose), *semi_axes);
        }
        Figure::Text { at, height, text } => {
            (out.figure, out.size, (out.points, out.n_points)) = (TG_TEXT, *height, points(&[*at]));
            out.text = keep.text(text);
        }
    }
    out
}
