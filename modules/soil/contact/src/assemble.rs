//! Wrench and stiffness of a patch at a motion of its foot.

use crate::bound::Bound;
use crate::patch::{Local, Patches};
use crate::patch_nodes::{Facing, PatchNodes};
use crate::vectors::{Stiffness, displacement, dot};
use crate::wall;
use terraglue_soil_law::ShearResponse;
use terraglue_subsystem::Result;

/// Answers of the laws at the nodes of the patches in one motion of their feet, for the stiffness there without a
/// second evaluation of the laws.
#[derive(Clone, Debug, Default)]
pub struct Noted {
    /// Node, slope of its pressure (Pa/m), answer of its shear law; patch after patch.
    nodes: Vec<(usize, f64, ShearResponse)>,
    /// Per patch one past its last node above, and the force of its law along n, N.
    patches: Vec<(usize, f64)>,
}

impl Noted {
    /// Forgets all patches.
    pub fn clear(&mut self) {
        self.nodes.clear();
        self.patches.clear();
    }

    /// Room for `nodes` nodes.
    pub fn reserve(&mut self, nodes: usize) {
        self.nodes.reserve(nodes);
    }

    /// The nodes of patch `p`, and the force of its law along n, N.
    fn of(&self, p: usize) -> (&[(usize, f64, ShearResponse)], f64) {
        let first = p.checked_sub(1).map_or(0, |before| self.patches[before].0);
        let (end, force) = self.patches[p];
        (&self.nodes[first..end], force)
    }
}

impl Patches {
    /// Wrench of the laws on the body (n, t1, t2, mn, mt1, mt2) when the foot of patch `p` has moved by `x`.
    ///
    /// # Errors
    /// The law, which is a module, has no answer.
    pub fn law_wrench(&self, p: usize, x: &[f64; 6]) -> Result<[f64; 6]> {
        let mut sum = [0.0; 6];
        self.each_answer(p, x, |k, pressure, _, r| {
            add_force(&mut sum, self.nodes.arm[k], self.nodes.force(k, pressure, r.stress));
        })?;
        self.add_beside(p, x, &mut sum);
        Ok(sum)
    }

    /// The same with the inertia of the soil that moves with the foot.
    ///
    /// # Errors
    /// The law, which is a module, has no answer.
    pub fn wrench(&self, p: usize, x: &[f64; 6]) -> Result<[f64; 6]> {
        let mut sum = self.law_wrench(p, x)?;
        if let Some(cone) = &self.ports[p].cone {
            cone.add_to(x, &mut sum);
        }
        Ok(sum)
    }

    /// [`Patches::wrench`] of the next patch `p`, with its answers added to `noted`.
    ///
    /// # Errors
    /// The law, which is a module, has no answer.
    pub fn noted_wrench(&self, p: usize, x: &[f64; 6], noted: &mut Noted) -> Result<[f64; 6]> {
        let mut sum = [0.0; 6];
        self.each_answer(p, x, |k, pressure, slope, r| {
            add_force(&mut sum, self.nodes.arm[k], self.nodes.force(k, pressure, r.stress));
            noted.nodes.push((k, slope, *r));
        })?;
        self.add_beside(p, x, &mut sum);
        noted.patches.push((noted.nodes.len(), sum[0]));
        if let Some(cone) = &self.ports[p].cone {
            cone.add_to(x, &mut sum);
        }
        Ok(sum)
    }

    /// Adds the wrench of the soil beside patch `p` on the body.
    fn add_beside(&self, p: usize, x: &[f64; 6], sum: &mut [f64; 6]) {
        let wall = &self.ports[p].wall;
        if !wall.is_empty() {
            let beside = wall.wrench(&self.beside(p, x));
            sum.iter_mut().zip(beside).for_each(|(s, b)| *s += b);
        }
    }

    /// Answer of the soil beside patch `p` when its foot has moved by `x`.
    pub fn beside(&self, p: usize, x: &[f64; 6]) -> wall::WallAnswer {
        let wall = &self.ports[p].wall;
        wall.answer(&self.sides, wall.way_of(x))
    }

    /// Wrench on the body as of the last commit, and the largest tangential force at rest, N.
    ///
    /// # Errors
    /// The law, which is a module, has no answer.
    pub fn at_rest(&self, p: usize) -> Result<([f64; 6], f64)> {
        let (mut sum, mut strength) = ([0.0; 6], 0.0);
        let n = &self.nodes;
        let mut bound = None;
        self.try_each_answer(p, &[0.0; 6], |k, pressure, _, r| {
            // changes of the bearing capacity by shear and motion of the last step belong to the step that begins
            let committed = n.stamp[k] != 0 && n.before[k] > 0.0 && pressure > 0.0;
            let now = if committed { n.before[k] } else { pressure };
            add_force(&mut sum, n.arm[k], self.nodes.force(k, now, r.stress));
            let inclined = n.area[k] * n.facing[k].stretch;
            let shear = &self.law(k).shear;
            // soil that clings under tension holds nothing along the underside
            let (pressed, slip) = (pressure.max(0.0), n.shear[k].slip);
            if shear.is_batched() {
                let bound = bound.get_or_insert_with(|| Bound::new(n.doubles));
                strength += bound.add(&self.laws, n.law[k], inclined, [pressed, slip], n.kept(k))?;
            } else {
                strength += inclined * shear.yield_stress(pressed, slip, n.mobilised[k], n.kept(k))?;
            }
            Ok(())
        })?;
        self.add_beside(p, &[0.0; 6], &mut sum);
        // of the sides of a closed outline at most half look one way
        let sides = &self.sides[self.ports[p].wall.sides.clone()];
        strength += 0.5 * sides.iter().map(|side| side.force).sum::<f64>();
        let waiting = bound.as_mut().map_or(Ok(0.0), |bound| bound.take(&self.laws))?;
        Ok((sum, strength + waiting))
    }

    /// Force of patch `p` on the body along n at `x`, N, and by how much it falls with X_n, N/m.
    ///
    /// # Errors
    /// The law, which is a module, has no answer.
    pub fn normal_force(&self, p: usize, x: &[f64; 6]) -> Result<[f64; 2]> {
        let (n, mut sum, mut stiffness) = (&self.nodes, [0.0; 6], 0.0);
        self.each_answer(p, x, |k, pressure, slope, r| {
            add_force(&mut sum, n.arm[k], self.nodes.force(k, pressure, r.stress));
            stiffness += node_slope(&n.facing[k], n.area[k], slope, r, [0, 0]);
        })?;
        self.add_beside(p, x, &mut sum);
        if let Some(cone) = &self.ports[p].cone {
            let mut all = [[0.0; 6]; 6];
            all[0][0] = stiffness;
            cone.stiffen(x, sum[0], &mut all);
            cone.add_to(x, &mut sum);
            stiffness = all[0][0];
        }
        Ok([sum[0], stiffness])
    }

    /// d(wrench on the soil)/dX at `x`: consistent tangents of both laws, moved to the port's origin.
    ///
    /// # Errors
    /// The law, which is a module, has no answer.
    pub fn stiffness(&self, p: usize, x: &[f64; 6]) -> Result<Stiffness> {
        let mut sum = [[0.0; 6]; 6];
        let moments = self.ports[p].carries_moments();
        self.each_answer(p, x, |k, _, slope, r| stiffen(&self.nodes, k, slope, r, moments, &mut sum))?;
        self.stiffen_beside(p, x, &mut sum);
        if let Some(cone) = &self.ports[p].cone {
            cone.stiffen(x, self.law_wrench(p, x)?[0], &mut sum);
        }
        Ok(sum)
    }

    /// The same where [`Patches::noted_wrench`] was evaluated at `x` before.
    pub fn noted_stiffness(&self, p: usize, x: &[f64; 6], noted: &Noted) -> Stiffness {
        let mut sum = [[0.0; 6]; 6];
        let moments = self.ports[p].carries_moments();
        let (nodes, force) = noted.of(p);
        nodes.iter().for_each(|(k, slope, r)| stiffen(&self.nodes, *k, *slope, r, moments, &mut sum));
        self.stiffen_beside(p, x, &mut sum);
        if let Some(cone) = &self.ports[p].cone {
            cone.stiffen(x, force, &mut sum);
        }
        sum
    }

    /// Adds the stiffness of the soil beside patch `p`.
    fn stiffen_beside(&self, p: usize, x: &[f64; 6], sum: &mut Stiffness) {
        let wall = &self.ports[p].wall;
        if wall.is_empty() {
            return;
        }
        let block = wall.stiffness(&self.beside(p, x));
        for (row, values) in sum.iter_mut().zip(&block) {
            row.iter_mut().zip(values).for_each(|(s, v)| *s += v);
        }
    }

    /// Calls `visit(node, pressure, slope, answer of the shear law)` for the nodes with pressure or tension.
    ///
    /// # Errors
    /// The law, which is a module, has no answer.
    #[inline]
    pub fn each_answer(
        &self,
        p: usize,
        x: &[f64; 6],
        mut visit: impl FnMut(usize, f64, f64, &ShearResponse),
    ) -> Result {
        self.try_each_answer(p, x, |k, pressure, slope, r| {
            visit(k, pressure, slope, r);
            Ok(())
        })
    }

    /// The same where `visit`, too, asks the law.
    #[inline]
    fn try_each_answer(
        &self,
        p: usize,
        x: &[f64; 6],
        mut visit: impl FnMut(usize, f64, f64, &ShearResponse) -> Result,
    ) -> Result {
        if let Some(law) = self.batched(p) {
            return self.each_answered(p, x, law, visit);
        }
        let n = &self.nodes;
        self.each_loaded(p, x, |k, pressure, slope, moved| {
            let shear = &self.law(k).shear;
            let r = shear.respond_kept(&n.shear[k], &[], n.mobilised[k], pressure, moved)?;
            visit(k, pressure, slope, &r)
        })
    }

    /// The law of patch `p`, if it is a single one that answers many nodes better than one after the other.
    #[inline]
    pub fn batched(&self, p: usize) -> Option<&Local> {
        match &self.laws[self.ports[p].laws.clone()] {
            [law] if law.curve.is_batched() || law.shear.is_batched() => Some(law),
            _ => None,
        }
    }

    /// Calls `visit(node, pressure, slope, displacement along the underside)` for the nodes with pressure or tension.
    #[inline]
    fn each_loaded(
        &self,
        p: usize,
        x: &[f64; 6],
        mut visit: impl FnMut(usize, f64, f64, [f64; 2]) -> Result,
    ) -> Result {
        let patch = &self.ports[p];
        let n = &self.nodes;
        for k in patch.nodes.clone().filter(|k| n.area[*k] > 0.0) {
            let moved = displacement(n.arm[k], x);
            let deeper = -dot(n.facing[k].press, moved);
            let (pressure, slope) = self.pressure(k, n.depth[k] + deeper)?;
            if pressure != 0.0 {
                visit(k, pressure, slope, n.facing[k].slide(moved))?;
            }
        }
        Ok(())
    }
}

/// d(force on the soil)/d(displacement) of a node: area·p acts along `press` and p falls with the displacement along
/// it; the shear acts on the inclined area.
pub fn node_stiffness(facing: &Facing, area: f64, slope: f64, r: &ShearResponse) -> [[f64; 3]; 3] {
    // the terms of `node_slope`, each taken once for its row or column
    let (g, [e, f], c) = (&facing.press, &facing.along, r.tangent);
    let inclined = area * facing.stretch;
    let mut across = [[0.0; 2]; 3];
    for b in 0..3 {
        across[b] = [c[0] * e[b] + c[1] * f[b], c[1] * e[b] + c[2] * f[b]];
    }
    let mut stiffness = [[0.0; 3]; 3];
    for a in 0..3 {
        let by_pressure = (r.by_pressure[0] * e[a] + r.by_pressure[1] * f[a]) * slope;
        let normal = area * slope * g[a];
        for b in 0..3 {
            let tangent = e[a] * across[b][0] + f[a] * across[b][1];
            stiffness[a][b] = normal * g[b] + inclined * (tangent - by_pressure * g[b]);
        }
    }
    stiffness
}

/// Adds the stiffness of node k.
#[inline]
fn stiffen(nodes: &PatchNodes, k: usize, slope: f64, r: &ShearResponse, moments: bool, sum: &mut Stiffness) {
    let node = node_stiffness(&nodes.facing[k], nodes.area[k], slope, r);
    add_stiffness(sum, nodes.arm[k], &node, moments);
}

/// One entry of [`node_stiffness`].
#[inline]
fn node_slope(facing: &Facing, area: f64, slope: f64, r: &ShearResponse, [a, b]: [usize; 2]) -> f64 {
    let (g, [e, f], c) = (facing.press, facing.along, r.tangent);
    let inclined = area * facing.stretch;
    let tangent = e[a] * (c[0] * e[b] + c[1] * f[b]) + f[a] * (c[1] * e[b] + c[2] * f[b]);
    let by_pressure = r.by_pressure[0] * e[a] + r.by_pressure[1] * f[a];
    area * slope * g[a] * g[b] + inclined * (tangent - by_pressure * slope * g[b])
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
    // B is the identity beside the matrix of θ × arm: only its terms that are not zero
    let [r_n, r_1, r_2] = arm;
    let mut kb = [[0.0; 6]; 3];
    for (row, [k_n, k_1, k_2]) in kb.iter_mut().zip(node) {
        *row = [*k_n, *k_1, *k_2, k_2 * r_1 - k_1 * r_2, k_n * r_2 - k_2 * r_n, k_1 * r_n - k_n * r_1];
    }
    for c in 0..6 {
        let [n, a, b] = [kb[0][c], kb[1][c], kb[2][c]];
        sum[0][c] += n;
        sum[1][c] += a;
        sum[2][c] += b;
        sum[3][c] = sum[3][c] - r_2 * a + r_1 * b;
        sum[4][c] = sum[4][c] + r_2 * n - r_n * b;
        sum[5][c] = sum[5][c] - r_1 * n + r_n * a;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use terraglue_soil_law::ShearState;

    #[test]
    fn a_stiffness_is_its_entries_to_the_bit() {
        for k in 0..200 {
            let number = |n: u32| libm::sin(f64::from(37 * k + n) * 1.7);
            let vector = |n: u32| [number(n), number(n + 1), number(n + 2)];
            let facing =
                Facing { press: vector(0), along: [vector(3), vector(6)], stretch: 1.0 + number(9).abs() };
            let r = ShearResponse {
                stress: [0.0; 2],
                tangent: [1e5, 1e4, 1e5].map(|size| size * number(10)),
                by_pressure: [number(13), number(14)],
                state: ShearState::default(),
                dissipated: 0.0,
            };
            let (area, slope) = (1e-4 * number(15).abs(), 1e6 * number(16));
            let whole = node_stiffness(&facing, area, slope, &r);
            for (a, b) in (0..3).flat_map(|a| (0..3).map(move |b| (a, b))) {
                let entry = node_slope(&facing, area, slope, &r, [a, b]);
                assert_eq!(whole[a][b].to_bits(), entry.to_bits(), "{a} {b}");
            }
        }
    }
}
