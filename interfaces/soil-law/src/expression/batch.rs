//! A pressure law given by a program over the nodes of a patch.

use super::program::{CHUNK, Program};
use crate::pressure::PressureCurve;

/// Depth, largest depth and pressure there of every node.
pub struct Nodes<'a> {
    /// Added to every depth, m.
    pub shift: f64,
    /// Depths, m.
    pub depth: &'a [f64],
    /// Largest depths so far, m.
    pub z_max: &'a [f64],
    /// Pressures at the largest depths, Pa.
    pub p_max: &'a [f64],
}

/// Calls `take(node, pressure, slope)` for every node: those in first loading are gathered into chunks for the
/// program, the others lie on their elastic line.
#[inline]
pub fn for_each_node(
    curve: &PressureCurve,
    law: &Program,
    nodes: &Nodes,
    mut take: impl FnMut(usize, f64, f64),
) {
    let (mut place, mut z) = ([0usize; CHUNK], [0.0; CHUNK]);
    let (mut p, mut slope) = ([0.0; CHUNK], [0.0; CHUNK]);
    let mut waiting = 0;
    for (k, (depth, z_max)) in nodes.depth.iter().zip(nodes.z_max).enumerate() {
        let depth = depth + nodes.shift;
        if depth > *z_max && depth > curve.elastic_limit() {
            (place[waiting], z[waiting]) = (k, depth);
            waiting += 1;
            if waiting == CHUNK {
                law.eval_chunk(&z, &mut p, &mut slope);
                (0..CHUNK).for_each(|l| take(place[l], p[l], slope[l]));
                waiting = 0;
            }
        } else {
            let (p, slope) = curve.at(depth, *z_max, nodes.p_max[k]);
            take(k, p, slope);
        }
    }
    if waiting > CHUNK / 2 {
        // what is left over of the chunk before is evaluated again and not used
        law.eval_chunk(&z, &mut p, &mut slope);
        (0..waiting).for_each(|l| take(place[l], p[l], slope[l]));
    } else {
        for l in 0..waiting {
            let (p, [slope]) = law.eval([z[l]]);
            take(place[l], p, slope);
        }
    }
}
