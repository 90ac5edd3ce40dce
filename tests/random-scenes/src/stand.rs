//! A stand of trees from a seed, on a ground with footprints: stems as cones without tips, branches and bushes as triangles; and
//! the rays of laser scanners that turn.

use crate::draw::seen;
use crate::naive::Heights;
use crate::random::Random;
use terraglue_numerics::rotation::{product, quaternion};
use terraglue_subsystem::{BodyState, Geometry, Material, MaterialClass, Pose, Ray, Scene, SceneBody};

/// A stand.
#[derive(Clone, Debug)]
pub struct Stand {
    /// One body for each tree.
    pub scene: Scene,
    /// Where they stand.
    pub states: Vec<BodyState>,
    /// The ground below.
    pub heights: Heights,
}

/// Edge of the plot, m.
const EDGE: f64 = 60.0;
/// Distance of the nodes of the ground, m.
const SPACING: f64 = 0.1;
/// Nothing stands nearer to the scanner than this, m.
const CLEARING: f64 = 1.5;

impl Stand {
    /// Trees in a square around the origin: diameters at breast height with mean 0.35 m, heights 1.3 + 0.55·d^0.85 (d in cm, as
    /// stands of conifers have them), stems that lean by 0.02 rad and taper to the tip, 40 triangles of branches each; and as many
    /// bushes of 100 triangles as half the trees.
    pub fn new(seed: u64, trees: usize) -> Self {
        let mut random = Random::new(seed);
        let heights = ground(&mut random);
        let mut stand = Self { scene: Scene::default(), states: Vec::new(), heights };
        for number in 0..trees + trees / 2 {
            let at = stand.place(&mut random);
            stand.scene.bodies.push(SceneBody { name: format!("plant{number}"), mass: 0.0 });
            let lean = random.direction().map(|x| 0.02 * x);
            let orientation = product(
                quaternion([lean[0], lean[1], 0.0]),
                quaternion([0.0, 0.0, random.between(-3.0, 3.0)]),
            );
            stand
                .states
                .push(BodyState { world_from_body: Pose { position: at, orientation }, ..BodyState::REST });
            if number < trees { stand.tree(&mut random) } else { stand.bush(&mut random) }
        }
        stand
    }

    /// Somewhere on the ground, not at the scanner.
    fn place(&self, random: &mut Random) -> [f64; 3] {
        loop {
            let [x, y, _] = random.point(0.5 * EDGE - 1.0);
            if x * x + y * y > CLEARING * CLEARING {
                let node = |v: f64, k: usize| ((v - self.heights.origin[k]) / SPACING).round() as u32;
                return [x, y, self.heights.at(node(x, 0), node(y, 1)) - 0.05];
            }
        }
    }

    fn shape(&mut self, geometry: Geometry, z: f64, class: MaterialClass) {
        let id = self.scene.shapes.len() as u32;
        let body = self.scene.bodies.len() as u32 - 1;
        let body_from_shape = Pose { position: [0.0, 0.0, z], ..Pose::IDENTITY };
        self.scene.shapes.push(seen(id, body, geometry, body_from_shape, Material::of(class, 0.5)));
    }

    /// Four pieces of stem and forty triangles of branches.
    fn tree(&mut self, random: &mut Random) {
        let across = (0.35 + 0.12 * random.normal()).max(0.07);
        let height = (1.3 + 0.55 * libm::pow(100.0 * across, 0.85)).clamp(3.0, 50.0);
        let radius = |z: f64| 0.5 * across * ((height - z) / (height - 1.3)).max(0.02);
        let cuts = [0.0, 1.6, 0.3 * height, 0.65 * height, height];
        for [low, high] in [0, 1, 2, 3].map(|k| [cuts[k], cuts[k + 1]]) {
            let frustum = Geometry::ConeFrustum {
                half_length: 0.5 * (high - low).abs(),
                radius_bottom: radius(low.min(high)),
                radius_top: radius(low.max(high)),
            };
            self.shape(frustum, 0.5 * (low + high), MaterialClass::WOOD);
        }
        let branch = |random: &mut Random| {
            let (z, angle) =
                (random.between(0.25, 0.95) * height, random.between(0.0, std::f64::consts::TAU));
            let (out, wide) = (0.12 * (height - z) + 0.3, 0.15);
            let (s, c) = (libm::sin(angle), libm::cos(angle));
            let tip = [out * c, out * s, z - 0.3 * out];
            [[wide * s, -wide * c, z], [-wide * s, wide * c, z], tip]
        };
        self.leaves(random, 40, branch);
    }

    /// A hundred leaves in a ball.
    fn bush(&mut self, random: &mut Random) {
        let size = random.between(0.3, 0.9);
        let leaf = |random: &mut Random| {
            let p = random.direction().map(|x| size * x);
            [0; 3].map(|_| {
                let off = random.point(0.12);
                [p[0] + off[0], p[1] + off[1], (p[2] + off[2]).abs()]
            })
        };
        self.leaves(random, 100, leaf);
    }

    fn leaves(&mut self, random: &mut Random, count: u32, one: impl Fn(&mut Random) -> [[f64; 3]; 3]) {
        let points: Vec<_> = (0..count).flat_map(|_| one(random)).collect();
        let triangles = (0..count).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
        self.shape(Geometry::Mesh { points, triangles }, 0.0, MaterialClass::FOLIAGE);
    }
}

/// Gentle waves and 2000 footprints of 4 × 3 nodes.
fn ground(random: &mut Random) -> Heights {
    let nodes = (EDGE / SPACING) as u32 + 1;
    let wave = |x: f64, y: f64| {
        0.6 * libm::sin(0.15 * x) * libm::cos(0.11 * y) + 0.05 * libm::sin(1.7 * x + 0.9 * y)
    };
    let place = |k: u32| f64::from(k) * SPACING - 0.5 * EDGE;
    let mut values: Vec<f64> = (0..nodes * nodes).map(|k| wave(place(k % nodes), place(k / nodes))).collect();
    for _ in 0..2000 {
        let (i, j) = (random.below(nodes as usize - 5), random.below(nodes as usize - 5));
        let depth = random.between(0.02, 0.08);
        (0..12).for_each(|k| values[(j + k / 4) * nodes as usize + i + k % 4] -= depth);
    }
    Heights { origin: [-0.5 * EDGE; 2], spacing: SPACING, size: [nodes; 2], values }
}

/// One turn of a laser scanner with so many lasers between two elevations (degrees), columns one after the other, each ray
/// at its own time within a step.
pub fn sweep(at: [f64; 3], columns: u32, lasers: u32, [low, high]: [f64; 2], step: [f64; 2]) -> Vec<Ray> {
    let ray = |k: u32| {
        let (column, laser) = (k / lasers, k % lasers);
        let part = f64::from(column) / f64::from(columns);
        let azimuth = std::f64::consts::TAU * part;
        let elevation = (low + (high - low) * f64::from(laser) / f64::from(lasers - 1)).to_radians();
        let level = libm::cos(elevation);
        let direction = [level * libm::cos(azimuth), level * libm::sin(azimuth), libm::sin(elevation)];
        Ray { origin: at, direction, time: step[0] + part * (step[1] - step[0]), range: 120.0 }
    };
    (0..columns * lasers).map(ray).collect()
}
