//! Free rotation of a body over a step by the implicit midpoint rule: conserves energy and angular momentum
//! of a free body exactly (both are quadratic), so the gyroscopic term can neither heat nor brake.

use crate::math::{M3, V3, skew};

/// Rates of free rotation over a step of length h, in body axes: at its middle and at its end.
///
/// I(Ω⁺ − Ω) = −h·Ω_m × I·Ω_m with Ω_m = (Ω + Ω⁺)/2, solved for Ω_m by Newton.
pub(crate) fn free_rotation(inertia: &M3, rate: &V3, h: f64) -> (V3, V3) {
    let momentum = inertia * rate;
    let mut middle = *rate;
    for _ in 0..8 {
        let spin = inertia * middle;
        let residual = 2.0 * (spin - momentum) + h * middle.cross(&spin);
        let slope = 2.0 * inertia + h * (skew(&middle) * inertia - skew(&spin));
        // The slope is the inertia plus O(h): it is regular for every step that resolves the rotation.
        let Some(change) = slope.try_inverse().map(|inverse| inverse * residual) else { break };
        middle -= change;
        if change.norm() <= 1e-15 * rate.norm() {
            break;
        }
    }
    (middle, 2.0 * middle - rate)
}

#[cfg(test)]
#[path = "../../tests/unit/gyro.rs"]
mod tests;
