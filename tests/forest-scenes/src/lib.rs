//! Stands of trees as worlds, and scans of them with the truth behind every point, for tests and figures of the forest.

mod drive;
mod machine;
mod score;
mod tally;
mod trials;

pub use drive::{Drive, Driven};
pub use machine::{HEAD, Machine, SCANNER_HEIGHT, SCANNERS};
pub use score::{OWN, Score, points, score};
pub use tally::{Tally, TrialRow, best, local, map};
pub use trials::{Trial, TrialKind, stand_of};

use random_scenes::{Heights, lend};
use terraglue_forest::{Growth, Stand, plants};
use terraglue_laser_scanner::{Pattern, RayErrors};
use terraglue_numerics::rotation::{quaternion, turned};
use terraglue_subsystem::{BodyRef, GROUND, Geometry, Ray, RayHit, RayMask, SceneShape, World};
use terraglue_world::{Result, WorldBuilder, WorldModel};

/// Errors of the scanners of these tests: 2 cm of noise, 2 % drop-out, 0.3 … 60 m.
pub const ERRORS: RayErrors =
    RayErrors { noise_m: 0.02, drop_out: 0.02, limits_m: [0.3, 60.0], ..RayErrors::NONE };

/// A point of a scan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// Place in the frame of the scanner, whose z is up, m.
    pub position: [f64; 3],
    /// Number of the beam.
    pub ring: u16,
    /// Number of the plant: trees first, then bushes; [`GROUND`]: the ground.
    pub plant: u32,
    /// Whether it lies on a stem.
    pub on_stem: bool,
    /// Whether it lies on the machine; `plant` is then the number of its body.
    pub is_own: bool,
}

/// A stand with the world that shows it.
pub struct Forest {
    /// How it grew.
    pub growth: Growth,
    /// The trees.
    pub stand: Stand,
    world: WorldModel,
    /// Shapes that are pieces of stems.
    is_stem: Vec<bool>,
}

/// Distance of the nodes of the ground, m.
const SPACING: f64 = 0.25;

impl Forest {
    /// Grows a stand.
    ///
    /// # Errors
    /// A world that is refused; none that grows is.
    pub fn grow(growth: Growth, seed: u64) -> Result<Self> {
        Self::of(growth, Stand::grow(&growth, seed), seed)
    }

    /// A stand on the ground of a growth, alone.
    ///
    /// # Errors
    /// A world that is refused.
    pub fn of(growth: Growth, stand: Stand, seed: u64) -> Result<Self> {
        Self::around(growth, stand, seed, &Machine::default())
    }

    /// A stand on the ground of a growth, around a machine at the origin.
    ///
    /// # Errors
    /// A world that is refused.
    pub fn around(growth: Growth, stand: Stand, seed: u64, machine: &Machine) -> Result<Self> {
        let plants = plants(&stand, seed, 0.0);
        let mut builder = WorldBuilder::new();
        builder.subsystem("stand", &plants.scene, &plants.states, &vec![true; plants.states.len()])?;
        let mut states = machine.states.clone();
        let low = growth.terrain.height([0.0; 2]);
        states.iter_mut().for_each(|s| s.world_from_body.position[2] += low);
        builder.subsystem("machine", &machine.scene, &states, &vec![true; states.len()])?;
        let heights = heights(&growth);
        builder.ground(0, &heights.info())?;
        let mut world = builder.build(0.0);
        let tiles = heights.tiles();
        world.update([0.0; 2]).ground(0, lend(&tiles, &heights, 1))?;
        let is_stem = |s: &SceneShape| matches!(s.geometry, Geometry::ConeFrustum { .. });
        let is_stem = plants.scene.shapes.iter().map(is_stem).collect();
        Ok(Self { growth, stand, world, is_stem })
    }

    /// One turn of a scanner at a place, `above` m over the ground, turned by `yaw` about the vertical; points are in its frame.
    pub fn scan(
        &self,
        pattern: &Pattern,
        errors: &RayErrors,
        at: [f64; 2],
        above: f64,
        yaw: f64,
        seed: u64,
    ) -> Vec<Seen> {
        let origin = [at[0], at[1], self.eye(at, above)];
        let turn = quaternion([0.0, 0.0, yaw]);
        let beams = pattern.elevations.len() as u32;
        let local: Vec<[f64; 3]> = (0..pattern.columns)
            .flat_map(|c| (0..beams).map(move |r| (c, r)))
            .map(|(c, r)| pattern.direction(c, r))
            .collect();
        let ray =
            |d: &[f64; 3]| Ray { origin, direction: turned(turn, *d), time: 0.0, range: errors.limits_m[1] };
        let rays: Vec<Ray> = local.iter().map(ray).collect();
        let mut hits = vec![RayHit::MISS; rays.len()];
        self.world.cast_rays(&rays, &RayMask::without(BodyRef::NONE), &mut hits);
        let mut seen = Vec::new();
        for (number, (hit, direction)) in hits.iter().zip(&local).enumerate() {
            if !hit.is_hit() {
                continue;
            }
            let cosine: f64 = (0..3).map(|k| hit.normal[k] * rays[number].direction[k]).sum();
            let Some(range) = errors.range(seed, number as u64, hit.distance, cosine) else { continue };
            let is_own = hit.subsystem == 1;
            let is_stem = self.is_stem.get(hit.shape as usize).copied().unwrap_or(false);
            let on_stem = hit.shape != GROUND && is_stem && !is_own;
            let ring = (number as u32 % beams) as u16;
            seen.push(Seen {
                position: direction.map(|x| range * x),
                ring,
                plant: hit.body,
                on_stem,
                is_own,
            });
        }
        seen
    }

    /// Height of a scanner that stands `above` m over the ground at a place, m.
    pub fn eye(&self, at: [f64; 2], above: f64) -> f64 {
        self.growth.terrain.height(at) + above
    }

    /// Trees with at least so many points of their stems up to 6 m above the scanner, within a distance of the scanner: the trees of a
    /// scan. Each is its number, and its place in the frame of the scanner.
    pub fn visible(
        &self,
        seen: &[Seen],
        at: [f64; 2],
        yaw: f64,
        within: f64,
        points: usize,
    ) -> Vec<(usize, [f64; 2])> {
        let mut counts = vec![0; self.stand.trees.len()];
        for s in seen.iter().filter(|s| s.on_stem && s.position[2] < 6.0) {
            counts[s.plant as usize] += 1;
        }
        let place = |k: usize| {
            let p = self.stand.trees[k].place();
            turned(quaternion([0.0, 0.0, -yaw]), [p[0] - at[0], p[1] - at[1], 0.0])
        };
        let all = (0..counts.len()).filter(|k| counts[*k] >= points);
        all.map(|k| (k, [place(k)[0], place(k)[1]]))
            .filter(|(_, p)| libm::hypot(p[0], p[1]) <= within)
            .collect()
    }
}

fn heights(growth: &Growth) -> Heights {
    let half = growth.half_m + 25.0;
    let nodes = (2.0 * half / SPACING) as u32 + 1;
    let place = |k: u32| f64::from(k) * SPACING - half;
    let values =
        (0..nodes * nodes).map(|k| growth.terrain.height([place(k % nodes), place(k / nodes)])).collect();
    Heights { origin: [-half; 2], spacing: SPACING, size: [nodes; 2], values }
}
