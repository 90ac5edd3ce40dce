//! A bench for one body of any shape on level soil: its horizontal motion and rotation are given, vertically it carries a load
//! or moves as prescribed. It keeps the balance of energies independently of the soil's own ledger.

use super::fixture::Shown;
use terraglue_ground::{Lattice, Placed, Surface, nodes_below};
use terraglue_numerics::extremes::larger;
use terraglue_subsystem::{
    Geometry, Input, Law, Motion, Node, Port, PortKind, Pose, Response, Step, Subsystem, component,
};

/// Gap up to which ground below the body counts, m.
const MARGIN: f64 = 5e-3;

/// Vertical load or motion in a step.
#[derive(Clone, Copy, Debug)]
pub enum Vertical {
    /// The body carries this load, N.
    Load(f64),
    /// It goes up by so much, m.
    Up(f64),
}

/// A step of the body's centre.
#[derive(Clone, Copy, Debug)]
pub struct Move {
    /// Displacement in world x and y, m.
    pub ahead: [f64; 2],
    /// Vertically.
    pub vertical: Vertical,
    /// Rotation vector, world, rad.
    pub turn: [f64; 3],
}

/// Orientation of a cylinder that stands on its rim as a wheel does, its plane turned from x by `yaw` (rad).
pub fn on_rim(yaw: f64) -> [f64; 4] {
    let (s, c) = (0.5 * yaw).sin_cos();
    [c, c, s, s].map(|x| x * std::f64::consts::FRAC_1_SQRT_2)
}

impl Move {
    /// A wheel yawed by `yaw` (rad) goes on by `ahead` (m) along x under a load (N) and turns by `turn` (rad) about its axle.
    pub fn rolling(ahead: f64, turn: f64, yaw: f64, load: f64) -> Self {
        let turn = [-yaw.sin() * turn, yaw.cos() * turn, 0.0];
        Self { ahead: [ahead, 0.0], vertical: Vertical::Load(load), turn }
    }
}

/// Work and energies since the start, J.
#[derive(Clone, Copy, Debug, Default)]
pub struct Balance {
    /// Work of the body on the soil.
    pub work: f64,
    /// Sum of its magnitudes.
    pub path: f64,
    /// Largest |heat + stored energy − work|.
    pub error: f64,
    /// Largest fall of the heat in a step.
    pub fall: f64,
    heat: f64,
}

impl Balance {
    /// The error over 1 % of the path of the work or 1e-9 J.
    pub fn relative(&self) -> f64 {
        self.error / (0.01 * self.path).max(1e-9)
    }
}

/// The bench.
pub struct Drive {
    /// The soil.
    pub soil: Box<dyn Subsystem>,
    geometry: Geometry,
    /// Centre, m.
    pub centre: [f64; 3],
    /// World from shape, w x y z.
    orientation: [f64; 4],
    /// Length of a step, s.
    pub h: f64,
    /// The balance so far.
    pub balance: Balance,
    index: u64,
    nodes: Vec<Node>,
}

/// The surface, or the level ground that was there before.
struct Undisturbed<'a>(Shown<'a>);

impl Surface for Undisturbed<'_> {
    fn lattice(&self) -> &Lattice {
        self.0.lattice()
    }
    fn height(&self, i: i32, j: i32) -> f64 {
        self.0.height(i, j).max(0.0)
    }
}

/// Force and moment about the centre on the body, world, N and N m.
pub type Wrench = [[f64; 3]; 2];

impl Drive {
    /// A body in an orientation (w, x, y, z), its lowest point on the level ground of `soil` at (x, y).
    pub fn new(soil: Box<dyn Subsystem>, geometry: Geometry, orientation: [f64; 4], at: [f64; 2]) -> Self {
        let pose = Pose { position: [at[0], at[1], 0.0], orientation };
        let low = Placed::new(&geometry, &pose).aabb().min[2];
        Self {
            soil,
            geometry,
            centre: [at[0], at[1], -low],
            orientation,
            h: 1e-3,
            balance: Balance::default(),
            index: 0,
            nodes: Vec::new(),
        }
    }

    /// Depth of the lowest point below the level ground, m.
    pub fn sinkage(&self) -> f64 {
        -self.placed().aabb().min[2]
    }

    fn placed(&self) -> Placed {
        let pose = Pose { position: self.centre, orientation: self.orientation };
        Placed::new(&self.geometry, &pose)
    }

    fn port(&mut self) -> Port {
        let placed = self.placed();
        self.nodes.clear();
        nodes_below(&placed, &Undisturbed(Shown::new(self.soil.as_ref())), MARGIN, &mut self.nodes);
        let bounds = placed.aabb();
        let half = |k: usize| 0.5 * (bounds.max[k] - bounds.min[k]);
        Port {
            key: 7,
            kind: PortKind::Contact as u32,
            side: -1,
            mask: component::WRENCH,
            first: 0,
            body: 0,
            shape: 0,
            first_node: 0,
            node_count: self.nodes.len() as u32,
            origin: [self.centre[0], self.centre[1], bounds.min[2]],
            frame: [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0],
            extent: [half(0), half(1)],
            law: Law::UNILATERAL,
        }
    }

    /// Makes a step and returns the wrench on the body about its centre.
    pub fn step(&mut self, now: &Move) -> Wrench {
        let port = self.port();
        let n = port.len();
        let (ports, nodes) = ([port], std::mem::take(&mut self.nodes));
        let step = Step {
            t: self.h * self.index as f64,
            h: self.h,
            index: self.index,
            trial: 0,
            n: n as u32,
            ports: &ports,
            nodes: &nodes,
        };
        let (mut out, mut laws) = ([[0.0; 6]; 4], [port.law]);
        let soil = &mut self.soil;
        soil.set_ports(&step, &mut laws, &mut response(&mut out, n)).expect("ports are taken");
        let arm = [0, 1, 2].map(|k| port.origin[k] - self.centre[k]);
        let swing = cross(now.turn, arm);
        let up = if let Vertical::Up(up) = now.vertical { up } else { 0.0 };
        let u = [now.ahead[0] + swing[0], now.ahead[1] + swing[1], up + swing[2]];
        let mut x = [u[2], u[0], u[1], now.turn[2], now.turn[0], now.turn[1]];
        let input = |x: &[f64; 6], load: &[f64; 6]| match now.vertical {
            Vertical::Load(_) => {
                let motion = Some(Motion { x: &x[..n], v: &[0.0; 6][..n] });
                let given = Input::Force { t: &load[..n], motion };
                soil_trial(&mut self.soil, &step, &given, n)
            }
            Vertical::Up(_) => {
                let motion = Motion { x: &x[..n], v: &[0.0; 6][..n] };
                soil_trial(&mut self.soil, &step, &Input::Motion(motion), n)
            }
        };
        let mut load = [0.0; 6];
        if let Vertical::Load(force) = now.vertical {
            load[0] = force;
        }
        let mut input = input;
        let answer = input(&x, &load);
        let mut wrench = answer[3];
        if let Vertical::Load(_) = now.vertical {
            x[0] = answer[0][0];
        }
        wrench[n..].fill(0.0);
        let v = x.map(|x| x / self.h);
        self.soil
            .commit(&step, &wrench[..n], &Motion { x: &x[..n], v: &v[..n] })
            .expect("the motion is taken");
        self.book(&wrench, &x);
        self.nodes = nodes;
        self.index += 1;
        for k in 0..2 {
            self.centre[k] += now.ahead[k];
        }
        self.centre[2] += x[0] - swing[2];
        self.orientation = turned(self.orientation, now.turn);
        let force = [wrench[1], wrench[2], wrench[0]];
        let about = [wrench[4], wrench[5], wrench[3]];
        let lever = cross(arm, force);
        [force, [0, 1, 2].map(|k| about[k] + lever[k])]
    }

    fn book(&mut self, wrench: &[f64; 6], x: &[f64; 6]) {
        let work: f64 = -wrench.iter().zip(x).map(|(t, x)| t * x).sum::<f64>();
        let e = self.soil.energy();
        let b = &mut self.balance;
        b.work += work;
        b.path += work.abs();
        b.error = larger(b.error, (e.dissipated + e.potential + e.kinetic - b.work).abs());
        b.fall = larger(b.fall, b.heat - e.dissipated);
        b.heat = e.dissipated;
    }
}

fn soil_trial(soil: &mut Box<dyn Subsystem>, step: &Step, input: &Input, n: usize) -> [[f64; 6]; 4] {
    let mut out = [[0.0; 6]; 4];
    soil.advance(step, input, &mut response(&mut out, n)).expect("the soil answers");
    out
}

fn response(out: &mut [[f64; 6]; 4], n: usize) -> Response<'_> {
    let [x, v, a, t] = out;
    Response { x: &mut x[..n], v: &mut v[..n], a: &mut a[..n], t: &mut t[..n], reached: 0.0, flags: 0 }
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The orientation (w, x, y, z) after a rotation vector in the world.
pub fn turned(q: [f64; 4], turn: [f64; 3]) -> [f64; 4] {
    let angle = (turn[0] * turn[0] + turn[1] * turn[1] + turn[2] * turn[2]).sqrt();
    if angle == 0.0 {
        return q;
    }
    let (s, c) = ((0.5 * angle).sin() / angle, (0.5 * angle).cos());
    let [a, b, d, w] = [s * turn[0], s * turn[1], s * turn[2], c];
    let [v, x, y, z] = q;
    [
        w * v - a * x - b * y - d * z,
        w * x + a * v + b * z - d * y,
        w * y - a * z + b * v + d * x,
        w * z + a * y - b * x + d * v,
    ]
}
