//! Scenes of every kind of shape at any pose, some moving, some twice at one place; grounds; rays.

use crate::naive::Heights;
use crate::random::Random;
use terraglue_numerics::rotation::quaternion;
use terraglue_subsystem::{BodyState, Geometry, Material, Pose, Ray, Scene, SceneBody, SceneShape};

/// A subsystem of a drawn world.
#[derive(Clone, Debug)]
pub struct Piece {
    /// Its name.
    pub name: String,
    /// Its bodies and shapes.
    pub scene: Scene,
    /// Whether its bodies move.
    pub moves: bool,
    pub(crate) before: Vec<BodyState>,
    pub(crate) after: Vec<BodyState>,
}

/// A world of about so many bodies: one subsystem that moves, one that is fixed, one that repeats some shapes of the others at
/// their places; and a ground of the first.
pub fn scenes(seed: u64, bodies: usize) -> (Vec<Piece>, Heights) {
    let mut random = Random::new(seed);
    // so that a ray meets something after some ten shapes
    let room = 1.5 * libm::cbrt(bodies as f64).max(1.0);
    let moving = piece(&mut random, "robots", bodies.div_ceil(3).min(300), room, true);
    let fixed =
        piece(&mut random, "rocks", bodies.saturating_sub(moving.scene.bodies.len()).max(1), room, false);
    let twin = Piece { name: "forest".into(), ..first_of(&fixed, 1 + bodies / 20) };
    (vec![moving, fixed, twin], ground(&mut random, room))
}

fn first_of(piece: &Piece, count: usize) -> Piece {
    let count = count.min(piece.scene.bodies.len());
    let mut few = piece.clone();
    few.scene.bodies.truncate(count);
    few.scene.shapes.retain(|s| (s.body as usize) < count);
    few.before.truncate(count);
    few.after.truncate(count);
    few
}

/// A shape that is seen only.
pub(crate) fn seen(
    id: u32,
    body: u32,
    geometry: Geometry,
    body_from_shape: Pose,
    material: Material,
) -> SceneShape {
    SceneShape { id, body, name: format!("shape{id}"), geometry, body_from_shape, collides: false, material }
}

fn piece(random: &mut Random, name: &str, bodies: usize, room: f64, moves: bool) -> Piece {
    let mut out =
        Piece { name: name.into(), scene: Scene::default(), moves, before: Vec::new(), after: Vec::new() };
    for body in 0..bodies {
        out.scene.bodies.push(SceneBody { name: format!("{name}{body}"), mass: 1.0 });
        for _ in 0..1 + random.below(2) {
            let id = 3 * out.scene.shapes.len() as u32 + random.below(3) as u32;
            let geometry = geometry(random);
            let body_from_shape = pose(random, 0.3);
            out.scene.shapes.push(seen(id, body as u32, geometry, body_from_shape, Material::UNKNOWN));
        }
        let before = BodyState { world_from_body: pose(random, room), ..BodyState::REST };
        let mut after = before;
        if moves {
            let p = before.world_from_body.position;
            let way = random.point(0.2);
            after.world_from_body.position = std::array::from_fn(|k| p[k] + way[k]);
            after.world_from_body.orientation = pose(random, 0.0).orientation;
        }
        out.before.push(before);
        out.after.push(after);
    }
    out
}

fn pose(random: &mut Random, half: f64) -> Pose {
    let position = random.point(half);
    let angle = random.between(0.0, 3.0);
    // every fourth stands upright, as most things do
    let orientation = match random.below(4) {
        0 => [1.0, 0.0, 0.0, 0.0],
        _ => quaternion(random.direction().map(|x| angle * x)),
    };
    Pose { position, orientation }
}

/// 2 cm … 1 m, small ones more often.
fn size(random: &mut Random) -> f64 {
    libm::exp(random.between(-4.0, 0.0))
}

fn geometry(random: &mut Random) -> Geometry {
    let mut length = || size(random);
    let (a, b, c) = (length(), length(), length());
    match random.below(8) {
        0 => Geometry::Sphere { radius: a },
        1 => Geometry::Box { half_extents: [a, b, c] },
        2 => Geometry::Capsule { half_length: a, radius: b },
        3 => Geometry::Cylinder { half_length: a, radius: b },
        4 => Geometry::ConeFrustum {
            half_length: a,
            radius_bottom: b,
            radius_top: if random.below(4) == 0 { 0.0 } else { c },
        },
        5 => Geometry::Ellipsoid { semi_axes: [a, b, c] },
        6 => sheet(random, a),
        _ => pyramid([a, b, c]),
    }
}

/// A crumpled sheet of 3 × 3 points.
fn sheet(random: &mut Random, size: f64) -> Geometry {
    let points = (0..9)
        .map(|k| [f64::from(k % 3 - 1), f64::from(k / 3 - 1), random.between(-0.5, 0.5)].map(|x| size * x));
    let cell = |k: u32| {
        let k = k + k / 2;
        [[k, k + 1, k + 3], [k + 1, k + 4, k + 3]]
    };
    Geometry::Mesh { points: points.collect(), triangles: (0..4).flat_map(cell).collect() }
}

fn pyramid([a, b, c]: [f64; 3]) -> Geometry {
    let points = vec![[-a, -b, -c], [a, -b, -c], [a, b, -c], [-a, b, -c], [0.0, 0.0, c]];
    let triangles = vec![[0, 2, 1], [0, 3, 2], [0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]];
    Geometry::ConvexMesh { points, triangles }
}

/// Waves with some footprints and a hole, more than one tile each way.
fn ground(random: &mut Random, room: f64) -> Heights {
    let size = [40 + random.below(60) as u32, 34 + random.below(40) as u32];
    let spacing = 2.2 * room / f64::from(size[0]);
    let origin = [-1.1 * room, -0.9 * room];
    let (phase, height) = (random.between(0.0, 6.0), -0.3 * room);
    let mut values = Vec::new();
    for j in 0..size[1] {
        for i in 0..size[0] {
            let (x, y) = (f64::from(i) * spacing / room, f64::from(j) * spacing / room);
            values.push(height + 0.1 * room * libm::sin(4.0 * x + phase) * libm::cos(3.0 * y));
        }
    }
    for _ in 0..5 {
        let (i, j) = (random.below(size[0] as usize - 4), random.below(size[1] as usize - 4));
        let sunk = height - random.between(0.0, 0.3);
        (0..16).for_each(|k| values[(j + k / 4) * size[0] as usize + i + k % 4] = sunk);
    }
    values[random.below((size[0] * size[1]) as usize)] = f64::NAN;
    Heights { origin, spacing, size, values }
}

/// Rays of every kind through a world of that many bodies.
pub fn rays(seed: u64, bodies: usize, count: usize) -> Vec<Ray> {
    let mut random = Random::new(seed ^ 0x5eed);
    let room = 1.5 * libm::cbrt(bodies as f64).max(1.0);
    let mut one = || {
        let mut direction = random.direction();
        match random.below(8) {
            0 => {
                let k = random.below(3);
                direction = [0.0; 3];
                direction[k] = if random.below(2) == 0 { 1.0 } else { -1.0 };
            }
            1 => {
                let (s, c) = (libm::sin(direction[0]), libm::cos(direction[0]));
                direction = [[c, s, 0.0], [0.0, c, s], [s, 0.0, c]][random.below(3)];
            }
            _ => {}
        }
        let far = if random.below(10) == 0 { 20.0 } else { 1.0 };
        let range = if random.below(5) == 0 { random.between(0.1, 2.0 * room) } else { f64::INFINITY };
        let time = random.between(crate::STEP[0], crate::STEP[1]);
        Ray { origin: random.point(far * room), direction, time, range }
    };
    (0..count).map(|_| one()).collect()
}
