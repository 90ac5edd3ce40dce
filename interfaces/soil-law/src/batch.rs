//! The pressure law over slices of nodes: one call per patch instead of one per node.

use crate::expression::{Nodes, for_each_node};
use crate::pressure::PressureCurve;

/// Pressures (Pa) and slopes (Pa/m) of nodes at depths `depth` that were pressed to `z_max` before, where
/// `p_max` = virgin(z_max). All slices have the length of `depth`.
pub fn pressures(
    curve: &PressureCurve,
    depth: &[f64],
    z_max: &[f64],
    p_max: &[f64],
    p: &mut [f64],
    slope: &mut [f64],
) {
    if let Some(program) = curve.program() {
        let nodes = Nodes { shift: 0.0, depth, z_max, p_max };
        return for_each_node(curve, program, &nodes, |k, value, by_z| (p[k], slope[k]) = (value, by_z));
    }
    let nodes = depth.iter().zip(z_max).zip(p_max);
    for (((z, z_max), p_max), (p, slope)) in nodes.zip(p.iter_mut().zip(slope)) {
        (*p, *slope) = curve.at(*z, *z_max, *p_max);
    }
}

/// Σ area·p and Σ area·dp/dz when all nodes are `shift` (m) deeper than `depth`: force (N) and stiffness (N/m) of
/// a patch that moves as a whole.
#[inline]
pub fn total_force(
    curve: &PressureCurve,
    shift: f64,
    depth: &[f64],
    z_max: &[f64],
    p_max: &[f64],
    area: &[f64],
) -> (f64, f64) {
    let (mut force, mut stiffness) = (0.0, 0.0);
    if let Some(program) = curve.program() {
        for_each_node(curve, program, &Nodes { shift, depth, z_max, p_max }, |k, p, slope| {
            force += area[k] * p;
            stiffness += area[k] * slope;
        });
        return (force, stiffness);
    }
    for (((z, z_max), p_max), area) in depth.iter().zip(z_max).zip(p_max).zip(area) {
        let (p, slope) = curve.at(z + shift, *z_max, *p_max);
        force += area * p;
        stiffness += area * slope;
    }
    (force, stiffness)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_batch_equals_its_nodes() {
        let curve = PressureCurve::new(1e6, 0.8, 4e8);
        let (z, z_max) = ([0.01, 0.02, -0.01], [0.005, 0.0200001, 0.0]);
        let p_max = z_max.map(|z| curve.virgin(z));
        let (mut p, mut slope) = ([0.0; 3], [0.0; 3]);
        pressures(&curve, &z, &z_max, &p_max, &mut p, &mut slope);
        for k in 0..3 {
            assert_eq!((p[k], slope[k]), curve.at(z[k], z_max[k], p_max[k]));
        }
        let (force, stiffness) = total_force(&curve, 0.0, &z, &z_max, &p_max, &[1.0, 2.0, 3.0]);
        assert!((force - (p[0] + 2.0 * p[1])).abs() < 1e-9 * force);
        assert!((stiffness - (slope[0] + 2.0 * slope[1])).abs() < 1e-9 * stiffness);
    }
}
