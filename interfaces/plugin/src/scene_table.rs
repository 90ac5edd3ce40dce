//! A scene as the arrays of the C ABI, and the way back. Modules show theirs to the host, and the host those of all others
//! to modules that see.

use crate::abi::*;
use crate::keep::Keep;
use crate::text::{borrowed, slice};
use std::ffi::c_char;
use terraglue_subsystem::{
    Error, Geometry, JointKind, JointVariables, Material, Pose, Result, Scene, SceneBody, SceneJoint,
    SceneShape,
};

/// The arrays of a scene.
pub(crate) struct SceneTable {
    pub(crate) bodies: Vec<TgBody>,
    pub(crate) shapes: Vec<TgShape>,
    pub(crate) joints: Vec<TgJoint>,
    pub(crate) materials: Vec<TgMaterial>,
    _keep: Keep,
}

impl SceneTable {
    pub(crate) fn of(scene: &Scene) -> Self {
        let mut keep = Keep::default();
        Self {
            bodies: scene.bodies.iter().map(|b| TgBody { name: keep.text(&b.name), mass: b.mass }).collect(),
            shapes: scene.shapes.iter().map(|s| shape(s, &mut keep)).collect(),
            joints: scene.joints.iter().map(|j| joint(j, &mut keep)).collect(),
            materials: scene.shapes.iter().map(|s| material(&s.material)).collect(),
            _keep: keep,
        }
    }

    pub(crate) fn scene(&self) -> TgScene {
        TgScene {
            bodies: self.bodies.as_ptr(),
            shapes: self.shapes.as_ptr(),
            n_bodies: self.bodies.len() as u32,
            n_shapes: self.shapes.len() as u32,
        }
    }
}

pub(crate) fn pose_out(pose: &Pose) -> TgPose {
    TgPose { position: pose.position, orientation: pose.orientation }
}

pub(crate) fn pose_in(pose: &TgPose) -> Pose {
    Pose { position: pose.position, orientation: pose.orientation }
}

fn material(m: &Material) -> TgMaterial {
    TgMaterial { class_id: m.class, reflectance: m.reflectance, transmittance: m.transmittance }
}

fn joint(j: &SceneJoint, keep: &mut Keep) -> TgJoint {
    let JointVariables { position, velocity, torque, torque_limit, blocked } = j.variables;
    TgJoint {
        name: keep.text(&j.name),
        break_action: keep.text(&j.break_action),
        parent: j.parent,
        child: j.child,
        kind: j.kind as u32,
        position,
        velocity,
        torque,
        torque_limit,
        blocked,
        parent_from_joint: pose_out(&j.parent_from_joint),
        axis: j.axis,
        limits: j.limits,
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
            let convex = matches!(s.geometry, Geometry::ConvexMesh { .. });
            out.geometry = if convex { TG_CONVEX_MESH } else { TG_MESH };
            (out.points, out.n_points) = (keep.points(points), points.len() as u32);
            out.triangles = keep.numbers(triangles.iter().flatten().copied().collect());
            out.n_triangles = triangles.len() as u32;
        }
    }
    out
}

/// # Safety
/// As `borrowed`.
unsafe fn text(text: *const c_char) -> Result<String> {
    // SAFETY: the same contract.
    unsafe { borrowed(text) }.map(str::to_owned)
}

pub(crate) fn unknown(what: &str, number: u32) -> Error {
    Error::Fatal(format!("{what} is the unknown number {number}"))
}

/// # Safety
/// The pointers of `s`, of its shapes and of the joints are valid.
pub(crate) unsafe fn scene_in(s: &TgScene, joints: &[TgJoint], materials: &[TgMaterial]) -> Result<Scene> {
    // SAFETY: by the contract.
    let (bodies, shapes) =
        unsafe { (slice(s.bodies, s.n_bodies as usize), slice(s.shapes, s.n_shapes as usize)) };
    if !materials.is_empty() && materials.len() != shapes.len() {
        let (given, all) = (materials.len(), shapes.len());
        return Err(Error::Fatal(format!("{given} materials for {all} shapes; each shape has one")));
    }
    let mut out = Scene::default();
    for body in bodies {
        // SAFETY: by the contract.
        out.bodies.push(SceneBody { name: unsafe { text(body.name)? }, mass: body.mass });
    }
    for (k, s) in shapes.iter().enumerate() {
        // SAFETY: by the contract.
        let shape = unsafe { shape_in(s, materials.get(k), out.bodies.len() as u32)? };
        out.shapes.push(shape);
    }
    for j in joints {
        // SAFETY: by the contract.
        let joint = unsafe { joint_in(j, out.bodies.len() as u32)? };
        out.joints.push(joint);
    }
    Ok(out)
}

/// # Safety
/// The pointers of `s` are valid.
unsafe fn shape_in(s: &TgShape, material: Option<&TgMaterial>, bodies: u32) -> Result<SceneShape> {
    // SAFETY: by the contract.
    let name = unsafe { text(s.name)? };
    if s.body >= bodies {
        let body = s.body;
        return Err(Error::Fatal(format!("the shape `{name}` belongs to body {body}, which does not exist")));
    }
    let material = material.map_or(Material::UNKNOWN, |m| Material {
        class: m.class_id,
        reflectance: m.reflectance,
        transmittance: m.transmittance,
    });
    // SAFETY: by the contract.
    let geometry = unsafe { geometry(s, &name)? };
    let shape = SceneShape {
        id: s.id,
        body: s.body,
        geometry,
        name,
        body_from_shape: pose_in(&s.body_from_shape),
        collides: s.collides != 0,
        material,
    };
    match shape.wrong() {
        Some(why) => Err(Error::Fatal(format!("the shape `{}`: {why}", shape.name))),
        None => Ok(shape),
    }
}

/// # Safety
/// The pointers of `j` are valid.
unsafe fn joint_in(j: &TgJoint, bodies: u32) -> Result<SceneJoint> {
    // SAFETY: by the contract.
    let (name, break_action) = unsafe { (text(j.name)?, text(j.break_action)?) };
    if j.child >= bodies || j.parent >= bodies && j.parent != SceneJoint::WORLD {
        return Err(Error::Fatal(format!(
            "the joint `{name}` connects bodies {} and {}, of which one does not exist",
            j.parent, j.child
        )));
    }
    let kind = JointKind::ALL.into_iter().find(|kind| *kind as u32 == j.kind);
    Ok(SceneJoint {
        kind: kind.ok_or_else(|| unknown(&format!("the kind of the joint `{name}`"), j.kind))?,
        name,
        parent: j.parent,
        child: j.child,
        parent_from_joint: pose_in(&j.parent_from_joint),
        axis: j.axis,
        limits: j.limits,
        variables: JointVariables {
            position: j.position,
            velocity: j.velocity,
            torque: j.torque,
            torque_limit: j.torque_limit,
            blocked: j.blocked,
        },
        break_action,
    })
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
