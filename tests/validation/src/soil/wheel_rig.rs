//! A single-wheel test bench: a rigid wheel with prescribed slip, free to sink under its load, on level soil.

use super::fixture::Shown;
use std::borrow::BorrowMut;
use terraglue_ground::{Placed, nodes_below};
use terraglue_subsystem::{
    Geometry, Input, Law, Motion, Node, Port, PortKind, Pose, Response, Step, Subsystem, component,
};

/// Way of the rim per step, m.
const STRIDE: f64 = 5e-4;
/// Gap up to which ground below the rim counts, m.
const MARGIN: f64 = 5e-3;

/// The bench.
pub struct Bench<S = Box<dyn Subsystem>> {
    /// The soil.
    pub soil: S,
    radius: f64,
    width: f64,
    load: f64,
    /// Position of the axle, x and z, m.
    pub axle: [f64; 2],
    index: u64,
    nodes: Vec<Node>,
}

/// Readings of the bench, means over a way.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reading {
    /// Depth of the lowest point below the undisturbed level, m.
    pub sinkage: f64,
    /// Drawbar pull, N.
    pub pull: f64,
    /// Torque at the axle, N m.
    pub torque: f64,
}

impl<S: BorrowMut<dyn Subsystem>> Bench<S> {
    /// A wheel of `[radius, width]` (m) under `load` (N), touching the soil at x = `start` (m).
    pub fn new(soil: S, [radius, width]: [f64; 2], load: f64, start: f64) -> Self {
        Self { soil, radius, width, load, axle: [start, radius], index: 0, nodes: Vec::new() }
    }

    /// Drives at the slip `slip` < 1 over `way` (m) and gives the means over its last `measured` (m).
    pub fn drive(&mut self, slip: f64, way: f64, measured: f64) -> Reading {
        let ahead = STRIDE * (1.0 - slip).min(1.0);
        let steps = (way / ahead).round() as u64;
        let first = steps - (measured / ahead).round() as u64;
        let mut sum = Reading::default();
        for k in 0..steps {
            let now = self.step(ahead, ahead / (1.0 - slip));
            if k >= first {
                sum.sinkage += now.sinkage;
                sum.pull += now.pull;
                sum.torque += now.torque;
            }
        }
        let count = (steps - first) as f64;
        Reading { sinkage: sum.sinkage / count, pull: sum.pull / count, torque: sum.torque / count }
    }

    /// One step: the axle goes by `ahead`, the rim turns by `rim` (m); the wheel sinks under its load.
    fn step(&mut self, ahead: f64, rim: f64) -> Reading {
        let port = self.port();
        let (ports, nodes) = ([port], std::mem::take(&mut self.nodes));
        let h = 1e-3;
        let step = Step {
            t: h * self.index as f64,
            h,
            index: self.index,
            trial: 0,
            n: 6,
            ports: &ports,
            nodes: &nodes,
        };
        let mut answer = Answer::default();
        let mut laws = [port.law];
        self.soil.borrow_mut().set_ports(&step, &mut laws, &mut answer.response()).expect("ports are taken");
        let mut x = [0.0, ahead - rim, 0.0, 0.0, 0.0, rim / self.radius];
        let t = [self.load, 0.0, 0.0, 0.0, 0.0, 0.0];
        let motion = Some(Motion { x: &x, v: &[0.0; 6] });
        self.soil
            .borrow_mut()
            .advance(&step, &Input::Force { t: &t, motion }, &mut answer.response())
            .expect("the soil carries the load");
        x[0] = answer.x[0];
        let wrench = answer.t;
        let v = x.map(|x| x / h);
        self.soil.borrow_mut().commit(&step, &wrench, &Motion { x: &x, v: &v }).expect("the motion is taken");
        self.nodes = nodes;
        self.axle = [self.axle[0] + ahead, self.axle[1] + x[0]];
        self.index += 1;
        let torque = self.radius * wrench[1] - wrench[5];
        Reading { sinkage: self.radius - self.axle[1], pull: wrench[1], torque }
    }

    fn port(&mut self) -> Port {
        let lying = [std::f64::consts::FRAC_1_SQRT_2, std::f64::consts::FRAC_1_SQRT_2, 0.0, 0.0];
        // off the symmetry of the lattice across the travel
        let position = [self.axle[0], 0.0013, self.axle[1]];
        let geometry = Geometry::Cylinder { half_length: 0.5 * self.width, radius: self.radius };
        let placed = Placed::new(&geometry, &Pose { position, orientation: lying });
        self.nodes.clear();
        nodes_below(&placed, &Shown::new(self.soil.borrow()), MARGIN, &mut self.nodes);
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
            origin: [position[0], position[1], position[2] - self.radius],
            frame: [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0],
            extent: [self.radius, 0.5 * self.width],
            law: Law::UNILATERAL,
        }
    }
}

#[derive(Default)]
struct Answer {
    x: [f64; 6],
    v: [f64; 6],
    a: [f64; 6],
    t: [f64; 6],
}

impl Answer {
    fn response(&mut self) -> Response<'_> {
        Response { x: &mut self.x, v: &mut self.v, a: &mut self.a, t: &mut self.t, reached: 0.0, flags: 0 }
    }
}
