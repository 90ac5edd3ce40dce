//! Cost of a further trial of the same step of the hexapod: the gluing's re-solve with the factor that stands.

use crate::process::{Outcome, root};
use crate::timing::{cpu_s, median};
use crate::{Figure, Limit};
use std::sync::Arc;
use terraglue_rigid_body::RigidBody;
use terraglue_subsystem::{
    BodyState, Config, Geometry, Input, Law, Module, Port, Response, Standalone, Step, Subsystem, component,
};

/// Trials per measurement, and measurements.
const TRIALS: usize = 2_000;
const RUNS: usize = 9;
const H: f64 = 1e-3;

/// Six feet as ports at the lowest points of their spheres.
fn feet(robot: &dyn Subsystem) -> Outcome<Vec<Port>> {
    let scene = robot.scene();
    let mut states = vec![BodyState::REST; scene.bodies.len()];
    robot.body_states(&mut states).map_err(|e| e.to_string())?;
    let mut ports = Vec::new();
    for shape in scene.shapes.iter().filter(|s| s.collides) {
        let Geometry::Sphere { radius } = shape.geometry else { continue };
        let (place, q) = crate::rigid_body::fixture::pose(&states[shape.body as usize]);
        let centre = place + q * nalgebra::Vector3::from(shape.body_from_shape.position);
        ports.push(Port {
            key: u64::from(shape.id),
            kind: 0,
            side: 1,
            mask: component::FORCE,
            first: 3 * ports.len() as u32,
            body: shape.body,
            shape: shape.id,
            first_node: 0,
            node_count: 0,
            origin: [centre.x, centre.y, centre.z - radius],
            frame: [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0],
            extent: [0.0; 2],
            law: Law::UNILATERAL,
        });
    }
    Ok(ports)
}

/// CPU time of a trial after the first of its step, µs.
pub fn resolve() -> Outcome<Figure> {
    let parameters = r#"{"model": "models/hexapod.urdf", "position_m": [0, 0, 0.33],
        "joints": {"*_j2": 0.958192, "*_j3": -1.379634, "*_j4": -1.149354}}"#;
    let host = Standalone { gravity: [0.0, 0.0, -1.62], terrain: None, folder: root().display().to_string() };
    let config = Config::parse(parameters).map_err(|e| e.to_string())?;
    let mut robot = RigidBody::instantiate(&config, Arc::new(host)).map_err(|e| e.to_string())?;
    let ports = feet(&*robot)?;
    let n = 3 * ports.len();
    let step = Step { ports: &ports, n: n as u32, ..Step::free(0.0, H, 0) };
    // The weight on the Moon, a sixth on each foot.
    let mut t: Vec<f64> = (0..n).map(|i| if i % 3 == 0 { 25.02 * 1.62 / 6.0 } else { 0.0 }).collect();
    let mut out = [(); 4].map(|()| vec![0.0; n]);
    let mut trial = |t: &[f64]| -> Outcome {
        let [x, v, a, taken] = &mut out;
        let mut response = Response { x, v, a, t: taken, reached: f64::NAN, flags: 0 };
        let input = Input::Force { t, motion: None };
        robot.advance(&step, &input, &mut response).map_err(|e| e.to_string())
    };
    trial(&t)?;
    let mut times = Vec::new();
    for _ in 0..RUNS {
        let start = cpu_s();
        for k in 0..TRIALS {
            // Another force every time, as an iteration has it.
            t[0] += 1e-3 * ((k % 7) as f64 - 3.0);
            trial(&t)?;
        }
        times.push(1e6 * (cpu_s() - start) / TRIALS as f64);
    }
    let what = "hexapod on 18 force components: CPU time of a further trial of the step, median, µs";
    Ok(Figure::new("rigid-body.gait.six.resolve", median(times), Limit::AtMost(5.0), what).timed())
}
