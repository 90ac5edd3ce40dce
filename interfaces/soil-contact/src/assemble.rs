//! Wrench and stiffness of a patch at a motion of its foot.

use crate::patch::Patches;
use terraglue_soil_law::ShearLaw;

/// A 6 × 6 stiffness, rows: components of the wrench on the soil, columns: components of X.
pub type Stiffness = [[f64; 6]; 6];

impl Patches {
    /// Wrench on the body (n, t1, t2, mn, mt1, mt2) when the foot of patch `p` has moved by `x`.
    pub fn wrench(&self, p: usize, x: &[f64; 6], shear: &ShearLaw) -> [f64; 6] {
        let mut sum = [0.0; 6];
        self.each_loaded(p, x, |k, pressure, _, moved| {
            let tau = shear.respond(&self.nodes.shear[k], pressure, moved).stress;
            let area = self.nodes.area[k];
            add_force(&mut sum, self.nodes.arm[k], [area * pressure, -area * tau[0], -area * tau[1]]);
        });
        sum
    }

    /// d(wrench on the soil)/dX at `x`: consistent tangents of both laws, moved to the port's origin.
    pub fn stiffness(&self, p: usize, x: &[f64; 6], shear: &ShearLaw) -> Stiffness {
        let mut sum = [[0.0; 6]; 6];
        let moments = self.ports[p].carries_moments();
        self.each_loaded(p, x, |k, pressure, slope, moved| {
            let r = shear.respond(&self.nodes.shear[k], pressure, moved);
            let (a, c) = (self.nodes.area[k], r.tangent);
            let node = [
                [a * slope, 0.0, 0.0],
                [-a * slope * r.by_pressure[0], a * c[0], a * c[1]],
                [-a * slope * r.by_pressure[1], a * c[1], a * c[2]],
            ];
            add_stiffness(&mut sum, self.nodes.arm[k], &node, moments);
        });
        sum
    }

    /// Calls `visit(node, pressure, slope, tangential displacement)` for the nodes with pressure.
    #[inline]
    fn each_loaded(&self, p: usize, x: &[f64; 6], mut visit: impl FnMut(usize, f64, f64, [f64; 2])) {
        let patch = &self.ports[p];
        let n = &self.nodes;
        for k in patch.nodes.clone().filter(|k| n.area[*k] > 0.0) {
            let moved = displacement(n.arm[k], x);
            let (pressure, slope) = patch.curve.at(n.depth[k] - moved[0], n.z_max[k], n.p_max[k]);
            if pressure > 0.0 {
                visit(k, pressure, slope, [moved[1], moved[2]]);
            }
        }
    }
}

/// Displacement along n, t1, t2 of a point at `arm` for X = (u, θ): u + θ × arm.
#[inline]
pub fn displacement(arm: [f64; 3], x: &[f64; 6]) -> [f64; 3] {
    let [u_n, u_1, u_2, w_n, w_1, w_2] = *x;
    let [r_n, r_1, r_2] = arm;
    [u_n + w_1 * r_2 - w_2 * r_1, u_1 + w_2 * r_n - w_n * r_2, u_2 + w_n * r_1 - w_1 * r_n]
}

/// Adds the wrench of a force at `arm`: (f, arm × f).
#[inline]
fn add_force(sum: &mut [f64; 6], arm: [f64; 3], f: [f64; 3]) {
    let [r_n, r_1, r_2] = arm;
    let moment = [r_1 * f[2] - r_2 * f[1], r_2 * f[0] - r_n * f[2], r_n * f[1] - r_1 * f[0]];
    for k in 0..3 {
        sum[k] += f[k];
        sum[3 + k] += moment[k];
    }
}

/// Adds Bᵀ·K·B with B from [`displacement`]; only the forces where the port carries no moments.
#[inline]
fn add_stiffness(sum: &mut Stiffness, arm: [f64; 3], node: &[[f64; 3]; 3], moments: bool) {
    if !moments {
        for (row, values) in sum.iter_mut().zip(node) {
            row.iter_mut().zip(values).for_each(|(s, v)| *s += v);
        }
        return;
    }
    let [r_n, r_1, r_2] = arm;
    let b =
        [[1.0, 0.0, 0.0, 0.0, r_2, -r_1], [0.0, 1.0, 0.0, -r_2, 0.0, r_n], [0.0, 0.0, 1.0, r_1, -r_n, 0.0]];
    let mut kb = [[0.0; 6]; 3];
    for (row, values) in kb.iter_mut().zip(node) {
        for (value, b) in values.iter().zip(&b) {
            row.iter_mut().zip(b).for_each(|(r, b)| *r += value * b);
        }
    }
    for (b, kb) in b.iter().zip(&kb) {
        for (row, b) in sum.iter_mut().zip(b) {
            row.iter_mut().zip(kb).for_each(|(r, k)| *r += b * k);
        }
    }
}
