//! Checks of single links (mass, inertia), of masses against each other and of names.

use crate::error::{Error, Source};
use crate::model::{Body, Robot};
use crate::values::LARGEST;
use nalgebra::{Isometry3, Matrix3, SymmetricEigen, Translation3, UnitQuaternion, Vector3};
use std::collections::BTreeSet;
use urdf_rs::{Link, Pose};

/// Mass, centre of mass and inertia about it in link axes; none where the link has no mass at all.
pub(crate) type Inertial = Option<(f64, Vector3<f64>, Matrix3<f64>)>;

/// Roll, pitch, yaw about fixed axes, as URDF has it.
pub(crate) fn isometry(pose: &Pose) -> Isometry3<f64> {
    let [x, y, z] = pose.xyz.0;
    let [roll, pitch, yaw] = pose.rpy.0;
    Isometry3::from_parts(Translation3::new(x, y, z), UnitQuaternion::from_euler_angles(roll, pitch, yaw))
}

/// Masses further apart than this leave few of sixteen digits to the lighter body.
const WIDEST_MASS_RATIO: f64 = 1e12;

/// A warning where masses of one file are too far apart for double precision.
pub(crate) fn mass_spread(file: &str, bodies: &[Body]) -> Option<String> {
    let lightest = bodies.iter().min_by(|a, b| a.mass.total_cmp(&b.mass))?;
    let heaviest = bodies.iter().max_by(|a, b| a.mass.total_cmp(&b.mass))?;
    (heaviest.mass > WIDEST_MASS_RATIO * lightest.mass).then(|| {
        format!(
            "{file}: link `{}` weighs {:e} kg and link `{}` {:e} kg: more than 1e12 apart, rounding at the heavy one \
             moves the light one; check the units, or fix the heavy one to the world",
            lightest.name, lightest.mass, heaviest.name, heaviest.mass
        )
    })
}

/// Reads and checks the inertial of a link.
pub(crate) fn inertial(source: &Source, link: &Link) -> Result<Inertial, Error> {
    let (mass, i) = (link.inertial.mass.value, &link.inertial.inertia);
    let tensor = Matrix3::new(i.ixx, i.ixy, i.ixz, i.ixy, i.iyy, i.iyz, i.ixz, i.iyz, i.izz);
    if mass == 0.0 && tensor == Matrix3::zeros() {
        return Ok(None);
    }
    if mass <= 0.0 {
        let problem =
            format!("mass {mass} kg is not positive; give it a mass, or leave <inertial> out and fix it");
        return Err(source.link(&link.name, problem));
    }
    physical(mass, &tensor).map_err(|problem| source.link(&link.name, problem))?;
    let frame = isometry(&link.inertial.origin);
    let r = frame.rotation.to_rotation_matrix();
    Ok(Some((mass, frame.translation.vector, r * tensor * r.transpose())))
}

/// Mass and moments must be of a size that can be computed with. Principal moments must be positive and each at most the
/// sum of the others (with 1e-6 for rounding in files).
pub(crate) fn physical(mass: f64, tensor: &Matrix3<f64>) -> Result<(), String> {
    let range = 1.0 / LARGEST..=LARGEST;
    if !range.contains(&mass) {
        return Err(format!(
            "mass {mass:e} kg is not within {:e} … {LARGEST:e}; check its unit",
            1.0 / LARGEST
        ));
    }
    if !tensor.iter().all(|v| v.abs() <= LARGEST) {
        return Err(format!(
            "a moment of inertia is beyond {LARGEST:e} kg m²; check mass, size and their units"
        ));
    }
    let mut p = SymmetricEigen::new(*tensor).eigenvalues;
    p.as_mut_slice().sort_by(f64::total_cmp);
    let shown = format!("principal moments {:.6e}, {:.6e}, {:.6e} kg m²", p[0], p[1], p[2]);
    if p[0] <= 1e-12 * p[2] || p[2] <= 0.0 || p[0] < 1.0 / LARGEST {
        return Err(format!(
            "{shown}: the inertia is not positive; a solid body of its mass and size has one"
        ));
    }
    if p[2] > (p[0] + p[1]) * (1.0 + 1e-6) {
        return Err(format!(
            "{shown}: no body has such an inertia, each moment is at most the sum of the other two; \
             check the axes and units of <inertia>"
        ));
    }
    Ok(())
}

/// Names of bodies and of joints are unique, also those that the reader has made up.
pub(crate) fn unique(source: &Source, robot: &Robot) -> Result<(), Error> {
    let bodies = robot.bodies.iter().map(|b| b.name.as_str());
    let joints = robot.joints.iter().map(|j| j.name.as_str());
    for (what, name) in [("bodies", twice(bodies)), ("joints", twice(joints))] {
        if let Some(name) = name {
            let problem = format!(
                "two {what} are called `{name}`, one of them because it has no name of its own; give it another one"
            );
            return Err(source.tree(problem));
        }
    }
    Ok(())
}

fn twice<'a>(mut names: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let mut known = BTreeSet::new();
    names.find(|name| !known.insert(*name))
}
