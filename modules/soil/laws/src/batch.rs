//! First loading of many nodes at a time: one call of the law per patch instead of one per node.

use crate::pressure_curve::PressureCurve;
use terraglue_subsystem::Result;

/// Nodes beyond the elastic limit that are evaluated together.
const CHUNK: usize = 64;

/// Pressures (Pa) and slopes (Pa/m) of first loading at the depths `depth` (m). All slices have the length of `depth`.
///
/// # Errors
/// The law, which is a module, has no answer.
pub fn first_loading(curve: &PressureCurve, depth: &[f64], p: &mut [f64], slope: &mut [f64]) -> Result {
    if !curve.is_batched() {
        for ((z, p), slope) in depth.iter().zip(p).zip(slope) {
            (*p, *slope) = curve.first_loading(*z)?;
        }
        return Ok(());
    }
    let (mut place, mut z) = ([0usize; CHUNK], [0.0; CHUNK]);
    let mut waiting = 0;
    for k in 0..depth.len() {
        if depth[k] > curve.elastic_limit() {
            (place[waiting], z[waiting]) = (k, depth[k]);
            waiting += 1;
        } else {
            (p[k], slope[k]) = curve.first_loading(depth[k])?;
        }
        if waiting == CHUNK || waiting > 0 && k + 1 == depth.len() {
            let (mut p_new, mut slope_new) = ([0.0; CHUNK], [0.0; CHUNK]);
            curve.beyond_many(&z[..waiting], &mut p_new[..waiting], &mut slope_new[..waiting])?;
            for ((place, p_new), slope_new) in place[..waiting].iter().zip(p_new).zip(slope_new) {
                (p[*place], slope[*place]) = (p_new, slope_new);
            }
            waiting = 0;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_batch_equals_its_nodes() {
        let curve = PressureCurve::new(1e6, 0.8, 4e8);
        let z = [0.01, 0.02, -0.01];
        let (mut p, mut slope) = ([0.0; 3], [0.0; 3]);
        first_loading(&curve, &z, &mut p, &mut slope).expect("an answer");
        for k in 0..3 {
            assert_eq!(Ok((p[k], slope[k])), curve.first_loading(z[k]));
        }
    }
}
