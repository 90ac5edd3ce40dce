//! A module in Python looks at the world and shows streams, joints and overlays, through its process.

use crate::isolation::{Isolation, What, start};
use std::sync::Arc;
use terraglue_subsystem::*;

const SEES: &str = r#"
import terraglue as tg


class Looker(tg.Subsystem):
    can = tg.FORCE | tg.SEES | tg.HIDES
    bodies = [("head", 1.0)]
    shapes = [
        tg.Shape(0, "cone", (0.5, 0.2, 0.1), material=(4, 0.25, 0.0)),
        tg.Shape(0, "sheet", ([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])),
    ]
    variables = [tg.Variable("neck", "rad", tg.OUTPUT)]
    joints = [tg.Joint("neck", None, 0, "continuous", axis=(0, 1, 0), variables={"position": "neck"})]
    streams = [tg.Stream("seen", "test.Text", "text", 100.0, 4096)]
    neck = 0.5
    text = None
    broken = False

    def advance(self, step, given, out):
        pass

    def observe(self, step, world):
        self.broken = world.subsystems[0] == "broken"
        if world.subsystems[0] == "endless":
            while True:
                world.pose((1, 0), step.t)
        ray = (1.0, 2.0, 3.0, 0.0, 0.0, -1.0, step.t, 9.0)
        body = world.body("unit", "leg")
        hits = world.cast_rays([ray, ray[:7] + (0.5,)], skip=body)
        self.text = repr([
            world.start, world.time, world.subsystems, body, len(hits), hits[0], hits.distances(),
            world.ground_heights([(0.5, 0.25), (1e9, 0.0)]), world.overlap((3.0, 0.0, 0.0), 2.0),
            world.pose(body, step.t)[0], world.pose((1, 9), step.t), world.body("unit", "tail"),
            world.is_visible(1, 0, 1), world.is_visible(1, 0, 2),
        ])

    def stream(self, k):
        if self.broken:
            raise ValueError("the lens is dirty")
        return None if self.text is None else (self.neck, self.text.encode())

    def shape_visibility(self):
        return [True, False]

    def overlays(self):
        return [
            tg.Overlay("way", "lines", [(0, 0, 0), (1, 1, 1)], colour=(1, 0, 0, 1)),
            tg.Overlay("place", "ellipse", ((1, 2, 3), (1, 0, 0, 0), (0.5, 0.25)), frame=0),
            tg.Overlay("name", "text", ((1, 2, 3), "Größe"), 0.1, frame=0),
        ]
"#;

struct TestWorld {
    names: Vec<String>,
    scene: Scene,
}

impl World for TestWorld {
    fn revision(&self) -> u64 {
        3
    }
    fn interval(&self) -> [f64; 2] {
        [1.0, 1.25]
    }
    fn subsystems(&self) -> &[String] {
        &self.names
    }
    fn scene(&self, subsystem: u32) -> Option<&Scene> {
        (subsystem == 1).then_some(&self.scene)
    }
    fn is_visible(&self, shape: ShapeRef) -> bool {
        shape.shape == 1
    }
    fn pose(&self, body: BodyRef, time: f64) -> Option<BodyState> {
        let world_from_body = Pose { position: [time, 0.5, 0.0], ..Pose::IDENTITY };
        (body.body < 2).then_some(BodyState { world_from_body, ..BodyState::REST })
    }
    fn cast_rays(&self, rays: &[Ray], mask: &RayMask, hits: &mut [RayHit]) {
        for (ray, hit) in rays.iter().zip(hits) {
            let distance = ray.origin[2] + ray.time;
            if distance <= ray.range {
                let material = Material { class: 4, reflectance: 0.75, transmittance: 0.25 };
                let (subsystem, body) = (mask.skip.subsystem, mask.skip.body);
                let normal = ray.direction.map(|d| -d);
                *hit = RayHit { distance, normal, subsystem, body, shape: 7, material };
            }
        }
    }
    fn ground_heights(&self, points: &[[f64; 2]], heights: &mut [f64]) {
        for ([x, y], z) in points.iter().zip(heights) {
            *z = if *x > 100.0 { f64::NAN } else { x + 10.0 * y };
        }
    }
    fn overlap(&self, centre: [f64; 3], radius: f64, _: &RayMask, found: &mut Vec<ShapeRef>) {
        let shape = |k| ShapeRef { subsystem: 1, body: centre[0] as u32, shape: k };
        *found = (0..radius as u32).map(shape).collect();
    }
}

fn world(first: &str) -> TestWorld {
    let body = |name: &str| SceneBody { name: name.into(), mass: 1.0 };
    let scene = Scene { bodies: vec![body("body"), body("leg")], ..Scene::default() };
    TestWorld { names: vec![first.into(), "unit".into()], scene }
}

fn looker(step_timeout_s: f64) -> Box<dyn Subsystem> {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("looker.py");
    std::fs::write(&path, SEES).expect("written");
    let what = What::Python { path, config: serde_json::json!({}), python: "python3".into() };
    let host: Arc<dyn Host> = Arc::new(Standalone::default());
    let isolation = Isolation { step_timeout_s, ..Isolation::default() };
    start(what, &host, &super::services(), isolation).expect("starts")
}

#[test]
fn python_asks_the_world_and_shows_what_it_saw() {
    let mut looker = looker(30.0);
    assert_eq!(looker.stream(0), Ok(None));
    let step = Step { t: 1.0, h: 0.25, ..Step::free(1.0, 0.25, 0) };
    looker.observe(&step, &world("ground")).expect("observes");
    let message = looker.stream(0).expect("a stream").expect("a message");
    assert_eq!(message.time, 0.5);
    let expected = "[1.0, 1.25, ['ground', 'unit'], (1, 1), 2, (4.0, (-0.0, -0.0, 1.0), 1, 1, 7, 4, 0.75, 0.25), [4.0, inf], \
                    [3.0, nan], [(1, 3, 0), (1, 3, 1)], (1.0, 0.5, 0.0), None, None, True, False]";
    assert_eq!(str::from_utf8(message.bytes).expect("text"), expected);
    assert!(looker.capabilities().has(Capabilities::SEES));
    assert!(matches!(looker.stream(1), Err(Error::Refused(_))));
}

#[test]
fn python_tells_joints_materials_and_overlays() {
    let looker = looker(30.0);
    let scene = looker.scene();
    assert_eq!(
        scene.shapes[0].geometry,
        Geometry::ConeFrustum { half_length: 0.5, radius_bottom: 0.2, radius_top: 0.1 }
    );
    assert_eq!(scene.shapes[0].material, Material::of(MaterialClass::WOOD, 0.25));
    assert!(matches!(scene.shapes[1].geometry, Geometry::Mesh { .. }) && !scene.shapes[1].collides);
    let neck = &scene.joints[0];
    assert_eq!(
        (neck.kind, neck.parent, neck.axis),
        (JointKind::Continuous, SceneJoint::WORLD, [0.0, 1.0, 0.0])
    );
    assert_eq!(neck.variables, JointVariables { position: 0, ..JointVariables::ABSENT });
    let mut shown = [false, true];
    looker.shape_visibility(&mut shown).expect("visibility");
    assert_eq!(shown, [true, false]);
    let mut overlays = Vec::new();
    looker.overlays(&mut overlays);
    assert_eq!((overlays.len(), overlays[0].frame, overlays[1].frame), (3, Overlay::WORLD, 0));
    let text = Figure::Text { at: [1.0, 2.0, 3.0], height: 0.1, text: "Größe".into() };
    assert_eq!(overlays[2].figure, text);
}

#[test]
fn a_module_that_never_stops_asking_is_ended() {
    let mut looker = looker(0.4);
    let error = looker.observe(&Step::free(1.0, 0.25, 0), &world("endless")).expect_err("no end");
    assert!(matches!(&error, Error::Fatal(text) if text.contains("went on asking")), "{error}");
}

#[test]
fn a_stream_that_fails_in_a_process_of_its_own_is_an_error_and_no_silence() {
    let mut looker = looker(30.0);
    let step = Step::free(1.0, 0.25, 0);
    looker.observe(&step, &world("broken")).expect("it sees");
    assert_eq!(looker.stream(0), Err(Error::Failed("the lens is dirty".into())));
    let instance = crate::Instance::new("eye", "looker", Kind::Sensor, looker);
    let told = crate::message(&instance, 0).expect_err("told with name and function").to_string();
    assert!(
        ["eye (looker)", "stream failed at t = ", "the lens is dirty"].iter().all(|word| told.contains(word)),
        "{told}"
    );
}

/// The range finders of the page on sensors, in C and in Python.
const EXAMPLES: [&str; 2] = [
    include_str!("../../../../tests/modules/range-finder/range_finder.c"),
    include_str!("../../../../tests/modules/range-finder/range_finder.py"),
];

#[test]
fn the_range_finders_of_the_page_measure_the_same() {
    let folder = tempfile::tempdir().expect("folder");
    let config = serde_json::json!({"mount": "unit.leg", "range_m": 10.0});
    let library = super::compile(folder.path(), "range_finder", EXAMPLES[0], &[]);
    let module = crate::LoadedModule::load(&library).expect("loads");
    assert_eq!(module.schema().kind, Kind::Sensor);
    let made = Config::parse(&config.to_string()).expect("config");
    let mut c = module.instantiate("eye", made, &super::services()).expect("instance");
    let path = folder.path().join("range_finder.py");
    std::fs::write(&path, EXAMPLES[1]).expect("written");
    let what = What::Python { path, config, python: "python3".into() };
    let host: Arc<dyn Host> = Arc::new(Standalone::default());
    let mut python = start(what, &host, &super::services(), Isolation::default()).expect("starts");
    let step = Step::free(1.0, 0.25, 0);
    crate::observe(&mut c, &step, &world("ground")).expect("observes");
    python.observe(&step, &world("ground")).expect("observes");
    let (mut a, mut b) = ([0.0], [0.0]);
    c.get(&[0], ValuesMut::F64(&mut a)).expect("a distance");
    python.get(&[0], ValuesMut::F64(&mut b)).expect("a distance");
    // the height of the sensor, and the time, which the world of this test adds
    assert_eq!((a, b), ([1.25], [1.25]));
    let scan = python.stream(0).expect("a stream").expect("a message");
    let scan: serde_json::Value = serde_json::from_slice(scan.bytes).expect("JSON");
    assert_eq!(scan["ranges"], serde_json::json!([1.25]));
    // a body that there is not is an error with a reason, and no end of the program
    let empty = TestWorld { names: vec!["ground".into()], scene: Scene::default() };
    let error = crate::observe(&mut c, &step, &empty);
    assert!(error.expect_err("no body").to_string().contains("the body of `mount` is not there"));
}

/// An open mesh that says it can be hit.
struct Sheet;

impl Module for Sheet {
    fn schema() -> Schema {
        Schema { name: "sheet".into(), kind: Kind::Robot, help: "A sheet".into(), parameters: Vec::new() }
    }
    fn instantiate(_: &Config, _: Arc<dyn Host>) -> Result<Box<dyn Subsystem>> {
        Ok(Box::new(Self))
    }
}

impl Subsystem for Sheet {
    fn capabilities(&self) -> Capabilities {
        Capabilities::FORCE
    }
    fn advance(&mut self, _: &Step, _: &Input, _: &mut Response) -> Result {
        Ok(())
    }
    fn scene(&self) -> Scene {
        let points = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let shape = SceneShape {
            id: 0,
            body: 0,
            name: "leaf".into(),
            geometry: Geometry::Mesh { points, triangles: vec![[0, 1, 2]] },
            body_from_shape: Pose::IDENTITY,
            collides: true,
            material: Material::UNKNOWN,
        };
        let bodies = vec![SceneBody { name: "leaf".into(), mass: 1.0 }];
        Scene { bodies, shapes: vec![shape], joints: Vec::new() }
    }
}

const PYTHON_SHEET: &str = r#""""A sheet.

[module]
name = "sheet"
kind = "robot"
"""
import terraglue as tg


class Sheet(tg.Subsystem):
    bodies = [("leaf", 1.0)]
    shapes = [tg.Shape(0, "sheet", ([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]), "leaf")]
    shapes[0].collides = True

    def advance(self, step, input, out):
        pass
"#;

#[test]
fn an_open_mesh_that_collides_is_refused_from_rust_and_python() {
    let folder = tempfile::tempdir().expect("folder");
    let path = folder.path().join("sheet.py");
    std::fs::write(&path, PYTHON_SHEET).expect("written");
    let python = crate::LoadedModule::load(&path).expect("loads");
    for module in [crate::LoadedModule::builtin::<Sheet>(), python] {
        let refused = module.instantiate("sheet", Config::default(), &super::services());
        let told = refused.err().expect("refused").to_string();
        assert!(told.contains("the shape `leaf`") && told.contains("is seen only"), "{told}");
    }
}
