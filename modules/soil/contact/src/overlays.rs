//! Overlays of a soil at its contacts: the pressure at every node, and the friction cone of every contact.
//!
//! Both follow from the committed nodes alone. Adjacent nodes, also across a corner, are one contact; its normal is that of
//! the plane through the reference levels of its nodes by least squares.

use crate::ground::Ground;
use std::collections::BTreeSet;
use terraglue_ground::Lattice;
use terraglue_subsystem::{Figure, Overlay};

/// Length of a line, m/Pa: a centimetre for 10 kPa.
const METRES_PER_PASCAL: f64 = 1e-6;
/// Height of a cone, m/N: a centimetre for 10 N.
const METRES_PER_NEWTON: f64 = 1e-3;
const WIDTH_M: f64 = 0.002;
/// Lines from the apex of a cone to its edge.
const LINES: u32 = 8;

/// A node with pressure.
struct DrawnNode {
    /// On the surface that the soil springs back to without the contact, m.
    at: [f64; 3],
    /// Height of the ground before the contact, m.
    reference: f64,
    /// Force of the soil along the normal, N.
    force: f64,
}

/// Figures of the committed state, behind what `out` holds. `friction`: tan φ of the soil at a node.
pub(crate) fn of(
    ground: &Ground,
    loaded: &[[i32; 2]],
    friction: impl Fn([i32; 2]) -> f64,
    out: &mut Vec<Overlay>,
) {
    let lattice = ground.heights.lattice();
    let mut left: BTreeSet<[i32; 2]> =
        loaded.iter().copied().filter(|[i, j]| ground.nodes.get(*i, *j).pressure > 0.0).collect();
    let (mut pressure, mut cones) = (Vec::new(), Vec::new());
    while let Some(first) = left.pop_first() {
        let members = connected(first, &mut left);
        let nodes: Vec<DrawnNode> = members.iter().map(|ij| pressed(ground, lattice, *ij)).collect();
        let tips = members.iter().zip(&nodes).flat_map(|([i, j], node)| {
            let [x, y, z] = node.at;
            [node.at, [x, y, z + METRES_PER_PASCAL * ground.nodes.get(*i, *j).pressure]]
        });
        pressure.extend(tips);
        let steepest = members.iter().map(|ij| friction(*ij)).fold(0.0, f64::max);
        cones.extend(cone(&nodes, steepest));
    }
    let mut show = |layer: &str, colour: [f32; 4], points: Vec<[f64; 3]>| {
        if !points.is_empty() {
            let figure = Figure::Lines { points, width: WIDTH_M };
            out.push(Overlay { layer: layer.into(), frame: Overlay::WORLD, colour, figure });
        }
    };
    show("pressure", [0.9, 0.3, 0.1, 1.0], pressure);
    show("friction cone", [0.6, 0.2, 0.8, 0.7], cones);
}

/// All nodes that a node is connected with; they leave `left`.
fn connected(first: [i32; 2], left: &mut BTreeSet<[i32; 2]>) -> Vec<[i32; 2]> {
    let mut members = vec![first];
    let mut next = 0;
    while let Some([i, j]) = members.get(next).copied() {
        next += 1;
        let around = (-1..=1).flat_map(|a| (-1..=1).map(move |b| [i + a, j + b]));
        members.extend(around.filter(|ij| left.remove(ij)));
    }
    members
}

fn pressed(ground: &Ground, lattice: &Lattice, [i, j]: [i32; 2]) -> DrawnNode {
    let state = ground.nodes.get(i, j);
    let place = |axis: usize, k: i32| lattice.origin[axis] + f64::from(k) * lattice.spacing;
    DrawnNode {
        at: [place(0, i), place(1, j), state.reference - state.permanent],
        reference: state.reference,
        force: state.pressure * state.area,
    }
}

/// Lines of the cone |T_t| ≤ tan φ · T_n with its apex where the force acts, as high as the normal force; pairs of points.
fn cone(nodes: &[DrawnNode], friction: f64) -> Vec<[f64; 3]> {
    let force: f64 = nodes.iter().map(|n| n.force).sum();
    let apex = [0, 1, 2].map(|k| nodes.iter().map(|n| n.at[k] * n.force).sum::<f64>() / force);
    let n = normal(nodes);
    // n looks up, so it does not lie along y
    let t1 = unit([n[2], 0.0, -n[0]]);
    let t2 = [n[1] * t1[2] - n[2] * t1[1], n[2] * t1[0] - n[0] * t1[2], n[0] * t1[1] - n[1] * t1[0]];
    let height = METRES_PER_NEWTON * force;
    let rim = |k: u32| {
        let angle = std::f64::consts::TAU * f64::from(k) / f64::from(LINES);
        let (sin, cos) = (libm::sin(angle), libm::cos(angle));
        [0, 1, 2].map(|c| apex[c] + height * (n[c] + friction * (cos * t1[c] + sin * t2[c])))
    };
    (0..LINES).flat_map(|k| [apex, rim(k), rim(k), rim((k + 1) % LINES)]).collect()
}

fn unit(v: [f64; 3]) -> [f64; 3] {
    let length = v.iter().map(|c| c * c).sum::<f64>().sqrt();
    v.map(|c| c / length)
}

/// Of the plane z = a + b·x + c·y through the reference levels by least squares; up where they do not span one.
fn normal(nodes: &[DrawnNode]) -> [f64; 3] {
    let count = nodes.len() as f64;
    let mean = |f: &dyn Fn(&DrawnNode) -> f64| nodes.iter().map(f).sum::<f64>() / count;
    let centre = [mean(&|n| n.at[0]), mean(&|n| n.at[1]), mean(&|n| n.reference)];
    let sum = |a: usize, b: usize| {
        let part =
            |n: &DrawnNode, k: usize| if k < 2 { n.at[k] - centre[k] } else { n.reference - centre[2] };
        nodes.iter().map(|n| part(n, a) * part(n, b)).sum::<f64>()
    };
    let [xx, xy, yy, xz, yz] = [(0, 0), (0, 1), (1, 1), (0, 2), (1, 2)].map(|(a, b)| sum(a, b));
    let determinant = xx * yy - xy * xy;
    if determinant <= 1e-9 * (xx + yy) * (xx + yy) {
        return [0.0, 0.0, 1.0];
    }
    let (b, c) = ((xz * yy - yz * xy) / determinant, (yz * xx - xz * xy) / determinant);
    unit([-b, -c, 1.0])
}
