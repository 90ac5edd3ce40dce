//! Shapes of the recorded scene as corners and triangles, in the frame of their body.

use foxglove::messages::{Pose as MessagePose, SceneEntity, Vector3};
use std::f64::consts::TAU;
use terraglue_subsystem::Pose;

/// Corners of a drawn circle.
const ROUND: u32 = 48;

/// Corners (m) and faces, three corners each, counter-clockwise seen from outside.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Solid {
    /// Corners.
    pub points: Vec<[f64; 3]>,
    /// Faces by the index of their corners.
    pub triangles: Vec<[u32; 3]>,
    /// Radius of a sphere, which looks the same from all sides: its triangles are the disc at `points[0]`, z upwards.
    pub round: Option<f64>,
}

/// All shapes of a body.
pub(super) fn solids(entity: &SceneEntity) -> Vec<Solid> {
    let spheres =
        entity.spheres.iter().filter_map(|b| Some(disc(own(b.pose.as_ref()?).position, 0.5 * b.size?.x)));
    let cubes = entity.cubes.iter().filter_map(|b| Some(cube(&b.size?).placed(&own(b.pose.as_ref()?))));
    let cylinders =
        entity.cylinders.iter().filter_map(|b| Some(cylinder(&b.size?).placed(&own(b.pose.as_ref()?))));
    let meshes = entity.triangles.iter().filter_map(|t| {
        let points = t.points.iter().map(|p| [p.x, p.y, p.z]).collect();
        let triangles = t.indices.chunks_exact(3).map(|k| [k[0], k[1], k[2]]).collect();
        Some(Solid { points, triangles, round: None }.placed(&own(t.pose.as_ref()?)))
    });
    spheres.chain(cubes).chain(cylinders).chain(meshes).collect()
}

fn own(pose: &MessagePose) -> Pose {
    let (p, q) = (pose.position.unwrap_or_default(), pose.orientation.unwrap_or_default());
    Pose { position: [p.x, p.y, p.z], orientation: [q.w, q.x, q.y, q.z] }
}

impl Solid {
    /// The same in the frame in which `pose` is given.
    pub fn placed(&self, pose: &Pose) -> Self {
        if let (Some(radius), Some(centre)) = (self.round, self.points.first()) {
            return disc(at(pose, centre), radius);
        }
        let points = self.points.iter().map(|p| at(pose, p)).collect();
        Self { points, triangles: self.triangles.clone(), round: None }
    }
}

/// A point of a frame: p + v + 2u × (u × v + w·v) with the quaternion (w, u).
fn at(pose: &Pose, v: &[f64; 3]) -> [f64; 3] {
    let ([w, x, y, z], p) = (pose.orientation, pose.position);
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    };
    let u = [x, y, z];
    let once = cross(u, *v);
    let turned = cross(u, [0, 1, 2].map(|k| once[k] + w * v[k]));
    [0, 1, 2].map(|k| p[k] + v[k] + 2.0 * turned[k])
}

fn disc(centre: [f64; 3], radius: f64) -> Solid {
    let [x, y, z] = centre;
    let rim = |k: u32| {
        let angle = TAU * f64::from(k) / f64::from(ROUND);
        [x + radius * libm::cos(angle), y + radius * libm::sin(angle), z]
    };
    let points = std::iter::once(centre).chain((0..ROUND).map(rim)).collect();
    let triangles = (0..ROUND).map(|k| [0, 1 + k, 1 + (k + 1) % ROUND]).collect();
    Solid { points, triangles, round: Some(radius) }
}

/// Corner k lies on the side of bit 0 along x, bit 1 along y, bit 2 along z.
fn cube(size: &Vector3) -> Solid {
    let lengths = [size.x, size.y, size.z];
    let corner = |k: usize| [0, 1, 2].map(|axis| lengths[axis] * if k >> axis & 1 == 1 { 0.5 } else { -0.5 });
    let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = sides.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    Solid { points: (0..8).map(corner).collect(), triangles, round: None }
}

/// Rims below and above in turn.
fn cylinder(size: &Vector3) -> Solid {
    let rim = |k: u32| {
        let angle = TAU * f64::from(k / 2) / f64::from(ROUND);
        let z = if k.is_multiple_of(2) { -0.5 } else { 0.5 };
        [0.5 * size.x * libm::cos(angle), 0.5 * size.y * libm::sin(angle), z * size.z]
    };
    let side = |k: u32| {
        let (a, b) = (2 * k, 2 * ((k + 1) % ROUND));
        [[a, b, b + 1], [a, b + 1, a + 1]]
    };
    let lids = (1..ROUND - 1).flat_map(|k| [[0, 2 * k + 2, 2 * k], [1, 2 * k + 1, 2 * k + 3]]);
    let triangles = (0..ROUND).flat_map(side).chain(lids).collect();
    Solid { points: (0..2 * ROUND).map(rim).collect(), triangles, round: None }
}
