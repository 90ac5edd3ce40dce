//! Fields and their tiles as structures of the C ABI, and the way back.

use crate::abi::*;
use crate::keep::Keep;
use crate::text::{borrowed, slice};
use std::ffi::c_void;
use terraglue_subsystem::{Error, FieldInfo, FieldTile, Result, TileValues};

pub(crate) fn field_out(f: &FieldInfo, keep: &mut Keep) -> TgField {
    TgField {
        name: keep.text(&f.name),
        unit: keep.text(&f.unit),
        origin: f.origin,
        spacing: f.spacing,
        size: f.size,
        tile_edge: f.tile_edge,
        reserved: 0,
    }
}

pub(crate) fn tile_out(tile: &FieldTile) -> TgFieldTile {
    let (format, scale, data, count): (u32, f64, *const c_void, usize) = match tile.values {
        TileValues::Uniform(value) => (TG_TILE_UNIFORM, value, std::ptr::null(), 0),
        TileValues::F64(data) => (TG_TILE_F64, 1.0, data.as_ptr().cast(), data.len()),
        TileValues::F32(data) => (TG_TILE_F32, 1.0, data.as_ptr().cast(), data.len()),
        TileValues::Fixed { data, unit } => (TG_TILE_FIXED, unit, data.as_ptr().cast(), data.len()),
    };
    TgFieldTile { generation: tile.generation, format, reserved: 0, scale, data, count }
}

/// # Safety
/// The pointers of `f` are valid.
pub(crate) unsafe fn field_in(f: &TgField) -> Result<FieldInfo> {
    // SAFETY: by the contract.
    let (name, unit) = unsafe { (borrowed(f.name)?.to_owned(), borrowed(f.unit)?.to_owned()) };
    if f.tile_edge == 0 || !(f.spacing > 0.0 && f.spacing.is_finite()) {
        return Err(Error::Fatal(format!(
            "the field `{name}` has tile edge {} and spacing {}",
            f.tile_edge, f.spacing
        )));
    }
    Ok(FieldInfo { name, unit, origin: f.origin, spacing: f.spacing, size: f.size, tile_edge: f.tile_edge })
}

/// A place for a tile of a foreign field.
pub(crate) const NO_TILE: TgFieldTile = TgFieldTile {
    generation: 0,
    format: TG_TILE_UNIFORM,
    reserved: 0,
    scale: f64::NAN,
    data: std::ptr::null(),
    count: 0,
};

/// # Safety
/// The data of the tile hold as many values as it declares and nobody writes them during `'a`.
pub(crate) unsafe fn tile_in<'a>(out: &TgFieldTile, info: &FieldInfo) -> Result<FieldTile<'a>> {
    let needed = (info.tile_edge as usize).pow(2);
    if out.format != TG_TILE_UNIFORM && (out.count < needed || out.data.is_null()) {
        let (name, count) = (&info.name, out.count);
        return Err(Error::Failed(format!("a tile of `{name}` has {count} of {needed} values")));
    }
    // SAFETY: at least `needed` values, by the contract.
    let values = unsafe {
        match out.format {
            TG_TILE_UNIFORM => TileValues::Uniform(out.scale),
            TG_TILE_F64 => TileValues::F64(slice(out.data.cast(), needed)),
            TG_TILE_F32 => TileValues::F32(slice(out.data.cast(), needed)),
            TG_TILE_FIXED => TileValues::Fixed { data: slice(out.data.cast(), needed), unit: out.scale },
            other => return Err(Error::Failed(format!("a tile has the unknown format {other}"))),
        }
    };
    Ok(FieldTile { generation: out.generation, values })
}
