//! A point mass with a foot on a soil, for the tests of all soils: gluing in its plainest form.
#![allow(dead_code, clippy::unwrap_used)]

use std::sync::{Arc, Mutex};
use terraglue_ground::{Lattice, Placed, Surface, nodes_below};
use terraglue_numerics::extremes::larger;
use terraglue_subsystem::{
    Config, Estimate, Geometry, Host, Input, Law, Level, LogLevel, Module, Motion, Node, NodeLaw, Port,
    PortKind, Pose, Response, Standalone, Step, Subsystem, Terrain, TerrainTile, ValuesMut, component,
};

pub const LUNAR: &str =
    r#"{"n":1.0,"k_c":1400,"k_phi":820000,"c_pa":170,"phi_rad":0.610865238198,"K_m":0.018}"#;
pub const LETE: &str = r#"{"n":0.793,"k_c":102000,"k_phi":5301000,"c_pa":1300,"wall_cohesion_pa":0,"phi_rad":0.542797397,"K_m":0.012}"#;
pub const DRY_SAND: &str = r#"{"n":1.1,"k_c":990,"k_phi":1528430,"c_pa":1040,"wall_cohesion_pa":0,"phi_rad":0.488692191,"K_m":0.01}"#;

/// Ground given by a function of x and y.
pub struct Shaped {
    pub size: [u32; 2],
    pub spacing: f64,
    pub height: fn(f64, f64) -> f64,
}

impl Terrain for Shaped {
    fn origin(&self) -> [f64; 2] {
        self.size.map(|n| -0.5 * f64::from(n - 1) * self.spacing)
    }
    fn spacing(&self) -> f64 {
        self.spacing
    }
    fn size(&self) -> [u32; 2] {
        self.size
    }
    fn heights(&self, i0: i64, j0: i64, ni: usize, nj: usize, out: &mut [f64]) -> TerrainTile {
        let o = self.origin();
        for b in 0..nj {
            for a in 0..ni {
                let i = (i0 + a as i64).clamp(0, i64::from(self.size[0]) - 1) as f64;
                let j = (j0 + b as i64).clamp(0, i64::from(self.size[1]) - 1) as f64;
                out[b * ni + a] = (self.height)(o[0] + i * self.spacing, o[1] + j * self.spacing);
            }
        }
        TerrainTile::Varied
    }
}

pub fn flat(_: f64, _: f64) -> f64 {
    0.0
}

/// An instance on shaped ground.
pub fn soil<M: Module>(
    config: &str,
    size: u32,
    spacing: f64,
    height: fn(f64, f64) -> f64,
) -> Box<dyn Subsystem> {
    hosted::<M>(config, Shaped { size: [size; 2], spacing, height }, None).0
}

/// An instance with a law of its own, and its log so far.
pub fn hosted<M: Module>(
    config: &str,
    terrain: Shaped,
    law: Option<Arc<dyn NodeLaw>>,
) -> (Box<dyn Subsystem>, Arc<Handed>) {
    let plain =
        Standalone { gravity: [0.0, 0.0, -9.81], terrain: Some(Box::new(terrain)), ..Default::default() };
    let host = Arc::new(Handed { plain, law, said: Mutex::default() });
    let config = Config::parse(config).unwrap().with_defaults(&M::schema());
    (M::instantiate(&config, host.clone()).unwrap(), host)
}

/// A host that hands a law to the soil and keeps its messages.
pub struct Handed {
    plain: Standalone,
    law: Option<Arc<dyn NodeLaw>>,
    pub said: Mutex<Vec<String>>,
}

impl Host for Handed {
    fn name(&self) -> &str {
        self.plain.name()
    }
    fn log(&self, _: LogLevel, text: &str) {
        self.said.lock().unwrap().push(text.into());
    }
    fn seed(&self) -> u64 {
        self.plain.seed()
    }
    fn folder(&self) -> &str {
        self.plain.folder()
    }
    fn slots(&self) -> u32 {
        self.plain.slots()
    }
    fn max_nodes(&self) -> u32 {
        self.plain.max_nodes()
    }
    fn gravity(&self) -> [f64; 3] {
        self.plain.gravity()
    }
    fn terrain(&self) -> Option<&dyn Terrain> {
        self.plain.terrain()
    }
    fn law(&self) -> Option<Arc<dyn NodeLaw>> {
        self.law.clone()
    }
}

/// Heights that a soil shows.
pub struct Shown<'a> {
    pub soil: &'a dyn Subsystem,
    pub field: usize,
    pub lattice: Lattice,
}

impl<'a> Shown<'a> {
    pub fn new(soil: &'a dyn Subsystem) -> Self {
        Self::field(soil, "height")
    }
    pub fn field(soil: &'a dyn Subsystem, name: &str) -> Self {
        let field = soil.fields().iter().position(|f| f.name == name).unwrap();
        let lattice = Lattice::of_field(&soil.fields()[field]).unwrap();
        Self { soil, field, lattice }
    }
}

impl Surface for Shown<'_> {
    fn lattice(&self) -> &Lattice {
        &self.lattice
    }
    fn height(&self, i: i32, j: i32) -> f64 {
        let (i, j) = self.lattice.clamp(i, j);
        let (tile, k) = self.lattice.locate(i, j);
        let nx = self.lattice.tiles()[0];
        self.soil.field_tile(self.field, tile as u32 % nx, tile as u32 / nx).unwrap().values.at(k)
    }
}

/// A variable by name.
pub fn read(soil: &dyn Subsystem, name: &str) -> f64 {
    let id = soil.variables().iter().find(|v| v.name == name).unwrap_or_else(|| panic!("no {name}")).id;
    let mut out = [0.0];
    soil.get(&[id], ValuesMut::F64(&mut out)).unwrap();
    out[0]
}

/// A point mass without rotation, its foot on the soil.
pub struct Fixture {
    pub soil: Box<dyn Subsystem>,
    pub geometry: Geometry,
    pub mass: f64,
    pub gravity: f64,
    pub position: [f64; 3],
    pub velocity: [f64; 3],
    pub force: [f64; 3],
    pub h: f64,
    pub time: f64,
    pub index: u64,
    pub normal: [f64; 3],
    /// Quaternion of the foot, w x y z.
    pub orientation: [f64; 4],
    /// Whether the foot does not stand upright on the ground.
    pub turned: bool,
    pub nodes: Vec<Node>,
    pub ports: Vec<Port>,
    pub t: Vec<f64>,
    pub law_force: Vec<f64>,
    pub evaluations: u32,
}

impl Fixture {
    pub fn new(soil: Box<dyn Subsystem>, geometry: Geometry, mass: f64, height: f64) -> Self {
        Self {
            soil,
            geometry,
            mass,
            gravity: 9.81,
            position: [0.0, 0.0, height],
            velocity: [0.0; 3],
            force: [0.0; 3],
            h: 1e-3,
            time: 0.0,
            index: 0,
            normal: [0.0, 0.0, 1.0],
            orientation: [1.0, 0.0, 0.0, 0.0],
            turned: false,
            nodes: Vec::new(),
            ports: Vec::new(),
            t: vec![0.0; 6],
            law_force: vec![0.0; 6],
            evaluations: 0,
        }
    }

    /// Turns foot and contact frame about y onto ground that falls with x at `angle`, touching at the origin.
    pub fn tilt(&mut self, angle: f64) {
        self.normal = [angle.sin(), 0.0, angle.cos()];
        self.orientation = [(0.5 * angle).cos(), 0.0, (0.5 * angle).sin(), 0.0];
        let above = self.position[2];
        self.position = self.normal.map(|c| above * c);
    }

    /// Finds the patch at the present pose.
    pub fn detect(&mut self) {
        let pose = Pose { position: self.position, orientation: self.orientation };
        let placed = Placed::new(&self.geometry, &pose);
        self.nodes.clear();
        nodes_below(&placed, &Shown::new(&*self.soil), 0.02, &mut self.nodes);
        let (below, extent) = match self.geometry {
            Geometry::Sphere { radius } => (radius, [radius; 2]),
            Geometry::Box { half_extents: e } => (e[2], [e[0], e[1]]),
            Geometry::Cylinder { half_length, radius } => (half_length, [radius; 2]),
            Geometry::Capsule { half_length, radius } => (radius, [half_length + radius, radius]),
            _ => panic!("not used"),
        };
        let n = self.normal;
        let t1 = {
            let d = n[0];
            let v = [1.0 - d * n[0], -d * n[1], -d * n[2]];
            let l = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
            v.map(|c| c / l)
        };
        let t2 = [n[1] * t1[2] - n[2] * t1[1], n[2] * t1[0] - n[0] * t1[2], n[0] * t1[1] - n[1] * t1[0]];
        let p = self.position;
        self.ports = vec![Port {
            key: 7,
            kind: PortKind::Contact as u32,
            side: -1,
            mask: component::WRENCH,
            first: 0,
            body: 0,
            shape: 0,
            first_node: 0,
            node_count: self.nodes.len() as u32,
            origin: if self.turned {
                placed.patch_origin(n)
            } else {
                std::array::from_fn(|k| p[k] - below * n[k])
            },
            frame: [n[0], n[1], n[2], t1[0], t1[1], t1[2], t2[0], t2[1], t2[2]],
            extent,
            law: Law::UNILATERAL,
        }];
    }

    pub fn step_info<'a>(
        ports: &'a [Port],
        nodes: &'a [Node],
        time: f64,
        h: f64,
        index: u64,
        n: usize,
    ) -> Step<'a> {
        Step { t: time, h, index, trial: 0, n: n as u32, ports, nodes }
    }

    /// (x2, law force) of `set_ports`.
    pub fn set_ports(&mut self) -> (Vec<f64>, Vec<f64>) {
        self.detect();
        let n = self.ports[0].len();
        let (mut x, mut v, mut a, mut t) =
            (vec![f64::NAN; n], vec![f64::NAN; n], vec![f64::NAN; n], vec![f64::NAN; n]);
        let step = Self::step_info(&self.ports, &self.nodes, self.time, self.h, self.index, n);
        let mut laws = [self.ports[0].law];
        let mut now = Response { x: &mut x, v: &mut v, a: &mut a, t: &mut t, reached: 0.0, flags: 0 };
        self.soil.set_ports(&step, &mut laws, &mut now).unwrap();
        self.ports[0].law = laws[0];
        assert!(x.iter().chain(&v).chain(&a).chain(&t).all(|v| v.is_finite()));
        (x, t)
    }

    pub fn trial(&mut self, input: &Input) -> (Vec<f64>, Vec<f64>) {
        let n = self.ports[0].len();
        let (mut x, mut v, mut a, mut t) =
            (vec![f64::NAN; n], vec![f64::NAN; n], vec![f64::NAN; n], vec![f64::NAN; n]);
        let step = Self::step_info(&self.ports, &self.nodes, self.time, self.h, self.index, n);
        let mut out = Response { x: &mut x, v: &mut v, a: &mut a, t: &mut t, reached: 0.0, flags: 0 };
        self.soil.advance(&step, input, &mut out).unwrap();
        assert_eq!(out.reached, self.time + self.h);
        self.evaluations += 1;
        assert!(x.iter().chain(&v).chain(&a).chain(&t).all(|v| v.is_finite()));
        (x, t)
    }

    pub fn jacobian(&mut self) -> Vec<f64> {
        let n = self.ports[0].len();
        let mut out = vec![f64::NAN; n * n];
        let step = Self::step_info(&self.ports, &self.nodes, self.time, self.h, self.index, n);
        self.soil.interface_jacobian(&step, Level::Position, &mut out).unwrap();
        out
    }

    /// Wrench on the body and tangent forces at a motion.
    pub fn under_motion(&mut self, x: &[f64]) -> Vec<f64> {
        let v = vec![0.0; x.len()];
        self.trial(&Input::Motion(Motion { x, v: &v })).1
    }

    pub fn under_force(&mut self, t: &[f64], x: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let v = vec![0.0; x.len()];
        self.trial(&Input::Force { t, motion: Some(Motion { x, v: &v }) })
    }

    /// Displacement of the mass over the step without contact, world axes.
    fn free(&self) -> [f64; 3] {
        let g = [0.0, 0.0, -self.gravity];
        std::array::from_fn(|k| self.h * (self.velocity[k] + self.h * (g[k] + self.force[k] / self.mass)))
    }

    fn to_port(&self, v: [f64; 3]) -> [f64; 3] {
        let f = self.ports[0].frame;
        std::array::from_fn(|c| f[3 * c] * v[0] + f[3 * c + 1] * v[1] + f[3 * c + 2] * v[2])
    }

    fn to_world(&self, v: &[f64]) -> [f64; 3] {
        let f = self.ports[0].frame;
        std::array::from_fn(|k| f[k] * v[0] + f[3 + k] * v[1] + f[6 + k] * v[2])
    }

    /// One step of the plain co-operational pass.
    pub fn cooperative_step(&mut self) {
        let (x2, force) = self.set_ports();
        self.law_force = force;
        let n = self.ports[0].len();
        let x_free = self.to_port(self.free());
        let g = self.h * self.h / self.mass;
        let mut t_star = vec![0.0; n];
        t_star[0] = (-(x_free[0] - x2[0]) / g).max(0.0);
        let wanted = [-x_free[1] / g, -x_free[2] / g];
        let bound = self.ports[0].law.mu * t_star[0];
        let size = wanted[0].hypot(wanted[1]);
        let share = if size > bound { bound / size } else { 1.0 };
        (t_star[1], t_star[2]) = (share * wanted[0], share * wanted[1]);
        let mut free = vec![0.0; n];
        free[..3].copy_from_slice(&x_free);
        let mut matrix = vec![0.0; n * n];
        (0..3).for_each(|k| matrix[k * n + k] = g);
        let (mut x, mut v, mut a, mut t) =
            (vec![f64::NAN; n], vec![f64::NAN; n], vec![f64::NAN; n], vec![f64::NAN; n]);
        let step = Self::step_info(&self.ports, &self.nodes, self.time, self.h, self.index, n);
        let estimate = Estimate {
            t_star: &mut t_star,
            x_free: &mut free,
            g: &mut matrix,
            active: &mut [1],
            unique: true,
        };
        let mut out = Response { x: &mut x, v: &mut v, a: &mut a, t: &mut t, reached: 0.0, flags: 0 };
        self.soil.solve_compatibility(&step, &estimate, &mut out).unwrap();
        let t1 = t;
        assert!(t1.iter().all(|v| v.is_finite()));
        self.finish(&t1, x_free, g);
    }

    /// One implicit step: Newton on r(X) = X − X_free − G·T(X), with the soil's own tangent.
    pub fn iterative_step(&mut self) {
        let (_, force) = self.set_ports();
        self.law_force = force;
        let x_free = self.to_port(self.free());
        let g = self.h * self.h / self.mass;
        let n = self.ports[0].len();
        // start from the estimate: rest where the foot is pressed
        let mut x = vec![0.0; n];
        let mut t = vec![0.0; n];
        let (mut before, mut d) = (f64::INFINITY, [0.0; 3]);
        for round in 0..60 {
            t = self.under_motion(&x);
            let r: [f64; 3] = std::array::from_fn(|k| x[k] - x_free[k] - g * t[k]);
            let size = r.iter().fold(0.0_f64, |m, v| larger(m, v.abs()));
            if size < 1e-9 * g * self.mass * 9.81 {
                break;
            }
            if size >= before {
                // beyond a kink of the law: half the way
                d = d.map(|d| 0.5 * d);
                (0..3).for_each(|a| x[a] += d[a]);
                continue;
            }
            before = size;
            assert!(round < 59, "Newton does not converge: {r:?} {x:?} {t:?}");
            let k = self.jacobian();
            // I + G·K with K = −dT/dX
            let mut m: [[f64; 3]; 3] = std::array::from_fn(|a| std::array::from_fn(|b| g * k[b * n + a]));
            (0..3).for_each(|a| m[a][a] += 1.0);
            d = solve3(m, r);
            (0..3).for_each(|a| x[a] -= d[a]);
        }
        self.finish(&t, x_free, g);
    }

    fn finish(&mut self, t: &[f64], x_free: [f64; 3], g: f64) {
        let n = self.ports[0].len();
        let mut x = vec![0.0; n];
        (0..3).for_each(|k| x[k] = x_free[k] + g * t[k]);
        let moved = self.to_world(&x);
        let v: Vec<f64> = x.iter().map(|x| x / self.h).collect();
        let step = Self::step_info(&self.ports, &self.nodes, self.time, self.h, self.index, n);
        self.soil.commit(&step, t, &Motion { x: &x, v: &v }).unwrap();
        for k in 0..3 {
            self.velocity[k] = moved[k] / self.h;
            self.position[k] += moved[k];
        }
        self.t = t.to_vec();
        self.time += self.h;
        self.index += 1;
    }

    /// Moves the foot by `x` in the port frame, whatever the force; returns the wrench at the end.
    pub fn prescribed_step(&mut self, x: &[f64]) -> Vec<f64> {
        self.set_ports();
        let t = self.under_motion(x);
        let v: Vec<f64> = x.iter().map(|x| x / self.h).collect();
        let n = self.ports[0].len();
        let step = Self::step_info(&self.ports, &self.nodes, self.time, self.h, self.index, n);
        self.soil.commit(&step, &t, &Motion { x, v: &v }).unwrap();
        let moved = self.to_world(x);
        (0..3).for_each(|k| self.position[k] += moved[k]);
        self.time += self.h;
        self.index += 1;
        t
    }

    /// Largest depth of the lowest point below height 0, m.
    pub fn sunk(&self) -> f64 {
        let below = match self.geometry {
            Geometry::Sphere { radius } => radius,
            Geometry::Box { half_extents } => half_extents[2],
            Geometry::Cylinder { half_length, .. } => half_length,
            _ => panic!("not used"),
        };
        below - self.position[2]
    }
}

fn solve3(mut m: [[f64; 3]; 3], mut r: [f64; 3]) -> [f64; 3] {
    for c in 0..3 {
        let pivot = (c..3).max_by(|a, b| m[*a][c].abs().total_cmp(&m[*b][c].abs())).unwrap();
        m.swap(c, pivot);
        r.swap(c, pivot);
        for a in c + 1..3 {
            let f = m[a][c] / m[c][c];
            for b in c..3 {
                m[a][b] -= f * m[c][b];
            }
            r[a] -= f * r[c];
        }
    }
    for c in (0..3).rev() {
        for b in c + 1..3 {
            r[c] -= m[c][b] * r[b];
        }
        r[c] /= m[c][c];
    }
    r
}
