//! The inverse of the normal law: how deep is the foot under a normal force?

use crate::assemble::displacement;
use crate::patch::Patches;
use terraglue_soil_law::total_force;

/// Relative accuracy of the force.
const TOLERANCE: f64 = 1e-14;

impl Patches {
    /// X_n of the soil's surface under the normal force `force` (N) when the foot of patch `p` is turned as the
    /// moments' part of `x` says; for `force` ≤ 0 the height at which the foot just leaves the soil.
    ///
    /// The force grows monotonely with the depth: Newton from the last solution of the step, kept inside a
    /// bracket whose lower end carries nothing and whose upper end carries at least `force` on every node.
    pub fn surface_under(&mut self, p: usize, force: f64, x: &[f64; 6]) -> f64 {
        self.turn(p, x);
        let (free, full) = match self.bracket(p, force) {
            Some(bracket) => bracket,
            None => return self.ports[p].surface,
        };
        if force <= 0.0 {
            return -free;
        }
        let (mut low, mut high) = (free, full);
        let mut shift = -self.ports[p].warm;
        for _ in 0..200 {
            if !(shift > low && shift < high) {
                shift = 0.5 * (low + high);
            }
            let (value, stiffness) = self.normal_force(p, shift);
            let residual = value - force;
            if residual.abs() <= TOLERANCE * force || high - low <= f64::EPSILON * shift.abs() {
                break;
            }
            if residual > 0.0 {
                high = shift
            } else {
                low = shift
            }
            let next = if stiffness > 0.0 { shift - residual / stiffness } else { f64::NAN };
            if next == shift {
                break;
            }
            shift = next;
        }
        self.ports[p].warm = -shift;
        -shift
    }

    /// Force (N) and stiffness (N/m) when all nodes are `shift` deeper; after [`Patches::turn`].
    fn normal_force(&self, p: usize, shift: f64) -> (f64, f64) {
        let (patch, n) = (&self.ports[p], &self.nodes);
        let r = patch.nodes.clone();
        total_force(
            &patch.curve,
            shift,
            &n.turned[r.clone()],
            &n.z_max[r.clone()],
            &n.p_max[r.clone()],
            &n.area[r],
        )
    }

    fn turn(&mut self, p: usize, x: &[f64; 6]) {
        let n = &mut self.nodes;
        n.turned.resize(n.depth.len(), 0.0);
        let rotation = [0.0, 0.0, 0.0, x[3], x[4], x[5]];
        for k in self.ports[p].nodes.clone() {
            n.turned[k] = n.depth[k] - displacement(n.arm[k], &rotation)[0];
        }
    }

    /// Shift at which the foot just touches, and one at which it carries `force` for certain; `None` without nodes.
    fn bracket(&self, p: usize, force: f64) -> Option<(f64, f64)> {
        let (patch, n) = (&self.ports[p], &self.nodes);
        let loaded = || patch.nodes.clone().filter(|k| n.area[*k] > 0.0);
        let area: f64 = loaded().map(|k| n.area[k]).sum();
        let pressure = force.max(0.0) / area;
        let virgin = patch.curve.virgin_depth(pressure);
        let elastic = pressure / patch.curve.unloading();
        let (mut free, mut full) = (f64::INFINITY, f64::NEG_INFINITY);
        for k in loaded() {
            free = free.min(n.permanent[k] - n.turned[k]);
            full = full.max(virgin.max(n.permanent[k] + elastic) - n.turned[k]);
        }
        let margin = 1e-12 * (1.0 + full.abs());
        (area > 0.0).then_some((free, full + margin))
    }
}

impl Patches {
    /// dW_n/dX_n at `x`, N/m.
    pub fn normal_stiffness(&mut self, p: usize, x: &[f64; 6]) -> f64 {
        self.turn(p, x);
        self.normal_force(p, -x[0]).1
    }
}
