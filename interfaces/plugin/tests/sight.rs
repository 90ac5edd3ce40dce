//! Views of the world, streams and overlays of a module are the same through the C table as in the direct call.
#![allow(unsafe_code, missing_docs, clippy::unwrap_used)]

#[allow(dead_code)]
mod everything;

use everything::Everything;
use std::cell::Cell;
use std::sync::Arc;
use terraglue_plugin::{ForeignModule, abi::*, table};
use terraglue_subsystem::*;

struct Flat;

impl Terrain for Flat {
    fn origin(&self) -> [f64; 2] {
        [0.0; 2]
    }
    fn spacing(&self) -> f64 {
        1.0
    }
    fn size(&self) -> [u32; 2] {
        [2, 2]
    }
    fn heights(&self, _: i64, _: i64, _: usize, _: usize, out: &mut [f64]) -> TerrainTile {
        out.fill(0.5);
        TerrainTile::Uniform(0.5)
    }
}

/// A world whose answers depend on all of the question.
struct TestWorld {
    names: Vec<String>,
    scene: Scene,
    fields: Vec<FieldInfo>,
    heights: Vec<f64>,
    revision: u64,
    panics: Cell<bool>,
}

impl TestWorld {
    fn new(scene: Scene) -> Self {
        let field = FieldInfo {
            name: "height".into(),
            unit: "m".into(),
            origin: [0.0; 2],
            spacing: 0.25,
            size: [2, 2],
            tile_edge: 2,
        };
        Self {
            names: vec!["ground".into(), "unit".into()],
            scene,
            fields: vec![field],
            heights: vec![0.1, 0.2, 0.3, 0.4],
            revision: 3,
            panics: Cell::new(false),
        }
    }
}

impl World for TestWorld {
    fn revision(&self) -> u64 {
        self.revision
    }
    fn interval(&self) -> [f64; 2] {
        [0.1, 0.35]
    }
    fn subsystems(&self) -> &[String] {
        &self.names
    }
    fn scene(&self, subsystem: u32) -> Option<&Scene> {
        (subsystem == 1).then_some(&self.scene)
    }
    fn is_visible(&self, shape: ShapeRef) -> bool {
        shape == ShapeRef { subsystem: 1, body: 0, shape: 1 }
    }
    fn pose(&self, body: BodyRef, time: f64) -> Option<BodyState> {
        let position = [time, f64::from(body.body), f64::from(body.subsystem)];
        let world_from_body = Pose { position, ..Pose::IDENTITY };
        (body.body < 2).then_some(BodyState { world_from_body, ..BodyState::REST })
    }
    fn cast_rays(&self, rays: &[Ray], mask: &RayMask, hits: &mut [RayHit]) {
        assert!(!self.panics.get(), "a fault of the host");
        for (ray, hit) in rays.iter().zip(hits) {
            let distance = ray.origin.iter().chain(&ray.direction).sum::<f64>() + ray.time;
            if distance > ray.range {
                continue;
            }
            let material = Material { class: 4, reflectance: 0.75, transmittance: 0.0 };
            let MaskOf { subsystem, body } = MaskOf::of(mask);
            *hit = RayHit { distance, normal: [0.0, 0.0, 1.0], subsystem, body, shape: 7, material };
        }
    }
    fn ground_heights(&self, points: &[[f64; 2]], heights: &mut [f64]) {
        for ([x, y], z) in points.iter().zip(heights) {
            *z = if *x > 100.0 { f64::NAN } else { x + 10.0 * y };
        }
    }
    fn overlap(&self, centre: [f64; 3], radius: f64, _: &RayMask, found: &mut Vec<ShapeRef>) {
        found.clear();
        let shape = |k| ShapeRef { subsystem: 1, body: centre[0] as u32, shape: k };
        found.extend((0..radius as u32).map(shape));
    }
    fn fields(&self, subsystem: u32) -> &[FieldInfo] {
        if subsystem == 0 { &self.fields } else { &[] }
    }
    fn field_tile(&self, subsystem: u32, _: usize, a: u32, b: u32) -> Result<FieldTile<'_>> {
        match subsystem {
            0 => Ok(FieldTile { generation: u64::from(a + b), values: TileValues::F64(&self.heights) }),
            _ => Err(Error::Unsupported),
        }
    }
}

struct MaskOf {
    subsystem: u32,
    body: u32,
}

impl MaskOf {
    fn of(mask: &RayMask) -> Self {
        Self { subsystem: mask.skip.subsystem + mask.sees, body: mask.skip.body }
    }
}

fn config(fault: &str) -> Config {
    Config::parse(&format!(r#"{{"fault": "{fault}"}}"#)).unwrap().with_defaults(&Everything::schema())
}

fn host() -> Arc<dyn Host> {
    Arc::new(Standalone { terrain: Some(Box::new(Flat)), ..Standalone::default() })
}

fn through(change: impl FnOnce(&mut TgSubsystem), fault: &str) -> Box<dyn Subsystem> {
    let mut table = table::<Everything>("everything-plugin", b"\0");
    change(&mut table);
    let table: &'static _ = Box::leak(Box::new(table));
    // SAFETY: a table of our own making that lives as long as the process.
    let module = unsafe { ForeignModule::new(table) }.unwrap();
    Box::new(module.instantiate(&config(fault), host()).unwrap())
}

fn both() -> [Box<dyn Subsystem>; 2] {
    [Everything::instantiate(&config("none"), host()).unwrap(), through(|_| {}, "none")]
}

const STEP: Step = Step { t: 0.1, h: 0.25, index: 3, trial: 0, n: 0, ports: &[], nodes: &[] };

#[test]
fn every_question_has_the_answer_of_the_direct_call() {
    let [mut direct, mut through] = both();
    let mut world = TestWorld::new(direct.scene());
    assert_eq!(direct.streams(), through.streams());
    assert_eq!(through.stream(0), Ok(None));
    for round in 0..3 {
        world.revision += round;
        direct.observe(&STEP, &world).unwrap();
        through.observe(&STEP, &world).unwrap();
        let [a, b] = [&direct, &through].map(|s| s.stream(0).unwrap().unwrap());
        assert!(a.bytes.len() > 8 * 60, "{}", a.bytes.len());
        assert_eq!(a, b);
    }
    assert!(matches!(through.stream(1), Err(Error::Refused(_))));
}

#[test]
fn names_and_scenes_are_copied_again_when_the_world_says_so() {
    let [mut direct, mut through] = both();
    let mut world = TestWorld::new(direct.scene());
    through.observe(&STEP, &world).unwrap();
    world.scene.joints.clear();
    world.scene.bodies.truncate(1);
    world.scene.shapes.clear();
    world.names.swap(0, 1);
    world.revision += 1;
    // the requested body has gone with its scene
    assert_eq!(through.observe(&STEP, &world), direct.observe(&STEP, &world));
    world.scene = direct.scene();
    world.names.swap(0, 1);
    world.revision += 1;
    direct.observe(&STEP, &world).unwrap();
    through.observe(&STEP, &world).unwrap();
    assert_eq!(through.stream(0), direct.stream(0));
}

#[test]
fn what_is_shown_comes_through() {
    let [direct, through] = both();
    let shown = |s: &dyn Subsystem| {
        let mut visible = vec![false; s.scene().shapes.len()];
        s.shape_visibility(&mut visible).unwrap();
        let mut overlays = Vec::new();
        s.overlays(&mut overlays);
        (visible, overlays)
    };
    let (visible, overlays) = shown(direct.as_ref());
    assert_eq!((visible.iter().filter(|v| **v).count(), overlays.len()), (4, 5));
    assert_eq!(shown(through.as_ref()), (visible, overlays));
}

#[test]
fn a_panic_on_either_side_ends_in_an_error() {
    let world = TestWorld::new(both()[0].scene());
    let mut module = through(|_| {}, "panic");
    assert!(matches!(module.observe(&STEP, &world), Err(Error::Fatal(text)) if text.contains("17")));
    // the host's own fault: the rays miss, and the module goes on
    let [_, mut module] = both();
    world.panics.set(true);
    module.observe(&STEP, &world).unwrap();
    let bytes = module.stream(0).unwrap().unwrap().bytes;
    assert_eq!(bytes[32..40], f64::INFINITY.to_le_bytes());
}

#[test]
fn a_table_of_the_version_before_shows_everything_and_sees_nothing() {
    let older = |t: &mut TgSubsystem| t.size = std::mem::offset_of!(TgSubsystem, observe) as u32;
    let error = {
        let mut table = table::<Everything>("everything-plugin", b"\0");
        older(&mut table);
        // SAFETY: a table of our own making.
        let module = unsafe { ForeignModule::new(&raw const table) }.unwrap();
        module.instantiate(&config("none"), host()).err().unwrap().to_string()
    };
    assert!(error.contains("`observe`") && error.contains("null"), "{error}");
    // without the capability it runs, and its shapes are shown
    unsafe extern "C" fn force(_: *mut std::ffi::c_void) -> u32 {
        1
    }
    let mut module = through(
        |t| {
            older(t);
            t.capabilities = Some(force);
        },
        "none",
    );
    let scene = module.scene();
    let mut visible = vec![false; scene.shapes.len()];
    module.shape_visibility(&mut visible).unwrap();
    let mut overlays = Vec::new();
    module.overlays(&mut overlays);
    assert!(visible.iter().all(|v| *v) && overlays.is_empty() && module.streams().is_empty());
    assert!(scene.joints.is_empty() && scene.shapes.iter().all(|s| s.material == Material::UNKNOWN));
    assert_eq!(module.observe(&STEP, &TestWorld::new(scene)), Err(Error::Unsupported));
}
