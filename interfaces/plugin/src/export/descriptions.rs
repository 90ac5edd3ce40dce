//! Everything about an instance that never changes, as C structures that point into memory that this keeps.

use crate::abi::*;
use crate::text::c_string;
use std::ffi::{CString, c_char};
use terraglue_subsystem::{FieldInfo, Geometry, SceneShape, Subsystem, Variable};

/// Arrays handed out by `variables`, `actions`, `scene` and `fields`.
pub(super) struct ExportedDescriptions {
    pub(super) variables: Vec<TgVariable>,
    pub(super) actions: Vec<TgAction>,
    pub(super) bodies: Vec<TgBody>,
    pub(super) shapes: Vec<TgShape>,
    pub(super) fields: Vec<TgField>,
    /// What the pointers above point at; moved or dropped only with the whole.
    _keep: Keep,
}

#[derive(Default)]
struct Keep {
    texts: Vec<CString>,
    dims: Vec<Box<[u32]>>,
    names: Vec<Box<[*const c_char]>>,
    points: Vec<Box<[f64]>>,
}

impl Keep {
    fn text(&mut self, text: &str) -> *const c_char {
        let text = c_string(text);
        let pointer = text.as_ptr();
        self.texts.push(text);
        pointer
    }

    fn numbers(&mut self, numbers: Vec<u32>) -> *const u32 {
        let numbers = numbers.into_boxed_slice();
        let pointer = numbers.as_ptr();
        self.dims.push(numbers);
        pointer
    }
}

impl ExportedDescriptions {
    pub(super) fn of(subsystem: &dyn Subsystem) -> Self {
        let mut keep = Keep::default();
        let scene = subsystem.scene();
        Self {
            variables: subsystem.variables().iter().map(|v| variable(v, &mut keep)).collect(),
            actions: subsystem
                .actions()
                .iter()
                .map(|a| TgAction { name: keep.text(&a.name), help: keep.text(&a.help) })
                .collect(),
            bodies: scene.bodies.iter().map(|b| TgBody { name: keep.text(&b.name), mass: b.mass }).collect(),
            shapes: scene.shapes.iter().map(|s| shape(s, &mut keep)).collect(),
            fields: subsystem.fields().iter().map(|f| field(f, &mut keep)).collect(),
            _keep: keep,
        }
    }
}

fn variable(v: &Variable, keep: &mut Keep) -> TgVariable {
    let names: Box<[*const c_char]> = v.enumeration.iter().map(|n| keep.text(n)).collect();
    let pointer = names.as_ptr();
    let n_names = names.len() as u32;
    keep.names.push(names);
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
        names: pointer,
        n_dims: v.dims.len() as u32,
        n_names,
    }
}

fn shape(s: &SceneShape, keep: &mut Keep) -> TgShape {
    let mut out = TgShape {
        id: s.id,
        body: s.body,
        geometry: TG_SPHERE,
        collides: u32::from(s.collides),
        name: keep.text(&s.name),
        size: [0.0; 3],
        points: std::ptr::null(),
        triangles: std::ptr::null(),
        n_points: 0,
        n_triangles: 0,
        body_from_shape: TgPose {
            position: s.body_from_shape.position,
            orientation: s.body_from_shape.orientation,
        },
    };
    match &s.geometry {
        Geometry::Sphere { radius } => out.size[0] = *radius,
        Geometry::Box { half_extents } => (out.geometry, out.size) = (TG_BOX, *half_extents),
        Geometry::Capsule { half_length, radius } => {
            (out.geometry, out.size) = (TG_CAPSULE, [*half_length, *radius, 0.0]);
        }
        Geometry::Cylinder { half_length, radius } => {
            (out.geometry, out.size) = (TG_CYLINDER, [*half_length, *radius, 0.0]);
        }
        Geometry::ConeFrustum { half_length, radius_bottom, radius_top } => {
            (out.geometry, out.size) = (TG_CONE_FRUSTUM, [*half_length, *radius_bottom, *radius_top]);
        }
        Geometry::Ellipsoid { semi_axes } => (out.geometry, out.size) = (TG_ELLIPSOID, *semi_axes),
        Geometry::ConvexMesh { points, triangles } | Geometry::Mesh { points, triangles } => {
            let corners: Box<[f64]> = points.iter().flatten().copied().collect();
            let convex = matches!(s.geometry, Geometry::ConvexMesh { .. });
            out.geometry = if convex { TG_CONVEX_MESH } else { TG_MESH };
            (out.points, out.n_points) = (corners.as_ptr(), points.len() as u32);
            keep.points.push(corners);
            out.triangles = keep.numbers(triangles.iter().flatten().copied().collect());
            out.n_triangles = triangles.len() as u32;
        }
    }
    out
}

fn field(f: &FieldInfo, keep: &mut Keep) -> TgField {
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
