//! `/overlays/<owner>/<layer>`: what subsystems and the gluing show beside the bodies, a topic for each layer, so that viewers
//! switch it on and off. No subsystem is asked where the scenario does not want it.

use crate::layout::timestamp;
use crate::scene_message::{along, pose, quaternion, vector};
use crate::topics::{self, Topic};
use foxglove::messages::{
    ArrowPrimitive, Color, LinePrimitive, Point3, Pose, SceneEntity, SceneEntityDeletion, SceneUpdate,
    SpherePrimitive, TextPrimitive, line_primitive, scene_entity_deletion,
};
use std::collections::BTreeMap;
use terraglue_engine::observer::{SubsystemView, View};
use terraglue_scenario::Scenario;
use terraglue_subsystem::{Figure, Mount, Overlay, Pose as OwnPose};

/// Whose layers those of the gluing are; no subsystem has this name.
const GLUING: &str = "gluing";
/// Corners of the edge of an ellipse.
const CORNERS: u32 = 48;
/// Width of the edge of an ellipse, pixels.
const EDGE: f64 = 2.0;

/// A topic and its channel.
type Layer = (String, u16);

/// The layers of a run.
#[derive(Debug, Default)]
pub(crate) struct Overlays {
    /// Frames of the bodies that subsystems sit on.
    mounts: BTreeMap<String, String>,
    /// In the order in which they came.
    layers: Vec<Layer>,
    shown: Vec<Overlay>,
    /// Subsystems whose figures lie in a frame that there is not.
    warned: Vec<String>,
}

impl Overlays {
    /// Of a scenario; none: it does not want them.
    pub fn of(scenario: &Scenario) -> Option<Self> {
        let mount = |s: &terraglue_scenario::SubsystemSpec| {
            let (on, body) = s.parameters.get(Mount::KEY)?.as_str()?.split_once('.')?;
            Some((s.name.clone(), crate::scene_message::frame_id(on, body)))
        };
        let mounts = || scenario.subsystems.iter().filter_map(mount).collect();
        scenario.recording.overlays.then(|| Self { mounts: mounts(), ..Self::default() })
    }

    /// Topics of all layers so far.
    pub fn layers(&self) -> impl Iterator<Item = &String> {
        self.layers.iter().map(|(topic, _)| topic)
    }

    /// The channel of a layer, where it has one.
    pub fn channel(&self, topic: &str) -> Option<u16> {
        self.layers.iter().find(|(known, _)| known == topic).map(|(_, channel)| *channel)
    }

    /// A layer has come.
    pub fn add(&mut self, topic: String, channel: u16) {
        self.layers.push((topic, channel));
    }

    /// The current overlays: the topic of each layer with its message, which replaces the one before. Earlier layers that
    /// show nothing now are emptied.
    pub fn read(&mut self, view: &View) -> Vec<(String, SceneUpdate)> {
        let mut all: Vec<(String, SceneUpdate)> =
            self.layers.iter().map(|(topic, _)| (topic.clone(), emptied(view.t_s))).collect();
        for s in view.subsystems {
            self.shown.clear();
            s.instance.overlays(&mut self.shown);
            for overlay in std::mem::take(&mut self.shown) {
                match self.frame(s, overlay.frame) {
                    Some(frame) => place(&mut all, view.t_s, (s.name, frame), &overlay),
                    None => self.warn(s.name),
                }
            }
        }
        for overlay in view.gluing.overlays() {
            place(&mut all, view.t_s, (GLUING, "world".into()), &overlay);
        }
        all
    }

    fn frame(&self, s: &SubsystemView, frame: u32) -> Option<String> {
        match frame {
            Overlay::WORLD => Some("world".into()),
            Overlay::MOUNT => self.mounts.get(s.name).cloned(),
            body => {
                s.scene.bodies.get(body as usize).map(|b| crate::scene_message::frame_id(s.name, &b.name))
            }
        }
    }

    fn warn(&mut self, name: &str) {
        if !self.warned.iter().any(|n| n == name) {
            log::warn!("`{name}` shows overlays in the frame of a body that there is not; they are left out");
            self.warned.push(name.into());
        }
    }
}

/// The topic of a layer.
pub(crate) fn topic(name: &str) -> Topic {
    topics::of::<SceneUpdate>(name)
}

fn emptied(t_s: f64) -> SceneUpdate {
    let all = SceneEntityDeletion {
        timestamp: Some(timestamp(t_s)),
        r#type: scene_entity_deletion::Type::All.into(),
        id: String::new(),
    };
    SceneUpdate { deletions: vec![all], entities: Vec::new() }
}

/// Puts a figure where it belongs: its layer, and there the entity of its frame.
fn place(all: &mut Vec<(String, SceneUpdate)>, t_s: f64, (owner, frame): (&str, String), overlay: &Overlay) {
    let layer = overlay.layer.replace(|c: char| !(c.is_ascii_alphanumeric() || c == '-'), "_");
    let topic = format!("/overlays/{owner}/{layer}");
    let at = all.iter().position(|(known, _)| *known == topic).unwrap_or_else(|| {
        all.push((topic, emptied(t_s)));
        all.len() - 1
    });
    let entities = &mut all[at].1.entities;
    let entity = entities.iter().position(|e| e.frame_id == frame).unwrap_or_else(|| {
        entities.push(SceneEntity {
            timestamp: Some(timestamp(t_s)),
            frame_id: frame.clone(),
            id: frame,
            frame_locked: true,
            ..SceneEntity::default()
        });
        entities.len() - 1
    });
    draw(&mut entities[entity], overlay);
}

fn draw(entity: &mut SceneEntity, overlay: &Overlay) {
    let [r, g, b, a] = overlay.colour.map(f64::from);
    let color = Some(Color { r, g, b, a });
    match &overlay.figure {
        Figure::Lines { points, width } => entity.lines.push(LinePrimitive {
            r#type: line_primitive::Type::LineList.into(),
            pose: pose(&OwnPose::IDENTITY),
            thickness: *width,
            points: points.iter().map(|p| point(*p)).collect(),
            color,
            ..LinePrimitive::default()
        }),
        Figure::Points { points, size } => entity.spheres.extend(points.iter().map(|p| SpherePrimitive {
            pose: upright(*p),
            size: Some(vector([*size; 3])),
            color,
        })),
        Figure::Arrows { points, width } => {
            let (pairs, _) = points.as_chunks::<2>();
            entity.arrows.extend(pairs.iter().filter_map(|pair| arrow(pair, *width, color)));
        }
        Figure::Ellipse { pose: at, semi_axes: [x, y] } => entity.lines.push(LinePrimitive {
            r#type: line_primitive::Type::LineLoop.into(),
            pose: pose(at),
            thickness: EDGE,
            scale_invariant: true,
            points: (0..CORNERS)
                .map(|k| std::f64::consts::TAU * f64::from(k) / f64::from(CORNERS))
                .map(|angle| point([x * libm::cos(angle), y * libm::sin(angle), 0.0]))
                .collect(),
            color,
            ..LinePrimitive::default()
        }),
        Figure::Text { at, height, text } => entity.texts.push(TextPrimitive {
            pose: upright(*at),
            billboard: true,
            font_size: *height,
            scale_invariant: false,
            color,
            text: text.clone(),
        }),
    }
}

/// Drawings need no more than single precision, and fewer digits take less room.
fn coarse(x: f64) -> f64 {
    f64::from(x as f32)
}

fn point(p: [f64; 3]) -> Point3 {
    let [x, y, z] = p.map(coarse);
    Point3 { x, y, z }
}

fn upright(p: [f64; 3]) -> Option<Pose> {
    pose(&OwnPose { position: p.map(coarse), ..OwnPose::IDENTITY })
}

/// From tail to tip; none without length.
fn arrow([tail, tip]: &[[f64; 3]; 2], width: f64, color: Option<Color>) -> Option<ArrowPrimitive> {
    let way = [0, 1, 2].map(|k| tip[k] - tail[k]);
    let length = way.iter().map(|c| c * c).sum::<f64>().sqrt();
    // of a short arrow the head takes half
    let head = (3.0 * width).min(0.5 * length);
    (length > 0.0 && length.is_finite()).then(|| ArrowPrimitive {
        pose: Some(Pose {
            position: Some(vector(tail.map(coarse))),
            orientation: Some(quaternion(along(way, length).map(coarse))),
        }),
        shaft_length: coarse(length - head),
        shaft_diameter: width,
        head_length: coarse(head),
        head_diameter: 2.0 * width,
        color,
    })
}
