//! The calls of a step.

use super::{Exported, Scratch, change};
use crate::abi::*;
use crate::convert;
use crate::text::{slice, slice_mut};
use std::ffi::c_void;
use terraglue_subsystem::{Error, Estimate, Input, Motion, Response, Result, Step};

/// # Safety
/// `step` points at a complete step whose arrays outlive `'a`.
pub(super) unsafe fn step_of<'a>(step: *const TgStep) -> Step<'a> {
    // SAFETY: by the contract; ports and nodes have the layout of ours (`abi::layout`).
    unsafe {
        let s = &*step;
        Step {
            t: s.t,
            h: s.h,
            index: s.index,
            trial: s.trial,
            n: s.n,
            ports: slice(s.ports.cast(), s.n_ports as usize),
            nodes: slice(s.nodes.cast(), s.n_nodes as usize),
        }
    }
}

/// # Safety
/// `motion` points at two vectors of n values that outlive `'a`.
unsafe fn motion_of<'a>(motion: *const TgMotion, n: usize) -> Motion<'a> {
    // SAFETY: by the contract.
    unsafe { Motion { x: slice((*motion).x, n), v: slice((*motion).v, n) } }
}

/// # Safety
/// `input` points at a complete input whose vectors have the lengths that its kind asks for.
unsafe fn input_of<'a>(input: *const TgInput, n: usize) -> Result<Input<'a>> {
    // SAFETY: by the contract.
    unsafe {
        let i = &*input;
        let motion = || Motion { x: slice(i.x, n), v: slice(i.v, n) };
        match i.kind {
            TG_FORCE => {
                Ok(Input::Force { t: slice(i.t, n), motion: (!i.x.is_null() && !i.v.is_null()).then(motion) })
            }
            TG_MOTION => Ok(Input::Motion(motion())),
            _ => Err(Error::Unsupported),
        }
    }
}

/// Runs a call that answers with a response; `reached`, flags and a discarded step go back by the response.
///
/// # Safety
/// `out` points at a complete response whose vectors hold n values.
unsafe fn respond(out: *mut TgResponse, n: usize, f: impl FnOnce(&mut Response) -> Result) -> Result {
    // SAFETY: by the contract; x, v, a and t are four different vectors.
    let (raw, mut response) = unsafe {
        let raw = &mut *out;
        let response = Response {
            x: slice_mut(raw.x, n),
            v: slice_mut(raw.v, n),
            a: slice_mut(raw.a, n),
            t: slice_mut(raw.t, n),
            reached: raw.reached,
            flags: raw.flags,
        };
        (raw, response)
    };
    let result = f(&mut response);
    (raw.reached, raw.flags) = (response.reached, response.flags);
    if let Err(Error::Discard { reached }) = result {
        raw.reached = reached;
    }
    result
}

pub(super) unsafe extern "C" fn set_ports(
    instance: *mut c_void,
    step: *const TgStep,
    laws: *mut TgLaw,
    now: *mut TgResponse,
) -> TgStatus {
    // SAFETY: the host passes a live instance and complete arguments; laws holds one entry per port.
    unsafe {
        change(instance, |e| {
            let step = step_of(step);
            let laws = slice_mut(laws.cast(), step.ports.len());
            respond(now, step.n as usize, |now| e.subsystem.set_ports(&step, laws, now))
        })
    }
}

pub(super) unsafe extern "C" fn estimate_forces(
    instance: *mut c_void,
    step: *const TgStep,
    partner: *const TgMotion,
    out: *mut TgEstimate,
) -> TgStatus {
    // SAFETY: the host passes a live instance and complete arguments.
    unsafe {
        change(instance, |e| {
            let (step, raw) = (step_of(step), &mut *out);
            let n = step.n as usize;
            let mut estimate = Estimate {
                t_star: slice_mut(raw.t_star, n),
                x_free: slice_mut(raw.x_free, n),
                g: slice_mut(raw.g, n * n),
                active: slice_mut(raw.active, step.ports.len()),
                unique: raw.unique != 0,
            };
            let result = e.subsystem.estimate_forces(&step, &motion_of(partner, n), &mut estimate);
            raw.unique = u32::from(estimate.unique);
            if let Err(Error::Discard { reached }) = result {
                raw.reached = reached;
            }
            result
        })
    }
}

pub(super) unsafe extern "C" fn solve_compatibility(
    instance: *mut c_void,
    step: *const TgStep,
    estimate: *const TgEstimate,
    out: *mut TgResponse,
) -> TgStatus {
    // SAFETY: the host passes a live instance and complete arguments.
    unsafe {
        change(instance, |e| {
            let step = step_of(step);
            let Exported { subsystem, scratch, .. } = e;
            let estimate = estimate_of(scratch.get_mut(), &*estimate, step.n as usize, step.ports.len());
            respond(out, step.n as usize, |out| subsystem.solve_compatibility(&step, &estimate, out))
        })
    }
}

/// A copy of the host's estimate in our own buffers: the interface holds it in mutable slices, the host does
/// not give up its own.
///
/// # Safety
/// `raw` is complete for n components and `ports` ports.
unsafe fn estimate_of<'a>(s: &'a mut Scratch, raw: &TgEstimate, n: usize, ports: usize) -> Estimate<'a> {
    s.estimate.clear();
    s.active.clear();
    // SAFETY: by the contract.
    unsafe {
        s.estimate.extend_from_slice(slice(raw.t_star, n));
        s.estimate.extend_from_slice(slice(raw.x_free, n));
        s.estimate.extend_from_slice(slice(raw.g, n * n));
        s.active.extend_from_slice(slice(raw.active, ports));
    }
    s.estimate.resize(2 * n + n * n, f64::NAN);
    let (t_star, rest) = s.estimate.split_at_mut(n);
    let (x_free, g) = rest.split_at_mut(n);
    Estimate { t_star, x_free, g, active: &mut s.active, unique: raw.unique != 0 }
}

pub(super) unsafe extern "C" fn advance(
    instance: *mut c_void,
    step: *const TgStep,
    input: *const TgInput,
    out: *mut TgResponse,
) -> TgStatus {
    // SAFETY: the host passes a live instance and complete arguments.
    unsafe {
        change(instance, |e| {
            let step = step_of(step);
            let n = step.n as usize;
            let input = input_of(input, n)?;
            respond(out, n, |out| e.subsystem.advance(&step, &input, out))
        })
    }
}

pub(super) unsafe extern "C" fn interface_jacobian(
    instance: *mut c_void,
    step: *const TgStep,
    level: u32,
    out: *mut f64,
) -> TgStatus {
    // SAFETY: the host passes a live instance, a complete step and n x n values.
    unsafe {
        change(instance, |e| {
            let step = step_of(step);
            let n = step.n as usize;
            let level = convert::level(level).ok_or(Error::Unsupported)?;
            e.subsystem.interface_jacobian(&step, level, slice_mut(out, n * n))
        })
    }
}

pub(super) unsafe extern "C" fn commit(
    instance: *mut c_void,
    step: *const TgStep,
    t: *const f64,
    partner: *const TgMotion,
) -> TgStatus {
    // SAFETY: the host passes a live instance and complete arguments.
    unsafe {
        change(instance, |e| {
            let step = step_of(step);
            let n = step.n as usize;
            e.subsystem.commit(&step, slice(t, n), &motion_of(partner, n))
        })
    }
}
