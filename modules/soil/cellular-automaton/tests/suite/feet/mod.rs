//! Any number of bodies in prescribed motion on the automaton, for tests and validation: contact geometry, forces and
//! material as in a run, without a coordinator.
#![allow(dead_code, clippy::unwrap_used)]

pub mod walk;

use std::sync::Arc;
use terraglue_ground::{Placed, Rotation, UNIT_M, nodes_below};
use terraglue_numerics::extremes::larger;
use terraglue_soil_cellular_automaton::{Automaton, Settings};
use terraglue_soil_contact::FieldSoil;
use terraglue_subsystem::{
    Config, Geometry, Host, Input, Law, Module, Motion, Node, Port, PortKind, Pose, Response, Step,
    Subsystem, component,
};

pub type Soil = FieldSoil<Automaton>;

pub const H: f64 = 1e-3;
/// Nodes whose surface lies so far below a body (m) belong to its patch all the same: material flows there.
const MARGIN: f64 = 0.002;
const FRAME: [f64; 9] = [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];

/// Bodies on a soil.
pub struct Feet {
    pub soil: Soil,
    pub bodies: Vec<Placed>,
    pub index: u64,
    pub nodes: Vec<Node>,
    pub ports: Vec<Port>,
    /// Which body a port belongs to.
    owners: Vec<usize>,
    /// Wrenches of the law at the end of the last step, by port.
    pub t: Vec<f64>,
    x: Vec<f64>,
    v: Vec<f64>,
    answer: [Vec<f64>; 3],
    laws: Vec<Law>,
}

/// State of the bodies at a moment: all but the soil's state.
#[derive(Clone)]
pub struct Moment {
    bodies: Vec<Placed>,
    index: u64,
    ports: Vec<Port>,
    owners: Vec<usize>,
    t: Vec<f64>,
}

pub fn instance<M: Module>(config: &str, host: Arc<dyn Host>) -> Soil {
    let config = Config::parse(config).unwrap().with_defaults(&M::schema());
    let automaton = Automaton::new(Settings::from_config(&config).unwrap(), host.clone());
    FieldSoil::new(&config, host, automaton).unwrap()
}

impl Feet {
    pub fn new(soil: Soil) -> Self {
        Self {
            soil,
            bodies: Vec::new(),
            index: 0,
            nodes: Vec::with_capacity(4096),
            ports: Vec::with_capacity(32),
            owners: Vec::with_capacity(32),
            t: Vec::with_capacity(256),
            x: Vec::with_capacity(256),
            v: Vec::with_capacity(256),
            answer: Default::default(),
            laws: Vec::with_capacity(32),
        }
    }

    /// Copies the state of the bodies.
    pub fn moment(&self) -> Moment {
        let Self { bodies, index, ports, owners, t, .. } = self;
        Moment {
            bodies: bodies.clone(),
            index: *index,
            ports: ports.clone(),
            owners: owners.clone(),
            t: t.clone(),
        }
    }

    /// Back to a moment; the soil's state is restored separately.
    pub fn return_to(&mut self, moment: &Moment) {
        let Moment { bodies, index, ports, owners, t } = moment.clone();
        (self.bodies, self.index, self.ports, self.owners, self.t) = (bodies, index, ports, owners, t);
    }

    /// One more body, at rest.
    pub fn add(&mut self, geometry: &Geometry, pose: Pose) {
        self.bodies.push(Placed::new(geometry, &pose));
    }

    /// Steps the soil while body k goes to `goal(k)`; the motion of a step is small.
    pub fn step(&mut self, goal: impl Fn(usize) -> Pose) {
        self.answer(&goal, true);
        for (k, body) in self.bodies.iter_mut().enumerate() {
            body.move_to(&goal(k));
        }
        self.index += 1;
    }

    /// Asks for the forces if body k went to `goal(k)`; nothing moves.
    pub fn ask(&mut self, goal: impl Fn(usize) -> Pose) {
        self.answer(&goal, false);
    }

    fn answer(&mut self, goal: &impl Fn(usize) -> Pose, commit: bool) {
        self.detect(goal);
        let step = Step {
            t: self.index as f64 * H,
            h: H,
            index: self.index,
            trial: 0,
            n: self.x.len() as u32,
            ports: &self.ports,
            nodes: &self.nodes,
        };
        let [x, v, a] = &mut self.answer;
        let mut out = Response { x, v, a, t: &mut self.t, reached: 0.0, flags: 0 };
        self.soil.set_ports(&step, &mut self.laws, &mut out).unwrap();
        let motion = Motion { x: &self.x, v: &self.v };
        self.soil.advance(&step, &Input::Motion(motion), &mut out).unwrap();
        assert!(out.x.iter().chain(&*out.v).chain(&*out.a).chain(&*out.t).all(|v| v.is_finite()));
        if commit {
            self.soil.commit(&step, &self.t, &motion).unwrap();
        }
    }

    /// Finds the patches and the motion of their origins.
    fn detect(&mut self, goal: &impl Fn(usize) -> Pose) {
        self.nodes.clear();
        self.ports.clear();
        self.owners.clear();
        self.laws.clear();
        self.x.clear();
        for (k, body) in self.bodies.iter().enumerate() {
            let first = self.nodes.len();
            nodes_below(body, &self.soil.ground().heights, MARGIN, &mut self.nodes);
            if self.nodes.len() == first {
                continue;
            }
            let origin = body.patch_origin([0.0, 0.0, 1.0]);
            let extent = [body.half_width([1.0, 0.0, 0.0]), body.half_width([0.0, 1.0, 0.0])];
            let port = Port {
                key: k as u64,
                kind: PortKind::Contact as u32,
                side: -1,
                mask: component::WRENCH,
                first: self.x.len() as u32,
                body: k as u32,
                shape: k as u32,
                first_node: first as u32,
                node_count: (self.nodes.len() - first) as u32,
                origin,
                frame: FRAME,
                extent,
                law: Law::UNILATERAL,
            };
            let motion = displacement(body.pose(), &goal(k), origin);
            self.x.extend(port.components().map(|(_, c)| motion[c]));
            self.laws.push(port.law);
            self.ports.push(port);
            self.owners.push(k);
        }
        let n = self.x.len();
        self.v.clear();
        self.v.extend(self.x.iter().map(|x| x / H));
        for packed in self.answer.iter_mut().chain([&mut self.t]) {
            packed.clear();
            packed.resize(n, f64::NAN);
        }
    }

    /// Force on body k along x, y, z; zero without contact.
    pub fn force(&self, k: usize) -> [f64; 3] {
        let port = self.owners.iter().position(|owner| *owner == k);
        port.map_or([0.0; 3], |p| self.ports[p].wrench_in_world(&self.t).0)
    }

    /// Takes all bodies away and lets the material come to rest; how many steps it took.
    pub fn lift_and_rest(&mut self, most: u32) -> u32 {
        self.bodies.clear();
        (0..most)
            .find(|_| {
                self.step(|_| Pose::IDENTITY);
                self.soil.material().active_nodes() == 0
            })
            .unwrap_or_else(|| panic!("not at rest after {most} steps"))
    }

    /// Units of material, compacted ones counted.
    pub fn mass(&self) -> i64 {
        self.soil.ground().heights.total_units() + self.soil.material().compaction().total()
    }

    /// A number that changes with any bit of the state: FNV-1a over heights, node states, forces and counts.
    pub fn hash(&self) -> u64 {
        let ground = self.soil.ground();
        let [nx, ny] = ground.heights.lattice().size.map(|n| n as i32);
        let mut sum = Fnv::new();
        for j in 0..ny {
            for i in 0..nx {
                sum.add(ground.heights.units(i, j) as u64);
                sum.add(ground.heights.sinkage_units(i, j) as u64);
                let state = ground.nodes.get(i, j);
                for part in [state.reference, state.remainder, state.permanent, state.pressure, state.energy]
                {
                    sum.add(part.to_bits());
                }
                sum.add(state.shear.slip.to_bits());
                state.shear.elastic.iter().for_each(|e| sum.add(e.to_bits()));
                sum.add(state.stamp);
            }
        }
        self.t.iter().for_each(|t| sum.add(t.to_bits()));
        let material = self.soil.material();
        sum.add(material.compaction().total() as u64);
        sum.add(material.active_nodes() as u64);
        sum.add(material.counts().moved as u64);
        sum.0
    }
}

struct Fnv(u64);

impl Fnv {
    const fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    fn add(&mut self, word: u64) {
        for byte in word.to_le_bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3);
        }
    }
}

/// Motion along z, x, y and rotation about them of a point of a body that goes from one pose to another.
fn displacement(from: &Pose, to: &Pose, origin: [f64; 3]) -> [f64; 6] {
    let (before, after) =
        (Rotation::from_quaternion(from.orientation), Rotation::from_quaternion(to.orientation));
    let offset: [f64; 3] = std::array::from_fn(|k| origin[k] - from.position[k]);
    let turned = after.to_world(before.to_shape(offset));
    let [x, y, z] = [0, 1, 2].map(|k| to.position[k] + turned[k] - origin[k]);
    let [rx, ry, rz] = rotation_vector(from.orientation, to.orientation);
    [z, x, y, rz, rx, ry]
}

/// Rotation vector in the world of to·from⁻¹, for small angles to second order.
fn rotation_vector([aw, ax, ay, az]: [f64; 4], [bw, bx, by, bz]: [f64; 4]) -> [f64; 3] {
    let w = bw * aw + bx * ax + by * ay + bz * az;
    let v = [
        -bw * ax + bx * aw - by * az + bz * ay,
        -bw * ay + bx * az + by * aw - bz * ax,
        -bw * az - bx * ay + by * ax + bz * aw,
    ];
    v.map(|c| 2.0 * c / w)
}

/// One of seven shapes, some centimetres large; the last two are blades.
pub fn shape(kind: u32) -> Geometry {
    match kind % 7 {
        0 => Geometry::Sphere { radius: 0.035 },
        1 => Geometry::Box { half_extents: [0.04, 0.025, 0.02] },
        2 => Geometry::Capsule { half_length: 0.04, radius: 0.02 },
        3 => Geometry::Cylinder { half_length: 0.02, radius: 0.035 },
        4 => wedge(),
        5 => Geometry::Box { half_extents: [0.05, 0.01, 0.03] },
        _ => Geometry::Box { half_extents: [0.05, 0.005, 0.03] },
    }
}

/// A convex mesh with faces, edges and corners in all directions.
fn wedge() -> Geometry {
    let points = vec![
        [-0.04, -0.03, 0.0],
        [0.04, -0.02, 0.01],
        [0.0, 0.04, 0.005],
        [0.005, 0.0, 0.05],
        [0.0, 0.0, -0.03],
    ];
    let triangles = vec![[0, 1, 3], [1, 2, 3], [2, 0, 3], [1, 0, 4], [2, 1, 4], [0, 2, 4]];
    Geometry::ConvexMesh { points, triangles }
}

/// Numbers without a pattern that are the same everywhere (Marsaglia 2003, xorshift).
#[derive(Clone, Copy, Debug)]
pub struct Dice(pub u64);

impl Dice {
    /// Uniform in low … high.
    pub fn roll(&mut self, low: f64, high: f64) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        low + (high - low) * (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A unit quaternion.
    pub fn turn(&mut self) -> [f64; 4] {
        loop {
            let q: [f64; 4] = std::array::from_fn(|_| self.roll(-1.0, 1.0));
            let square: f64 = q.iter().map(|c| c * c).sum();
            if square > 0.01 && square < 1.0 {
                return q.map(|c| c / square.sqrt());
            }
        }
    }
}

/// A body that is pressed, dragged and lifted over a square of ground by random goals, at most 1.5 m/s fast.
#[derive(Clone, Copy, Debug)]
pub struct Wanderer {
    pub pose: Pose,
    goal: [f64; 3],
    steps_left: u32,
    half: f64,
    deepest: f64,
    dice: Dice,
}

impl Wanderer {
    pub fn new(seed: u64, half: f64, deepest: f64) -> Self {
        let mut dice = Dice(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
        (0..8).for_each(|_| {
            dice.roll(0.0, 1.0);
        });
        let position = [dice.roll(-half, half), dice.roll(-half, half), 0.08];
        let pose = Pose { position, orientation: dice.turn() };
        Self { pose, goal: position, steps_left: 0, half, deepest, dice }
    }

    /// The pose a step later.
    pub fn next(&mut self) -> Pose {
        if self.steps_left == 0 {
            self.steps_left = self.dice.roll(20.0, 150.0) as u32;
            let (half, dice) = (self.half, &mut self.dice);
            self.goal = [dice.roll(-half, half), dice.roll(-half, half), dice.roll(-self.deepest, 0.08)];
        }
        let left = f64::from(self.steps_left);
        for k in 0..3 {
            self.pose.position[k] += ((self.goal[k] - self.pose.position[k]) / left).clamp(-1e-3, 1e-3);
        }
        self.steps_left -= 1;
        self.pose
    }

    /// Another orientation, for a moment when the body is in the air.
    pub fn turn_in_the_air(&mut self) {
        self.pose.position[2] = 0.09;
        self.pose.orientation = self.dice.turn();
        self.steps_left = 0;
    }
}

/// Largest slope of a surface in units of height by central differences and by single faces: the larger of
/// √(g_n² + g_t²) of the rule of repose over all faces, divided by the spacing.
pub fn steepest(soil: &Soil) -> f64 {
    let heights = &soil.ground().heights;
    let [nx, ny] = heights.lattice().size.map(|n| n as i32);
    let h = |i: i32, j: i32| f64::from(heights.units(i, j));
    let mut worst: f64 = 0.0;
    for j in 0..ny {
        for i in 0..nx {
            for [a, b] in [[1, 0], [0, 1]] {
                if i + a >= nx || j + b >= ny {
                    continue;
                }
                let along = h(i, j) - h(i + a, j + b);
                let across = |i: i32, j: i32| 0.5 * (h(i + b, j + a) - h(i - b, j - a));
                worst = larger(worst, along.hypot(0.5 * (across(i, j) + across(i + a, j + b))));
            }
        }
    }
    worst * UNIT_M / heights.lattice().spacing
}
