//! Sight of sensors in a run: the committed world at the time that they ask for, the same for every order and number of
//! threads, and streams within their bounds.

use std::sync::{Arc, Mutex};
use terraglue_engine::{Options, Testbed};
use terraglue_host::Library;
use terraglue_scenario::Scenario;
use terraglue_subsystem::*;

/// A ball that goes along x with the time squared, and a post that hides itself at 0.25 s.
struct Mover {
    fields: [FieldInfo; 1],
    warmth: [f64; 4],
    x: f64,
    v: f64,
    next: [f64; 2],
    t: f64,
}

impl Module for Mover {
    fn schema() -> Schema {
        Schema { name: "mover".into(), kind: Kind::Robot, help: "Moves".into(), parameters: Vec::new() }
    }
    fn instantiate(_: &Config, _: Arc<dyn Host>) -> Result<Box<dyn Subsystem>> {
        let warmth = FieldInfo {
            name: "warmth".into(),
            unit: "K".into(),
            origin: [0.0; 2],
            spacing: 1.0,
            size: [2; 2],
            tile_edge: 2,
        };
        Ok(Box::new(Self { fields: [warmth], warmth: [0.0; 4], x: 0.0, v: 0.0, next: [0.0; 2], t: 0.0 }))
    }
}

impl Subsystem for Mover {
    fn capabilities(&self) -> Capabilities {
        Capabilities::RETRY | Capabilities::HIDES
    }
    fn advance(&mut self, step: &Step, _: &Input, _: &mut Response) -> Result {
        let end = step.t + step.h;
        self.next = [end * end, 2.0 * end];
        Ok(())
    }
    fn commit(&mut self, step: &Step, _: &[f64], _: &Motion) -> Result {
        [self.x, self.v] = self.next;
        self.t = step.t + step.h;
        self.warmth = [self.t; 4];
        Ok(())
    }
    fn scene(&self) -> Scene {
        let body = |name: &str| SceneBody { name: name.into(), mass: 1.0 };
        let shape = |id: u32, z: f64| SceneShape {
            id,
            body: id,
            name: format!("shape {id}"),
            geometry: Geometry::Sphere { radius: 0.5 },
            body_from_shape: Pose { position: [0.0, 0.0, z], ..Pose::IDENTITY },
            collides: false,
            material: Material::of(MaterialClass::WOOD, 0.25),
        };
        Scene {
            bodies: vec![body("ball"), body("post")],
            shapes: vec![shape(0, 0.0), shape(1, 0.0)],
            joints: vec![],
        }
    }
    fn body_states(&self, out: &mut [BodyState]) -> Result {
        let at = |position| Pose { position, ..Pose::IDENTITY };
        out[0] = BodyState {
            world_from_body: at([self.x, 0.0, 0.0]),
            linear_velocity: [self.v, 0.0, 0.0],
            ..BodyState::REST
        };
        out[1] = BodyState { world_from_body: at([0.0, 5.0, 0.0]), ..BodyState::REST };
        Ok(())
    }
    fn fields(&self) -> &[FieldInfo] {
        &self.fields
    }
    fn field_tile(&self, field: usize, _: u32, _: u32) -> Result<FieldTile<'_>> {
        assert_eq!(field, 0);
        Ok(FieldTile { generation: (10.0 * self.t) as u64 + 1, values: TileValues::F64(&self.warmth) })
    }
    fn shape_visibility(&self, out: &mut [bool]) -> Result {
        out[1] = self.t < 0.25;
        Ok(())
    }
}

type Log = Mutex<Vec<(String, f64, f64, Vec<f64>)>>;
static SEEN: Log = Mutex::new(Vec::new());
/// Tests that look at [`SEEN`] run one after the other.
static ALONE: Mutex<()> = Mutex::new(());

/// Looks at the ball at three times of each step, and at the post.
struct Looker {
    host: Arc<dyn Host>,
    mount: Mount,
    fast: bool,
    streams: Vec<StreamInfo>,
    message: Option<(f64, Vec<u8>)>,
}

impl Module for Looker {
    fn schema() -> Schema {
        let mut parameters = Mount::parameters().to_vec();
        parameters.push(Parameter::of("fast", ParameterType::Bool, "Floods its stream").or(false));
        Schema { name: "looker".into(), kind: Kind::Sensor, help: "Looks".into(), parameters }
    }
    fn instantiate(config: &Config, host: Arc<dyn Host>) -> Result<Box<dyn Subsystem>> {
        let (mount, fast) = (Mount::from_config(config)?, config.flag("fast")?);
        let stream = StreamInfo {
            name: "seen".into(),
            schema: "test".into(),
            encoding: "json".into(),
            rate_hz: if fast { 2.0 } else { 10.0 },
            most_bytes: 64,
            help: String::new(),
        };
        Ok(Box::new(Self { host, mount, fast, streams: vec![stream], message: None }))
    }
}

impl Subsystem for Looker {
    fn capabilities(&self) -> Capabilities {
        Capabilities::SEES
    }
    fn advance(&mut self, _: &Step, _: &Input, _: &mut Response) -> Result {
        Ok(())
    }
    fn observe(&mut self, step: &Step, world: &dyn World) -> Result {
        let ball = self.mount.find(world)?;
        let [start, end] = world.interval();
        let mut seen: Vec<f64> = Vec::new();
        for time in [start, 0.5 * (start + end), end, end + 1.0] {
            let state = world.pose(ball, time).unwrap();
            let ray = Ray { origin: [-10.0, 0.0, 0.0], direction: [1.0, 0.0, 0.0], time, range: 100.0 };
            let mut hits = [RayHit::MISS];
            world.cast_rays(&[ray], &RayMask::ALL, &mut hits);
            assert_eq!(hits[0].material.class, 4);
            // the ray meets the ball where the ball is
            assert!((hits[0].distance - 9.5 - state.world_from_body.position[0]).abs() < 1e-12);
            seen.push(state.world_from_body.position[0]);
        }
        // fields of the others are those at the end of the step; of those that see none are shown
        for (k, name) in (0..).zip(world.subsystems()) {
            let known = if k == ball.subsystem { 1 } else { 0 };
            assert_eq!(world.fields(k).len(), known, "{name}");
            match world.field_tile(k, 0, 0, 0) {
                Ok(tile) => assert!(known == 1 && (tile.values.at(3) - end).abs() < 1e-12),
                Err(e) => assert_eq!((known, e), (0, Error::Unsupported)),
            }
        }
        let post = ShapeRef { subsystem: ball.subsystem, body: 1, shape: 1 };
        seen.push(f64::from(u8::from(world.is_visible(post))));
        SEEN.lock().unwrap().push((self.host.name().into(), step.t, step.h, seen));
        let size = if self.fast && step.index == 3 { 65 } else { 8 };
        self.message = Some((step.t + step.h, vec![7; size]));
        Ok(())
    }
    fn streams(&self) -> &[StreamInfo] {
        &self.streams
    }
    fn stream(&self, _: usize) -> Result<Option<Message<'_>>> {
        Ok(self.message.as_ref().map(|(time, bytes)| Message { time: *time, bytes }))
    }
}

fn testbed(tables: &str, threads: usize) -> std::result::Result<Testbed, String> {
    let text = format!("[time]\nstep_s = 0.1\nduration_s = 1.0\n[mover]\nmodule = \"mover\"\n{tables}");
    let scenario = Scenario::parse(&text, "sight.toml", &[]).map_err(|e| e.to_string())?;
    let library = Library::new().with::<Mover>().with::<Looker>();
    let options = Options { threads, ..Options::default() };
    Testbed::build_with(&scenario, &options, &library).map_err(|e| format!("{e:?}"))
}

fn looker(name: &str, more: &str) -> String {
    format!("[{name}]\nmodule = \"looker\"\nmount = \"mover.ball\"\n{more}\n")
}

/// Measurements of each sensor in five steps.
fn seen(tables: &str, threads: usize) -> Vec<(String, f64, f64, Vec<f64>)> {
    let _alone = ALONE.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    SEEN.lock().unwrap().clear();
    let mut testbed = testbed(tables, threads).unwrap();
    testbed.run_until(0.5, &mut []).unwrap();
    std::mem::take(&mut *SEEN.lock().unwrap())
}

#[test]
fn a_sensor_sees_the_committed_step_and_nothing_beyond() {
    let all = seen(&looker("eye", ""), 1);
    // the start, and five steps
    assert_eq!(all.len(), 6);
    assert_eq!((all[0].1, all[0].2, all[0].3[0]), (0.0, 0.0, 0.0));
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
    for (k, (_, t, h, x)) in all[1..].iter().enumerate() {
        let (before, after) = (0.01 * (k * k) as f64, 0.01 * ((k + 1) * (k + 1)) as f64);
        near(*t, 0.1 * k as f64);
        near(*h, 0.1);
        near(x[0], before);
        near(x[1], 0.5 * (before + after));
        near(x[2], after);
        // a time to come is answered with the newest that there is
        near(x[3], after);
        // the post hides from the first step on that ends at 0.25 s or later
        assert_eq!(x[4], if k < 2 { 1.0 } else { 0.0 }, "{k}");
    }
}

#[test]
fn neither_order_nor_threads_nor_a_long_step_changes_what_is_seen() {
    let one = seen(&looker("eye", ""), 1);
    let of = |all: &[(String, f64, f64, Vec<f64>)], name: &str| -> Vec<Vec<f64>> {
        all.iter().filter(|s| s.0 == name).map(|s| s.3.clone()).collect()
    };
    // names before and after that of the ball
    let two = seen(&format!("{}{}", looker("an_eye", ""), looker("z_eye", "")), 3);
    assert_eq!(of(&one, "eye"), of(&two, "an_eye"));
    assert_eq!(of(&one, "eye"), of(&two, "z_eye"));
    let slow = seen(&looker("eye", "step_multiple = 2"), 2);
    let steps: Vec<(f64, f64)> = slow.iter().map(|s| (s.1, s.2)).collect();
    assert_eq!(steps, [(0.0, 0.0), (0.0, 0.2), (0.2, 0.2)]);
    assert_eq!(slow[1].3, one[2].3);
    assert_eq!(slow[2].3, one[4].3);
}

#[test]
fn a_mount_on_nothing_is_refused_with_the_names_that_there_are() {
    let refused = |mount: &str| {
        let table = format!("[eye]\nmodule = \"looker\"\nmount = \"{mount}\"\n");
        testbed(&table, 1).err().expect("refused")
    };
    let text = refused("mover.bal");
    assert!(text.contains("`mover` has no body `bal`"), "{text}");
    assert!(text.contains("did you mean `ball`"), "{text}");
    let text = refused("mower.ball");
    assert!(text.contains("no subsystem `mower`") && text.contains("did you mean `mover`"), "{text}");
}

#[test]
fn a_stream_that_floods_is_cut_and_the_run_goes_on() {
    let _alone = ALONE.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let mut testbed =
        testbed(&format!("{}{}", looker("calm", ""), looker("flood", "fast = true")), 1).unwrap();
    let mut times = [Vec::new(), Vec::new()];
    for _ in 0..10 {
        testbed.step().unwrap();
        testbed.view(|view| {
            for (view, times) in view.streams.iter().zip(&mut times) {
                times.extend(view.messages.iter().map(|(time, bytes)| (*time, bytes.len())));
            }
        });
    }
    testbed.view(|view| assert_eq!(view.streams[1].name, "flood.seen"));
    assert_eq!(times[0].len(), 10);
    // two per second were promised: half a period apart at least, and nothing longer than 64 bytes
    assert!((2..=4).contains(&times[1].len()), "{:?}", times[1]);
    assert!(times[1].windows(2).all(|w| w[1].0 - w[0].0 >= 0.25 - 1e-9), "{:?}", times[1]);
    assert!(times[1].iter().all(|(_, size)| *size == 8));
}
