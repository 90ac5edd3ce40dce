//! `/joints/<subsystem>`: coordinates, rates and torques of all joints by name, as viewers plot them, and the tree of the robot.

use crate::layout::timestamp;
use crate::scene_message::frame_id;
use crate::selection::Precision;
use crate::snapshot::failed;
use crate::topics::{self, Topic};
use foxglove::messages::{JointState, JointStates};
use terraglue_diagnostics::error::Result;
use terraglue_engine::observer::{SubsystemView, View};
use terraglue_subsystem::{JointVariables, SceneJoint, ValuesMut};

/// The joints of one subsystem on their way into the file.
pub(crate) struct Joints {
    subsystem: usize,
    pub message: JointStates,
    /// Position, velocity and torque: places among the joints and ids.
    places: [Vec<usize>; 3],
    ids: [Vec<u32>; 3],
    values: Vec<f64>,
}

impl Joints {
    /// Of all subsystems that have joints with a position.
    pub fn find(view: &View) -> Vec<Self> {
        (0..view.subsystems.len()).filter_map(|k| Self::of(&view.subsystems[k], k)).collect()
    }

    fn of(s: &SubsystemView, subsystem: usize) -> Option<Self> {
        let moving = |j: &&SceneJoint| j.variables.position != JointVariables::NONE;
        let all: Vec<&SceneJoint> = s.scene.joints.iter().filter(moving).collect();
        if all.is_empty() {
            return None;
        }
        let of = |id: fn(&JointVariables) -> u32| -> (Vec<usize>, Vec<u32>) {
            let ids = all.iter().enumerate().map(|(k, j)| (k, id(&j.variables)));
            ids.filter(|(_, id)| *id != JointVariables::NONE).unzip()
        };
        let [a, b, c] = [of(|v| v.position), of(|v| v.velocity), of(|v| v.torque)];
        let named = |j: &&SceneJoint| JointState { name: j.name.clone(), ..JointState::default() };
        let message = JointStates { timestamp: None, joints: all.iter().map(named).collect() };
        Some(Self { subsystem, message, places: [a.0, b.0, c.0], ids: [a.1, b.1, c.1], values: Vec::new() })
    }

    /// The topic; its metadata hold the tree as JSON.
    pub fn topic(&self, view: &View) -> Topic {
        let s = &view.subsystems[self.subsystem];
        let frame = |body: u32| match s.scene.bodies.get(body as usize) {
            Some(body) => frame_id(s.name, &body.name),
            None => "world".to_owned(),
        };
        let joint = |j: &SceneJoint| {
            let pose = &j.parent_from_joint;
            serde_json::json!({
                "name": j.name, "kind": format!("{:?}", j.kind).to_lowercase(), "parent": frame(j.parent),
                "child": frame(j.child), "position_m": pose.position, "orientation_wxyz": pose.orientation,
                "axis": j.axis, "limits": j.limits.map(|x| x.is_finite().then_some(x)),
            })
        };
        let tree: Vec<_> = s.scene.joints.iter().map(joint).collect();
        let topic = topics::of::<JointStates>(&format!("/joints/{}", s.name));
        topic.with("joints", serde_json::Value::from(tree).to_string())
    }

    /// Takes the committed values.
    pub fn read(&mut self, view: &View, precision: Precision) -> Result {
        let s = &view.subsystems[self.subsystem];
        self.message.timestamp = Some(timestamp(view.t_s));
        for (kind, (places, ids)) in self.places.iter().zip(&self.ids).enumerate() {
            self.values.clear();
            self.values.resize(ids.len(), f64::NAN);
            let read = s.instance.get(ids, ValuesMut::F64(&mut self.values));
            read.map_err(|e| failed(s, view.t_s, "get", e.to_string()))?;
            for (place, value) in places.iter().zip(&self.values) {
                let joint = &mut self.message.joints[*place];
                let to = [&mut joint.position, &mut joint.velocity, &mut joint.effort];
                to.into_iter().skip(kind).take(1).for_each(|to| *to = Some(precision.of(*value)));
            }
        }
        Ok(())
    }
}
