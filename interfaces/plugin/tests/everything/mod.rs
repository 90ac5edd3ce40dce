//! A module that offers every call of the interface with answers that depend on all of their input.

use std::sync::Arc;
use terraglue_subsystem::*;

/// Fault that the module commits, from its parameter `fault`.
#[derive(Clone, Copy, PartialEq)]
enum Fault {
    None,
    Panic,
    Discard,
    Refuse,
    Fatal,
}

pub struct Everything {
    host: Arc<dyn Host>,
    fault: Fault,
    state: f64,
    slots: Vec<f64>,
    heights: Vec<f64>,
    fixed: Vec<i32>,
    floats: Vec<f32>,
    flag: bool,
    word: String,
    blob: Vec<u8>,
    integers: [i64; 9],
    variables: Vec<Variable>,
    actions: Vec<Action>,
    fields: Vec<FieldInfo>,
    streams: Vec<StreamInfo>,
    message: Vec<u8>,
}

pub const TYPES: [ValueType; 14] = [
    ValueType::F64,
    ValueType::F32,
    ValueType::I8,
    ValueType::I16,
    ValueType::I32,
    ValueType::I64,
    ValueType::U8,
    ValueType::U16,
    ValueType::U32,
    ValueType::U64,
    ValueType::Bool,
    ValueType::String,
    ValueType::Binary,
    ValueType::Enumeration,
];

impl Module for Everything {
    fn schema() -> Schema {
        Schema {
            name: "everything".into(),
            kind: Kind::Soil,
            help: "Tries every call".into(),
            parameters: vec![
                Parameter::number("start", "m", 0.25, "First state").within(-1.0, f64::INFINITY),
                Parameter::of("fault", ParameterType::Text, "The fault to show").or("none").choices(&[
                    "none",
                    "panic",
                    "discard",
                    "refuse",
                    "fatal",
                    "start",
                    "start-panic",
                ]),
            ],
        }
    }

    fn instantiate(config: &Config, host: Arc<dyn Host>) -> Result<Box<dyn Subsystem>> {
        let fault = match config.text("fault")? {
            "panic" => Fault::Panic,
            "discard" => Fault::Discard,
            "refuse" => Fault::Refuse,
            "fatal" => Fault::Fatal,
            "start" => return Err(Error::Refused("the start is refused".into())),
            "start-panic" => panic!("at the start"),
            _ => Fault::None,
        };
        let mut heights = vec![0.0; 12];
        host.required_terrain()?.heights(-1, 0, 4, 3, &mut heights);
        host.log(
            LogLevel::Warning,
            &format!("{} in {} with {:?}", host.name(), host.folder(), host.gravity()),
        );
        let variables = TYPES.iter().enumerate().map(|(k, t)| variable(k as u32, *t)).collect();
        let field = |name: &str| FieldInfo {
            name: name.into(),
            unit: "m".into(),
            origin: [-1.0, -2.0],
            spacing: 0.5,
            size: [4, 3],
            tile_edge: 2,
        };
        Ok(Box::new(Self {
            fault,
            state: config.number("start")?,
            slots: vec![0.0; host.slots() as usize],
            host,
            heights,
            fixed: vec![1, -2, 3, -4],
            floats: vec![0.5, 1.5, 2.5, 3.5],
            flag: true,
            word: "Grüße".into(),
            blob: vec![0, 255, 7],
            integers: [-1, -300, -70_000, i64::MIN, 255, 65_535, u32::MAX.into(), -1, 2],
            variables,
            actions: vec![Action { name: "joint.break".into(), help: "Breaks".into() }],
            fields: ["height", "sinkage", "load", "flat"].map(field).into(),
            streams: vec![StreamInfo {
                name: "scan.points".into(),
                schema: "foxglove.PointCloud".into(),
                encoding: "protobuf".into(),
                rate_hz: 12.5,
                most_bytes: 4096,
                help: "Heights that are seen".into(),
            }],
            message: Vec::new(),
        }))
    }
}

fn variable(id: u32, value_type: ValueType) -> Variable {
    let mut v = Variable::real(3 * id, format!("a.{value_type:?}"), "N m", Causality::Input, "One of a type")
        .typed(value_type)
        .within(-1e300, 1e300);
    if value_type == ValueType::Enumeration {
        v = v.named(&["off", "position", "velocity"]);
    }
    if value_type == ValueType::F64 {
        v.dims = vec![2, 3];
        v.effect = Effect::NeedsReset;
    }
    v
}

impl Everything {
    fn trouble(&self) -> Result {
        match self.fault {
            Fault::None => Ok(()),
            Fault::Panic => panic!("index {} is out of range", 17),
            Fault::Discard => Err(Error::Discard { reached: 0.125 }),
            Fault::Refuse => Err(Error::Refused("not like this".into())),
            Fault::Fatal => Err(Error::Fatal("broken for good".into())),
        }
    }
}

/// Sum over everything in a step, so that a lost field is seen.
fn digest(step: &Step) -> f64 {
    let ports: f64 = step
        .ports
        .iter()
        .map(|p| {
            p.key as f64
                + f64::from(p.kind + p.mask + p.first + p.body + p.shape % 1000 + p.first_node + p.node_count)
                + f64::from(p.side)
                + p.origin.iter().chain(&p.frame).chain(&p.extent).sum::<f64>()
                + p.law.mu
                + p.law.compliance
        })
        .sum();
    let nodes: f64 = step.nodes.iter().map(|n| f64::from(n.i * 3 + n.j) + n.area + n.lower).sum();
    ports + nodes + step.t + step.h + step.index as f64 + f64::from(step.trial * 2 + step.n)
}

impl Subsystem for Everything {
    fn capabilities(&self) -> Capabilities {
        Capabilities(0x7fb) | Capabilities::SEES | Capabilities::HIDES
    }

    fn set_ports(&mut self, step: &Step, laws: &mut [Law], now: &mut Response) -> Result {
        for (k, law) in laws.iter_mut().enumerate() {
            law.mu = 0.5 + k as f64;
            law.t_max = 100.0;
        }
        fill(now, digest(step) + self.state);
        Ok(())
    }

    fn estimate_forces(&mut self, step: &Step, partner: &Motion, out: &mut Estimate) -> Result {
        let sum = digest(step) + partner.x.iter().chain(partner.v).sum::<f64>();
        for (k, t) in out.t_star.iter_mut().enumerate() {
            *t = sum * (k + 1) as f64;
        }
        out.x_free.copy_from_slice(partner.x);
        for (k, g) in out.g.iter_mut().enumerate() {
            *g = sum + k as f64;
        }
        out.active.fill(1);
        out.unique = !out.unique;
        Ok(())
    }

    fn solve_compatibility(&mut self, step: &Step, e: &Estimate, out: &mut Response) -> Result {
        let sum: f64 = e.t_star.iter().chain(&*e.x_free).chain(&*e.g).sum();
        let active: f64 = e.active.iter().map(|a| f64::from(*a)).sum();
        fill(out, digest(step) + sum + active + f64::from(u8::from(e.unique)));
        out.flags = flag::YIELDED;
        Ok(())
    }

    fn advance(&mut self, step: &Step, input: &Input, out: &mut Response) -> Result {
        self.trouble()?;
        let sum: f64 = match input {
            Input::Force { t, motion } => {
                let motion: f64 = motion.iter().flat_map(|m| m.x.iter().chain(m.v)).map(|v| 3.0 * v).sum();
                t.iter().sum::<f64>() + motion
            }
            Input::Motion(m) => 7.0 * m.x.iter().chain(m.v).sum::<f64>(),
        };
        fill(out, digest(step) + sum + self.state);
        out.reached -= 0.5 * step.h;
        out.flags |= flag::EVENT;
        Ok(())
    }

    fn interface_jacobian(&mut self, step: &Step, level: Level, out: &mut [f64]) -> Result {
        for (k, g) in out.iter_mut().enumerate() {
            *g = digest(step) + k as f64 * f64::from(level as u32 + 1);
        }
        Ok(())
    }

    fn commit(&mut self, step: &Step, t: &[f64], partner: &Motion) -> Result {
        self.state += digest(step) + t.iter().chain(partner.x).chain(partner.v).sum::<f64>();
        Ok(())
    }

    fn observe(&mut self, step: &Step, world: &dyn World) -> Result {
        self.trouble()?;
        self.message.clear();
        let mut put = |x: f64| self.message.extend(x.to_le_bytes());
        [step.t, step.h, world.time(), world.interval()[0]].into_iter().for_each(&mut put);
        let ray = Ray { origin: [1.0, 2.0, 3.0], direction: [0.0, 0.0, -1.0], time: step.t, range: 9.0 };
        let mut hits = [RayHit::MISS; 2];
        let own = world.body("unit", "leg").ok_or_else(|| Error::Failed("no body".into()))?;
        world.cast_rays(&[ray, Ray { range: 0.5, ..ray }], &RayMask::without(own), &mut hits);
        for hit in &hits {
            [hit.distance, hit.normal[2], f64::from(hit.shape), f64::from(hit.material.reflectance)]
                .into_iter()
                .for_each(&mut put);
        }
        let mut heights = [0.0; 2];
        world.ground_heights(&[[0.5, 0.25], [1e9, 0.0]], &mut heights);
        heights.into_iter().for_each(&mut put);
        let mut found = Vec::new();
        world.overlap([0.0; 3], 40.0, &RayMask::ALL, &mut found);
        found.iter().for_each(|s| put(f64::from(s.subsystem + s.body + s.shape)));
        let state = world.pose(own, step.t).ok_or_else(|| Error::Failed("no pose".into()))?;
        state.world_from_body.position.into_iter().chain(state.angular_velocity).for_each(&mut put);
        put(f64::from(u8::from(world.pose(BodyRef { body: 99, ..own }, 0.0).is_none())));
        put(f64::from(u8::from(world.body("unit", "tail").is_none())));
        for k in 0..world.subsystems().len() as u32 + 1 {
            let (scene, fields) = (world.scene(k), world.fields(k));
            put(scene.map_or(-1.0, |s| (s.shapes.len() + 10 * s.joints.len() + 100 * s.bodies.len()) as f64));
            put(fields.first().map_or(-1.0, |f| f.spacing));
            put(world.field_tile(k, 0, 1, 2).map_or(-1.0, |t| t.values.at(0)));
            put(f64::from(u8::from(world.is_visible(ShapeRef { subsystem: k, body: 0, shape: 1 }))));
        }
        Ok(())
    }

    fn shape_visibility(&self, out: &mut [bool]) -> Result {
        out.iter_mut().enumerate().for_each(|(k, shown)| *shown = k % 2 == 0);
        Ok(())
    }

    fn streams(&self) -> &[StreamInfo] {
        &self.streams
    }

    fn stream(&self, k: usize) -> Result<Option<Message<'_>>> {
        match (k, self.message.is_empty()) {
            (0, true) => Ok(None),
            (0, false) => Ok(Some(Message { time: self.state, bytes: &self.message })),
            _ => Err(Error::Refused(format!("no stream {k}"))),
        }
    }

    fn overlays(&self, out: &mut Vec<Overlay>) {
        let points = || vec![[0.0, 1.0, 2.0], [self.state, 4.0, 5.0]];
        let pose = Pose { position: [1.0, 2.0, 3.0], ..Pose::IDENTITY };
        let figures = [
            Figure::Lines { points: points(), width: 0.01 },
            Figure::Points { points: points(), size: 0.02 },
            Figure::Arrows { points: points(), width: 0.03 },
            Figure::Ellipse { pose, semi_axes: [0.5, 0.25] },
            Figure::Text { at: [7.0, 8.0, 9.0], height: 0.1, text: "Größe".into() },
        ];
        for (k, figure) in figures.into_iter().enumerate() {
            let frame = if k == 0 { Overlay::WORLD } else { 1 };
            out.push(Overlay { layer: format!("layer {k}"), frame, colour: [0.1, 0.2, 0.3, 1.0], figure });
        }
    }

    fn save_state(&mut self, slot: u32) -> Result {
        let slot = self.slots.get_mut(slot as usize).ok_or_else(|| Error::Refused("no such slot".into()))?;
        *slot = self.state;
        Ok(())
    }

    fn restore_state(&mut self, slot: u32) -> Result {
        self.state = *self.slots.get(slot as usize).ok_or_else(|| Error::Refused("no such slot".into()))?;
        Ok(())
    }

    fn serialize(&self) -> Result<Vec<u8>> {
        Ok(self.state.to_le_bytes().to_vec())
    }

    fn deserialize(&mut self, bytes: &[u8]) -> Result {
        let bytes = bytes.try_into().map_err(|_| Error::Refused(format!("{} bytes", bytes.len())))?;
        self.state = f64::from_le_bytes(bytes);
        Ok(())
    }

    fn variables(&self) -> &[Variable] {
        &self.variables
    }

    fn get(&self, ids: &[u32], out: ValuesMut) -> Result {
        let id = *ids.first().ok_or_else(|| Error::Refused("no ids".into()))?;
        let i = &self.integers;
        match out {
            ValuesMut::F64(d) => d.iter_mut().enumerate().for_each(|(k, v)| *v = self.state + k as f64),
            ValuesMut::F32(d) => d.fill(id as f32 + 0.5),
            ValuesMut::I8(d) => d.fill(i[0] as i8),
            ValuesMut::I16(d) => d.fill(i[1] as i16),
            ValuesMut::I32(d) => d.fill(i[2] as i32),
            ValuesMut::I64(d) => d.fill(i[3]),
            ValuesMut::U8(d) => d.fill(i[4] as u8),
            ValuesMut::U16(d) => d.fill(i[5] as u16),
            ValuesMut::U32(d) => d.fill(i[6] as u32),
            ValuesMut::U64(d) => d.fill(i[7] as u64),
            ValuesMut::Enumeration(d) => d.fill(i[8]),
            ValuesMut::Bool(d) => d.fill(self.flag),
            ValuesMut::String(d) => d.fill(self.word.clone()),
            ValuesMut::Binary(d) => d.fill(self.blob.clone()),
        }
        Ok(())
    }

    fn set(&mut self, ids: &[u32], values: Values) -> Result {
        if ids.is_empty() {
            return Err(Error::Refused("no ids".into()));
        }
        match values {
            Values::F64(d) => self.state = d.iter().sum(),
            Values::F32(d) => self.state = d.iter().map(|v| f64::from(*v)).sum(),
            Values::I8(d) => self.integers[0] = d[0].into(),
            Values::I16(d) => self.integers[1] = d[0].into(),
            Values::I32(d) => self.integers[2] = d[0].into(),
            Values::I64(d) => self.integers[3] = d[0],
            Values::U8(d) => self.integers[4] = d[0].into(),
            Values::U16(d) => self.integers[5] = d[0].into(),
            Values::U32(d) => self.integers[6] = d[0].into(),
            Values::U64(d) => self.integers[7] = d[0] as i64,
            Values::Enumeration(d) => self.integers[8] = d[0],
            Values::Bool(d) => self.flag = d[0],
            Values::String(d) => self.word = d.concat(),
            Values::Binary(d) => self.blob = d.concat(),
        }
        Ok(())
    }

    fn actions(&self) -> &[Action] {
        &self.actions
    }

    fn act(&mut self, action: &str, arguments: &str) -> Result {
        if action != "joint.break" {
            return Err(Error::Refused(format!("no action `{action}`")));
        }
        self.word = format!("{action} {arguments}");
        Ok(())
    }

    fn next_event_time(&self) -> f64 {
        self.state + 1.0
    }

    fn scene(&self) -> Scene {
        let pose = Pose { position: [1.0, 2.0, 3.0], orientation: [0.5, 0.5, -0.5, 0.5] };
        let shape = |id: u32, geometry| SceneShape {
            id,
            body: id % 2,
            name: format!("shape {id}"),
            geometry,
            body_from_shape: pose,
            collides: id != 3,
            material: Material { class: id, reflectance: 0.25, transmittance: 0.5 },
        };
        let mesh = Geometry::ConvexMesh {
            points: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        };
        let sheet = Geometry::Mesh {
            points: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            triangles: vec![[0, 1, 2]],
        };
        let joint = SceneJoint {
            name: "hip".into(),
            parent: SceneJoint::WORLD,
            child: 1,
            parent_from_joint: pose,
            axis: [0.0, 0.6, 0.8],
            kind: JointKind::Prismatic,
            limits: [-0.5, f64::INFINITY],
            variables: JointVariables { position: 3, torque: 6, ..JointVariables::ABSENT },
            break_action: "joint.break".into(),
        };
        Scene {
            bodies: ["body", "leg"].map(|n| SceneBody { name: n.into(), mass: 2.5 }).into(),
            shapes: vec![
                shape(1, Geometry::Sphere { radius: 0.03 }),
                shape(2, Geometry::Box { half_extents: [0.1, 0.2, 0.3] }),
                shape(3, Geometry::Capsule { half_length: 0.4, radius: 0.05 }),
                shape(4, Geometry::Cylinder { half_length: 0.5, radius: 0.06 }),
                shape(9, mesh),
                shape(10, Geometry::ConeFrustum { half_length: 0.5, radius_bottom: 0.2, radius_top: 0.1 }),
                shape(11, Geometry::Ellipsoid { semi_axes: [0.1, 0.2, 0.3] }),
                SceneShape { collides: false, ..shape(12, sheet) },
            ],
            joints: vec![joint],
        }
    }

    fn body_states(&self, out: &mut [BodyState]) -> Result {
        for (k, s) in out.iter_mut().enumerate() {
            *s = BodyState { linear_velocity: [self.state, k as f64, 2.0], ..BodyState::REST };
        }
        Ok(())
    }

    fn fields(&self) -> &[FieldInfo] {
        &self.fields
    }

    fn field_tile(&self, field: usize, a: u32, b: u32) -> Result<FieldTile<'_>> {
        let values = match field {
            0 => TileValues::F64(&self.heights[4 * b as usize..][..4]),
            1 => TileValues::Fixed { data: &self.fixed, unit: 0.25 },
            2 => TileValues::F32(&self.floats),
            3 => TileValues::Uniform(f64::from(a)),
            _ => return Err(Error::Refused(format!("no field {field}"))),
        };
        Ok(FieldTile { generation: u64::from(10 * a + b), values })
    }

    fn energy(&self) -> Energy {
        let mut parallel = [(); 8].map(|()| std::sync::atomic::AtomicU64::new(0));
        self.host.parallel_for(8, &|k| {
            parallel[k].store(k as u64 + 1, std::sync::atomic::Ordering::Relaxed);
        });
        let sum: u64 = parallel.iter_mut().map(|p| *p.get_mut()).sum();
        Energy {
            kinetic: self.state,
            potential: self.host.seed() as f64,
            dissipated: sum as f64,
            port_work: f64::from(u8::from(self.host.cancelled())),
            actuator_work: f64::from(self.host.max_nodes()),
            electrical: 7.0,
        }
    }
}

fn fill(out: &mut Response, seed: f64) {
    for (factor, vector) in [&mut *out.x, &mut *out.v, &mut *out.a, &mut *out.t].into_iter().enumerate() {
        for (k, v) in vector.iter_mut().enumerate() {
            *v = seed * (k + 1) as f64 + factor as f64;
        }
    }
}
