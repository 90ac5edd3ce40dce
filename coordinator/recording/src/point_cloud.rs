//! Point clouds: what viewers show that draw no primitives. Surfaces of the bodies, tiles of ground, and forces as
//! rows of points.

use crate::layout::timestamp;
use crate::scene_message::{frame_id, pose, rgb};
use foxglove::messages::packed_element_field::NumericType;
use foxglove::messages::{PackedElementField, PointCloud};
use prost::bytes::Bytes;
use std::f64::consts::{PI, TAU};
use terraglue_engine::observer::View;
use terraglue_subsystem::{Geometry, Pose, SceneShape};

/// Bytes of a point: x, y, z, colour, and a number.
const STRIDE: usize = 20;

/// Points under construction.
pub(crate) struct Points {
    data: Vec<u8>,
    /// Name of the number that each point carries.
    number: &'static str,
}

impl Points {
    /// None yet; `number` names what each carries.
    pub fn new(number: &'static str) -> Self {
        Self::with_room(number, 0)
    }

    /// None yet, for so many.
    pub fn with_room(number: &'static str, count: usize) -> Self {
        Self { data: Vec::with_capacity(STRIDE * count), number }
    }

    /// Adds a point.
    pub fn push(&mut self, at: [f64; 3], rgb: [u8; 3], number: f32) {
        let [x, y, z] = at.map(|x| (x as f32).to_le_bytes());
        let mut point = [0; STRIDE];
        let parts = [x, y, z, [rgb[0], rgb[1], rgb[2], 255], number.to_le_bytes()];
        point.chunks_exact_mut(4).zip(parts).for_each(|(to, part)| to.copy_from_slice(&part));
        self.data.extend_from_slice(&point);
    }

    /// The message, in a frame and at a place in it.
    pub fn message(self, t_s: f64, frame_id: &str, at: &Pose) -> PointCloud {
        let field = |name: &str, offset: usize, of: NumericType| PackedElementField {
            name: name.into(),
            offset: offset as u32,
            r#type: of.into(),
        };
        let mut fields: Vec<_> =
            ["x", "y", "z"].iter().zip(0..).map(|(n, k)| field(n, 4 * k, NumericType::Float32)).collect();
        let colours = ["red", "green", "blue", "alpha"];
        fields.extend(colours.iter().zip(12..).map(|(n, k)| field(n, k, NumericType::Uint8)));
        fields.push(field(self.number, 16, NumericType::Float32));
        PointCloud {
            timestamp: Some(timestamp(t_s)),
            frame_id: frame_id.into(),
            pose: pose(at),
            point_stride: STRIDE as u32,
            fields,
            data: Bytes::from(self.data),
        }
    }
}

/// Place and number of every point that [`Points::message`] packed; empty where the message is another's.
pub(crate) fn unpack(cloud: &PointCloud) -> Vec<([f64; 3], f32)> {
    if cloud.point_stride as usize != STRIDE {
        return Vec::new();
    }
    let corner = cloud.pose.and_then(|p| p.position).unwrap_or_default();
    let one = |p: &[u8]| {
        let number = |k: usize| p[k..k + 4].try_into().map_or(f32::NAN, f32::from_le_bytes);
        let [x, y, z] = [number(0), number(4), number(8)].map(f64::from);
        ([corner.x + x, corner.y + y, corner.z + z], number(16))
    };
    cloud.data.chunks_exact(STRIDE).map(one).collect()
}

/// Points on the surfaces of every body that has shapes: (`subsystem/body`, its cloud).
pub(crate) fn bodies(view: &View) -> Vec<(String, PointCloud)> {
    let mut clouds = Vec::new();
    for s in view.subsystems {
        for (k, body) in s.scene.bodies.iter().enumerate() {
            let mut points = Points::new("collides");
            for shape in s.scene.shapes.iter().filter(|shape| shape.body as usize == k) {
                let colour = rgb(shape).map(|c| (255.0 * c) as u8);
                let number = f32::from(u8::from(shape.collides));
                surface(shape)
                    .iter()
                    .for_each(|p| points.push(placed(&shape.body_from_shape, *p), colour, number));
            }
            if !points.data.is_empty() {
                let frame = frame_id(s.name, &body.name);
                clouds.push((frame.clone(), points.message(view.t_s, &frame, &Pose::IDENTITY)));
            }
        }
    }
    clouds
}

/// p + v + 2u × (u × v + w·v) with the quaternion (w, u).
fn placed(pose: &Pose, v: [f64; 3]) -> [f64; 3] {
    let ([w, x, y, z], p) = (pose.orientation, pose.position);
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    };
    let once = cross([x, y, z], v);
    let turned = cross([x, y, z], [0, 1, 2].map(|k| once[k] + w * v[k]));
    [0, 1, 2].map(|k| p[k] + v[k] + 2.0 * turned[k])
}

/// Points on a shape, in its own frame.
fn surface(shape: &SceneShape) -> Vec<[f64; 3]> {
    match &shape.geometry {
        Geometry::Sphere { radius } => ball(*radius, 0.0),
        Geometry::Box { half_extents } => block(half_extents),
        Geometry::Capsule { half_length, radius } => {
            let mut points = tube(*radius, *half_length);
            points.extend(ball(*radius, *half_length));
            points
        }
        Geometry::Cylinder { half_length, radius } => {
            let mut points = tube(*radius, *half_length);
            for share in [0.25, 0.5, 0.75] {
                points.extend(ring(share * radius, *half_length).chain(ring(share * radius, -half_length)));
            }
            points
        }
        Geometry::ConeFrustum { half_length, radius_bottom, radius_top } => {
            let level = |k: i32| {
                let part = f64::from(k + 3) / 6.0;
                ring(radius_bottom + part * (radius_top - radius_bottom), f64::from(k) / 3.0 * half_length)
            };
            (-3..=3).flat_map(level).collect()
        }
        Geometry::Ellipsoid { semi_axes } => {
            let stretched = |p: [f64; 3]| [0, 1, 2].map(|k| semi_axes[k] * p[k]);
            ball(1.0, 0.0).into_iter().map(stretched).collect()
        }
        Geometry::ConvexMesh { points, triangles } | Geometry::Mesh { points, triangles } => {
            let middle = |t: &[u32; 3]| {
                let corner = |k: usize| points.get(t[k] as usize).copied().unwrap_or_default();
                [0, 1, 2].map(|axis| (0..3).map(|k| corner(k)[axis]).sum::<f64>() / 3.0)
            };
            points.iter().copied().chain(triangles.iter().map(middle)).collect()
        }
    }
}

/// Evenly on a sphere, by the golden angle; the halves `half_length` apart from the centre along z.
fn ball(radius: f64, half_length: f64) -> Vec<[f64; 3]> {
    const COUNT: u32 = 96;
    let golden = PI * (3.0 - 5.0_f64.sqrt());
    let one = |k: u32| {
        let z = 1.0 - 2.0 * (f64::from(k) + 0.5) / f64::from(COUNT);
        let (r, angle) = ((1.0 - z * z).sqrt(), golden * f64::from(k));
        [r * libm::cos(angle) * radius, r * libm::sin(angle) * radius, z * radius + half_length.copysign(z)]
    };
    (0..COUNT).map(one).collect()
}

fn ring(radius: f64, z: f64) -> impl Iterator<Item = [f64; 3]> {
    const COUNT: u32 = 24;
    (0..COUNT).map(move |k| {
        let angle = TAU * f64::from(k) / f64::from(COUNT);
        [radius * libm::cos(angle), radius * libm::sin(angle), z]
    })
}

fn tube(radius: f64, half_length: f64) -> Vec<[f64; 3]> {
    (-3..=3).flat_map(|k| ring(radius, f64::from(k) / 3.0 * half_length)).collect()
}

/// A lattice on each side.
fn block(half: &[f64; 3]) -> Vec<[f64; 3]> {
    const SIDE: i32 = 4;
    let place = |k: i32, axis: usize| f64::from(k) / f64::from(SIDE) * half[axis];
    let mut points = Vec::new();
    for (x, y, z) in
        (-SIDE..=SIDE).flat_map(|x| (-SIDE..=SIDE).flat_map(move |y| (-SIDE..=SIDE).map(move |z| (x, y, z))))
    {
        if [x, y, z].iter().any(|k| k.abs() == SIDE) {
            points.push([place(x, 0), place(y, 1), place(z, 2)]);
        }
    }
    points
}
