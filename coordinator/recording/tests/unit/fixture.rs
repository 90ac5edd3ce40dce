//! A synthetic testbed in closed form: a body that walks along x at constant speed on six feet, and a soil with
//! tiles that take footprints. Every figure that a recording derives from it is known beforehand.

use super::{Recorder, RecorderOptions, RecorderState, Status, Summary};
use std::path::Path;
use terraglue_diagnostics::error::Result;
use terraglue_engine::observer::StreamView;
use terraglue_engine::observer::{Event, Observer, SubsystemView, View, ledger_of};
use terraglue_gluing::{PortReport, StepReport};
use terraglue_scenario::*;
use terraglue_subsystem::bytes::Persist;
use terraglue_subsystem::*;

pub const SPEED: f64 = 0.15;
pub const H: f64 = 0.001;
pub const ROLL: f64 = 0.05;
pub const DEPTH: f64 = 0.012;
pub const FEET: [&str; 6] = ["LF4", "LM4", "LR4", "RF4", "RM4", "RR4"];
const EDGE: usize = 16;

/// Robot, controller and soil are one struct, distinguished by `kind`.
pub struct Synthetic {
    pub kind: Kind,
    pub t: f64,
    pub nan: bool,
    /// Whether it keeps no energy ledger.
    pub silent: bool,
    /// Commanded speed, m/s.
    pub speed: f64,
    /// Whether its second shape is hidden from 0.3 s to 0.6 s.
    pub hides: bool,
    /// How often it was asked for overlays.
    pub asked: std::cell::Cell<u32>,
    variables: Vec<Variable>,
    fields: Vec<FieldInfo>,
    tiles: Vec<(u64, Vec<f64>, Vec<f64>)>,
    tiles_x: usize,
}

fn robot_variables() -> Vec<Variable> {
    let out = |id, name: &str, unit| Variable::real(id, name, unit, Causality::Output, "synthetic");
    let mut all = vec![
        out(0, "body.x", "m"),
        out(1, "LF_j2.angle", "rad"),
        out(2, "LF_j2.velocity", "rad/s"),
        out(3, "LF_j2.torque", "N m"),
        Variable::real(4, "LF_j2.max_torque", "N m", Causality::Parameter, "largest torque"),
    ];
    all.push(out(5, "LF_j2.motor", "").named(&["off", "position"]));
    all.push(out(6, "LF_j2.broken", "").typed(ValueType::Bool));
    all
}

fn soil_variables() -> Vec<Variable> {
    let local = |id, name: &str| Variable::real(id, name, "", Causality::Local, "synthetic");
    vec![local(0, "active_nodes").typed(ValueType::U64), local(1, "mass_error_relative")]
}

impl Synthetic {
    pub fn robot() -> Self {
        Self::of(Kind::Robot, robot_variables())
    }

    /// Adds `n` variables that change all the time.
    pub fn widen(&mut self, n: u32) {
        let more =
            |k| Variable::real(100 + k, format!("extra_{k}.angle"), "rad", Causality::Output, "synthetic");
        self.variables.extend((0..n).map(more));
    }

    /// Has this variable in place of its own.
    pub fn tell(&mut self, variable: Variable) {
        self.variables = vec![variable];
    }

    pub fn controller() -> Self {
        let speed = Variable::real(0, "speed", "m/s", Causality::Parameter, "commanded speed");
        Self::of(Kind::Controller, vec![speed])
    }

    pub fn soil(size: [u32; 2], spacing: f64) -> Self {
        let mut soil = Self::of(Kind::Soil, soil_variables());
        let origin = [-0.5 * f64::from(size[0] - 1) * spacing, -0.5 * f64::from(size[1] - 1) * spacing];
        let info = |name: &str| FieldInfo {
            name: name.into(),
            unit: "m".into(),
            origin,
            spacing,
            size,
            tile_edge: EDGE as u32,
        };
        soil.fields = vec![info("height"), info("sinkage")];
        soil.tiles_x = (size[0] as usize).div_ceil(EDGE);
        let tiles_y = (size[1] as usize).div_ceil(EDGE);
        for k in 0..soil.tiles_x * tiles_y {
            let (a, b) = (k % soil.tiles_x, k / soil.tiles_x);
            let node = |k: usize| {
                let x = origin[0] + (a * EDGE + k % EDGE) as f64 * spacing;
                let y = origin[1] + (b * EDGE + k / EDGE) as f64 * spacing;
                0.02 * (libm::sin(3.1 * x + 0.7 * y) + libm::cos(2.3 * y - 1.1 * x))
                    + 0.006 * libm::sin(9.0 * x) * libm::cos(11.0 * y)
            };
            soil.tiles.push((1, (0..EDGE * EDGE).map(node).collect(), vec![0.0; EDGE * EDGE]));
        }
        soil
    }

    fn of(kind: Kind, variables: Vec<Variable>) -> Self {
        Self {
            kind,
            t: 0.0,
            nan: false,
            silent: false,
            speed: SPEED,
            hides: false,
            asked: std::cell::Cell::new(0),
            variables,
            fields: Vec::new(),
            tiles: Vec::new(),
            tiles_x: 0,
        }
    }

    /// Presses a spherical dent of 3 cm around a point.
    fn press(&mut self, x: f64, y: f64, depth: f64) {
        let Some(info) = self.fields.first().cloned() else { return };
        let r = 0.045;
        let index = |p: f64, axis: usize| ((p - info.origin[axis]) / info.spacing).round() as i64;
        for j in index(y - r, 1)..=index(y + r, 1) {
            for i in index(x - r, 0)..=index(x + r, 0) {
                if i < 0 || j < 0 || i >= i64::from(info.size[0]) || j >= i64::from(info.size[1]) {
                    continue;
                }
                let (i, j) = (i as usize, j as usize);
                let dx = info.origin[0] + i as f64 * info.spacing - x;
                let dy = info.origin[1] + j as f64 * info.spacing - y;
                let sinkage = depth * (1.0 - (dx * dx + dy * dy) / (0.035 * 0.035)).max(-0.25);
                let tile = &mut self.tiles[(j / EDGE) * self.tiles_x + i / EDGE];
                let k = (j % EDGE) * EDGE + i % EDGE;
                let old = tile.2[k];
                if sinkage > old || (old == 0.0 && sinkage < 0.0) {
                    tile.0 += 1;
                    tile.1[k] += old - sinkage;
                    tile.2[k] = sinkage;
                }
            }
        }
    }

    fn real(&self, id: u32) -> f64 {
        let w = 2.0 * std::f64::consts::PI;
        match (self.kind, id) {
            (Kind::Robot, 0) if self.nan => f64::NAN,
            (Kind::Robot, 0) => SPEED * self.t,
            (Kind::Robot, 1) => 0.3 * libm::sin(w * self.t),
            (Kind::Robot, 2) => 0.3 * w * libm::cos(w * self.t),
            (Kind::Robot, 3) => 4.0,
            (Kind::Robot, 4) => f64::INFINITY,
            (Kind::Robot, id) if id >= 100 => libm::sin(self.t * f64::from(id)),
            (Kind::Controller, 0) => self.speed,
            _ => 1e-12,
        }
    }
}

impl Subsystem for Synthetic {
    fn capabilities(&self) -> Capabilities {
        if self.hides { Capabilities::HIDES } else { Capabilities::default() }
    }
    fn shape_visibility(&self, out: &mut [bool]) -> terraglue_subsystem::Result {
        out.fill(true);
        out[1] = !(0.3..0.6).contains(&self.t);
        Ok(())
    }
    /// The robot has a way and, from 0.25 s on, a name; the gait a line in the frame of the body that it walks.
    fn overlays(&self, out: &mut Vec<Overlay>) {
        self.asked.set(self.asked.get() + 1);
        let mut show = |layer: &str, frame: u32, figure: Figure| {
            out.push(Overlay { layer: layer.into(), frame, colour: [1.0, 0.5, 0.0, 1.0], figure });
        };
        let points = vec![[0.0; 3], [0.0, self.t, 1.0]];
        match self.kind {
            Kind::Robot => {
                show("the way", 0, Figure::Arrows { points, width: 0.01 });
                if self.t >= 0.25 {
                    show("name", 0, Figure::Text { at: [0.0, 0.0, 0.2], height: 0.1, text: "walker".into() });
                    show(
                        "name",
                        Overlay::WORLD,
                        Figure::Points { points: vec![[1.0, 2.0, 3.0]], size: 0.02 },
                    );
                    show("name", 99, Figure::Points { points: vec![[0.0; 3]], size: 0.02 });
                }
            }
            Kind::Controller => {
                show("polygon", Overlay::MOUNT, Figure::Lines { points, width: 0.01 });
                let pose = Pose { position: [0.0, 0.0, 0.5], ..Pose::IDENTITY };
                show("polygon", Overlay::MOUNT, Figure::Ellipse { pose, semi_axes: [0.2, 0.1] });
            }
            _ => {}
        }
    }
    fn advance(&mut self, _: &Step, _: &Input, _: &mut Response) -> terraglue_subsystem::Result {
        Ok(())
    }
    fn variables(&self) -> &[Variable] {
        &self.variables
    }
    fn get(&self, ids: &[u32], out: ValuesMut) -> terraglue_subsystem::Result {
        match out {
            ValuesMut::F64(out) => out.iter_mut().zip(ids).for_each(|(o, id)| *o = self.real(*id)),
            ValuesMut::Bool(out) => out.fill(self.t > 0.5),
            ValuesMut::Enumeration(out) => out.fill(1),
            ValuesMut::U64(out) => out.fill((40.0 * (1.0 + libm::sin(9.0 * self.t))) as u64),
            _ => return Err(terraglue_subsystem::Error::Unsupported),
        }
        Ok(())
    }
    fn fields(&self) -> &[FieldInfo] {
        &self.fields
    }
    fn field_tile(&self, field: usize, a: u32, b: u32) -> terraglue_subsystem::Result<FieldTile<'_>> {
        let (generation, height, sinkage) = &self.tiles[b as usize * self.tiles_x + a as usize];
        let values = TileValues::F64(if field == 0 { height } else { sinkage });
        Ok(FieldTile { generation: *generation, values })
    }
    fn energy(&self) -> Energy {
        let kinetic = 0.5 * 25.0 * SPEED * SPEED * (1.0 + 0.2 * libm::sin(12.0 * self.t));
        match self.kind {
            Kind::Robot => Energy {
                kinetic,
                potential: 8.0 + 0.05 * libm::sin(6.0 * self.t),
                dissipated: 1.1 * self.t,
                port_work: -0.8 * self.t,
                actuator_work: 2.0 * self.t,
                electrical: 3.0 * self.t,
            },
            Kind::Soil if self.silent => Energy::UNKNOWN,
            Kind::Soil => Energy { dissipated: 0.7 * self.t, port_work: 0.75 * self.t, ..Energy::default() },
            _ => Energy::default(),
        }
    }
}

/// The whole synthetic testbed.
pub struct Fixture {
    pub scenario: Scenario,
    pub parts: Vec<(&'static str, Synthetic)>,
    pub feet: usize,
    /// Whether steps are single passes.
    pub single_pass: bool,
    scene: Scene,
    iterations: u32,
}

/// A scenario with every table that recording and reports read.
pub fn scenario(strategy: &str) -> Scenario {
    let text = format!(
        "# Six feet on synthetic regolith.\n[time]\nstep_s = 0.001\nduration_s = 4.0\n\n[gluing]\nstrategy = \
         \"{strategy}\"\n\n[robot]\nmodule = \"rigid-body\"\n\n[soil]\nmodule = \"soil-bekker\"\n"
    );
    let part = |name: &str, module: &str| SubsystemSpec {
        isolate: false,
        isolation: Default::default(),
        python: None,
        build: None,
        sources: Vec::new(),
        name: name.into(),
        module: module.into(),
        step_multiple: 1,
        parameters: Default::default(),
        offered: Default::default(),
        regions: Vec::new(),
    };
    let mut source = Source::default();
    (source.path, source.text) = ("/nowhere/synthetic_walk.toml".into(), text);
    Scenario {
        name: "synthetic_walk".into(),
        folder: "scenarios".into(),
        time: Time { step_s: H, duration_s: 4.0, settle_s: 0.0 },
        world: terraglue_scenario::World { gravity_m_s2: [0.0, 0.0, -1.62], seed: 1 },
        terrain: None,
        gluing: GluingSpec {
            strategy: StrategyKind::named(strategy).unwrap_or(StrategyKind::Iterative),
            tolerance: 1e-8,
            max_iterations: 20,
            contact_margin_m: 1e-3,
            ..GluingSpec::default()
        },
        recording: RecordingSpec {
            ground_every_steps: 100,
            every_steps: 5,
            overlays: false,
            digits: 17,
            include: Vec::new(),
            exclude: Vec::new(),
        },
        report: ReportSpec {
            body: Some("robot.body".into()),
            commanded_speed: Some("gait.speed".into()),
            joint: Some("robot.LF_j2".into()),
        },
        page: Default::default(),
        sweep: None,
        task: None,
        subsystems: vec![part("gait", "gait"), part("robot", "rigid-body"), part("soil", "soil-bekker")],
        glue: Vec::new(),
        connections: Vec::new(),
        events: Vec::new(),
        faults: Vec::new(),
        source,
    }
}

/// A stream of the gait with a message at every tenth step.
fn scan(index: u64, t: f64) -> StreamView {
    let info = StreamInfo {
        name: "scan.points".into(),
        schema: "foxglove.LaserScan".into(),
        encoding: "protobuf".into(),
        rate_hz: 0.1 / H,
        most_bytes: 1000,
        help: String::new(),
    };
    let message = foxglove::messages::LaserScan { ranges: vec![t, 2.0], ..Default::default() };
    let messages = if index.is_multiple_of(10) {
        vec![(t, prost::Message::encode_to_vec(&message))]
    } else {
        Vec::new()
    };
    StreamView { name: "gait.scan.points".into(), info, messages }
}

/// A stream with a message in JSON at every step.
fn note(t: f64) -> StreamView {
    let info = StreamInfo { encoding: "json".into(), name: "note".into(), ..scan(1, t).info };
    StreamView { name: "gait.note".into(), info, messages: vec![(t, b"{}".to_vec())] }
}

/// The joint whose variables are 1 to 3.
fn hip() -> SceneJoint {
    SceneJoint {
        name: "LF_j2".into(),
        parent: 0,
        child: 1,
        parent_from_joint: Pose { position: [0.1, 0.2, 0.3], ..Pose::IDENTITY },
        axis: [0.0, 1.0, 0.0],
        kind: JointKind::Revolute,
        limits: [-1.0, f64::INFINITY],
        variables: JointVariables { position: 1, velocity: 2, torque: 3, ..JointVariables::ABSENT },
        break_action: String::new(),
    }
}

impl Fixture {
    pub fn new(strategy: &str) -> Self {
        let body = |name: &str, mass: f64| SceneBody { name: name.into(), mass };
        let mut scene = Scene { bodies: vec![body("body", 19.0)], shapes: Vec::new(), joints: vec![hip()] };
        let shape = |id: u32, name: &str, geometry: Geometry, collides: bool| SceneShape {
            id,
            body: id,
            name: name.into(),
            geometry,
            body_from_shape: Pose::IDENTITY,
            collides,
            material: Material::UNKNOWN,
        };
        scene.shapes.push(shape(0, "body", Geometry::Box { half_extents: [0.2, 0.1, 0.05] }, false));
        for (k, foot) in FEET.iter().enumerate() {
            scene.bodies.push(body(foot, 1.0));
            scene.shapes.push(shape(k as u32 + 1, foot, Geometry::Sphere { radius: 0.03 }, true));
        }
        let parts = vec![
            ("gait", Synthetic::controller()),
            ("robot", Synthetic::robot()),
            ("soil", Synthetic::soil([150, 100], 0.02)),
        ];
        Self {
            scenario: scenario(strategy),
            parts,
            feet: FEET.len(),
            single_pass: false,
            scene,
            iterations: u32::from(strategy == "iterative"),
        }
    }

    /// Single passes on a soil without an energy ledger.
    pub fn unknown() -> Self {
        let mut fixture = Self::new("cooperative");
        fixture.single_pass = true;
        fixture.parts[2].1.silent = true;
        fixture
    }

    /// A whole run that is recorded.
    pub fn recorded(&mut self, folder: &Path, options: RecorderOptions, steps: u64) -> Summary {
        let mut recorder = Recorder::create(folder, &self.scenario, options).expect("created");
        self.run(&mut recorder, steps).expect("ran");
        recorder.finish(2.0, 1.5, None, Status::Done).expect("finished")
    }

    /// The same by two recorders, of which the second goes on after step `at` from the state of the first.
    pub fn recorded_twice(&mut self, folder: &Path, options: RecorderOptions, at: u64, steps: u64) {
        let mut recorder = Recorder::create(folder, &self.scenario, options).expect("created");
        self.start(&mut recorder).expect("started");
        self.steps(&mut recorder, 0, at).expect("stepped");
        let (mut state, mut again) = (Vec::new(), None);
        self.view(at, &mut |view| recorder.state(view).map(|s| s.write(&mut state))).expect("a state");
        // its end is written, and has to be cut off
        drop(recorder);
        self.view(at, &mut |view| {
            let state = RecorderState::read(&mut state.as_slice()).expect("the same");
            Recorder::resume(folder, &self.scenario, options, view, state).map(|r| again = Some(r))
        })
        .expect("resumed");
        let mut recorder = again.expect("a recorder");
        self.go_on(&mut recorder, at, steps).expect("ran");
        recorder.finish(2.0, 1.5, None, Status::Done).expect("finished");
    }

    /// World position of a foot and whether it stands: tripods of 0.5 s.
    fn foot(k: usize, t: f64) -> ([f64; 3], bool) {
        let side = if k < 3 { 0.32 } else { -0.32 };
        let along = [0.28, 0.0, -0.28][k % 3];
        let phase = t + if k.is_multiple_of(2) { 0.0 } else { 0.5 };
        let (cycle, share) = (phase.floor(), phase.fract());
        let stride = SPEED;
        let (x, stands) = match share {
            s if s < 0.5 => (stride * cycle, true),
            s => (stride * (cycle + 2.0 * (s - 0.5)), false),
        };
        let lift = if stands { -DEPTH } else { 0.05 * libm::sin((share - 0.5) * 2.0 * std::f64::consts::PI) };
        ([x + along - 0.9, side, lift], stands)
    }

    fn report(&self, t: f64) -> StepReport {
        let mut report = StepReport { converged: true, ..StepReport::default() };
        report.evaluations_bodies = 1 + self.iterations * (1 + (t * 7.0) as u32 % 3);
        report.evaluations_soil = report.evaluations_bodies + 1;
        report.max_gap_m = if self.iterations > 0 { 3e-11 } else { 4e-6 } * (1.2 + libm::sin(5.0 * t));
        let gap_n = if self.iterations > 0 { 2e-9 } else { 0.6 };
        report.max_action_reaction_gap_n = gap_n * (1.1 + libm::cos(8.0 * t));
        report.estimate_gap_n = 1.5 * report.max_action_reaction_gap_n;
        let silent = self.parts.iter().any(|(_, part)| part.silent);
        report.interface_work_error_j = if silent { f64::NAN } else { 1e-6 };
        report.single_pass = self.single_pass;
        report.rank = (6 * self.iterations, 6 * self.iterations);
        for k in 0..self.feet {
            let (origin, stands) = Self::foot(k, t);
            let phase = (t + if k.is_multiple_of(2) { 0.0 } else { 0.5 }).fract();
            let load =
                if stands { 13.5 * libm::sin((phase * 2.0) * std::f64::consts::PI).sqrt() } else { 0.0 };
            report.ports.push(PortReport {
                key: u64::MAX - 10 + k as u64,
                subsystem: 1,
                body: k as u32 + 1,
                shape: k as u32 + 1,
                origin,
                frame: [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0],
                wrench: [load, 0.2 * load, 0.0, 0.0, 0.0, 0.0],
                t_star_n: 1.1 * load,
                gap_m: if stands { 0.0 } else { origin[2] },
            });
        }
        report
    }

    fn states(t: f64) -> Vec<BodyState> {
        let roll = ROLL * libm::sin(2.0 * std::f64::consts::PI * t);
        let orientation = [libm::cos(0.5 * roll), libm::sin(0.5 * roll), 0.0, 0.0];
        let z = 0.3 + 0.01 * libm::cos(12.0 * t);
        let mut states = vec![BodyState {
            world_from_body: Pose { position: [SPEED * t - 0.9, 0.01 * libm::sin(3.0 * t), z], orientation },
            ..BodyState::REST
        }];
        for k in 0..FEET.len() {
            let (position, _) = Self::foot(k, t);
            let pose = Pose { position: [position[0], position[1], position[2] + 0.03], ..Pose::IDENTITY };
            states.push(BodyState { world_from_body: pose, ..BodyState::REST });
        }
        states
    }

    /// Shows the state at step `index` to `look`.
    pub fn view(&self, index: u64, look: &mut dyn FnMut(&View) -> Result) -> Result {
        let t = index as f64 * H;
        let states = Self::states(t);
        let none = Scene::default();
        let views: Vec<SubsystemView> = self
            .parts
            .iter()
            .map(|(name, part)| SubsystemView {
                name,
                module: match part.kind {
                    Kind::Robot => "rigid-body",
                    Kind::Soil => "soil-bekker",
                    _ => "gait",
                },
                kind: part.kind,
                scene: if part.kind == Kind::Robot { &self.scene } else { &none },
                body_states: if part.kind == Kind::Robot { &states } else { &[] },
                instance: part,
            })
            .collect();
        let gluing = if index == 0 { StepReport::default() } else { self.report(t) };
        let ledgers = self.parts.iter().map(|(_, part)| ledger_of(part.kind, &part.energy()));
        let energy = ledgers.fold(Energy::default(), |sum, ledger| sum.plus(&ledger));
        let h_s = if index == 0 { 0.0 } else { H };
        look(&View {
            t_s: t,
            step_index: index,
            h_s,
            subsystems: &views,
            gluing: &gluing,
            energy,
            streams: &[scan(index, t), note(t)],
        })
    }

    /// Goes to step `index`: feet leave their prints.
    fn advance(&mut self, index: u64) {
        let t = index as f64 * H;
        for (_, part) in &mut self.parts {
            part.t = t;
            for k in 0..FEET.len() {
                let (at, stands) = Self::foot(k, t);
                if stands && part.kind == Kind::Soil {
                    part.press(at[0], at[1], DEPTH);
                }
            }
        }
    }

    /// Lets an observer see the start.
    pub fn start(&self, observer: &mut dyn Observer) -> Result {
        self.view(0, &mut |view| observer.started(view))
    }

    /// Lets an observer see a step, with the parts as they are.
    pub fn show(&self, index: u64, observer: &mut dyn Observer) -> Result {
        self.view(index, &mut |view| observer.stepped(view))
    }

    /// Runs `steps` steps under an observer, with one event at step 700.
    pub fn run(&mut self, observer: &mut dyn Observer, steps: u64) -> Result {
        self.start(observer)?;
        self.go_on(observer, 0, steps)
    }

    /// The steps after step `from`, to the end.
    pub fn go_on(&mut self, observer: &mut dyn Observer, from: u64, steps: u64) -> Result {
        self.steps(observer, from, steps)?;
        self.view(steps, &mut |view| observer.finished(view, None))
    }

    /// The steps after step `from`.
    pub fn steps(&mut self, observer: &mut dyn Observer, from: u64, steps: u64) -> Result {
        for index in from + 1..=steps {
            if index == 700 {
                let what = "set robot.LF_j2.max_torque = 0 (was 60)".into();
                observer.event(&Event { t_s: index as f64 * H, what })?;
            }
            self.advance(index);
            if let Err(error) = self.show(index, observer) {
                self.view(index, &mut |view| observer.finished(view, Some(&error)))?;
                return Err(error);
            }
        }
        Ok(())
    }
}
