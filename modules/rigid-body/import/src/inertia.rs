//! Which inertia tensors a body can have.
//!
//! The inertia I of a body is tr(Σ)·1 − Σ with the covariance Σ = ∫ x xᵀ dm of its mass, and Σ = ½·tr(I)·1 − I has no negative
//! eigenvalue (Wensing, Kim and Slotine, "Linear matrix inequalities for physically consistent inertial parameter
//! identification", IEEE Robotics and Automation Letters 3(1), 2018). That is the triangle inequality of the moments.

use crate::values::LARGEST;
use nalgebra::{Matrix3, SymmetricEigen, Vector3};

/// Mass, centre of mass and inertia about it, in one frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Inertial {
    pub mass: f64,
    pub com: Vector3<f64>,
    pub tensor: Matrix3<f64>,
}

impl Inertial {
    /// Whether a body of its own can have it.
    pub fn is_sound(&self) -> bool {
        self.mass > 0.0 && flaw(&self.tensor).is_none()
    }

    /// Both as one body.
    pub fn with(&self, other: &Self) -> Self {
        let mass = self.mass + other.mass;
        let share = if mass > 0.0 { other.mass / mass } else { 0.0 };
        let arm = other.com - self.com;
        let apart = Matrix3::from_diagonal_element(arm.norm_squared()) - arm * arm.transpose();
        let tensor = self.tensor + other.tensor + self.mass * share * apart;
        Self { mass, com: self.com + share * arm, tensor }
    }
}

/// Mass and moments must be of a size that can be computed with.
pub(crate) fn in_range(mass: f64, tensor: &Matrix3<f64>) -> Result<(), String> {
    let range = 1.0 / LARGEST..=LARGEST;
    if mass != 0.0 && !range.contains(&mass) {
        return Err(format!(
            "mass {mass:e} kg is not within {:e} … {LARGEST:e}; check its unit",
            1.0 / LARGEST
        ));
    }
    match tensor.iter().all(|v| v.abs() <= LARGEST) {
        true => Ok(()),
        false => {
            Err(format!("a moment of inertia is beyond {LARGEST:e} kg m²; check mass, size and their units"))
        }
    }
}

/// Defect of a tensor; none: a body can have it. Principal moments are positive and each at most the sum of the others
/// (with 1e-6 for rounding in files).
pub(crate) fn flaw(tensor: &Matrix3<f64>) -> Option<String> {
    if *tensor == Matrix3::zeros() {
        return Some(
            "it has mass and no inertia: that is not positive, a solid body of its mass and size has one"
                .into(),
        );
    }
    let p = moments(tensor);
    let shown = shown(tensor);
    if p[0] <= 1e-12 * p[2] || p[2] <= 0.0 || p[0] < 1.0 / LARGEST {
        return Some(format!(
            "{shown}: the inertia is not positive; a solid body of its mass and size has one"
        ));
    }
    (p[2] > (p[0] + p[1]) * (1.0 + 1e-6)).then(|| {
        format!(
            "{shown}: no body has such an inertia, each moment is at most the sum of the other two; \
             check the axes and units of <inertia>"
        )
    })
}

/// Principal moments as text.
pub(crate) fn shown(tensor: &Matrix3<f64>) -> String {
    let p = moments(tensor);
    format!("principal moments {:.6e}, {:.6e}, {:.6e} kg m²", p[0], p[1], p[2])
}

fn moments(tensor: &Matrix3<f64>) -> Vector3<f64> {
    let mut p = SymmetricEigen::new(*tensor).eigenvalues;
    p.as_mut_slice().sort_by(f64::total_cmp);
    // A value within rounding of 0 counts as none.
    let largest = p.amax();
    p.map(|moment| if moment.abs() <= 1e-15 * largest { 0.0 } else { moment })
}
