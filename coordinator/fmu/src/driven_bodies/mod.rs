//! The module `feet`: shapes that follow given poses and report the forces on them.
//!
//! It replaces a robot that is simulated elsewhere: in an exported soil the poses come from another program, in a scenario
//! from a connection. No force moves it, so G = dX/dT = 0, and the force of a soil's law at its motion is the answer.

mod motion;
mod settings;
mod values;

use motion::DrivenBody;
pub(crate) use settings::{DrivenBodiesSettings, schema};
use std::sync::Arc;
use terraglue_subsystem::{
    BodyState, Capabilities, Config, Energy, Error, Estimate, Host, Input, Level, Module, Motion, Response,
    Result, Scene, SceneBody, SceneShape, Schema, Step, Subsystem, Values, ValuesMut, Variable,
};

pub(super) use values::id;

/// Name in a scenario.
pub const NAME: &str = "feet";

/// Normal force that a rigid ground would need against a motion that nothing stops, N: larger than that of any soil.
const UNSTOPPABLE_N: f64 = 1e12;

/// The module.
#[derive(Debug)]
pub struct DrivenBodiesModule;

impl Module for DrivenBodiesModule {
    fn schema() -> Schema {
        settings::schema()
    }

    fn instantiate(config: &Config, host: Arc<dyn Host>) -> Result<Box<dyn Subsystem>> {
        let settings = DrivenBodiesSettings::read(config)?;
        let state = State {
            feet: settings.positions.iter().map(|p| DrivenBody::at(*p)).collect(),
            duration_s: settings.duration_s,
            jump: false,
            work_j: 0.0,
        };
        Ok(Box::new(DrivenBodies {
            variables: values::variables(settings.positions.len() as u32),
            saved: vec![None; host.slots() as usize],
            settings,
            state,
        }))
    }
}

/// State of the module.
#[derive(Clone, Debug)]
pub(super) struct State {
    pub feet: Vec<DrivenBody>,
    /// Time over which a new pose is reached, s.
    pub duration_s: f64,
    /// A new pose holds at once.
    pub jump: bool,
    /// Work that the ground has done on the feet since the start, J; what drives them takes it.
    pub work_j: f64,
}

/// An instance.
struct DrivenBodies {
    settings: DrivenBodiesSettings,
    variables: Vec<Variable>,
    state: State,
    saved: Vec<Option<State>>,
}

impl DrivenBodies {
    /// Packed motion of all ports over the step.
    fn move_ports(&self, step: &Step, x: &mut [f64], v: Option<&mut [f64]>) {
        let mut v = v;
        for port in step.ports {
            let foot = &self.state.feet[port.body as usize];
            let moved = foot.displacement(step.h, port.origin);
            let rate = foot.velocity(port.origin);
            for (i, c) in port.components() {
                let d = port.direction(c);
                let along = |of: &[[f64; 3]; 2]| (0..3).map(|k| d[k] * of[c / 3][k]).sum::<f64>();
                x[i] = along(&moved);
                if let Some(v) = v.as_deref_mut() {
                    v[i] = along(&rate);
                }
            }
        }
    }
}

impl Subsystem for DrivenBodies {
    fn capabilities(&self) -> Capabilities {
        use Capabilities as C;
        C::FORCE | C::ESTIMATE | C::DERIVATIVES | C::RETRY | C::STATE | C::SERIALIZE
    }

    fn estimate_forces(&mut self, step: &Step, partner: &Motion, out: &mut Estimate) -> Result {
        self.move_ports(step, out.x_free, None);
        out.g.fill(0.0);
        out.t_star.fill(0.0);
        // nothing but the soil's law bounds the force on a foot that follows, or keeps, a given pose
        out.active.fill(1);
        for port in step.ports {
            for (i, c) in port.components() {
                let against = partner.x[i] - out.x_free[i];
                out.t_star[i] = if c == 0 { UNSTOPPABLE_N } else { UNSTOPPABLE_N * sign(against) };
            }
        }
        out.unique = true;
        Ok(())
    }

    fn advance(&mut self, step: &Step, input: &Input, out: &mut Response) -> Result {
        let Input::Force { t, .. } = input else { return Err(Error::Unsupported) };
        self.move_ports(step, out.x, Some(out.v));
        out.a.fill(0.0);
        out.t.copy_from_slice(t);
        out.reached = step.t + step.h;
        Ok(())
    }

    fn interface_jacobian(&mut self, _: &Step, _: Level, out: &mut [f64]) -> Result {
        out.fill(0.0);
        Ok(())
    }

    fn commit(&mut self, step: &Step, t: &[f64], _: &Motion) -> Result {
        for foot in &mut self.state.feet {
            (foot.force, foot.moment) = ([0.0; 3], [0.0; 3]);
        }
        for port in step.ports {
            let foot = &mut self.state.feet[port.body as usize];
            let (force, moment) = port.wrench_in_world(t);
            let moved = foot.displacement(step.h, port.origin);
            let work = |a: [f64; 3], b: [f64; 3]| (0..3).map(|k| a[k] * b[k]).sum::<f64>();
            self.state.work_j += work(force, moved[0]) + work(moment, moved[1]);
            let origin = std::array::from_fn(|k| port.origin[k] + moved[0][k]);
            foot.load(step.h, origin, force, moment);
        }
        self.state.feet.iter_mut().for_each(|foot| foot.go(step.h));
        Ok(())
    }

    fn save_state(&mut self, slot: u32) -> Result {
        *self.saved.get_mut(slot as usize).ok_or(Error::Unsupported)? = Some(self.state.clone());
        Ok(())
    }

    fn restore_state(&mut self, slot: u32) -> Result {
        let saved = self.saved.get(slot as usize).and_then(Option::as_ref);
        self.state =
            saved.ok_or_else(|| Error::Refused(format!("no state was saved in slot {slot}")))?.clone();
        Ok(())
    }

    fn serialize(&self) -> Result<Vec<u8>> {
        Ok(self.state.to_bytes())
    }

    fn deserialize(&mut self, bytes: &[u8]) -> Result {
        let state = State::from_bytes(bytes, self.state.feet.len());
        self.state = state.ok_or_else(|| Error::Refused("these bytes are no state of these feet".into()))?;
        Ok(())
    }

    fn variables(&self) -> &[Variable] {
        &self.variables
    }

    fn get(&self, ids: &[u32], out: ValuesMut) -> Result {
        values::get(&self.state, ids, out)
    }

    fn set(&mut self, ids: &[u32], new: Values) -> Result {
        values::set(&mut self.state, ids, new)
    }

    /// They weigh nothing: what the ground does on them, what drives them takes.
    fn energy(&self) -> Energy {
        Energy { port_work: self.state.work_j, actuator_work: -self.state.work_j, ..Energy::default() }
    }

    fn scene(&self) -> Scene {
        let name = |k: usize| format!("foot{}", k + 1);
        let count = self.settings.positions.len();
        let shape = |k: usize| SceneShape {
            id: k as u32,
            body: k as u32,
            name: name(k),
            geometry: self.settings.shape.clone(),
            body_from_shape: terraglue_subsystem::Pose::IDENTITY,
            collides: true,
            material: terraglue_subsystem::Material::UNKNOWN,
        };
        Scene {
            bodies: (0..count).map(|k| SceneBody { name: name(k), mass: 0.0 }).collect(),
            shapes: (0..count).map(shape).collect(),
            joints: Vec::new(),
        }
    }

    fn body_states(&self, out: &mut [BodyState]) -> Result {
        out.iter_mut().zip(&self.state.feet).for_each(|(out, foot)| *out = foot.body_state());
        Ok(())
    }
}

fn sign(x: f64) -> f64 {
    if x == 0.0 { 0.0 } else { x.signum() }
}
