//! Reads robot files (URDF, xacro, MJCF) into a checked tree of bodies, joints and shapes.
//!
//! The result can be simulated: every body has a physical mass and inertia, the joints form a tree, links that cannot
//! stand alone are merged into the link to which they are fixed. A defect that a simulation can live with is a warning
//! that names the value used instead; any other is refused with file, line, link or joint, the offending value and a
//! way out.

/// The examples of the README, which the tests compile.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod attach;
mod check;
mod error;
mod inertia;
mod merge;
mod mesh;
mod mjcf;
mod model;
mod plausible;
mod pose;
mod repair;
mod shapes;
mod solid;
mod syntax;
mod tree;
mod unread;
mod urdf;
mod values;
mod xacro;

pub use error::Error;
pub use mesh::Mesh;
pub use mjcf::read_mjcf_text;
pub use model::{
    AxisData, Base, Body, Coupling, Drive, DriveKind, Heights, Joint, JointKind, Loop, Plane, Robot, Shape,
    ShapeGeometry,
};
pub use pose::TotalMass;
pub use urdf::read_urdf_text;

use error::Source;
use std::path::{Path, PathBuf};

/// Options of reading a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Options {
    /// A root link of URDF without mass is the world; one with mass the caller fixes.
    pub fixed_base: bool,
    /// Folders of packages by name, for `package://`.
    pub packages: Vec<(String, PathBuf)>,
    /// Folders that hold packages, or are one.
    pub package_path: Vec<PathBuf>,
    /// Refuse a file where there is a warning.
    pub strict: bool,
}

impl Options {
    /// The folders of the environment's `ROS_PACKAGE_PATH`.
    pub fn with_ros_package_path(mut self) -> Self {
        let value = std::env::var_os("ROS_PACKAGE_PATH").unwrap_or_default();
        self.package_path.extend(std::env::split_paths(&value).filter(|p| !p.as_os_str().is_empty()));
        self
    }

    fn folders(&self, file: &str) -> mesh::Folders {
        let beside = Path::new(file).parent().map(Path::to_path_buf).unwrap_or_default();
        let (packages, package_path) = (self.packages.clone(), self.package_path.clone());
        mesh::Folders { beside, packages, package_path }
    }
}

/// Reads a file of either format, which the root element determines; xacro is expanded first.
///
/// # Errors
/// [`Error`] with file, line and element: the file cannot be read, or its model cannot be simulated.
pub fn read_robot(path: &Path, options: &Options) -> Result<Robot, Error> {
    let file = path.display().to_string();
    let mut text = terraglue_subsystem::files::read_text(path)
        .map_err(|e| Error::Read { file: file.clone(), reason: e.to_string() })?;
    syntax::check_depth(&Source { file: &file, text: &text })?;
    // URDF may hold an element <mujoco>, too, for MuJoCo's own reader. Text that is no XML is refused by its reader.
    let (is_mjcf, is_xacro) = match roxmltree::Document::parse(&text) {
        Ok(document) => {
            let is_mjcf = document.root_element().has_tag_name("mujoco");
            (is_mjcf, !is_mjcf && xacro::is_xacro(&document))
        }
        Err(_) => (text.contains("<mujoco"), false),
    };
    let file = if is_xacro {
        text = xacro::expand(path, options)?;
        xacro::expanded_name(&file)
    } else {
        file
    };
    let read = if is_mjcf { read_mjcf_text } else { read_urdf_text };
    let robot = read(&file, &text, options)?;
    match robot.warnings.first().filter(|_| options.strict) {
        Some(first) => Err(Error::Strict { first: first.clone(), count: robot.warnings.len() }),
        None => Ok(robot),
    }
}
