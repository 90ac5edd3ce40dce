//! Friction in a joint: Coulomb friction that sticks exactly, or LuGre friction with bristles.
//!
//! LuGre (Canudas de Wit, Olsson, Åström and Lischinsky, IEEE TAC 40, 1995, eqs. 3–5): ż = u − σ0·|u|/g(u)·z,
//! τ = σ0·z + σ1·ż (the viscous part σ2·u is the setting `viscous_friction`), g(u) = F_c + (F_s − F_c)·e^−(u/v_s)².
//! Implicit Euler with g of the last rate: z⁺ = (z + h·u)/(1 + h·σ0·|u|/g), rising in u. It enters the step as the
//! polygon through its values at 0, at the last rate and at twenty times that, on both sides: exact where the joint
//! slides on as before, of first order in h elsewhere, and the bristles are advanced by the same polygon.

use super::curve::{Curve, Line, Tag};
use super::{Actuator, Item};

/// Corners of the polygon, as h·σ0·|u|/g: at least this, and that times `FAR`.
const NEAR: f64 = 0.05;
const FAR: f64 = 20.0;

/// Friction torque while sliding at a rate, N m.
pub(crate) fn sliding(a: &Actuator, rate: f64) -> f64 {
    let (coulomb, v) = (a[Item::CoulombFriction], rate / a[Item::StribeckRate]);
    let more = a[Item::StaticFriction] - coulomb;
    if more > 0.0 { coulomb + more * libm::exp(-v * v) } else { coulomb }
}

/// Impulse against rate; none without friction.
pub(crate) fn curve(a: &Actuator, h: f64) -> Option<Curve> {
    let g = if a.stuck { a[Item::StaticFriction].max(a[Item::CoulombFriction]) } else { sliding(a, a.rate) };
    if g <= 0.0 {
        return None;
    }
    if a[Item::BristleStiffness] <= 0.0 {
        let mut curve = Curve::line(Line::ZERO, Tag::Friction);
        curve.add_step(0.0, h * g, -h * g, Tag::Friction);
        return Some(curve);
    }
    Some(lugre(a, h))
}

/// Corners of the polygon on one side: rate and deflection.
fn corners(a: &Actuator, h: f64, side: f64) -> [(f64, f64); 3] {
    let g = sliding(a, a.rate);
    let scale = g / (h * a[Item::BristleStiffness]);
    let near = (a.rate.abs() / scale).max(NEAR);
    [0.0, near, FAR * near].map(|x| {
        let u = side * x * scale;
        (u, (a.bristle + h * u) / (1.0 + x))
    })
}

/// Deflection of the bristles after a step at the rate u.
pub(crate) fn bristle_after(a: &Actuator, h: f64, u: f64) -> f64 {
    let [zero, near, far] = corners(a, h, 1.0_f64.copysign(u));
    let between = |p: (f64, f64), q: (f64, f64)| {
        if q.0 == p.0 { p.1 } else { p.1 + (q.1 - p.1) * (u - p.0) / (q.0 - p.0) }
    };
    if u.abs() >= far.0.abs() {
        far.1
    } else if u.abs() >= near.0.abs() {
        between(near, far)
    } else {
        between(zero, near)
    }
}

fn lugre(a: &Actuator, h: f64) -> Curve {
    let (s0, s1, z) = (a[Item::BristleStiffness], a[Item::BristleDamping], a.bristle);
    let impulse = |deflection: f64| -(h * s0 * deflection + s1 * (deflection - z));
    let (right, left) = (corners(a, h, 1.0), corners(a, h, -1.0));
    let points = [left[2], left[1], right[0], right[1], right[2]].map(|(u, z)| (u, impulse(z)));
    Curve::polygon(&points, Tag::Friction)
}
