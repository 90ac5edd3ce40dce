//! Why joints stay open where light links carry much: the longest step that can follow them.
//!
//! A link under the forces F of its joints at the arms a swings about its centre of mass with ω² = Σ F·a/I at most, as a
//! string does (a rod of mass m and length l in a taut chain: 12·F/(m·l)). The rule of first order pushes along the rows
//! of the start of the step, so it takes this stiffness explicitly and is stable for h·ω < 2 like the leapfrog
//! (Leimkuhler and Skeel 1994); beyond, the links swing up until the equations of a step have no solution.

use super::{Dynamics, Failure};
use crate::math::V3;

/// Determines for a joint that stays open whether the step is beyond that limit; the solution of the trial is the step on its
/// branches before joints are closed.
pub(super) fn explained(dynamics: &Dynamics, failure: Failure) -> Failure {
    let Failure::Gap { joint, gap } = failure else { return failure };
    let load = |b: usize| load_of(dynamics, b);
    let bodies = &dynamics.model.bodies;
    let longest = |b: usize| 2.0 * (largest_inertia(&bodies[b].inertia) / load(b).0).sqrt();
    let worst = (0..bodies.len()).min_by(|a, b| longest(*a).total_cmp(&longest(*b)));
    match worst.map(|b| (b, longest(b))).filter(|(_, longest)| *longest < dynamics.h) {
        None => Failure::Gap { joint, gap },
        Some((b, longest)) => {
            let (link, mass, force) = (bodies[b].name.clone(), bodies[b].mass, load(b).1);
            Failure::Swinging { joint, gap, force, link, mass, h: dynamics.h, longest: 0.5 * longest }
        }
    }
}

/// Sum of force times arm over the joints of a body, N m, and the largest of the forces, N.
fn load_of(dynamics: &Dynamics, body: usize) -> (f64, f64) {
    let mut sum = (0.0, 0.0_f64);
    let joints = dynamics.model.joints.iter().enumerate();
    for (j, joint) in joints.filter(|(j, _)| !dynamics.branches.broken[*j]) {
        let arm = match body {
            b if b == joint.child => joint.child_anchor,
            b if joint.parent == Some(b) => joint.parent_anchor,
            _ => continue,
        };
        let rigid = joint.rigid();
        let impulses = &dynamics.trial.solution[dynamics.kkt.joint_at[j]..];
        let row = |r: usize| if rigid[r] { impulses[r] / dynamics.impulse_per_force() } else { 0.0 };
        let force = V3::new(row(0), row(1), row(2)).norm();
        sum = (sum.0 + force * arm.norm(), sum.1.max(force));
    }
    sum
}

fn largest_inertia(inertia: &crate::math::M3) -> f64 {
    inertia.symmetric_eigenvalues().max()
}
