//! Copies the descriptions of a foreign instance; checked once, so that nothing foreign is read later.

use super::raw::Raw;
use crate::abi::*;
use crate::convert;
use crate::field_table::field_in;
use crate::scene_table::{scene_in, unknown};
use crate::text::{borrowed, slice};
use std::ffi::c_char;
use terraglue_subsystem::{Action, Capabilities, Error, FieldInfo, Result, Scene, StreamInfo, Variable};

/// Everything about an instance that never changes.
#[derive(Default)]
pub(super) struct ForeignDescriptions {
    pub(super) variables: Vec<Variable>,
    pub(super) actions: Vec<Action>,
    pub(super) scene: Scene,
    pub(super) fields: Vec<FieldInfo>,
    pub(super) streams: Vec<StreamInfo>,
}

impl ForeignDescriptions {
    pub(super) fn of(raw: &Raw) -> Result<Self> {
        let (i, t) = (raw.instance, &raw.table);
        let mut out = Self::default();
        // SAFETY: functions of the instance's table; the arrays are valid and constant until `free`.
        unsafe {
            if let Some(f) = t.variables {
                out.variables =
                    list(|first| f(i, first)).iter().map(|v| variable(v)).collect::<Result<_>>()?;
            }
            if let Some(f) = t.actions {
                let action = |a: &TgAction| Ok(Action { name: text(a.name)?, help: text(a.help)? });
                out.actions = list(|first| f(i, first)).iter().map(action).collect::<Result<_>>()?;
            }
            if let Some(f) = t.fields {
                out.fields = list(|first| f(i, first)).iter().map(|f| field_in(f)).collect::<Result<_>>()?;
            }
            if let Some(f) = t.streams {
                out.streams = list(|first| f(i, first)).iter().map(|s| stream(s)).collect::<Result<_>>()?;
            }
            if let Some(f) = t.scene {
                let mut s =
                    TgScene { bodies: std::ptr::null(), shapes: std::ptr::null(), n_bodies: 0, n_shapes: 0 };
                raw.check(f(i, &raw mut s), f64::NAN)?;
                let joints = t.scene_joints.map_or(&[][..], |f| list(|first| f(i, first)));
                let materials = t.shape_materials.map_or(&[][..], |f| list(|first| f(i, first)));
                out.scene = scene_in(&s, joints, materials)?;
            }
        }
        if out.variables.windows(2).any(|w| w[0].id >= w[1].id) {
            return Err(Error::Fatal("variables: the ids are not in ascending order".into()));
        }
        Ok(out)
    }
}

/// Refuses capabilities whose functions are null.
pub(super) fn check_capabilities(capabilities: Capabilities, t: &TgSubsystem) -> Result {
    for (capability, missing, name) in [
        (Capabilities::ESTIMATE, t.estimate_forces.is_none(), "estimate_forces"),
        (Capabilities::SOLVE, t.solve_compatibility.is_none(), "solve_compatibility"),
        (Capabilities::DERIVATIVES, t.interface_jacobian.is_none(), "interface_jacobian"),
        (Capabilities::STATE, t.save_state.is_none(), "save_state"),
        (Capabilities::STATE, t.restore_state.is_none(), "restore_state"),
        (Capabilities::SERIALIZE, t.serialize.is_none(), "serialize"),
        (Capabilities::SERIALIZE, t.deserialize.is_none(), "deserialize"),
        (Capabilities::SEES, t.observe.is_none(), "observe"),
        (Capabilities::HIDES, t.shape_visibility.is_none(), "shape_visibility"),
    ] {
        if missing && capabilities.has(capability) {
            return Err(Error::Fatal(format!(
                "declares the capability `{name}`, but its table has null there"
            )));
        }
    }
    Ok(())
}

/// # Safety
/// `f` fills the pointer with an array of as many elements as it answers.
pub(super) unsafe fn list<'a, T>(f: impl FnOnce(*mut *const T) -> usize) -> &'a [T] {
    let mut first = std::ptr::null();
    let count = f(&raw mut first);
    // SAFETY: by the contract.
    unsafe { slice(first, count) }
}

/// # Safety
/// As `borrowed`.
unsafe fn text(text: *const c_char) -> Result<String> {
    // SAFETY: the same contract.
    unsafe { borrowed(text) }.map(str::to_owned)
}

/// # Safety
/// The pointers of `v` are valid.
unsafe fn variable(v: &TgVariable) -> Result<Variable> {
    // SAFETY: by the contract.
    unsafe {
        let name = text(v.name)?;
        let about = |what| format!("{what} of the variable `{name}`");
        let names = slice(v.names, v.n_names as usize);
        Ok(Variable {
            id: v.id,
            value_type: convert::value_type(v.value_type)
                .ok_or_else(|| unknown(&about("type"), v.value_type))?,
            causality: convert::causality(v.causality)
                .ok_or_else(|| unknown(&about("causality"), v.causality))?,
            effect: convert::effect(v.effect).ok_or_else(|| unknown(&about("effect"), v.effect))?,
            unit: text(v.unit)?,
            help: text(v.help)?,
            min: v.min,
            max: v.max,
            dims: slice(v.dims, v.n_dims as usize).to_vec(),
            enumeration: names.iter().map(|n| text(*n)).collect::<Result<_>>()?,
            name,
        })
    }
}

/// # Safety
/// The pointers of `s` are valid.
unsafe fn stream(s: &TgStream) -> Result<StreamInfo> {
    // SAFETY: by the contract.
    let (name, schema, encoding, help) =
        unsafe { (text(s.name)?, text(s.schema)?, text(s.encoding)?, text(s.help)?) };
    if !(s.rate_hz >= 0.0 && s.rate_hz.is_finite()) {
        return Err(Error::Fatal(format!("the stream `{name}` makes {} messages per second", s.rate_hz)));
    }
    Ok(StreamInfo { name, schema, encoding, help, rate_hz: s.rate_hz, most_bytes: s.most_bytes })
}
