//! Overlays: figures that a subsystem shows in three dimensions with its bodies.

use crate::pose::Pose;

/// A figure in a layer that people switch on and off by its name.
#[derive(Clone, Debug, PartialEq)]
pub struct Overlay {
    /// Name of the layer, e.g. `support polygon`; unique words, no dots.
    pub layer: String,
    /// Index of the body of the own scene in whose frame the figure lies; [`Overlay::WORLD`]: the world,
    /// [`Overlay::MOUNT`]: the body of another subsystem that the parameter `mount` names.
    pub frame: u32,
    /// Red, green, blue, opacity, 0 … 1.
    pub colour: [f32; 4],
    /// Its figure.
    pub figure: Figure,
}

impl Overlay {
    /// The frame of figures in the world.
    pub const WORLD: u32 = u32::MAX;
    /// The frame of the body that the parameter [`crate::Mount::KEY`] names, without the offset.
    pub const MOUNT: u32 = u32::MAX - 1;
}

/// Figure of an overlay; lengths in m.
#[derive(Clone, Debug, PartialEq)]
pub enum Figure {
    /// Lines from point to point.
    Lines {
        /// Two for each line.
        points: Vec<[f64; 3]>,
        /// Width.
        width: f64,
    },
    /// Points.
    Points {
        /// Where.
        points: Vec<[f64; 3]>,
        /// Size.
        size: f64,
    },
    /// Arrows.
    Arrows {
        /// Tail and tip of each, one after the other.
        points: Vec<[f64; 3]>,
        /// Width of the shaft.
        width: f64,
    },
    /// The edge of an ellipse in the x, y plane of its pose.
    Ellipse {
        /// Its centre and axes in the frame of the overlay.
        pose: Pose,
        /// Half lengths along x and y.
        semi_axes: [f64; 2],
    },
    /// A text that faces whoever looks.
    Text {
        /// Position of its start.
        at: [f64; 3],
        /// Height of its letters.
        height: f64,
        /// Its text.
        text: String,
    },
}
