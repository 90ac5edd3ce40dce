//! A robot stepped through its interface without a coordinator.

use crate::process::{Outcome, root};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use std::sync::Arc;
use terraglue_rigid_body::RigidBody;
use terraglue_subsystem::{
    BodyState, Config, Energy, Input, Module, Motion, Response, Standalone, Step, Subsystem, Values,
    ValuesMut,
};

/// Gravity of the Earth in the reference cases, m/s².
pub const G: f64 = 9.81;

/// A robot with a clock.
pub struct Fixture {
    robot: Box<dyn Subsystem>,
    bodies: usize,
    index: u64,
    h: f64,
}

impl Fixture {
    /// From parameters in JSON, gravity in the world (m/s²) and the step (s).
    pub fn new(parameters: &str, gravity: [f64; 3], h: f64) -> Outcome<Self> {
        let host = Standalone { gravity, terrain: None, folder: root().display().to_string() };
        let config = Config::parse(parameters).map_err(|e| e.to_string())?;
        let robot = RigidBody::instantiate(&config, Arc::new(host)).map_err(|e| e.to_string())?;
        Ok(Self { bodies: robot.scene().bodies.len(), robot, index: 0, h })
    }

    /// Committed time, s.
    pub fn t(&self) -> f64 {
        self.index as f64 * self.h
    }

    /// One step without ports.
    pub fn step(&mut self) -> Outcome {
        let step = Step::free(self.t(), self.h, self.index);
        let mut out =
            Response { x: &mut [], v: &mut [], a: &mut [], t: &mut [], reached: f64::NAN, flags: 0 };
        let input = Input::Force { t: &[], motion: None };
        let failed = |e: terraglue_subsystem::Error| format!("t = {} s: {e}", step.t);
        self.robot.advance(&step, &input, &mut out).map_err(failed)?;
        self.robot.commit(&step, &[], &Motion { x: &[], v: &[] }).map_err(failed)?;
        self.index += 1;
        Ok(())
    }

    /// Steps until a time, s; `each` sees every committed state.
    pub fn run(&mut self, until: f64, mut each: impl FnMut(&mut Self) -> Outcome) -> Outcome {
        while self.index < (until / self.h).round() as u64 {
            self.step()?;
            each(self)?;
        }
        Ok(())
    }

    /// Motion of all bodies.
    pub fn states(&self) -> Outcome<Vec<BodyState>> {
        let mut out = vec![BodyState::REST; self.bodies];
        self.robot.body_states(&mut out).map_err(|e| e.to_string())?;
        Ok(out)
    }

    /// Energies.
    pub fn energy(&self) -> Energy {
        self.robot.energy()
    }

    /// Number of a variable.
    pub fn id(&self, name: &str) -> Outcome<u32> {
        let found = self.robot.variables().iter().find(|v| v.name == name);
        found.map(|v| v.id).ok_or_else(|| format!("there is no variable {name}"))
    }

    /// A number.
    pub fn get(&self, id: u32) -> Outcome<f64> {
        let mut out = [f64::NAN];
        self.robot.get(&[id], ValuesMut::F64(&mut out)).map_err(|e| e.to_string())?;
        Ok(out[0])
    }

    /// Sets numbers.
    pub fn set(&mut self, ids: &[u32], values: &[f64]) -> Outcome {
        self.robot.set(ids, Values::F64(values)).map_err(|e| e.to_string())
    }

    /// Does an action.
    pub fn act(&mut self, action: &str) -> Outcome {
        self.robot.act(action, "{}").map_err(|e| e.to_string())
    }
}

/// Origin and orientation of a body's frame.
pub fn pose(state: &BodyState) -> (Vector3<f64>, UnitQuaternion<f64>) {
    let [w, x, y, z] = state.world_from_body.orientation;
    let q = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
    (Vector3::from(state.world_from_body.position), q)
}

/// Rows of numbers of a table with one header line.
pub fn table(file: &str) -> Outcome<Vec<Vec<f64>>> {
    let text = crate::process::read(&root().join("tests/reference/multibody").join(file))?;
    let row = |line: &str| line.split(',').map(|x| x.trim().parse::<f64>()).collect::<Result<Vec<_>, _>>();
    text.lines().skip(1).map(|l| row(l).map_err(|e| format!("{file}: `{l}`: {e}"))).collect()
}

/// Writes a model for one case and gives its path.
pub fn model(folder: &std::path::Path, name: &str, text: &str) -> Outcome<String> {
    std::fs::create_dir_all(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let path = folder.join(name);
    crate::process::write(&path, text)?;
    Ok(path.display().to_string())
}

/// A robot file in the making.
pub struct Urdf {
    text: String,
}

impl Urdf {
    /// Everything hangs on the world.
    pub fn in_world() -> Self {
        Self { text: r#"<robot name="mechanism"><link name="world"/>"#.into() }
    }

    /// A body: mass, centre of mass, principal moments about it in the axes of its frame.
    pub fn body(mut self, name: &str, mass: f64, com: [f64; 3], moments: [f64; 3]) -> Self {
        let ([x, y, z], [ix, iy, iz]) = (com, moments);
        self.text += &format!(
            r#"<link name="{name}"><inertial><origin xyz="{x} {y} {z}"/><mass value="{mass}"/>
            <inertia ixx="{ix}" iyy="{iy}" izz="{iz}" ixy="0" ixz="0" iyz="0"/></inertial></link>"#
        );
        self
    }

    /// A joint called `j_CHILD`: kind, its place in the parent's frame, its axis.
    pub fn joint(mut self, kind: &str, [parent, child]: [&str; 2], at: [f64; 3], axis: [f64; 3]) -> Self {
        let ([x, y, z], [ax, ay, az]) = (at, axis);
        let limit = if kind == "prismatic" {
            r#"<limit lower="-1e9" upper="1e9" effort="0" velocity="0"/>"#
        } else {
            ""
        };
        self.text += &format!(
            r#"<joint name="j_{child}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>
            <origin xyz="{x} {y} {z}"/><axis xyz="{ax} {ay} {az}"/>{limit}</joint>"#
        );
        self
    }

    /// Writes it; its path.
    pub fn write(self, folder: &std::path::Path, name: &str) -> Outcome<String> {
        model(folder, name, &(self.text + "</robot>"))
    }
}
