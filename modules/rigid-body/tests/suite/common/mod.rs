//! A robot driven through its interface: ports on a rigid plane, steps with the estimate as force.
#![allow(dead_code, missing_docs, clippy::unwrap_used)]

use std::sync::Arc;
use terraglue_rigid_body::RigidBody;
use terraglue_subsystem::{
    BodyState, Config, Estimate, Geometry, Input, Law, Module, Motion, Port, Response, Result, Scene,
    Standalone, Step, Subsystem, Values, ValuesMut, component,
};

pub const MOON: f64 = 1.62;
pub const STAND: &str =
    r#""joints": {"*_j2": 0.9581921787462744, "*_j3": -1.3796341802638374, "*_j4": -1.1493543252773333}"#;

/// Folder of the repository.
pub fn root() -> String {
    format!("{}/../..", env!("CARGO_MANIFEST_DIR"))
}

pub fn instantiate(parameters: &str, g: f64) -> Result<Box<dyn Subsystem>> {
    let host = Standalone { gravity: [0.0, 0.0, -g], terrain: None, folder: root() };
    RigidBody::instantiate(&Config::parse(parameters)?, Arc::new(host))
}

/// A robot with a clock.
pub struct Fixture {
    pub robot: Box<dyn Subsystem>,
    pub scene: Scene,
    pub t: f64,
    pub h: f64,
    pub index: u64,
    /// Reverse the order in which feet become ports.
    pub reversed: bool,
    pub margin: f64,
    pub mu: f64,
}

/// Answer of an estimate.
pub struct Estimated {
    pub t_star: Vec<f64>,
    pub x_free: Vec<f64>,
    pub g: Vec<f64>,
    pub active: Vec<u8>,
    pub unique: bool,
}

impl Fixture {
    pub fn new(parameters: &str, g: f64, h: f64) -> Self {
        let robot = instantiate(parameters, g).expect("a good robot");
        let scene = robot.scene();
        Self { robot, scene, t: 0.0, h, index: 0, reversed: false, margin: 1e-3, mu: 0.8 }
    }

    pub fn hexapod(z: f64, g: f64, h: f64) -> Self {
        Self::new(&format!(r#"{{"model": "models/hexapod.urdf", "position_m": [0, 0, {z}], {STAND}}}"#), g, h)
    }

    pub fn states(&self) -> Vec<BodyState> {
        let mut out = vec![BodyState::REST; self.scene.bodies.len()];
        self.robot.body_states(&mut out).expect("states");
        out
    }

    pub fn id(&self, name: &str) -> u32 {
        self.robot.variables().iter().find(|v| v.name == name).unwrap_or_else(|| panic!("no {name}")).id
    }

    pub fn get(&self, name: &str) -> f64 {
        let mut out = [f64::NAN];
        self.robot.get(&[self.id(name)], ValuesMut::F64(&mut out)).expect("a number");
        out[0]
    }

    pub fn set(&mut self, name: &str, value: f64) {
        let id = self.id(name);
        self.robot.set(&[id], Values::F64(&[value])).expect("accepted");
    }

    pub fn motor(&mut self, joint: &str, motor: i64) {
        let id = self.id(&format!("{joint}.motor"));
        self.robot.set(&[id], Values::Enumeration(&[motor])).expect("accepted");
    }

    pub fn joints(&self) -> Vec<String> {
        let names = self.robot.variables().iter().filter_map(|v| v.name.strip_suffix(".angle"));
        names.map(str::to_owned).collect()
    }

    /// Ports of all spheres that can touch the plane z = 0.
    pub fn ports(&self) -> Vec<Port> {
        let states = self.states();
        let mut ports = Vec::new();
        for shape in self.scene.shapes.iter().filter(|s| s.collides) {
            let Geometry::Sphere { radius } = shape.geometry else { continue };
            let pose = states[shape.body as usize].world_from_body;
            let q = nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(
                pose.orientation[0],
                pose.orientation[1],
                pose.orientation[2],
                pose.orientation[3],
            ));
            let centre = nalgebra::Vector3::from(pose.position)
                + q * nalgebra::Vector3::from(shape.body_from_shape.position);
            if centre.z - radius < self.margin {
                ports.push(Port {
                    key: u64::from(shape.id),
                    kind: 0,
                    side: 1,
                    mask: component::FORCE,
                    first: 0,
                    body: shape.body,
                    shape: shape.id,
                    first_node: 0,
                    node_count: 0,
                    origin: [centre.x, centre.y, centre.z - radius],
                    frame: [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0],
                    extent: [0.0; 2],
                    law: Law { mu: self.mu, ..Law::UNILATERAL },
                });
            }
        }
        if self.reversed {
            ports.reverse();
        }
        (0..ports.len()).for_each(|i| ports[i].first = 3 * i as u32);
        ports
    }

    pub fn step<'a>(&self, ports: &'a [Port]) -> Step<'a> {
        Step { ports, n: 3 * ports.len() as u32, ..Step::free(self.t, self.h, self.index) }
    }

    /// x2: the plane stands at z = 0, tangentially where the origin was.
    pub fn plane(ports: &[Port]) -> Vec<f64> {
        ports.iter().flat_map(|p| [-p.origin[2], 0.0, 0.0]).collect()
    }

    pub fn estimate(&mut self, ports: &[Port]) -> Result<Estimated> {
        let n = 3 * ports.len();
        let x2 = Self::plane(ports);
        let step = self.step(ports);
        let mut e = Estimated {
            t_star: vec![f64::NAN; n],
            x_free: vec![f64::NAN; n],
            g: vec![f64::NAN; n * n],
            active: vec![9; ports.len()],
            unique: false,
        };
        let mut out = Estimate {
            t_star: &mut e.t_star,
            x_free: &mut e.x_free,
            g: &mut e.g,
            active: &mut e.active,
            unique: false,
        };
        self.robot.estimate_forces(&step, &Motion { x: &x2, v: &vec![0.0; n] }, &mut out)?;
        e.unique = out.unique;
        Ok(e)
    }

    /// A trial under the wrenches t: displacement at the ports.
    pub fn advance(&mut self, ports: &[Port], t: &[f64]) -> Result<Vec<f64>> {
        let n = 3 * ports.len();
        let (mut x, mut v, mut a, mut t_out) =
            (vec![f64::NAN; n], vec![f64::NAN; n], vec![f64::NAN; n], vec![f64::NAN; n]);
        let step = self.step(ports);
        let mut out =
            Response { x: &mut x, v: &mut v, a: &mut a, t: &mut t_out, reached: f64::NAN, flags: 0 };
        self.robot.advance(&step, &Input::Force { t, motion: None }, &mut out)?;
        assert!(out.reached == step.t + step.h);
        assert!(x.iter().chain(&v).chain(&a).chain(&t_out).all(|x| x.is_finite()));
        Ok(x)
    }

    pub fn commit(&mut self, ports: &[Port], t: &[f64]) -> Result {
        let x2 = Self::plane(ports);
        let step = self.step(ports);
        self.robot.commit(&step, t, &Motion { x: &x2, v: &vec![0.0; x2.len()] })?;
        self.t += self.h;
        self.index += 1;
        Ok(())
    }

    /// External force on a body during the next step, then none.
    pub fn push(&mut self, body: &str, force: [f64; 3]) {
        for (axis, f) in ["x", "y", "z"].iter().zip(force) {
            self.set(&format!("{body}.force_{axis}"), f);
        }
    }

    /// A step without ground.
    pub fn free_step(&mut self) {
        self.advance(&[], &[]).expect("a step");
        self.commit(&[], &[]).expect("a commit");
    }

    /// A step on the rigid plane; returns T*.
    pub fn ground_step(&mut self) -> Vec<f64> {
        let ports = self.ports();
        let e = self.estimate(&ports).expect("an estimate");
        self.advance(&ports, &e.t_star).expect("a step");
        self.commit(&ports, &e.t_star).expect("a commit");
        e.t_star
    }

    pub fn mass(&self) -> f64 {
        self.scene.bodies.iter().map(|b| b.mass).sum()
    }

    /// Kinetic plus potential energy and heat less all work put in: constant but for errors of the scheme.
    pub fn balance(&self) -> f64 {
        let e = self.robot.energy();
        e.mechanical() + e.dissipated - e.port_work - e.actuator_work
    }
}

/// Writes a robot file for one test and gives the path relative to the repository.
pub fn temporary_urdf(name: &str, text: &str) -> String {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR"));
    let path = folder.join(format!("{name}.urdf"));
    std::fs::write(&path, text).expect("a temporary file");
    path.display().to_string()
}

/// A ball of 5 kg, radius 3 cm.
pub fn ball(name: &str) -> String {
    temporary_urdf(
        name,
        r#"<robot name="ball"><link name="ball">
        <inertial><mass value="5"/><inertia ixx="0.0018" iyy="0.0018" izz="0.0018" ixy="0" ixz="0" iyz="0"/></inertial>
        <visual><geometry><sphere radius="0.03"/></geometry></visual>
        <collision><geometry><sphere radius="0.03"/></geometry></collision>
        </link></robot>"#,
    )
}
