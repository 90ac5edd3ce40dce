//! A soil below feet that move as they are told.

use super::{Flat, Vectors};
use crate::finding::Verdict;
use crate::lab::Lab;
use terraglue_gluing::contact::{BodySide, ContactDetector, GroundSide, Now};
use terraglue_host::{Instance, LoadedModule, Progress};
use terraglue_subsystem::{
    BodyState, Estimate, Geometry, Input, Law, Level, Motion, Node, Port, Pose, Scene, SceneBody, SceneShape,
    Step, Terrain,
};

/// A foot: its shape and where its centre is at the start, m.
#[derive(Clone, Debug)]
pub struct Foot {
    /// Shape around the centre.
    pub geometry: Geometry,
    /// Centre in the world, m.
    pub centre: [f64; 3],
    /// World from shape, w x y z.
    pub orientation: [f64; 4],
}

impl Foot {
    /// A sphere of 4 cm radius that touches level ground at (x, y).
    pub fn sphere(x: f64, y: f64) -> Self {
        Self::of(Geometry::Sphere { radius: 0.04 }, [x, y, 0.04])
    }

    /// A plate of 10 cm by 6 cm that lies on level ground at (x, y).
    pub fn plate(x: f64, y: f64) -> Self {
        Self::of(Geometry::Box { half_extents: [0.05, 0.03, 0.01] }, [x, y, 0.01])
    }

    /// A wheel of 6 cm radius and 6 cm width, its axis along y, that touches level ground at (x, y).
    pub fn wheel(x: f64, y: f64) -> Self {
        let lying = std::f64::consts::FRAC_1_SQRT_2;
        let wheel = Self::of(Geometry::Cylinder { half_length: 0.03, radius: 0.06 }, [x, y, 0.06]);
        Self { orientation: [lying, lying, 0.0, 0.0], ..wheel }
    }

    fn of(geometry: Geometry, centre: [f64; 3]) -> Self {
        Self { geometry, centre, orientation: Pose::IDENTITY.orientation }
    }

    /// The same, higher by h (m).
    pub fn lifted(mut self, h: f64) -> Self {
        self.centre[2] += h;
        self
    }
}

/// What a foot met in a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moved {
    /// Force of the soil on the foot, world, N.
    pub force: [f64; 3],
    /// Moment of the soil on the foot about its centre, world, N m.
    pub moment: [f64; 3],
    /// Force along the normal of the port, N.
    pub normal: f64,
    /// Force across it, N.
    pub tangential: f64,
    /// Coulomb coefficient that the soil declared.
    pub mu: f64,
    /// Whether there was a port at all.
    pub touched: bool,
}

/// The bench.
pub struct SoilBench {
    /// The soil.
    pub soil: Instance,
    detector: ContactDetector,
    /// Centres of the feet now.
    pub states: Vec<BodyState>,
    /// Ports of the last step, as the soil sees them.
    pub ports: Vec<Port>,
    /// Nodes of the last step.
    pub nodes: Vec<Node>,
    laws: Vec<Law>,
    n: usize,
    /// Time, s.
    pub t: f64,
    /// Accepted steps.
    pub index: u64,
    /// Answer of the soil to `set_ports`.
    pub now: Vectors,
    /// Answer of the last trial.
    pub out: Vectors,
    x: Vec<f64>,
    v: Vec<f64>,
    /// Answers per foot in the last step.
    pub moved: Vec<Moved>,
    /// Rate at which every foot turns about its centre, world, rad/s.
    pub turning: [f64; 3],
    /// Angle by which the tangents of every port are turned about its normal, rad.
    pub turn: f64,
}

impl SoilBench {
    /// A new instance on level ground.
    ///
    /// # Errors
    /// A finding: the soil cannot be made.
    pub fn new(lab: &Lab, feet: &[Foot]) -> Verdict<Self> {
        Self::on(lab, &lab.module()?, Flat::LEVEL, feet)
    }

    /// The same of a module that is loaded already, on other ground.
    ///
    /// # Errors
    /// As [`SoilBench::new`].
    pub fn on(lab: &Lab, module: &LoadedModule, ground: Flat, feet: &[Foot]) -> Verdict<Self> {
        Self::around(lab.instance_on(module, ground)?, &ground, feet)
    }

    /// Around a soil that exists.
    ///
    /// # Errors
    /// It shows a ground that cannot be read.
    pub fn around(soil: Instance, ground: &dyn Terrain, feet: &[Foot]) -> Verdict<Self> {
        let scene = scene(feet);
        let bodies = [BodySide { subsystem: 0, name: "feet", scene: &scene }];
        let grounds = [GroundSide { subsystem: 1, instance: soil.subsystem() }];
        let detector = ContactDetector::new(&bodies, &grounds, Some(ground))?;
        let state = |f: &Foot| BodyState {
            world_from_body: Pose { position: f.centre, orientation: f.orientation },
            ..BodyState::REST
        };
        Ok(Self {
            soil,
            detector,
            states: feet.iter().map(state).collect(),
            ports: Vec::new(),
            nodes: Vec::new(),
            laws: Vec::new(),
            n: 0,
            t: 0.0,
            index: 0,
            now: Vectors::default(),
            out: Vectors::default(),
            x: Vec::new(),
            v: Vec::new(),
            moved: vec![Moved::default(); feet.len()],
            turning: [0.0; 3],
            turn: 0.0,
        })
    }

    /// Contacts of the feet that move with these velocities (m/s), and the soil's answer to `set_ports`.
    ///
    /// # Errors
    /// The soil failed.
    pub fn meet(&mut self, velocities: &[[f64; 3]], h: f64) -> Verdict {
        for (state, v) in self.states.iter_mut().zip(velocities) {
            state.linear_velocity = *v;
            state.angular_velocity = self.turning;
        }
        let now = Now { t: self.t, h, gravity: [0.0, 0.0, -9.81], margin: 1e-3 };
        let (states, soil) = (&self.states, &self.soil);
        let set = self.detector.detect(&now, |_| states, |_| soil.subsystem())?;
        self.ports.clear();
        let turn = self.turn;
        self.ports.extend(set.ports.iter().map(|p| turned(&Port { side: -1, ..*p }, turn)));
        self.nodes.clone_from(&set.nodes);
        self.n = set.n as usize;
        self.ask_ports(h)
    }

    /// The soil's answer to `set_ports` with the ports as they are.
    ///
    /// # Errors
    /// The soil failed.
    pub fn ask_ports(&mut self, h: f64) -> Verdict {
        self.laws.clear();
        self.laws.resize(self.ports.len(), Law::UNILATERAL);
        (self.now, self.out) = (Vectors::new(self.n), Vectors::new(self.n));
        let n = self.n as u32;
        let step = Step { n, ports: &self.ports, nodes: &self.nodes, ..Step::free(self.t, h, self.index) };
        Ok(self.soil.set_ports(&step, &mut self.laws, &mut self.now.response())?)
    }

    /// Packed motion of the feet over h.
    pub fn motion_of(&self, velocities: &[[f64; 3]], h: f64) -> (Vec<f64>, Vec<f64>) {
        let (mut x, mut v) = (vec![0.0; self.n], vec![0.0; self.n]);
        for port in &self.ports {
            let body = port.body as usize;
            let centre = self.states[body].world_from_body.position;
            let arm: [f64; 3] = std::array::from_fn(|k| port.origin[k] - centre[k]);
            let swing = cross(self.turning, arm);
            let point: [f64; 3] = std::array::from_fn(|k| velocities[body][k] + swing[k]);
            for (i, c) in port.components() {
                v[i] = dot(port.direction(c), if c < 3 { point } else { self.turning });
                x[i] = h * v[i];
            }
        }
        (x, v)
    }

    /// A trial: the answer to a motion of the feet.
    ///
    /// # Errors
    /// The soil failed.
    pub fn try_motion(&mut self, x: &[f64], v: &[f64], h: f64) -> Verdict {
        let n = self.n as u32;
        let step = Step { n, ports: &self.ports, nodes: &self.nodes, ..Step::free(self.t, h, self.index) };
        let progress = self.soil.advance(&step, &Input::Motion(Motion { x, v }), &mut self.out.response())?;
        match progress {
            Progress::Complete => Ok(()),
            Progress::Early { reached_s } => Err(crate::Stop::fail(
                "advance",
                format!("motion over h = {h} s at t = {} s", self.t),
                format!("it ended early at {reached_s} s"),
                "a whole step of a foot that moves a fraction of a millimetre",
            )),
        }
    }

    /// A trial: the answer to a force with the motion of the feet.
    ///
    /// # Errors
    /// The soil failed.
    pub fn try_force(&mut self, t: &[f64], motion: Option<(&[f64], &[f64])>, h: f64) -> Verdict {
        let n = self.n as u32;
        let step = Step { n, ports: &self.ports, nodes: &self.nodes, ..Step::free(self.t, h, self.index) };
        let motion = motion.map(|(x, v)| Motion { x, v });
        let input = Input::Force { t, motion };
        self.soil.advance(&step, &input, &mut self.out.response())?;
        Ok(())
    }

    /// A packed wrench with this normal force (N) on every port.
    pub fn packed_normal(&self, size: f64) -> Vec<f64> {
        let mut t = vec![0.0; self.n];
        self.normal_components().into_iter().for_each(|i| t[i] = size);
        t
    }

    /// A trial of the co-operational pass under a rigid estimate.
    ///
    /// # Errors
    /// The soil failed.
    pub fn try_estimate(&mut self, t_star: &[f64], h: f64) -> Verdict {
        let (mut t_star, mut x_free) = (t_star.to_vec(), vec![0.0; self.n]);
        let (mut g, mut active) = (vec![0.0; self.n * self.n], vec![1u8; self.ports.len()]);
        (0..self.n).for_each(|i| g[i * self.n + i] = h * h);
        let estimate = Estimate {
            t_star: &mut t_star,
            x_free: &mut x_free,
            g: &mut g,
            active: &mut active,
            unique: true,
        };
        let n = self.n as u32;
        let step = Step { n, ports: &self.ports, nodes: &self.nodes, ..Step::free(self.t, h, self.index) };
        self.soil.solve_compatibility(&step, &estimate, &mut self.out.response())?;
        Ok(())
    }

    /// Height (m) of the node of the field `height` nearest to a point; None: there is no such field.
    ///
    /// # Errors
    /// The soil failed.
    pub fn ground_height(&self, x: f64, y: f64) -> Verdict<Option<f64>> {
        let Some(number) = self.soil.fields().iter().position(|f| f.name == "height") else {
            return Ok(None);
        };
        let field = &self.soil.fields()[number];
        let node = |at: f64, axis: usize| {
            let k = ((at - field.origin[axis]) / field.spacing).round().max(0.0) as u32;
            k.min(field.size[axis].saturating_sub(1))
        };
        let (i, j, edge) = (node(x, 0), node(y, 1), field.tile_edge.max(1));
        let tile = self.soil.field_tile(number, i / edge, j / edge)?;
        Ok(Some(tile.values.at(((j % edge) * edge + i % edge) as usize)))
    }

    /// Sum of the heights of all nodes times the area of a cell, m³; None: there is no field `height`.
    ///
    /// # Errors
    /// The soil failed.
    pub fn ground_volume(&self) -> Verdict<Option<f64>> {
        let Some(number) = self.soil.fields().iter().position(|f| f.name == "height") else {
            return Ok(None);
        };
        let field = &self.soil.fields()[number];
        let edge = field.tile_edge.max(1);
        let mut sum = 0.0;
        for (a, b) in (0..field.size[0].div_ceil(edge))
            .flat_map(|a| (0..field.size[1].div_ceil(edge)).map(move |b| (a, b)))
        {
            let tile = self.soil.field_tile(number, a, b)?;
            let inside = |k: u32| a * edge + k % edge < field.size[0] && b * edge + k / edge < field.size[1];
            sum += (0..edge * edge).filter(|k| inside(*k)).map(|k| tile.values.at(k as usize)).sum::<f64>();
        }
        Ok(Some(sum * field.spacing * field.spacing))
    }

    /// Places of all components of ports that carry more than a normal force (N) in the last trial.
    pub fn components_above(&self, force: f64) -> Vec<usize> {
        let carries = |p: &&Port| p.components().any(|(i, c)| c == 0 && self.out.t[i] > force);
        self.ports.iter().filter(carries).flat_map(Port::components).map(|(i, _)| i).collect()
    }

    /// Places of the normal components in packed vectors.
    pub fn normal_components(&self) -> Vec<usize> {
        self.ports.iter().flat_map(|p| p.components().filter(|(_, c)| *c == 0)).map(|(i, _)| i).collect()
    }

    /// The derivative after a trial, column-major.
    ///
    /// # Errors
    /// The soil failed.
    pub fn jacobian(&mut self, level: Level, h: f64) -> Verdict<Vec<f64>> {
        let mut k = vec![0.0; self.n * self.n];
        let n = self.n as u32;
        let step = Step { n, ports: &self.ports, nodes: &self.nodes, ..Step::free(self.t, h, self.index) };
        self.soil.interface_jacobian(&step, level, &mut k)?;
        Ok(k)
    }

    /// Accepts the last trial with the feet at this motion, and moves them.
    ///
    /// # Errors
    /// The soil failed.
    pub fn commit(&mut self, velocities: &[[f64; 3]], h: f64) -> Verdict {
        let (x, v) = self.motion_of(velocities, h);
        let n = self.n as u32;
        let step = Step { n, ports: &self.ports, nodes: &self.nodes, ..Step::free(self.t, h, self.index) };
        self.soil.commit(&step, &self.out.t, &Motion { x: &x, v: &v })?;
        self.note_moved();
        for (state, v) in self.states.iter_mut().zip(velocities) {
            let pose = &mut state.world_from_body;
            (0..3).for_each(|k| pose.position[k] += h * v[k]);
            pose.orientation = turned_by(pose.orientation, self.turning.map(|w| h * w));
        }
        self.t += h;
        self.index += 1;
        (self.x, self.v) = (x, v);
        Ok(())
    }

    /// Work of the feet on the soil in the last step by the soil's own answer to their motion, J.
    pub fn work(&self) -> f64 {
        -self.out.t.iter().zip(&self.x).map(|(t, x)| t * x).sum::<f64>()
    }

    fn note_moved(&mut self) {
        self.moved.fill(Moved::default());
        for (port, law) in self.ports.iter().zip(&self.laws) {
            let (force, about_origin) = port.wrench_in_world(&self.out.t);
            let centre = self.states[port.body as usize].world_from_body.position;
            let arm: [f64; 3] = std::array::from_fn(|k| port.origin[k] - centre[k]);
            let turned = cross(arm, force);
            let normal = dot(port.direction(0), force);
            let across: [f64; 3] = std::array::from_fn(|k| force[k] - normal * port.frame[k]);
            self.moved[port.body as usize] = Moved {
                force,
                moment: std::array::from_fn(|k| about_origin[k] + turned[k]),
                normal,
                tangential: dot(across, across).sqrt(),
                mu: law.mu,
                touched: true,
            };
        }
    }

    /// A whole step with feet that move with these velocities (m/s).
    ///
    /// # Errors
    /// The soil failed.
    pub fn go(&mut self, velocities: &[[f64; 3]], h: f64) -> Verdict<&[Moved]> {
        self.meet(velocities, h)?;
        let (x, v) = self.motion_of(velocities, h);
        self.try_motion(&x, &v, h)?;
        self.commit(velocities, h)?;
        Ok(&self.moved)
    }

    /// Steps of one millisecond that move the only foot by a displacement (m) in `steps` steps.
    ///
    /// # Errors
    /// The soil failed.
    pub fn drag(&mut self, displacement: [f64; 3], steps: usize) -> Verdict<Moved> {
        let velocity = displacement.map(|d| d / (steps as f64 * 1e-3));
        for _ in 0..steps {
            self.go(&[velocity], 1e-3)?;
        }
        Ok(self.moved[0])
    }
}

/// The port with its tangents turned about its normal.
fn turned(port: &Port, angle: f64) -> Port {
    if angle == 0.0 {
        return *port;
    }
    let (sin, cos) = (libm::sin(angle), libm::cos(angle));
    let (t1, t2) = (port.direction(1), port.direction(2));
    let mut out = *port;
    for k in 0..3 {
        out.frame[3 + k] = cos * t1[k] + sin * t2[k];
        out.frame[6 + k] = cos * t2[k] - sin * t1[k];
    }
    // Half lengths along the turned tangents hold the whole plate.
    let [a, b] = port.extent;
    out.extent = [a * cos.abs() + b * sin.abs(), a * sin.abs() + b * cos.abs()];
    out
}

fn scene(feet: &[Foot]) -> Scene {
    let body = |k: usize| SceneBody { name: format!("foot {k}"), mass: 1.0 };
    let shape = |(k, foot): (usize, &Foot)| SceneShape {
        id: k as u32,
        body: k as u32,
        name: format!("foot {k}"),
        geometry: foot.geometry.clone(),
        body_from_shape: Pose::IDENTITY,
        collides: true,
    };
    Scene {
        bodies: (0..feet.len()).map(body).collect(),
        shapes: feet.iter().enumerate().map(shape).collect(),
    }
}

/// Scalar product.
pub fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The orientation (w, x, y, z) after a rotation vector in the world, rad.
fn turned_by(q: [f64; 4], turn: [f64; 3]) -> [f64; 4] {
    let angle = dot(turn, turn).sqrt();
    if angle == 0.0 {
        return q;
    }
    let (share, w) = (libm::sin(0.5 * angle) / angle, libm::cos(0.5 * angle));
    let ([a, b, c], [v, x, y, z]) = (turn.map(|r| share * r), q);
    [
        w * v - a * x - b * y - c * z,
        w * x + a * v + b * z - c * y,
        w * y - a * z + b * v + c * x,
        w * z + a * y - b * x + c * v,
    ]
}
