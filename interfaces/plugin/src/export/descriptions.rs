//! Everything about an instance that never changes, as C structures that point into memory that this keeps.

use crate::abi::*;
use crate::field_table::field_out;
use crate::keep::Keep;
use crate::scene_table::SceneTable;
use std::ffi::c_char;
use terraglue_subsystem::{StreamInfo, Subsystem, Variable};

/// Arrays handed out by `variables`, `actions`, `scene`, `fields` and `streams`.
pub(super) struct ExportedDescriptions {
    pub(super) variables: Vec<TgVariable>,
    pub(super) actions: Vec<TgAction>,
    pub(super) scene: SceneTable,
    pub(super) fields: Vec<TgField>,
    pub(super) streams: Vec<TgStream>,
    /// Data behind the pointers above; moved or dropped only with the whole.
    _keep: Keep,
}

impl ExportedDescriptions {
    pub(super) fn of(subsystem: &dyn Subsystem) -> Self {
        let mut keep = Keep::default();
        Self {
            variables: subsystem.variables().iter().map(|v| variable(v, &mut keep)).collect(),
            actions: subsystem
                .actions()
                .iter()
                .map(|a| TgAction { name: keep.text(&a.name), help: keep.text(&a.help) })
                .collect(),
            scene: SceneTable::of(&subsystem.scene()),
            fields: subsystem.fields().iter().map(|f| field_out(f, &mut keep)).collect(),
            streams: subsystem.streams().iter().map(|s| stream(s, &mut keep)).collect(),
            _keep: keep,
        }
    }
}

fn stream(s: &StreamInfo, keep: &mut Keep) -> TgStream {
    TgStream {
        name: keep.text(&s.name),
        schema: keep.text(&s.schema),
        encoding: keep.text(&s.encoding),
        help: keep.text(&s.help),
        rate_hz: s.rate_hz,
        most_bytes: s.most_bytes,
        reserved: 0,
    }
}

fn variable(v: &Variable, keep: &mut Keep) -> TgVariable {
    let names: Box<[*const c_char]> = v.enumeration.iter().map(|n| keep.text(n)).collect();
    let n_names = names.len() as u32;
    TgVariable {
        id: v.id,
        value_type: v.value_type as u32,
        causality: v.causality as u32,
        effect: v.effect as u32,
        name: keep.text(&v.name),
        unit: keep.text(&v.unit),
        help: keep.text(&v.help),
        min: v.min,
        max: v.max,
        dims: keep.numbers(v.dims.clone()),
        names: keep.names(names),
        n_dims: v.dims.len() as u32,
        n_names,
    }
}
