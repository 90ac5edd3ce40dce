//! A joint between two bodies: its freedoms, and its place in both.

use crate::math::{Q, V3};
use terraglue_robot_import as import;

/// Freedoms of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Revolute,
    Prismatic,
    Fixed,
    /// Slides along its axis and turns about it.
    Cylindrical,
    /// Turns about the parent's axis x and the child's axis y of the joint frame, which stay perpendicular.
    Universal,
    /// Turns freely.
    Spherical,
    /// Slides across its axis and turns about it.
    Planar,
}

/// A joint between a body and its parent (or the world).
#[derive(Clone, Debug)]
pub(crate) struct Joint {
    pub name: String,
    pub kind: Kind,
    pub parent: Option<usize>,
    pub child: usize,
    /// Joint's origin from the parent's centre of mass in its axes (in the world without a parent), m.
    pub parent_anchor: V3,
    /// Joint's origin from the child's centre of mass in its axes, m.
    pub child_anchor: V3,
    /// Orientation of the joint's frame, x along the axis, in parent and child.
    pub parent_frame: Q,
    pub child_frame: Q,
    pub limits: Option<[f64; 2]>,
    /// Data of its axis from the file.
    pub data: import::AxisData,
}

impl Joint {
    /// Which of the six rows (three translations, three rotations, each along axis, t1, t2) is the free one, for joints
    /// with one coordinate, which motors can drive.
    pub fn free_row(&self) -> Option<usize> {
        match self.kind {
            Kind::Prismatic => Some(0),
            Kind::Revolute => Some(3),
            _ => None,
        }
    }

    /// Which rows hold.
    pub fn rigid(&self) -> [bool; 6] {
        match self.kind {
            Kind::Revolute => [true, true, true, false, true, true],
            Kind::Prismatic => [false, true, true, true, true, true],
            Kind::Fixed => [true; 6],
            Kind::Cylindrical => [false, true, true, false, true, true],
            Kind::Universal => [true, true, true, false, false, true],
            Kind::Spherical => [true, true, true, false, false, false],
            Kind::Planar => [true, false, false, false, true, true],
        }
    }

    /// Whether it keeps two axes parallel that may turn about each other.
    pub fn aligns_axes(&self) -> bool {
        matches!(self.kind, Kind::Revolute | Kind::Cylindrical | Kind::Planar)
    }

    /// Whether it has one coordinate.
    pub fn moves(&self) -> bool {
        self.free_row().is_some()
    }

    /// Unit of its coordinate.
    pub fn unit(&self) -> &'static str {
        if self.kind == Kind::Prismatic { "m" } else { "rad" }
    }
}
