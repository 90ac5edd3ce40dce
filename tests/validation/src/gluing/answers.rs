//! Answers of the strategies to the rows of a table of values.

use super::extrapolate::Limits;

/// Answers of the strategies to the rows of one case.
pub struct Answers {
    /// One per row.
    pub values: Vec<f64>,
    /// Allowed difference by row.
    pub tolerance: Vec<f64>,
    /// Relative to the value; else to max(1, |value|).
    pub relative: bool,
    /// Strategy, integrator, step, extrapolation.
    pub note: String,
}

impl Answers {
    /// From runs with halved steps.
    pub fn extrapolated(limits: Limits, h: f64, halvings: u32, integrator: &str) -> Self {
        let note = format!(
            "iterative, {integrator}, h = {h:.3e} s halved {halvings} times and extrapolated, last change {:.1e}",
            limits.apart
        );
        Self { tolerance: vec![1e-6; limits.values.len()], values: limits.values, relative: false, note }
    }
}
