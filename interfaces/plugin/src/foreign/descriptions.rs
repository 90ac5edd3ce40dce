//! Copies what a foreign instance says about itself; checked once, so that nothing foreign is read later.

use super::raw::Raw;
use crate::abi::*;
use crate::convert;
use crate::text::{borrowed, slice};
use std::ffi::c_char;
use terraglue_subsystem::{
    Action, Capabilities, Error, FieldInfo, Geometry, Material, Pose, Result, Scene, SceneBody, SceneShape,
    Variable,
};

/// Everything about an instance that never changes.
#[derive(Default)]
pub(super) struct ForeignDescriptions {
    pub(super) variables: Vec<Variable>,
    pub(super) actions: Vec<Action>,
    pub(super) scene: Scene,
    pub(super) fields: Vec<FieldInfo>,
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
                out.fields = list(|first| f(i, first)).iter().map(|f| field(f)).collect::<Result<_>>()?;
            }
            if let Some(f) = t.scene {
                let mut s =
                    TgScene { bodies: std::ptr::null(), shapes: std::ptr::null(), n_bodies: 0, n_shapes: 0 };
                raw.check(f(i, &raw mut s), f64::NAN)?;
                out.scene = scene(&s)?;
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
unsafe fn list<'a, T>(f: impl FnOnce(*mut *const T) -> usize) -> &'a [T] {
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

fn unknown(what: &str, number: u32) -> Error {
    Error::Fatal(format!("{what} is the unknown number {number}"))
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
/// The pointers of `f` are valid.
unsafe fn field(f: &TgField) -> Result<FieldInfo> {
    // SAFETY: by the contract.
    let (name, unit) = unsafe { (text(f.name)?, text(f.unit)?) };
    if f.tile_edge == 0 || !(f.spacing > 0.0 && f.spacing.is_finite()) {
        return Err(Error::Fatal(format!(
            "the field `{name}` has tile edge {} and spacing {}",
            f.tile_edge, f.spacing
        )));
    }
    Ok(FieldInfo { name, unit, origin: f.origin, spacing: f.spacing, size: f.size, tile_edge: f.tile_edge })
}

/// # Safety
/// The pointers of `s` are valid.
unsafe fn scene(s: &TgScene) -> Result<Scene> {
    // SAFETY: by the contract.
    let (bodies, shapes) =
        unsafe { (slice(s.bodies, s.n_bodies as usize), slice(s.shapes, s.n_shapes as usize)) };
    let mut out = Scene::default();
    for body in bodies {
        // SAFETY: by the contract.
        out.bodies.push(SceneBody { name: unsafe { text(body.name)? }, mass: body.mass });
    }
    for s in shapes {
        // SAFETY: by the contract.
        let name = unsafe { text(s.name)? };
        if s.body >= out.bodies.len() as u32 {
            return Err(Error::Fatal(format!(
                "the shape `{name}` belongs to body {}, which does not exist",
                s.body
            )));
        }
        out.shapes.push(SceneShape {
            id: s.id,
            body: s.body,
            // SAFETY: by the contract.
            geometry: unsafe { geometry(s, &name)? },
            name,
            body_from_shape: Pose {
                position: s.body_from_shape.position,
                orientation: s.body_from_shape.orientation,
            },
            collides: s.collides != 0,
            material: Material::UNKNOWN,
        });
    }
    Ok(out)
}

/// # Safety
/// The pointers of `s` are valid.
unsafe fn geometry(s: &TgShape, name: &str) -> Result<Geometry> {
    let [a, b, c] = s.size;
    Ok(match s.geometry {
        TG_SPHERE => Geometry::Sphere { radius: a },
        TG_BOX => Geometry::Box { half_extents: s.size },
        TG_CAPSULE => Geometry::Capsule { half_length: a, radius: b },
        TG_CYLINDER => Geometry::Cylinder { half_length: a, radius: b },
        TG_CONE_FRUSTUM => Geometry::ConeFrustum { half_length: a, radius_bottom: b, radius_top: c },
        TG_ELLIPSOID => Geometry::Ellipsoid { semi_axes: s.size },
        TG_CONVEX_MESH | TG_MESH => {
            // SAFETY: by the contract.
            let (points, triangles) = unsafe {
                (slice(s.points, 3 * s.n_points as usize), slice(s.triangles, 3 * s.n_triangles as usize))
            };
            if triangles.iter().any(|k| *k >= s.n_points) {
                return Err(Error::Fatal(format!(
                    "a face of the shape `{name}` names a corner that does not exist"
                )));
            }
            let points = points.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect();
            let triangles = triangles.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect();
            match s.geometry {
                TG_MESH => Geometry::Mesh { points, triangles },
                _ => Geometry::ConvexMesh { points, triangles },
            }
        }
        other => return Err(unknown(&format!("geometry of the shape `{name}`"), other)),
    })
}
