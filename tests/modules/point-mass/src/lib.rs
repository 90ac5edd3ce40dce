//! A point mass with a spherical shape that knows only `advance`: the smallest body, for tests.
//!
//! It neither estimates contact forces nor gives derivatives, so the coordinator's own defaults are at work.
//! Semi-implicit Euler: v⁺ = v + h·(g + T/m), x⁺ = x + h·v⁺; hence G1 = h²/m per force component.

use std::sync::Arc;
use terraglue_subsystem::{
    BodyState, Capabilities, Causality, Config, Energy, Error, Geometry, Host, Input, Kind, Law, Material,
    Module, Motion, Parameter, ParameterType, Pose, Response, Result, Scene, SceneBody, SceneShape, Schema,
    Step, Subsystem, ValuesMut, Variable,
};

/// The module.
pub struct PointMass {
    mass: f64,
    radius: f64,
    gravity: [f64; 3],
    now: State,
    trial: State,
    saved: Vec<State>,
    variables: Vec<Variable>,
    port_work: f64,
}

#[derive(Clone, Copy)]
struct State {
    position: [f64; 3],
    velocity: [f64; 3],
}

impl Module for PointMass {
    fn schema() -> Schema {
        Schema {
            name: "point-mass".into(),
            kind: Kind::Robot,
            help: "A point mass with a spherical shape".into(),
            parameters: vec![
                Parameter::number("mass_kg", "kg", 5.0, "Mass").positive(),
                Parameter::number("radius_m", "m", 0.03, "Radius of the sphere").positive(),
                Parameter::of("position_m", ParameterType::Numbers, "Centre at the start").optional(),
                Parameter::of("velocity_m_s", ParameterType::Numbers, "Velocity at the start").optional(),
            ],
        }
    }

    fn instantiate(config: &Config, host: Arc<dyn Host>) -> Result<Box<dyn Subsystem>> {
        let vector = |name| {
            let v = config.numbers(name)?;
            Ok::<_, Error>(if v.len() == 3 { [v[0], v[1], v[2]] } else { [0.0; 3] })
        };
        let now = State { position: vector("position_m")?, velocity: vector("velocity_m_s")? };
        let output =
            |id, name, unit| Variable::real(id, name, unit, Causality::Output, "state of the centre");
        Ok(Box::new(Self {
            mass: config.number("mass_kg")?,
            radius: config.number("radius_m")?,
            gravity: host.gravity(),
            now,
            trial: now,
            saved: vec![now; host.slots() as usize],
            variables: vec![output(0, "mass.z", "m"), output(1, "mass.vz", "m/s")],
            port_work: 0.0,
        }))
    }
}

impl Subsystem for PointMass {
    fn capabilities(&self) -> Capabilities {
        Capabilities::FORCE | Capabilities::RETRY | Capabilities::STATE
    }

    fn set_ports(&mut self, step: &Step, _: &mut [Law], now: &mut Response) -> Result {
        for port in step.ports {
            for (i, c) in port.components() {
                now.x[i] = 0.0;
                now.v[i] = dot(port.direction(c), self.now.velocity);
                now.a[i] = 0.0;
                now.t[i] = 0.0;
            }
        }
        Ok(())
    }

    fn advance(&mut self, step: &Step, input: &Input, out: &mut Response) -> Result {
        let Input::Force { t, .. } = input else { return Err(Error::Unsupported) };
        let mut force = self.gravity.map(|g| g * self.mass);
        for port in step.ports {
            let (f, _) = port.wrench_in_world(t);
            (0..3).for_each(|k| force[k] += f[k]);
        }
        for k in 0..3 {
            self.trial.velocity[k] = self.now.velocity[k] + step.h * force[k] / self.mass;
            self.trial.position[k] = self.now.position[k] + step.h * self.trial.velocity[k];
        }
        for port in step.ports {
            for (i, c) in port.components() {
                out.v[i] = dot(port.direction(c), self.trial.velocity);
                out.x[i] = step.h * out.v[i];
                out.a[i] = dot(port.direction(c), force.map(|f| f / self.mass));
                out.t[i] = t[i];
            }
        }
        out.reached = step.t + step.h;
        Ok(())
    }

    fn commit(&mut self, step: &Step, t: &[f64], _: &Motion) -> Result {
        for port in step.ports {
            let (f, _) = port.wrench_in_world(t);
            self.port_work += dot(f, self.trial.velocity) * step.h;
        }
        self.now = self.trial;
        Ok(())
    }

    fn save_state(&mut self, slot: u32) -> Result {
        let room = self.saved.get_mut(slot as usize).ok_or(Error::Unsupported)?;
        *room = self.now;
        Ok(())
    }

    fn restore_state(&mut self, slot: u32) -> Result {
        self.now = *self.saved.get(slot as usize).ok_or(Error::Unsupported)?;
        Ok(())
    }

    fn variables(&self) -> &[Variable] {
        &self.variables
    }

    fn get(&self, ids: &[u32], out: ValuesMut) -> Result {
        let ValuesMut::F64(out) = out else { return Err(Error::Unsupported) };
        for (id, value) in ids.iter().zip(out) {
            *value = if *id == 0 { self.now.position[2] } else { self.now.velocity[2] };
        }
        Ok(())
    }

    fn scene(&self) -> Scene {
        Scene {
            bodies: vec![SceneBody { name: "mass".into(), mass: self.mass }],
            shapes: vec![SceneShape {
                id: 0,
                body: 0,
                name: "mass".into(),
                geometry: Geometry::Sphere { radius: self.radius },
                body_from_shape: Pose::IDENTITY,
                collides: true,
                material: Material::UNKNOWN,
            }],
            joints: Vec::new(),
        }
    }

    fn body_states(&self, out: &mut [BodyState]) -> Result {
        out[0] = BodyState {
            world_from_body: Pose { position: self.now.position, ..Pose::IDENTITY },
            linear_velocity: self.now.velocity,
            angular_velocity: [0.0; 3],
        };
        Ok(())
    }

    fn energy(&self) -> Energy {
        Energy {
            kinetic: 0.5 * self.mass * dot(self.now.velocity, self.now.velocity),
            potential: -self.mass * dot(self.gravity, self.now.position),
            port_work: self.port_work,
            ..Energy::default()
        }
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
