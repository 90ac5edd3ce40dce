//! The nodes of a patch in chunks, for laws that answer many nodes at once: an expression, a module.

use crate::patch::{Local, Patches};
use crate::spread::Look;
use crate::vectors::{displacement, dot};
use terraglue_soil_law::{KeptNodes, ShearResponse, ShearState, Sheared, first_loading};
use terraglue_subsystem::{MOST_LAW_STATE, Result};

/// Nodes that are evaluated together.
const CHUNK: usize = 64;

/// Nodes of a patch in one place of its foot.
pub struct Chunk {
    count: usize,
    /// Number of them, at the front, that are under pressure.
    pressed: usize,
    node: [usize; CHUNK],
    depth: [f64; CHUNK],
    pressure: [f64; CHUNK],
    slope: [f64; CHUNK],
    slide: [[f64; 2]; CHUNK],
}

impl Patches {
    /// Calls `visit` for chunks of the nodes with pressure or tension when the foot of patch `p` has moved by `x`.
    fn each_chunk(
        &self,
        p: usize,
        x: &[f64; 6],
        law: &Local,
        mut visit: impl FnMut(&Chunk) -> Result,
    ) -> Result {
        let mut chunk = Chunk {
            count: 0,
            pressed: 0,
            node: [0; CHUNK],
            depth: [0.0; CHUNK],
            pressure: [0.0; CHUNK],
            slope: [0.0; CHUNK],
            slide: [[0.0; 2]; CHUNK],
        };
        let n = &self.nodes;
        for k in self.ports[p].nodes.clone().filter(|k| n.area[*k] > 0.0) {
            let moved = displacement(n.arm[k], x);
            let at = chunk.count;
            chunk.node[at] = k;
            chunk.depth[at] = n.depth[k] - dot(n.facing[k].press, moved);
            chunk.slide[at] = n.facing[k].slide(moved);
            chunk.count += 1;
            if chunk.count == CHUNK {
                self.press_chunk(law, &mut chunk)?;
                visit(&chunk)?;
                chunk.count = 0;
            }
        }
        if chunk.count > 0 {
            self.press_chunk(law, &mut chunk)?;
            visit(&chunk)?;
        }
        Ok(())
    }

    /// Pressures and slopes; nodes without are left out, those that cling come at the end.
    fn press_chunk(&self, law: &Local, chunk: &mut Chunk) -> Result {
        let (curve, count) = (&law.curve, chunk.count);
        let (pressure, slope) = (&mut chunk.pressure[..count], &mut chunk.slope[..count]);
        if curve.keeper().is_some() {
            self.kept_pressures(law, &chunk.node[..count], &chunk.depth[..count], pressure, slope)?;
        } else {
            self.yielding(law, &chunk.node[..count], &chunk.depth[..count], pressure, slope)?;
        }
        let (mut left, mut clings) = (0, 0);
        let mut clinging = [(0, 0.0, 0.0, [0.0; 2]); CHUNK];
        for at in 0..count {
            let (k, pressed) = (chunk.node[at], (chunk.pressure[at], chunk.slope[at]));
            let (pressure, slope) =
                if pressed.0 > 0.0 { pressed } else { self.clinging_at(k, chunk.depth[at]) };
            let slide = chunk.slide[at];
            if pressure > 0.0 {
                (chunk.node[left], chunk.pressure[left]) = (k, pressure);
                (chunk.slope[left], chunk.slide[left]) = (slope, slide);
                left += 1;
            } else if pressure < 0.0 {
                clinging[clings] = (k, pressure, slope, slide);
                clings += 1;
            }
        }
        chunk.pressed = left;
        for (k, pressure, slope, slide) in &clinging[..clings] {
            (chunk.node[left], chunk.pressure[left]) = (*k, *pressure);
            (chunk.slope[left], chunk.slide[left]) = (*slope, *slide);
            left += 1;
        }
        chunk.count = left;
        Ok(())
    }

    /// Pressures of nodes at depths: those that may yield are gathered for the law.
    fn yielding(
        &self,
        law: &Local,
        nodes: &[usize],
        depth: &[f64],
        pressure: &mut [f64],
        slope: &mut [f64],
    ) -> Result {
        let (n, k_u) = (&self.nodes, law.curve.unloading());
        let mut looks = [(0, Look::default()); CHUNK];
        let mut count = 0;
        for (at, (k, depth)) in nodes.iter().zip(depth).enumerate() {
            let elastic = k_u * (depth - n.permanent[*k]);
            (pressure[at], slope[at]) = if elastic > 0.0 { (elastic, k_u) } else { (0.0, 0.0) };
            if elastic > n.bound[*k].max(0.0) {
                match n.spread[*k].look(*depth, n.top(*k)) {
                    Some(look) => {
                        looks[count] = (at, look);
                        count += 1;
                    }
                    None => (pressure[at], slope[at]) = (0.0, 0.0),
                }
            }
        }
        let looks = &looks[..count];
        let first = yields_together(self, law, nodes, looks, 0)?;
        let spread = looks.iter().any(|(_, look)| look.depth[0] != look.depth[1]);
        let second = if spread { yields_together(self, law, nodes, looks, 1)? } else { first };
        for (c, (at, look)) in looks.iter().enumerate() {
            let yields = look.mean([first[c], second[c]]);
            if yields.0 < pressure[*at] {
                (pressure[*at], slope[*at]) = yields;
            }
        }
        Ok(())
    }

    /// Pressures of a law that keeps a state; the state that it would keep after the step is dropped.
    fn kept_pressures(
        &self,
        law: &Local,
        nodes: &[usize],
        depth: &[f64],
        pressure: &mut [f64],
        slope: &mut [f64],
    ) -> Result {
        let Some((law, b)) = law.curve.keeper() else { return Ok(()) };
        let (n, doubles) = (&self.nodes, law.state_doubles());
        let (mut permanent, mut slip) = ([0.0; CHUNK], [0.0; CHUNK]);
        let mut state = [0.0; CHUNK * MOST_LAW_STATE];
        for (at, k) in nodes.iter().enumerate() {
            (permanent[at], slip[at]) = (n.permanent[*k], n.shear[*k].slip);
            state[at * doubles..(at + 1) * doubles].copy_from_slice(n.kept(*k));
        }
        let count = nodes.len();
        let (permanent, slip) = (&permanent[..count], &slip[..count]);
        let (mut unloaded, mut new) = ([0.0; CHUNK], [0.0; CHUNK * MOST_LAW_STATE]);
        let given = KeptNodes { depth, permanent, slip, state: &state[..count * doubles] };
        let out = [&mut *pressure, &mut *slope, &mut unloaded[..count]];
        law.kept(b, &given, out, &mut new[..count * doubles])?;
        for ((k, p), slope) in nodes.iter().zip(pressure).zip(slope) {
            (*p, *slope) = (n.share[*k] * *p, n.share[*k] * *slope);
        }
        Ok(())
    }

    /// As [`Patches::each_answer`] for a patch on one soil, in chunks.
    ///
    /// # Errors
    /// The law, which is a module, has no answer.
    pub fn each_answered(
        &self,
        p: usize,
        x: &[f64; 6],
        law: &Local,
        mut visit: impl FnMut(usize, f64, f64, &ShearResponse) -> Result,
    ) -> Result {
        let (n, shear) = (&self.nodes, &law.shear);
        self.each_chunk(p, x, law, |c| {
            let count = c.pressed;
            let mut answers = [ShearResponse::default(); CHUNK];
            if shear.is_batched() {
                let mut states = [ShearState::default(); CHUNK];
                let mut kept = [0.0; CHUNK * MOST_LAW_STATE];
                let doubles = n.doubles;
                for (at, k) in c.node[..count].iter().enumerate() {
                    states[at] = n.shear[*k];
                    kept[at * doubles..(at + 1) * doubles].copy_from_slice(n.kept(*k));
                }
                let sheared = Sheared {
                    states: &states[..count],
                    kept: &kept[..count * doubles],
                    pressure: &c.pressure[..count],
                    slide: &c.slide[..count],
                };
                shear.respond_many(&sheared, &mut answers[..count])?;
            } else {
                for (at, k) in c.node[..count].iter().enumerate() {
                    let (state, mobilised) = (&n.shear[*k], n.mobilised[*k]);
                    answers[at] = shear.respond_kept(state, &[], mobilised, c.pressure[at], c.slide[at])?;
                }
            }
            for (at, answer) in answers[..c.count].iter().enumerate() {
                visit(c.node[at], c.pressure[at], c.slope[at], answer)?;
            }
            Ok(())
        })
    }
}

/// Pressures and slopes at which nodes yield at the depth number `which` of their looks.
fn yields_together(
    patches: &Patches,
    law: &Local,
    nodes: &[usize],
    looks: &[(usize, Look)],
    which: usize,
) -> Result<[(f64, f64); CHUNK]> {
    let (n, count) = (&patches.nodes, looks.len());
    let [mut bed, mut bed_slope, mut top, mut loose, mut loose_slope, mut z] = [[0.0; CHUNK]; 6];
    let mut covered = false;
    for (c, (at, look)) in looks.iter().enumerate() {
        let k = nodes[*at];
        z[c] = look.depth[which];
        top[c] = n.above_bed(k, z[c]).unwrap_or(0.0);
        covered |= n.loose[k] > 0.0;
    }
    first_loading(&law.curve, &z[..count], &mut bed[..count], &mut bed_slope[..count])?;
    if covered {
        first_loading(&law.curve, &top[..count], &mut loose[..count], &mut loose_slope[..count])?;
    }
    let mut out = [(0.0, 0.0); CHUNK];
    for (c, (at, _)) in looks.iter().enumerate() {
        let k = nodes[*at];
        let on_bed = (n.loose[k] > 0.0).then_some((loose[c], loose_slope[c]));
        out[c] = patches.yields_from(k, z[c], (bed[c], bed_slope[c]), on_bed, law);
    }
    Ok(out)
}
