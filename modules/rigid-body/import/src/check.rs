//! Checks of single links (mass, inertia, places) and of masses against each other.

use crate::error::{Error, Source};
use crate::model::Body;
use nalgebra::{Isometry3, Matrix3, SymmetricEigen, Translation3, UnitQuaternion, Vector3};
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

/// What is wrong with a place: URDF reads `nan` and `inf` as numbers.
fn not_finite(what: &str, pose: &Pose) -> Option<String> {
    let (xyz, rpy) = (pose.xyz.0, pose.rpy.0);
    let bad = xyz.iter().chain(&rpy).any(|x| !x.is_finite());
    bad.then(|| {
        format!("the <origin> of {what} is xyz {xyz:?} rpy {rpy:?}; write finite numbers in m and rad")
    })
}

/// Refuses places of joints, masses and shapes that are not finite.
pub(crate) fn places(source: &Source, robot: &urdf_rs::Robot) -> Result<(), Error> {
    for joint in &robot.joints {
        if let Some(problem) = not_finite("the joint", &joint.origin) {
            return Err(source.joint(&joint.name, problem));
        }
    }
    for link in &robot.links {
        let mass = not_finite("<inertial>", &link.inertial.origin);
        let hit = link.collision.iter().find_map(|c| not_finite("a <collision>", &c.origin));
        let seen = link.visual.iter().find_map(|v| not_finite("a <visual>", &v.origin));
        if let Some(problem) = mass.or(hit).or(seen) {
            return Err(source.link(&link.name, problem));
        }
    }
    Ok(())
}

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
    if !(mass > 0.0 && mass.is_finite()) {
        let problem =
            format!("mass {mass} kg is not positive; give it a mass, or leave <inertial> out and fix it");
        return Err(source.link(&link.name, problem));
    }
    physical(&tensor).map_err(|problem| source.link(&link.name, problem))?;
    let frame = isometry(&link.inertial.origin);
    let r = frame.rotation.to_rotation_matrix();
    Ok(Some((mass, frame.translation.vector, r * tensor * r.transpose())))
}

/// Principal moments must be positive and each at most the sum of the others (with 1e-6 for rounding in files).
pub(crate) fn physical(tensor: &Matrix3<f64>) -> Result<(), String> {
    if !tensor.iter().all(|v| v.is_finite()) {
        return Err("the inertia is not finite; write numbers in kg m²".into());
    }
    let mut p = SymmetricEigen::new(*tensor).eigenvalues;
    p.as_mut_slice().sort_by(f64::total_cmp);
    let shown = format!("principal moments {:.6e}, {:.6e}, {:.6e} kg m²", p[0], p[1], p[2]);
    if p[0] <= 1e-12 * p[2] || p[2] <= 0.0 {
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
