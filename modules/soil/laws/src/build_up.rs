//! Strength of soil without pressure builds up over the first pressure, so that the strength does not jump when a foot
//! begins to touch: over a tenth of the cohesion, in all laws alike.

use terraglue_subsystem::Result;

/// Share of the cohesion over which it builds up, inverse.
pub(crate) const BUILD_UP: f64 = 10.0;
/// Slip after which soil is taken to be fully mobilised, m.
pub(crate) const FULL_SLIP: f64 = 10.0;
/// Pressure at which the friction of a law is read, Pa.
const TYPICAL_PRESSURE: f64 = 1e4;

/// Whether the pressure is so small that strength without pressure is still building up.
#[inline]
pub(crate) fn is_building_up(cohesion: f64, pressure: f64) -> bool {
    BUILD_UP * pressure < cohesion
}

/// A stress with its derivatives by pressure and slip, as the law `at` a pressure gives it, except for its strength
/// without pressure, `cohesion` once it has slipped.
#[inline]
pub(crate) fn built_up(
    cohesion: f64,
    pressure: f64,
    at: impl Fn(f64) -> Result<(f64, [f64; 2])>,
) -> Result<(f64, [f64; 2])> {
    let (mut y, mut d) = at(pressure)?;
    if is_building_up(cohesion, pressure) {
        let (held, [_, by_j]) = at(0.0)?;
        let missing = 1.0 - BUILD_UP * pressure / cohesion;
        y -= held * missing;
        d[0] += held * BUILD_UP / cohesion;
        d[1] -= by_j * missing;
    }
    Ok((y, d))
}

/// Strength without pressure, Pa, of a law that answers (stress, derivatives) at (pressure, slip), and its friction
/// once the soil has slipped far.
pub(crate) fn cohesion_and_friction(at: impl Fn(f64, f64) -> Result<(f64, [f64; 2])>) -> Result<[f64; 2]> {
    let cohesion = at(0.0, FULL_SLIP)?.0;
    let full = at(TYPICAL_PRESSURE, FULL_SLIP)?.0;
    Ok([cohesion, (full - cohesion) / TYPICAL_PRESSURE])
}
