//! The pressure law over slices of nodes: one call per patch instead of one per node.

use crate::pressure::PressureCurve;

/// Nodes in first loading that are evaluated together.
const CHUNK: usize = 64;

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
    if curve.is_batched() {
        return gathered(curve, depth, z_max, p_max, p, slope);
    }
    let nodes = depth.iter().zip(z_max).zip(p_max);
    for (((z, z_max), p_max), (p, slope)) in nodes.zip(p.iter_mut().zip(slope)) {
        (*p, *slope) = curve.at(*z, *z_max, *p_max);
    }
}

/// Those in first loading are gathered for the law, the others lie on their elastic line.
fn gathered(
    curve: &PressureCurve,
    depth: &[f64],
    z_max: &[f64],
    p_max: &[f64],
    p: &mut [f64],
    slope: &mut [f64],
) {
    let (mut place, mut z) = ([0usize; CHUNK], [0.0; CHUNK]);
    let mut waiting = 0;
    let flush = |count: usize, place: &[usize; CHUNK], z: &[f64; CHUNK], p: &mut [f64], slope: &mut [f64]| {
        let (mut p_new, mut slope_new) = ([0.0; CHUNK], [0.0; CHUNK]);
        curve.beyond_many(&z[..count], &mut p_new[..count], &mut slope_new[..count]);
        for ((place, p_new), slope_new) in place[..count].iter().zip(p_new).zip(slope_new) {
            (p[*place], slope[*place]) = (p_new, slope_new);
        }
    };
    for k in 0..depth.len() {
        if depth[k] > z_max[k] && depth[k] > curve.elastic_limit() {
            (place[waiting], z[waiting]) = (k, depth[k]);
            waiting += 1;
            if waiting == CHUNK {
                flush(CHUNK, &place, &z, p, slope);
                waiting = 0;
            }
        } else {
            (p[k], slope[k]) = curve.at(depth[k], z_max[k], p_max[k]);
        }
    }
    if waiting > 0 {
        flush(waiting, &place, &z, p, slope);
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
    let (mut z, mut p, mut slope) = ([0.0; CHUNK], [0.0; CHUNK], [0.0; CHUNK]);
    let chunks =
        depth.chunks(CHUNK).zip(z_max.chunks(CHUNK)).zip(p_max.chunks(CHUNK)).zip(area.chunks(CHUNK));
    for (((depth, z_max), p_max), area) in chunks {
        let n = depth.len();
        depth.iter().zip(&mut z).for_each(|(depth, z)| *z = depth + shift);
        pressures(curve, &z[..n], z_max, p_max, &mut p[..n], &mut slope[..n]);
        for ((area, p), slope) in area.iter().zip(&p).zip(&slope) {
            force += area * p;
            stiffness += area * slope;
        }
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
