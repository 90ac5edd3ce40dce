//! The largest depths of nodes, from what stayed of them: laws that answer many nodes at once are asked for all together.

use crate::patch::{PatchNodes, Patches, key};
use terraglue_soil_law::PressureCurve;

/// Nodes of one soil that were pressed under another law than the one that acts now.
struct Changed {
    law: usize,
    count: usize,
    node: [usize; 64],
    permanent: [f64; 64],
    depth: [f64; 64],
}

impl Patches {
    /// The largest depths of nodes that were pressed before, as far as something stayed: as remembered, or where the law that
    /// acts now is another one, those that leave as much behind.
    pub(crate) fn recall_depths(&mut self, nodes: std::ops::Range<usize>, n_z: f64) {
        let mut changed = Changed { law: 0, count: 0, node: [0; _], permanent: [0.0; _], depth: [0.0; _] };
        for k in nodes {
            let (permanent, law) = (self.nodes.permanent[k], self.nodes.law[k]);
            let curve = &self.laws[law].curve;
            if permanent <= 0.0 || curve.keeper().is_some() {
                continue;
            }
            let (largest, curve_then) = self.nodes.remembered[k];
            if curve_then == key(curve, n_z) {
                self.nodes.pressed_before(k, curve, largest);
                continue;
            }
            if changed.count == changed.node.len() || changed.law != law {
                self.recall_changed(&mut changed);
            }
            changed.law = law;
            let at = changed.count;
            (changed.node[at], changed.permanent[at], changed.depth[at]) = (k, permanent, largest);
            changed.count += 1;
        }
        self.recall_changed(&mut changed);
    }

    fn recall_changed(&mut self, changed: &mut Changed) {
        let n = std::mem::take(&mut changed.count);
        if n == 0 {
            return;
        }
        let curve = &self.laws[changed.law].curve;
        curve.largest_depths(&changed.permanent[..n], &mut changed.depth[..n]);
        for (k, depth) in changed.node[..n].iter().zip(&changed.depth) {
            self.nodes.pressed_before(*k, curve, *depth);
        }
    }
}

impl PatchNodes {
    /// Node k was pressed down to `largest` (m) of this curve.
    fn pressed_before(&mut self, k: usize, curve: &PressureCurve, largest: f64) {
        self.z_max[k] = largest;
        self.p_max[k] = curve.unloading() * (largest - self.permanent[k]);
    }
}
