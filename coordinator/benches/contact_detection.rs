//! Cost of step 1: ports of six feet on rolling ground of 6 × 4 m at 1 cm, the soil changing under them.

use divan::Bencher;
use terraglue::contact::{BodySide, ContactDetector, GroundSide, Now};
use terraglue::scenario::{TerrainKind, TerrainSpec};
use terraglue::subsystem::{
    BodyState, Capabilities, FieldInfo, FieldTile, Geometry, Input, Material, Pose, Response, Result, Scene,
    SceneBody, SceneShape, Step, Subsystem,
};
use terraglue_ground::HeightField;

fn main() {
    divan::main();
}

struct Soil {
    field: HeightField,
    fields: [FieldInfo; 1],
}

impl Subsystem for Soil {
    fn capabilities(&self) -> Capabilities {
        Capabilities::default()
    }
    fn advance(&mut self, _: &Step, _: &Input, _: &mut Response) -> Result {
        Ok(())
    }
    fn fields(&self) -> &[FieldInfo] {
        &self.fields
    }
    fn field_tile(&self, _: usize, a: u32, b: u32) -> Result<FieldTile<'_>> {
        Ok(self.field.height_tile(a, b))
    }
}

fn soil() -> Soil {
    let kind = TerrainKind::Undulating {
        rms_m: 0.015,
        wavelengths_m: [0.3, 3.0],
        seed: Some(1),
        flat_radius_m: 0.0,
    };
    let spec = TerrainSpec { size_m: [6.0, 4.0], spacing_m: 0.01, kind };
    let terrain = terraglue::terrain::build(&spec, 1).expect("sound numbers");
    let field = HeightField::from_terrain(&*terrain).expect("low hills");
    let fields = [field.height_info()];
    Soil { field, fields }
}

/// A trunk, eighteen links and six spherical feet.
fn scene() -> Scene {
    let geometry = |k: usize| match k {
        0 => Geometry::Box { half_extents: [0.3, 0.2, 0.06] },
        1..=18 => Geometry::Capsule { half_length: 0.1, radius: 0.02 },
        _ => Geometry::Sphere { radius: 0.03 },
    };
    let shape = |k: usize| SceneShape {
        id: k as u32,
        body: k as u32,
        name: format!("link{k}"),
        geometry: geometry(k),
        body_from_shape: Pose::IDENTITY,
        collides: true,
        material: Material::UNKNOWN,
    };
    Scene {
        bodies: (0..25).map(|k| SceneBody { name: format!("link{k}"), mass: 1.0 }).collect(),
        shapes: (0..25).map(shape).collect(),
        joints: Vec::new(),
    }
}

/// Trunk and links hang above, `feet` of the six feet stand 2 mm deep.
fn states(field: &HeightField, feet: usize) -> Vec<BodyState> {
    let lattice = field.lattice();
    let place = |k: usize| {
        let leg = k.saturating_sub(19);
        let (x, y) = (0.4 * (leg % 3) as f64 - 0.4, if leg < 3 { 0.4 } else { -0.4 });
        let [u, v] = lattice.coordinates(x, y);
        let surface = field.height(u.round() as i32, v.round() as i32);
        let above = if k >= 19 && leg < feet { 0.028 } else { 0.3 };
        let world_from_body = Pose { position: [x, y, surface + above], ..Pose::IDENTITY };
        BodyState { world_from_body, linear_velocity: [0.1, 0.0, -0.05], ..BodyState::REST }
    };
    (0..25).map(place).collect()
}

/// One detection; the tiles under the feet are written before each, as a soil does at its commit.
#[divan::bench(args = [0, 3, 6])]
fn step(bencher: Bencher, feet: usize) {
    let mut soil = soil();
    let scene = scene();
    let bodies = [BodySide { subsystem: 0, name: "robot", scene: &scene }];
    let grounds = [GroundSide { subsystem: 1, instance: &soil }];
    let mut detector = ContactDetector::new(&bodies, &grounds, None).expect("has ground");
    let states = states(&soil.field, feet);
    let now = Now { t: 0.0, h: 1e-3, gravity: [0.0, 0.0, -1.62], margin: 1e-3 };
    let mut change = 1;
    bencher.bench_local(|| {
        change = -change;
        for state in &states[19..19 + feet] {
            let [x, y, _] = state.world_from_body.position;
            let [u, v] = soil.field.lattice().coordinates(x, y).map(|c| c.round() as i32);
            soil.field.add_units(u, v, change);
        }
        let found = detector.detect(&now, |_| &states, |_| &soil).expect("on the ground");
        assert_eq!(found.ports.len(), feet);
    });
}
