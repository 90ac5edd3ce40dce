//! Laws across the border: a Rust [`LawModule`] as a table, and any table as a [`NodeLaw`].
//!
//! A law has no instance: its functions take the numbers of the law with every call, and a panic inside one is a status.

use crate::abi::*;
use crate::text::{borrowed, c_string, slice, slice_mut};
use std::any::Any;
use std::ffi::CString;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use terraglue_subsystem::{
    Error, LawModule, MOST_LAW_STATE, NodeLaw, PressureAnswer, PressureNodes, Result, ShearAnswer, ShearNodes,
};

/// The functions of a law in Rust.
pub(crate) fn functions<L: LawModule>() -> TgNodeLaw {
    TgNodeLaw {
        size: size_of::<TgNodeLaw>() as u32,
        state_doubles: L::STATE_DOUBLES as u32,
        pressure: L::PRESSURE.then_some(pressure::<L>),
        shear: L::SHEAR.then_some(shear::<L>),
    }
}

/// Calls a law in Rust; a panic is a status. `longest` is the step that it allows, before and after.
#[inline]
fn called(h: f64, longest: &mut f64, law: impl FnOnce(&mut f64) -> Result) -> TgStatus {
    match catch_unwind(AssertUnwindSafe(|| law(longest))) {
        Ok(Ok(())) => TG_OK,
        Ok(Err(Error::Discard { .. })) => {
            // a law knows no time: half the step unless it has given a length
            *longest = longest.min(0.5 * h);
            TG_OK
        }
        Ok(Err(error)) => crate::convert::status(error).0,
        Err(_) => TG_FATAL,
    }
}

unsafe extern "C" fn pressure<L: LawModule>(
    nodes: *const TgPressureNodes,
    out: *mut TgPressureAnswer,
) -> TgStatus {
    // SAFETY: by the contract of the table.
    unsafe { pressed(nodes, out, L::STATE_DOUBLES, L::pressure) }
}

unsafe extern "C" fn shear<L: LawModule>(nodes: *const TgShearNodes, out: *mut TgShearAnswer) -> TgStatus {
    // SAFETY: by the contract of the table.
    unsafe { sheared(nodes, out, L::STATE_DOUBLES, L::shear) }
}

/// A pressure function of C around one in Rust; a panic is a status.
///
/// # Safety
/// The pointers are null or as the header requires, for a law that keeps `doubles` per node.
#[inline]
pub(crate) unsafe fn pressed(
    nodes: *const TgPressureNodes,
    out: *mut TgPressureAnswer,
    doubles: usize,
    law: impl FnOnce(&[f64], &PressureNodes, &mut PressureAnswer) -> Result,
) -> TgStatus {
    if nodes.is_null() || out.is_null() {
        return TG_ERROR;
    }
    // SAFETY: not null; the host passes arrays of the lengths that the header names, for this call.
    unsafe {
        let (raw, answer) = (&*nodes, &mut *out);
        let (n, states) = (raw.n, raw.n * doubles);
        let kept = if doubles > 0 { n } else { 0 };
        let nodes = PressureNodes {
            b: raw.b,
            h: raw.h,
            depth: slice(raw.depth, n),
            permanent: slice(raw.permanent, kept),
            slip: slice(raw.slip, kept),
            state: slice(raw.state, states),
        };
        let mut into = PressureAnswer {
            pressure: slice_mut(answer.pressure, n),
            slope: slice_mut(answer.slope, n),
            permanent: slice_mut(answer.permanent, kept),
            state: slice_mut(answer.state, states),
            longest_s: answer.longest,
        };
        let parameters = slice(raw.parameters, raw.n_parameters);
        called(raw.h, &mut answer.longest, |longest| {
            let done = law(parameters, &nodes, &mut into);
            *longest = into.longest_s;
            done
        })
    }
}

/// A shear function of C around one in Rust.
///
/// # Safety
/// As [`pressed`].
#[inline]
pub(crate) unsafe fn sheared(
    nodes: *const TgShearNodes,
    out: *mut TgShearAnswer,
    doubles: usize,
    law: impl FnOnce(&[f64], &ShearNodes, &mut ShearAnswer) -> Result,
) -> TgStatus {
    if nodes.is_null() || out.is_null() {
        return TG_ERROR;
    }
    // SAFETY: as in `pressed`.
    unsafe {
        let (raw, answer) = (&*nodes, &mut *out);
        let n = raw.n;
        let nodes = ShearNodes {
            h: raw.h,
            pressure: slice(raw.pressure, n),
            slip: slice(raw.slip, n),
            state: slice(raw.state, n * doubles),
        };
        let mut into = ShearAnswer {
            stress: slice_mut(answer.stress, n),
            by_pressure: slice_mut(answer.by_pressure, n),
            by_slip: slice_mut(answer.by_slip, n),
            longest_s: answer.longest,
        };
        let parameters = slice(raw.parameters, raw.n_parameters);
        called(raw.h, &mut answer.longest, |longest| {
            let done = law(parameters, &nodes, &mut into);
            *longest = into.longest_s;
            done
        })
    }
}

/// A law behind a table, with its numbers.
pub struct TableLaw {
    name: CString,
    label: String,
    law: TgNodeLaw,
    parameters: Vec<f64>,
}

impl TableLaw {
    /// Checks size and functions without calling anything.
    ///
    /// # Errors
    /// Why it is none: no table, no function, or a state that a soil cannot keep.
    ///
    /// # Safety
    /// `law` is null or points at functions that state their size truly, live as long as the process and keep to the
    /// contract of `terraglue.h`.
    pub unsafe fn new(
        name: &str,
        law: *const TgNodeLaw,
        parameters: Vec<f64>,
    ) -> std::result::Result<Self, String> {
        if law.is_null() {
            return Err("`law` of its table is null; a module of kind law names its functions there".into());
        }
        // SAFETY: the size comes first, and all zero is valid (null pointers).
        let law = unsafe {
            let mut whole: TgNodeLaw = std::mem::zeroed();
            let bytes = ((*law).size as usize).min(size_of::<TgNodeLaw>());
            std::ptr::copy_nonoverlapping(law.cast::<u8>(), (&raw mut whole).cast::<u8>(), bytes);
            whole
        };
        if law.pressure.is_none() && law.shear.is_none() {
            return Err("it has neither a pressure nor a shear function".into());
        }
        if law.state_doubles as usize > MOST_LAW_STATE {
            return Err(format!(
                "it wants {} doubles per node; a soil keeps at most {MOST_LAW_STATE}",
                law.state_doubles
            ));
        }
        if law.state_doubles > 0 && law.pressure.is_none() {
            return Err("it keeps a state, but has no pressure function that would write it".into());
        }
        Ok(Self { name: c_string(name), label: name.to_owned(), law, parameters })
    }

    /// A law that a host has opened.
    ///
    /// # Safety
    /// `open` is null or valid as the header requires.
    pub(crate) unsafe fn of_host(open: *const TgOpenLaw) -> Option<Arc<dyn NodeLaw>> {
        // SAFETY: by the contract; the numbers are copied.
        unsafe {
            let open = open.as_ref()?;
            let numbers = slice(open.parameters, open.n_parameters).to_vec();
            let law = Self::new(borrowed(open.name).ok()?, open.law, numbers).ok()?;
            Some(Arc::new(law))
        }
    }

    /// The law as the table of a host shows it; valid as long as this.
    pub(crate) fn open(&self) -> TgOpenLaw {
        TgOpenLaw {
            name: self.name.as_ptr(),
            law: &raw const self.law,
            parameters: self.parameters.as_ptr(),
            n_parameters: self.parameters.len(),
        }
    }

    #[cold]
    fn failed(&self, function: &str, status: TgStatus) -> Error {
        let said = match status {
            TG_FATAL => "panicked or cannot go on".to_owned(),
            TG_UNSUPPORTED => "has no such function".to_owned(),
            other => format!("answered with the status {other}"),
        };
        Error::Failed(format!("[TG14] the law `{}`, function {function}: {said}", self.label))
    }

    #[cold]
    fn uneven(&self, function: &str) -> Error {
        Error::Failed(format!("the law `{}`, function {function}: arrays of different lengths", self.label))
    }
}

/// Null for an array that a law without state does not get.
fn given(values: &[f64], used: bool) -> *const f64 {
    if used { values.as_ptr() } else { std::ptr::null() }
}

impl NodeLaw for TableLaw {
    fn name(&self) -> &str {
        &self.label
    }

    fn state_doubles(&self) -> usize {
        self.law.state_doubles as usize
    }

    fn has_pressure(&self) -> bool {
        self.law.pressure.is_some()
    }

    fn has_shear(&self) -> bool {
        self.law.shear.is_some()
    }

    #[inline]
    fn pressure(&self, nodes: &PressureNodes, out: &mut PressureAnswer) -> Result {
        let Some(pressure) = self.law.pressure else { return Err(Error::Unsupported) };
        let (n, doubles) = (nodes.depth.len(), self.state_doubles());
        let keeps = doubles > 0;
        let mut even = out.pressure.len() == n && out.slope.len() == n;
        if keeps {
            even &= nodes.permanent.len() == n && nodes.slip.len() == n && out.permanent.len() == n;
            even &= nodes.state.len() == n * doubles && out.state.len() == n * doubles;
        }
        if !even {
            return Err(self.uneven("pressure"));
        }
        let raw = TgPressureNodes {
            n,
            parameters: self.parameters.as_ptr(),
            n_parameters: self.parameters.len(),
            b: nodes.b,
            h: nodes.h,
            depth: nodes.depth.as_ptr(),
            permanent: given(nodes.permanent, keeps),
            slip: given(nodes.slip, keeps),
            state: given(nodes.state, keeps),
        };
        let mut answer = TgPressureAnswer {
            pressure: out.pressure.as_mut_ptr(),
            slope: out.slope.as_mut_ptr(),
            permanent: if keeps { out.permanent.as_mut_ptr() } else { std::ptr::null_mut() },
            state: if keeps { out.state.as_mut_ptr() } else { std::ptr::null_mut() },
            longest: f64::INFINITY,
        };
        // SAFETY: the lengths of all arrays were compared; the function keeps to the header.
        let status = unsafe { pressure(&raw const raw, &raw mut answer) };
        out.longest_s = answer.longest;
        if status == TG_OK { Ok(()) } else { Err(self.failed("pressure", status)) }
    }

    #[inline]
    fn shear(&self, nodes: &ShearNodes, out: &mut ShearAnswer) -> Result {
        let Some(shear) = self.law.shear else { return Err(Error::Unsupported) };
        let (n, doubles) = (nodes.pressure.len(), self.state_doubles());
        let answers = [&*out.stress, &*out.by_pressure, &*out.by_slip];
        if nodes.slip.len() != n
            || nodes.state.len() != n * doubles
            || answers.iter().any(|values| values.len() != n)
        {
            return Err(self.uneven("shear"));
        }
        let raw = TgShearNodes {
            n,
            parameters: self.parameters.as_ptr(),
            n_parameters: self.parameters.len(),
            h: nodes.h,
            pressure: nodes.pressure.as_ptr(),
            slip: nodes.slip.as_ptr(),
            state: given(nodes.state, doubles > 0),
        };
        let mut answer = TgShearAnswer {
            stress: out.stress.as_mut_ptr(),
            by_pressure: out.by_pressure.as_mut_ptr(),
            by_slip: out.by_slip.as_mut_ptr(),
            longest: f64::INFINITY,
        };
        // SAFETY: as in `pressure`.
        let status = unsafe { shear(&raw const raw, &raw mut answer) };
        out.longest_s = answer.longest;
        if status == TG_OK { Ok(()) } else { Err(self.failed("shear", status)) }
    }

    fn as_any(&self) -> &dyn Any {
        self
    }
}
