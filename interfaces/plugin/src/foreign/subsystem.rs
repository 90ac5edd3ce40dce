//! A foreign instance as a [`Subsystem`]: every call goes through the table, nothing is allocated on success.

use super::descriptions::{ForeignDescriptions, check_capabilities, list};
use super::raw::Raw;
use super::services::Services;
use super::sight::{Shown, overlay_in};
use crate::abi::*;
use crate::field_table::{NO_TILE, tile_in};
use crate::text::{c_string, slice};
use std::cell::RefCell;
use std::ffi::c_void;
use terraglue_subsystem::{
    Action, BodyState, Capabilities, Energy, Error, Estimate, FieldInfo, FieldTile, Input, Law, Level,
    Message, Motion, Overlay, Response, Result, Scene, Step, StreamInfo, Subsystem, Values, ValuesMut,
    Variable, World,
};

/// An instance of a foreign module.
pub struct ForeignSubsystem {
    pub(super) raw: Raw,
    capabilities: Capabilities,
    descriptions: ForeignDescriptions,
    pub(super) scratch: RefCell<Vec<TgBytes>>,
    // At one place as long as the instance, which may have kept a pointer to it.
    shown: Box<Shown>,
}

// SAFETY: the ABI asks for calls from one thread at a time, not always the same; `&self` is not shared
// between threads (no Sync).
unsafe impl Send for ForeignSubsystem {}

/// Refuses a call whose vectors are too short: the module would write beyond them.
#[inline]
fn enough(lengths: &[(usize, usize)]) -> Result {
    if lengths.iter().all(|(have, need)| have >= need) { Ok(()) } else { Err(too_short()) }
}

#[cold]
fn too_short() -> Error {
    Error::Failed("called with vectors shorter than the ports of the step need".into())
}

fn step_out(s: &Step) -> Result<TgStep> {
    let inside = s.ports.iter().all(|p| {
        p.range().end <= s.n as usize && p.first_node as usize + p.node_count as usize <= s.nodes.len()
    });
    if !inside {
        return Err(too_short());
    }
    Ok(TgStep {
        t: s.t,
        h: s.h,
        index: s.index,
        trial: s.trial,
        n: s.n,
        n_ports: s.ports.len() as u32,
        n_nodes: s.nodes.len() as u32,
        ports: s.ports.as_ptr().cast(),
        nodes: s.nodes.as_ptr().cast(),
    })
}

fn motion_out(m: &Motion) -> TgMotion {
    TgMotion { x: m.x.as_ptr(), v: m.v.as_ptr() }
}

fn input_out(input: &Input, n: usize) -> Result<TgInput> {
    let null = std::ptr::null();
    let mut out = TgInput { kind: TG_FORCE, reserved: 0, t: null, x: null, v: null };
    match input {
        Input::Force { t, motion } => {
            enough(&[(t.len(), n)])?;
            out.t = t.as_ptr();
            if let Some(m) = motion {
                enough(&[(m.x.len(), n), (m.v.len(), n)])?;
                (out.x, out.v) = (m.x.as_ptr(), m.v.as_ptr());
            }
        }
        Input::Motion(m) => {
            enough(&[(m.x.len(), n), (m.v.len(), n)])?;
            (out.kind, out.x, out.v) = (TG_MOTION, m.x.as_ptr(), m.v.as_ptr());
        }
    }
    Ok(out)
}

impl ForeignSubsystem {
    /// The table and the opaque instance, for programs that put a module to the test. The pointer is valid as long
    /// as `self`.
    pub fn raw(&self) -> (&TgSubsystem, *mut c_void) {
        (&self.raw.table, self.raw.instance)
    }

    pub(super) fn new(table: TgSubsystem, instance: *mut c_void, services: Box<Services>) -> Result<Self> {
        let raw = Raw { table, instance, services };
        let descriptions = ForeignDescriptions::of(&raw)?;
        // SAFETY: a required function with the live instance.
        let bits = table.capabilities.map_or(0, |f| unsafe { f(instance) });
        let capabilities = Capabilities(bits);
        check_capabilities(capabilities, &table)?;
        let (scratch, shown) = (RefCell::default(), Box::<Shown>::default());
        Ok(Self { raw, capabilities, descriptions, scratch, shown })
    }

    /// Runs a call that answers with a response.
    fn respond(
        &self,
        step: &Step,
        out: &mut Response,
        call: impl FnOnce(*const TgStep, *mut TgResponse) -> TgStatus,
    ) -> Result {
        let n = step.n as usize;
        enough(&[(out.x.len(), n), (out.v.len(), n), (out.a.len(), n), (out.t.len(), n)])?;
        let step = step_out(step)?;
        let mut response = TgResponse {
            x: out.x.as_mut_ptr(),
            v: out.v.as_mut_ptr(),
            a: out.a.as_mut_ptr(),
            t: out.t.as_mut_ptr(),
            reached: out.reached,
            flags: out.flags,
            reserved: 0,
        };
        let status = call(&raw const step, &raw mut response);
        (out.reached, out.flags) = (response.reached, response.flags);
        self.raw.check(status, response.reached)
    }
}

impl Subsystem for ForeignSubsystem {
    fn capabilities(&self) -> Capabilities {
        self.capabilities
    }

    fn set_ports(&mut self, step: &Step, laws: &mut [Law], now: &mut Response) -> Result {
        let Some(f) = self.raw.table.set_ports else { return Ok(()) };
        enough(&[(laws.len(), step.ports.len())])?;
        let (instance, laws) = (self.raw.instance, laws.as_mut_ptr().cast());
        // SAFETY: a live instance; lengths were checked.
        self.respond(step, now, |s, now| unsafe { f(instance, s, laws, now) })
    }

    fn estimate_forces(&mut self, step: &Step, partner: &Motion, out: &mut Estimate) -> Result {
        let f = self.raw.table.estimate_forces.ok_or(Error::Unsupported)?;
        let n = step.n as usize;
        enough(&[(partner.x.len(), n), (partner.v.len(), n), (out.t_star.len(), n), (out.x_free.len(), n)])?;
        enough(&[(out.g.len(), n * n), (out.active.len(), step.ports.len())])?;
        let (step, partner) = (step_out(step)?, motion_out(partner));
        let mut estimate = TgEstimate {
            t_star: out.t_star.as_mut_ptr(),
            x_free: out.x_free.as_mut_ptr(),
            g: out.g.as_mut_ptr(),
            active: out.active.as_mut_ptr(),
            reached: f64::NAN,
            unique: u32::from(out.unique),
            reserved: 0,
        };
        // SAFETY: a live instance; lengths were checked.
        let status = unsafe { f(self.raw.instance, &raw const step, &raw const partner, &raw mut estimate) };
        out.unique = estimate.unique != 0;
        self.raw.check(status, estimate.reached)
    }

    fn solve_compatibility(&mut self, step: &Step, e: &Estimate, out: &mut Response) -> Result {
        let f = self.raw.table.solve_compatibility.ok_or(Error::Unsupported)?;
        let n = step.n as usize;
        enough(&[(e.t_star.len(), n), (e.x_free.len(), n), (e.g.len(), n * n)])?;
        enough(&[(e.active.len(), step.ports.len())])?;
        // The module only reads the estimate (its argument is const).
        let estimate = TgEstimate {
            t_star: e.t_star.as_ptr().cast_mut(),
            x_free: e.x_free.as_ptr().cast_mut(),
            g: e.g.as_ptr().cast_mut(),
            active: e.active.as_ptr().cast_mut(),
            reached: f64::NAN,
            unique: u32::from(e.unique),
            reserved: 0,
        };
        let instance = self.raw.instance;
        // SAFETY: a live instance; lengths were checked.
        self.respond(step, out, |s, out| unsafe { f(instance, s, &raw const estimate, out) })
    }

    fn advance(&mut self, step: &Step, input: &Input, out: &mut Response) -> Result {
        let f = self.raw.table.advance.ok_or(Error::Unsupported)?;
        let input = input_out(input, step.n as usize)?;
        let instance = self.raw.instance;
        // SAFETY: a live instance; lengths were checked.
        self.respond(step, out, |s, out| unsafe { f(instance, s, &raw const input, out) })
    }

    fn interface_jacobian(&mut self, step: &Step, level: Level, out: &mut [f64]) -> Result {
        let f = self.raw.table.interface_jacobian.ok_or(Error::Unsupported)?;
        enough(&[(out.len(), (step.n as usize).pow(2))])?;
        let step = step_out(step)?;
        // SAFETY: a live instance; lengths were checked.
        let status = unsafe { f(self.raw.instance, &raw const step, level as u32, out.as_mut_ptr()) };
        self.raw.check(status, f64::NAN)
    }

    fn commit(&mut self, step: &Step, t: &[f64], partner: &Motion) -> Result {
        let Some(f) = self.raw.table.commit else { return Ok(()) };
        let n = step.n as usize;
        enough(&[(t.len(), n), (partner.x.len(), n), (partner.v.len(), n)])?;
        let (step, partner) = (step_out(step)?, motion_out(partner));
        // SAFETY: a live instance; lengths were checked.
        let status = unsafe { f(self.raw.instance, &raw const step, t.as_ptr(), &raw const partner) };
        self.raw.check(status, f64::NAN)?;
        self.shown.check()
    }

    fn observe(&mut self, step: &Step, world: &dyn World) -> Result {
        let f = self.raw.table.observe.ok_or(Error::Unsupported)?;
        let step = step_out(step)?;
        let raw = &self.raw;
        self.shown.with(world, |world| {
            // SAFETY: a live instance; the world is valid during the call.
            raw.check(unsafe { f(raw.instance, &raw const step, world) }, f64::NAN)
        })
    }

    fn shape_visibility(&self, out: &mut [bool]) -> Result {
        out.fill(true);
        let Some(f) = self.raw.table.shape_visibility else { return Ok(()) };
        enough(&[(out.len(), self.descriptions.scene.shapes.len())])?;
        let first: *mut u8 = out.as_mut_ptr().cast();
        // SAFETY: a live instance and room for all shapes.
        let status = unsafe { f(self.raw.instance, out.len(), first) };
        for k in 0..out.len() {
            // SAFETY: inside `out`, as bytes: the bytes written by the module need not be bools yet.
            unsafe { *first.add(k) = u8::from(*first.add(k) != 0) }
        }
        self.raw.check(status, f64::NAN)
    }

    fn streams(&self) -> &[StreamInfo] {
        &self.descriptions.streams
    }

    fn stream(&self, k: usize) -> Result<Option<Message<'_>>> {
        let f = self.raw.table.stream.ok_or(Error::Unsupported)?;
        if k >= self.descriptions.streams.len() {
            return Err(Error::Refused(format!("no stream number {k}")));
        }
        let mut out =
            TgMessage { time: f64::NAN, bytes: std::ptr::null(), size: 0, is_there: 0, reserved: 0 };
        // SAFETY: a live instance and a place for the answer.
        self.raw.check(unsafe { f(self.raw.instance, k, &raw mut out) }, f64::NAN)?;
        // SAFETY: valid until a call that takes `&mut self`.
        let bytes = unsafe { slice(out.bytes, out.size) };
        Ok((out.is_there != 0).then_some(Message { time: out.time, bytes }))
    }

    fn overlays(&self, out: &mut Vec<Overlay>) {
        if let Some(f) = self.raw.table.overlays {
            // SAFETY: a live instance; the figures are copied before its next call.
            let shown = unsafe { list(|first| f(self.raw.instance, first)) };
            // SAFETY: the pointers of a figure are valid until the next call.
            out.extend(shown.iter().filter_map(|o| unsafe { overlay_in(o) }));
        }
    }

    fn save_state(&mut self, slot: u32) -> Result {
        let f = self.raw.table.save_state.ok_or(Error::Unsupported)?;
        // SAFETY: a live instance.
        self.raw.check(unsafe { f(self.raw.instance, slot) }, f64::NAN)
    }

    fn restore_state(&mut self, slot: u32) -> Result {
        let f = self.raw.table.restore_state.ok_or(Error::Unsupported)?;
        // SAFETY: a live instance.
        self.raw.check(unsafe { f(self.raw.instance, slot) }, f64::NAN)
    }

    fn serialize(&self) -> Result<Vec<u8>> {
        let f = self.raw.table.serialize.ok_or(Error::Unsupported)?;
        let mut out = TgBytes { data: std::ptr::null(), size: 0 };
        // SAFETY: a live instance; the bytes are copied before the next call.
        unsafe {
            self.raw.check(f(self.raw.instance, &raw mut out), f64::NAN)?;
            Ok(slice(out.data, out.size).to_vec())
        }
    }

    fn deserialize(&mut self, bytes: &[u8]) -> Result {
        let f = self.raw.table.deserialize.ok_or(Error::Unsupported)?;
        let bytes = TgBytes { data: bytes.as_ptr(), size: bytes.len() };
        // SAFETY: a live instance and bytes for this call.
        self.raw.check(unsafe { f(self.raw.instance, bytes) }, f64::NAN)
    }

    fn variables(&self) -> &[Variable] {
        &self.descriptions.variables
    }

    fn get(&self, ids: &[u32], out: ValuesMut) -> Result {
        self.get_values(ids, out)
    }

    fn set(&mut self, ids: &[u32], values: Values) -> Result {
        self.set_values(ids, values)
    }

    fn actions(&self) -> &[Action] {
        &self.descriptions.actions
    }

    fn act(&mut self, action: &str, arguments: &str) -> Result {
        let f = self.raw.table.act.ok_or(Error::Unsupported)?;
        let (action, arguments) = (c_string(action), c_string(arguments));
        // SAFETY: a live instance and texts for this call.
        self.raw.check(unsafe { f(self.raw.instance, action.as_ptr(), arguments.as_ptr()) }, f64::NAN)
    }

    fn next_event_time(&self) -> f64 {
        // SAFETY: a live instance.
        self.raw.table.next_event_time.map_or(f64::INFINITY, |f| unsafe { f(self.raw.instance) })
    }

    fn scene(&self) -> Scene {
        self.descriptions.scene.clone()
    }

    fn body_states(&self, out: &mut [BodyState]) -> Result {
        let Some(f) = self.raw.table.body_states else { return Ok(()) };
        enough(&[(out.len(), self.descriptions.scene.bodies.len())])?;
        // SAFETY: a live instance and room for all bodies.
        let status =
            unsafe { f(self.raw.instance, self.descriptions.scene.bodies.len(), out.as_mut_ptr().cast()) };
        self.raw.check(status, f64::NAN)
    }

    fn fields(&self) -> &[FieldInfo] {
        &self.descriptions.fields
    }

    fn field_tile(&self, field: usize, a: u32, b: u32) -> Result<FieldTile<'_>> {
        let f = self.raw.table.field_tile.ok_or(Error::Unsupported)?;
        let info =
            self.fields().get(field).ok_or_else(|| Error::Failed(format!("no field number {field}")))?;
        let mut out = NO_TILE;
        // SAFETY: a live instance and a place for the answer.
        self.raw.check(unsafe { f(self.raw.instance, field, a, b, &raw mut out) }, f64::NAN)?;
        // SAFETY: valid until a call that takes `&mut self`.
        unsafe { tile_in(&out, info) }
    }

    fn energy(&self) -> Energy {
        let mut out = Energy::UNKNOWN;
        if let Some(f) = self.raw.table.energy {
            // SAFETY: a live instance and a place for the answer, laid out as ours (`abi::layout`).
            let status = unsafe { f(self.raw.instance, (&raw mut out).cast()) };
            if status != TG_OK {
                return Energy::UNKNOWN;
            }
        }
        out
    }
}
