//! Where the machine itself is, as it knows from the angles of its joints: which bodies, and the boxes around their shapes.

use terraglue_subsystem::{BodyRef, Error, Mount, Pose, Result, Scene, World};
use terraglue_tree_localisation::Volume;

/// Bodies of the machine that are masked.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct OwnBodies {
    /// Number of the machine's subsystem.
    pub subsystem: u32,
    /// Numbers of the bodies, in ascending order.
    pub bodies: Vec<u32>,
}

/// Added to all sides of a box, m: noise of a range and the play of joints.
const MARGIN: f64 = 0.15;

impl OwnBodies {
    /// The bodies of these names in the subsystem of a mount; all of them where there are no names.
    pub fn find(names: &[String], mount: &Mount, world: &dyn World) -> Result<Self> {
        let name = mount.subsystem();
        let missing = || Error::Failed(format!("there is no subsystem `{name}`"));
        let place = world.subsystems().iter().position(|s| s == name).ok_or_else(missing)?;
        let scene = world.scene(place as u32).ok_or_else(missing)?;
        let number = |wanted: &String| {
            let found = scene.bodies.iter().position(|b| b.name == *wanted);
            found.map(|k| k as u32).ok_or_else(|| {
                let known: Vec<&str> = scene.bodies.iter().map(|b| b.name.as_str()).collect();
                let known = known.join(", ");
                Error::Failed(format!(
                    "parameter `own_bodies`: `{name}` has no body `{wanted}`; it has {known}"
                ))
            })
        };
        let all = 0..scene.bodies.len() as u32;
        let mut bodies = if names.is_empty() {
            all.collect()
        } else {
            names.iter().map(number).collect::<Result<Vec<_>>>()?
        };
        bodies.sort_unstable();
        bodies.dedup();
        Ok(Self { subsystem: place as u32, bodies })
    }

    /// Boxes around the shapes of the bodies at a time, in the frame of a pose that is turned level.
    pub fn volumes(&self, [frame, level]: [&Pose; 2], world: &dyn World, time: f64, out: &mut Vec<Volume>) {
        out.clear();
        let Some(scene) = world.scene(self.subsystem) else { return };
        for body in &self.bodies {
            let whole = BodyRef { subsystem: self.subsystem, body: *body };
            let Some(state) = world.pose(whole, time) else { continue };
            out.extend(boxes(scene, *body, &state.world_from_body, [frame, level]));
        }
    }
}

/// Boxes around the shapes of a body.
fn boxes<'a>(
    scene: &'a Scene,
    body: u32,
    pose: &'a Pose,
    [frame, level]: [&'a Pose; 2],
) -> impl Iterator<Item = Volume> + 'a {
    scene.shapes.iter().filter(move |s| s.body == body).map(move |shape| {
        let [low, high] = shape.geometry.extent();
        let (mut from, mut to) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for corner in 0..8_usize {
            let at = [0, 1, 2].map(|k| if corner >> k & 1 == 0 { low[k] } else { high[k] });
            let world = pose.point(shape.body_from_shape.point(at));
            let local = level.turned(frame.turned_back([0, 1, 2].map(|k| world[k] - frame.position[k])));
            for k in 0..3 {
                from[k] = from[k].min(local[k] - MARGIN);
                to[k] = to[k].max(local[k] + MARGIN);
            }
        }
        Volume { low: from, high: to }
    })
}
