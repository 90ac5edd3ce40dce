//! The inverse of the normal law: how deep is the foot under a normal force?

use crate::clinging::Clinging;
use crate::patch::Patches;
use terraglue_subsystem::Result;

/// Relative accuracy of the force.
const TOLERANCE: f64 = 1e-14;

impl Patches {
    /// X_n of the soil's surface under the normal force `force` (N) when the other components of the motion of the
    /// foot of patch `p` are those of `x`; for `force` ≤ 0 the height at which the foot just leaves the soil.
    ///
    /// The force mostly grows with the depth: Newton from the given place of the foot (X_n = 0: from the last solution
    /// of the step), kept inside a bracket whose lower end carries nothing. Where cohesion pulls at an inclined node as
    /// soon as it is touched, a force belongs to two depths close together; the one next to the foot is meant.
    /// Its upper end carries `force` by pressure alone; where shear on inclined undersides
    /// lifts the foot, it moves further down.
    ///
    /// # Errors
    /// The law, which is a module, has no answer.
    pub fn surface_under(&mut self, p: usize, force: f64, x: &[f64; 6]) -> Result<f64> {
        self.nodes.turn(self.ports[p].nodes.clone(), x);
        let (free, full) = match self.bracket(p, force)? {
            Some(bracket) => bracket,
            None => return Ok(self.ports[p].surface),
        };
        if force <= 0.0 {
            self.list_clinging(p);
            return Ok(-self.clinging.held(force).unwrap_or(free));
        }
        let mut at = *x;
        let (mut low, mut high) = (free, full);
        for _ in 0..60 {
            at[0] = -high;
            if self.wrench(p, &at)?[0] >= force {
                break;
            }
            (low, high) = (high, high + (high - free) + 1e-9);
        }
        let mut shift = if x[0] == 0.0 { -self.ports[p].warm } else { -x[0] };
        for _ in 0..200 {
            if !(shift > low && shift < high) {
                shift = 0.5 * (low + high);
            }
            at[0] = -shift;
            let [now, stiffness] = self.normal_force(p, &at)?;
            let residual = now - force;
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
        Ok(-shift)
    }

    /// Largest force with which the soil holds back the foot of patch `p` as it is lifted, N: its nodes let go one after
    /// the other.
    pub fn pull(&mut self, p: usize) -> f64 {
        if self.laws[self.ports[p].laws.clone()].iter().all(|law| law.adhesion == 0.0) {
            return 0.0;
        }
        self.nodes.turn(self.ports[p].nodes.clone(), &[0.0; 6]);
        self.list_clinging(p);
        self.clinging.most()
    }

    /// The nodes that cling to the foot of patch `p`, those that let go first at the front.
    fn list_clinging(&mut self, p: usize) {
        let mut list = std::mem::take(&mut self.clinging);
        list.clear();
        let n = &self.nodes;
        for k in self.ports[p].nodes.clone().filter(|k| n.area[*k] > 0.0 && n.stamp[*k] != 0) {
            let (law, down) = (self.law(k), n.facing[k].press[0]);
            if law.adhesion > 0.0 {
                let stiffness = n.area[k] * down * law.curve.unloading();
                let touch = n.permanent[k] - n.turned[k];
                let end = (touch - law.adhesion / law.curve.unloading()) / down;
                list.push(Clinging { end, stiffness: stiffness * down, at_zero: stiffness * touch });
            }
        }
        list.sort();
        self.clinging = list;
    }

    /// Shift at which the foot just touches, and one at which the pressure carries `force` for certain; `None`
    /// without nodes.
    fn bracket(&self, p: usize, force: f64) -> Result<Option<(f64, f64)>> {
        let (patch, n) = (&self.ports[p], &self.nodes);
        let loaded = || patch.nodes.clone().filter(|k| n.area[*k] > 0.0);
        let area: f64 = loaded().map(|k| n.area[k] * n.facing[k].press[0]).sum();
        let pressure = force.max(0.0) / area;
        let curves = || self.laws[patch.laws.clone()].iter().map(|law| &law.curve);
        // of a law with a state nothing is known but where it begins
        let mut virgin = 0.0_f64;
        for curve in curves().filter(|c| c.keeper().is_none()) {
            virgin = virgin.max(curve.virgin_depth(pressure)?);
        }
        let elastic = curves().fold(0.0_f64, |m, c| m.max(pressure / c.unloading()));
        let (mut free, mut full) = (f64::INFINITY, f64::NEG_INFINITY);
        for k in loaded() {
            let down = n.facing[k].press[0];
            free = free.min((n.permanent[k] - n.turned[k]) / down);
            full = full.max((virgin.max(n.permanent[k] + elastic) - n.turned[k]) / down);
        }
        let margin = 1e-12 * (1.0 + full.abs());
        Ok((area > 0.0).then_some((free, full + margin)))
    }
}
