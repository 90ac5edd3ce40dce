//! Checks of single links (mass, sign of the moments), of masses against each other and of names.

use crate::error::{Error, Source};
use crate::inertia::{Inertial, in_range};
use crate::model::{Body, Robot};
use nalgebra::{Isometry3, Matrix3, Translation3, UnitQuaternion};
use std::collections::BTreeSet;
use urdf_rs::{Link, Pose};

/// Roll, pitch, yaw about fixed axes, as URDF has it.
pub(crate) fn isometry(pose: &Pose) -> Isometry3<f64> {
    let [x, y, z] = pose.xyz.0;
    let [roll, pitch, yaw] = pose.rpy.0;
    Isometry3::from_parts(Translation3::new(x, y, z), UnitQuaternion::from_euler_angles(roll, pitch, yaw))
}

/// A moment below 0 by this part of the largest entry is rounding.
const ROUNDING: f64 = 1e-9;
/// So is everything up to this, kg m².
const SMALLEST: f64 = 1e-18;

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

/// Reads the inertial of a link, in its axes; none where it has neither mass nor inertia. Values that are impossible for
/// any body are refused here; whether the rest can be simulated is decided for links that move as one.
pub(crate) fn inertial(source: &Source, link: &Link) -> Result<Option<Inertial>, Error> {
    let (mass, i) = (link.inertial.mass.value, &link.inertial.inertia);
    let tensor = Matrix3::new(i.ixx, i.ixy, i.ixz, i.ixy, i.iyy, i.iyz, i.ixz, i.iyz, i.izz);
    if mass == 0.0 && tensor == Matrix3::zeros() {
        return Ok(None);
    }
    if mass < 0.0 {
        return Err(source.link(&link.name, not_positive(mass)));
    }
    in_range(mass, &tensor).map_err(|problem| source.link(&link.name, problem))?;
    // A value within rounding of 0, on either side, counts as none; a little below 0 among larger ones is repaired.
    let largest = tensor.amax();
    let tensor = if largest <= SMALLEST { Matrix3::zeros() } else { tensor };
    let least = -(ROUNDING * largest).max(SMALLEST);
    let moments = [("ixx", i.ixx), ("iyy", i.iyy), ("izz", i.izz)];
    if let Some((name, value)) = moments.into_iter().find(|m| m.1 < least) {
        let problem =
            format!("{name} = {value} is negative; a moment is a sum of squares times mass: check its sign");
        return Err(source.link(&link.name, problem));
    }
    let frame = isometry(&link.inertial.origin);
    let r = frame.rotation.to_rotation_matrix();
    Ok(Some(Inertial { mass, com: frame.translation.vector, tensor: r * tensor * r.transpose() }))
}

/// Words for a mass that moves nothing.
pub(crate) fn not_positive(mass: f64) -> String {
    format!("mass {mass} kg is not positive; give it a mass, or leave <inertial> out and fix it")
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
