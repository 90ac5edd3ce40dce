//! The step that conserves energy and momentum: midpoint rule with constraint forces along the mean rows.
//!
//! Rotation: Θ = h·(Ω + Ω⁺)/2 in body axes, q⁺ = q·cay(Θ), L⁺ − L = h·m in world axes; then ΔT = θ·m exactly
//! (Simo and Wong 1991; Austin, Krishnaprasad and Wang 1993), where θ = R·Θ is the turn in world axes. Joints ask for
//! expressions that are bilinear in positions and body-fixed directions, so that their change over the step is the
//! row made of the mean vectors times (Δc, θ): closed joints do no work, whatever the step (discrete gradient, Gonzalez
//! 1996; for rigid bodies Betsch and Leyendecker 2006). In terms of the mean rate u = (Δc, θ)/h:
//! M(u − v) = ½·h·f and v⁺ = 2u − v.

use super::scheme::{Acceleration, BodyEnd, rates};
use crate::math::{V3, cayley};
use crate::model::Body;
use crate::motion::Motion;
use crate::state::Load;

/// End of a body for the mean rate u, with its rates and mean acceleration.
pub(super) fn end(start: &Motion, u: &[f64], h: f64) -> BodyEnd {
    let (way, rate) = (V3::from_row_slice(&u[..3]), V3::from_row_slice(&u[3..6]));
    let turn = h * rate;
    let step = cayley(&turn);
    let mut q = step * start.q;
    q.renormalize_fast();
    let motion = Motion { c: start.c + h * way, q, v: 2.0 * way - start.v, w: 2.0 * rate - step * start.w };
    let (before, after) = (rates(start), rates(&motion));
    let mean: [f64; 6] = std::array::from_fn(|k| (after[k] - before[k]) / h);
    BodyEnd { motion, turn, acceleration: Acceleration { algorithmic: mean, real: mean } }
}

/// ½·(h·f − change of momentum) of a body.
pub(super) fn equilibrium(
    body: &Body,
    gravity: &V3,
    load: &Load,
    (start, end): (&Motion, &Motion),
    h: f64,
) -> [f64; 6] {
    let force = body.mass * gravity + load.force;
    let push = h * force - body.mass * (end.v - start.v);
    let spin = |m: &Motion| m.q * (body.inertia * m.q.inverse_transform_vector(&m.w));
    let turn = h * load.moment + spin(start) - spin(end);
    std::array::from_fn(|k| 0.5 * if k < 3 { push[k] } else { turn[k - 3] })
}
