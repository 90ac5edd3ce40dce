//! Whether bodies move as their estimate says, x1 = x_free + G1·T. They do not where a motor is at its limit under T* and
//! not under T1: the strategies of one evaluation then take the estimate again about T1.

use super::interface_problem::InterfaceProblem;
use terraglue_host::Instance;
use terraglue_subsystem::Capabilities;

/// Passes of a step in which motors change their branch at most.
pub(super) const PASSES: usize = 4;
/// Part of the motion (and length, m; angle, rad) by which bodies may miss what their estimate says.
const MISS: [f64; 2] = [1e-3, 1e-8];

/// Whether the bodies have moved as `said` (packed; m, rad).
pub(super) fn followed(problem: &InterfaceProblem, said: &[f64]) -> bool {
    let most = problem.first.x.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    let miss = problem.first.x.iter().zip(said).fold(0.0, |m: f64, (x, said)| m.max((x - said).abs()));
    miss <= MISS[0] * most + MISS[1]
}

/// Whether all bodies can take the estimate again.
pub(super) fn can_repeat(problem: &InterfaceProblem, instances: &[Instance]) -> bool {
    let needed = Capabilities::RETRY | Capabilities::DERIVATIVES;
    problem.bodies.iter().all(|side| instances[side.slot].capabilities().has(needed))
}
