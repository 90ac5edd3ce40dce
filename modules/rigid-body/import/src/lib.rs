//! Reads robot files (URDF, MJCF) into a checked tree of bodies, joints and shapes.
//!
//! What comes out can be simulated: every body has a physical mass and inertia, the joints form a tree, links
//! without mass are merged into the link to which they are fixed. What cannot be is refused with file, line,
//! link or joint, the offending value and a way out.

mod check;
mod error;
mod mjcf;
mod model;
mod tree;
mod urdf;

pub use error::Error;
pub use mjcf::{read_mjcf, read_mjcf_text};
pub use model::{
    AxisData, Base, Body, Drive, DriveKind, Joint, JointKind, Plane, Robot, Shape, ShapeGeometry,
};
pub use urdf::{read_urdf, read_urdf_text};

use std::path::Path;

/// Reads a file of either format, which the root of its text tells. `fixed_base`: see [`read_urdf`].
pub fn read_robot(path: &Path, fixed_base: bool) -> Result<Robot, Error> {
    let file = path.display().to_string();
    let text = std::fs::read_to_string(path)
        .map_err(|e| Error::Read { file: file.clone(), reason: e.to_string() })?;
    if text.contains("<mujoco") {
        read_mjcf_text(&file, &text)
    } else {
        read_urdf_text(&file, &text, fixed_base)
    }
}
