//! A robot under forces: free steps, and steps with a contact port at the lowest point of one of its shapes.

use super::Vectors;
use crate::finding::{Stop, Verdict};
use terraglue_ground::{Placed, compose};
use terraglue_host::Instance;
use terraglue_subsystem::{
    BodyState, Estimate, Input, Law, Level, Motion, Port, PortKind, SceneShape, Step, component,
};

/// The bench.
pub struct BodyBench {
    /// The robot.
    pub robot: Instance,
    /// Time, s.
    pub t: f64,
    /// Accepted steps.
    pub index: u64,
    /// Answer of the last trial.
    pub out: Vectors,
    /// Ports of the next step.
    pub ports: Vec<Port>,
    /// Ports of the last step.
    pub ports_before: Vec<Port>,
}

/// A rigid estimate at one port.
#[derive(Clone, Debug, Default)]
pub struct Held {
    /// T*.
    pub t_star: Vec<f64>,
    /// Motion without a wrench.
    pub x_free: Vec<f64>,
    /// Whether each port is active.
    pub active: Vec<u8>,
}

impl BodyBench {
    /// Around a robot.
    pub fn new(robot: Instance) -> Self {
        Self { robot, t: 0.0, index: 0, out: Vectors::default(), ports: Vec::new(), ports_before: Vec::new() }
    }

    /// Committed states of its bodies.
    ///
    /// # Errors
    /// It failed.
    pub fn states(&self) -> Verdict<Vec<BodyState>> {
        let mut states = vec![BodyState::REST; self.robot.scene().bodies.len()];
        self.robot.body_states(&mut states)?;
        Ok(states)
    }

    /// Total momentum (N s) of the frames' origins, by the masses in the scene.
    ///
    /// # Errors
    /// It failed.
    pub fn momentum(&self) -> Verdict<[f64; 3]> {
        let states = self.states()?;
        let mut sum = [0.0; 3];
        for (body, state) in self.robot.scene().bodies.iter().zip(&states) {
            (0..3).for_each(|k| sum[k] += body.mass * state.linear_velocity[k]);
        }
        Ok(sum)
    }

    /// Puts a contact port of three forces at the lowest point of its first shape that can be hit.
    ///
    /// # Errors
    /// It has no such shape: a skip.
    pub fn place_port(&mut self) -> Verdict {
        let states = self.states()?;
        let shape = self.robot.scene().shapes.iter().find(|s| s.collides).cloned();
        let Some(shape) = shape else {
            return Err(Stop::Skip("it has no shape that can be hit: it cannot stand on ground".into()));
        };
        self.ports = vec![port_below(&shape, &states[shape.body as usize])];
        Ok(())
    }

    /// A trial under the packed wrench.
    ///
    /// # Errors
    /// It failed.
    pub fn try_force(&mut self, t: &[f64], h: f64) -> Verdict {
        let n = self.ports.iter().map(Port::len).sum();
        let mut laws = vec![Law::UNILATERAL; self.ports.len()];
        let (mut now, mut out) = (Vectors::new(n), Vectors::new(n));
        let ports = std::mem::take(&mut self.ports);
        let step = step_of(&ports, self.t, h, self.index);
        let asked = self.robot.set_ports(&step, &mut laws, &mut now.response());
        let input = Input::Force { t, motion: None };
        let done = asked.and_then(|()| self.robot.advance(&step, &input, &mut out.response()));
        (self.ports, self.out) = (ports, out);
        done?;
        Ok(())
    }

    /// The rigid estimate against ground that stands at `partner` (packed X) at the end of the step.
    ///
    /// # Errors
    /// It failed.
    pub fn estimate(&mut self, partner: &[f64], h: f64) -> Verdict<Held> {
        let n = partner.len();
        let mut held = Held { t_star: vec![0.0; n], x_free: vec![0.0; n], active: vec![0; self.ports.len()] };
        let (mut g, still) = (vec![0.0; n * n], vec![0.0; n]);
        let mut laws = vec![Law { mu: 0.5, ..Law::UNILATERAL }; self.ports.len()];
        let ports = std::mem::take(&mut self.ports);
        let step = step_of(&ports, self.t, h, self.index);
        let mut now = Vectors::new(n);
        let asked = self.robot.set_ports(&step, &mut laws, &mut now.response());
        let mut out = Estimate {
            t_star: &mut held.t_star,
            x_free: &mut held.x_free,
            g: &mut g,
            active: &mut held.active,
            unique: false,
        };
        let motion = Motion { x: partner, v: &still };
        let done = asked.and_then(|()| self.robot.estimate_forces(&step, &motion, &mut out));
        self.ports = ports;
        done?;
        Ok(held)
    }

    /// The derivative after a trial, column-major.
    ///
    /// # Errors
    /// It failed.
    pub fn jacobian(&mut self, h: f64) -> Verdict<Vec<f64>> {
        let n: usize = self.ports.iter().map(Port::len).sum();
        let mut g = vec![0.0; n * n];
        let ports = std::mem::take(&mut self.ports);
        let step = step_of(&ports, self.t, h, self.index);
        let done = self.robot.interface_jacobian(&step, Level::Position, &mut g);
        self.ports = ports;
        done?;
        Ok(g)
    }

    /// Accepts the last trial under the wrench.
    ///
    /// # Errors
    /// It failed.
    pub fn commit(&mut self, t: &[f64], h: f64) -> Verdict {
        let ports = std::mem::take(&mut self.ports);
        let n: usize = ports.iter().map(Port::len).sum();
        let step = step_of(&ports, self.t, h, self.index);
        let still = vec![0.0; n];
        let done = self.robot.commit(&step, t, &Motion { x: &still, v: &still });
        self.ports_before = ports;
        done?;
        self.t += h;
        self.index += 1;
        Ok(())
    }

    /// A whole step without ports.
    ///
    /// # Errors
    /// It failed.
    pub fn fall(&mut self, h: f64) -> Verdict {
        self.ports.clear();
        self.try_force(&[], h)?;
        self.commit(&[], h)
    }
}

fn step_of(ports: &[Port], t: f64, h: f64, index: u64) -> Step<'_> {
    let n = ports.iter().map(|p| p.len() as u32).sum();
    Step { n, ports, ..Step::free(t, h, index) }
}

fn port_below(shape: &SceneShape, state: &BodyState) -> Port {
    let placed = Placed::new(&shape.geometry, &compose(&state.world_from_body, &shape.body_from_shape));
    Port {
        key: 7,
        kind: PortKind::Contact as u32,
        side: 1,
        mask: component::FORCE,
        first: 0,
        body: shape.body,
        shape: shape.id,
        first_node: 0,
        node_count: 0,
        origin: placed.patch_origin([0.0, 0.0, 1.0]),
        frame: [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0],
        extent: [0.0; 2],
        law: Law::UNILATERAL,
    }
}
