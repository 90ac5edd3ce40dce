//! Passive earth pressure: the reaction of the soil beside a contact that is pushed sideways.
//!
//! The sides of a foot that stands in the soil are walls. A wall that is pushed against the soil meets the passive pressure
//! a + b·z of Rankine (1857), which is built up like friction: elastic over the way w₀, then it yields. A wall that is pushed
//! obliquely meets the part n·e of it, with n the normal of the wall and e the way over w₀; a contact that was pressed straight
//! down has no way to the side and meets none of it. The same way mobilises the passive pressure on inclined undersides.

use crate::contact_memory::Remembered;
use crate::patch_nodes::PatchNodes;
use crate::rows::Rows;
use crate::vectors::{displacement, dot};
use terraglue_ground::Lattice;
use terraglue_subsystem::{Port, Result};

/// Elastic displacement of the soil beside a contact. Part of the committed state.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Push {
    /// Key of the port.
    pub key: u64,
    /// Elastic way over the way at which the soil yields: world x and y, and rotation about the vertical times the radius of
    /// gyration of the sides; at most of length 1.
    pub mobilised: [f64; 3],
    /// Elastic energy, J.
    pub energy: f64,
}

/// A side of a contact in the soil.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Side {
    /// Outward normal, world x and y, of unit length, and its lever arm about the vertical over the radius of gyration.
    pub normal: [f64; 3],
    /// Force of the whole passive pressure, N.
    pub force: f64,
}

/// The sides of one contact during a step.
#[derive(Clone, Debug, PartialEq)]
pub struct Wall {
    /// Its sides in [`crate::patch::Patches::sides`].
    pub sides: std::ops::Range<usize>,
    /// Way at which the soil yields, m.
    pub way: f64,
    /// Point at which the resultant acts and whose motion pushes, from the port's origin along n, t1, t2, m.
    pub arm: [f64; 3],
    /// World x and y of the directions n, t1, t2.
    pub axes: [[f64; 2]; 3],
    /// Radius of gyration of the sides about the vertical through that point, m.
    pub gyration: f64,
    /// World z of the directions n, t1, t2.
    up: [f64; 3],
    /// As of the last commit.
    pub before: Push,
}

/// Answer of the soil beside a contact.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WallAnswer {
    /// Force on the body, world x and y, N, and moment about the vertical over the radius of gyration.
    pub force: [f64; 3],
    /// d(force on the soil)/d(way), N/m.
    pub stiffness: [[f64; 3]; 3],
    /// The new elastic way over that of yielding.
    pub mobilised: [f64; 3],
}

impl Wall {
    /// No sides.
    pub fn none(port: &Port, before: Push) -> Self {
        let axes = [0, 1, 2].map(|c| {
            let [x, y, _] = port.direction(c);
            [x, y]
        });
        let up = [0, 1, 2].map(|c| port.direction(c)[2]);
        Self { sides: 0..0, way: 1.0, arm: [0.0; 3], axes, gyration: 0.0, up, before }
    }

    /// Way of the sides for a motion `x` (n, t1, t2 and rotations) of the port: see [`Push::mobilised`].
    pub fn way_of(&self, x: &[f64; 6]) -> [f64; 3] {
        let [u, v] = self.in_world(displacement(self.arm, x));
        let turn = x[3..].iter().zip(&self.up).map(|(w, up)| w * up).sum::<f64>();
        [u, v, self.gyration * turn]
    }

    /// Horizontal world components of a vector along n, t1, t2.
    fn in_world(&self, v: [f64; 3]) -> [f64; 2] {
        [0, 1].map(|k| v.iter().zip(&self.axes).map(|(v, axis)| v * axis[k]).sum())
    }

    /// Derivative of the way by the motion of the port: a row of six for each of its components.
    fn gradient(&self) -> [[f64; 6]; 3] {
        let unit = |c: usize| std::array::from_fn(|k| f64::from(u8::from(k == c)));
        let columns: [[f64; 3]; 6] = std::array::from_fn(|c| self.way_of(&unit(c)));
        std::array::from_fn(|r| std::array::from_fn(|c| columns[c][r]))
    }

    /// The answer to a way `u` (see [`Wall::way_of`]) since the last commit.
    pub fn answer(&self, sides: &[Side], u: [f64; 3]) -> WallAnswer {
        let trial = [0, 1, 2].map(|k| self.before.mobilised[k] + u[k] / self.way);
        let length = trial.iter().map(|t| t * t).sum::<f64>().sqrt();
        let yields = length > 1.0;
        let scale = if yields { 1.0 / length } else { 1.0 };
        let e = trial.map(|t| scale * t);
        let mut out = WallAnswer { mobilised: e, ..WallAnswer::default() };
        let mut by_e = [[0.0; 3]; 3];
        for side in &sides[self.sides.clone()] {
            let n = side.normal;
            let pushed = dot(n, e);
            if pushed > 0.0 {
                for r in 0..3 {
                    out.force[r] -= side.force * pushed * n[r];
                    (0..3).for_each(|c| by_e[r][c] += side.force * n[r] * n[c]);
                }
            }
        }
        // d(e)/d(u): the identity, or its part across e, over the way
        let own = scale / self.way;
        let de: [[f64; 3]; 3] = std::array::from_fn(|r| {
            std::array::from_fn(|c| {
                let one = f64::from(u8::from(r == c));
                own * (one - if yields { e[r] * e[c] } else { 0.0 })
            })
        });
        out.stiffness =
            std::array::from_fn(|r| std::array::from_fn(|c| (0..3).map(|k| by_e[r][k] * de[k][c]).sum()));
        out
    }

    /// Wrench on the body of a force of the sides, along n, t1, t2 and about them.
    pub fn wrench(&self, answer: &WallAnswer) -> [f64; 6] {
        let gradient = self.gradient();
        std::array::from_fn(|c| (0..3).map(|r| gradient[r][c] * answer.force[r]).sum())
    }

    /// d(wrench on the soil)/d(motion of the port).
    pub fn stiffness(&self, answer: &WallAnswer) -> [[f64; 6]; 6] {
        let (g, k) = (self.gradient(), &answer.stiffness);
        std::array::from_fn(|r| {
            std::array::from_fn(|c| {
                (0..3).map(|a| (0..3).map(|b| g[a][r] * k[a][b] * g[b][c]).sum::<f64>()).sum()
            })
        })
    }

    /// Elastic energy at the elastic way `e` over that of yielding, J.
    pub fn energy(&self, sides: &[Side], e: [f64; 3]) -> f64 {
        let each = |side: &Side| {
            let pushed = dot(side.normal, e).max(0.0);
            0.5 * side.force * self.way * pushed * pushed
        };
        sides[self.sides.clone()].iter().map(each).sum()
    }

    /// Gives the sides, which lie at `places` (world x and y from the port), their lever arms; `sum`: of their forces, N.
    fn turn_about_middle(&mut self, sides: &mut [Side], places: &[[f64; 2]], sum: f64) {
        let middle = self.in_world(self.arm);
        let lever = |side: &Side, at: &[f64; 2]| {
            (at[0] - middle[0]) * side.normal[1] - (at[1] - middle[1]) * side.normal[0]
        };
        let squares = |(side, at): (&Side, &[f64; 2])| {
            let r = [at[0] - middle[0], at[1] - middle[1]];
            side.force * (r[0] * r[0] + r[1] * r[1])
        };
        self.gyration = (sides.iter().zip(places).map(squares).sum::<f64>() / sum).sqrt();
        if self.gyration > 0.0 {
            for (side, at) in sides.iter_mut().zip(places) {
                side.normal[2] = lever(side, at) / self.gyration;
            }
        }
    }

    /// Whether there is anything to answer.
    pub fn is_empty(&self) -> bool {
        self.sides.is_empty()
    }

    /// Passive pressure on an underside with the inward normal `nu` (along n, t1, t2), as a part of the whole.
    pub fn share(&self, nu: [f64; 3]) -> f64 {
        let [x, y] = self.in_world(nu);
        let [a, b, _] = self.before.mobilised;
        (-x * a - y * b).max(0.0)
    }
}

/// The ground beside a contact.
pub struct Beside<'a> {
    /// Lattice of its nodes.
    pub lattice: &'a Lattice,
    /// World height of the bed at a node and height of the loose soil on it, m.
    pub levels: &'a dyn Fn(i32, i32) -> [f64; 2],
    /// a and b of the passive stress of the soil, Pa and Pa/m.
    pub passive: [f64; 2],
    /// Stiffness of the soil, Pa/m.
    pub stiffness: f64,
    /// z of the port's normal.
    pub n_z: f64,
    /// Length over height of the wedge that a wall pushes up, √K_p = tan(45° + φ/2) (Rankine 1857).
    pub wedge: f64,
}

/// Cells over which the loose soil on a wedge is measured, at most.
const MOST_CELLS: i32 = 32;

impl Beside<'_> {
    /// Mean height (m) of the loose soil on the wedge beside node `at` that a wall pushes up, towards the neighbour `way`;
    /// `height` of the wall in the bed, m. Loose soil on the wedge loads it, wherever it lies. `next`: that on the neighbour, if known.
    fn loose(&self, at: [i32; 2], way: (i32, i32), height: f64, next: Option<f64>) -> f64 {
        let cells = (self.wedge * height / self.lattice.spacing).clamp(1.0, f64::from(MOST_CELLS));
        let (mut sum, mut left, mut k) = (0.0, cells, 0);
        while left > 0.0 {
            k += 1;
            let there = || (self.levels)(at[0] + k * way.0, at[1] + k * way.1)[1];
            let loose = next.filter(|_| k == 1).unwrap_or_else(there);
            sum += left.min(1.0) * loose;
            left -= 1.0;
        }
        sum / cells
    }
}

const NEIGHBOURS: [(i32, i32); 4] = [(1, 0), (-1, 0), (0, 1), (0, -1)];

/// Gathers the sides of the contact whose nodes are `range`: where the covered part of the cells falls from a node to its
/// neighbour and soil stands above the underside. The parts of a node make one side, so that the normal follows the
/// outline and not the lattice. `rows` lists the nodes. `pressed`: pressure at a node over that at which it yields: where
/// the underside rises again, as behind the lowest line of a wheel, it leaves the soil that the sides have pushed away.
pub fn gather(
    nodes: &PatchNodes,
    range: std::ops::Range<usize>,
    beside: &Beside,
    pressed: impl Fn(usize) -> Result<f64>,
    rows: &mut Rows,
    sides: &mut Vec<Side>,
    wall: &mut Wall,
) -> Result {
    let first = sides.len();
    let (spacing, n_z) = (beside.lattice.spacing, beside.n_z);
    rows.places.clear();
    let (mut arm, mut sum, mut face) = ([0.0; 3], 0.0, 0.0);
    for k in range {
        let part = pressed(k)?;
        if part <= 0.0 || nodes.area[k] <= 0.0 {
            continue;
        }
        let faces = faces(nodes, k, beside, rows);
        let [east, west, north, south] = faces;
        let net = [east[0] - west[0], north[0] - south[0]];
        let [width, height, loose] = [0, 1, 2].map(|c| faces.iter().map(|face| face[c]).sum::<f64>());
        let length = (net[0] * net[0] + net[1] * net[1]).sqrt();
        if length <= 1e-9 * spacing {
            continue;
        }
        // the mean height: parts that lie opposite cancel in the normal, not in the heights
        let (h, on_bed) = (height / width, loose / width);
        let [a, b] = beside.passive;
        // loose soil weighs on the bed and has no cohesion of its own
        let a = a + b * on_bed;
        let force = part * length * h * (a + 0.5 * b * h);
        let [x, y] = net.map(|v| v / length);
        sides.push(Side { normal: [x, y, 0.0], force });
        rows.places.push(wall.in_world(nodes.arm[k]));
        let up = if a + b * h > 0.0 { h * (3.0 * a + b * h) / (6.0 * a + 3.0 * b * h) } else { 0.0 };
        let at = nodes.arm[k];
        arm = [arm[0] + force * (at[0] + up * n_z), arm[1] + force * at[1], arm[2] + force * at[2]];
        (sum, face) = (sum + force, face + part * length * h);
    }
    wall.sides = first..sides.len();
    if sum > 0.0 {
        wall.arm = arm.map(|a| a / sum);
        wall.way = sum / face / beside.stiffness;
        wall.turn_about_middle(&mut sides[first..], &rows.places, sum);
    }
    Ok(())
}

/// The faces of node k that stand in the soil, towards +x, −x, +y and −y: width of the face and, times that, height of the bed above
/// it and of the loose soil on the bed.
fn faces(nodes: &PatchNodes, k: usize, beside: &Beside, rows: &Rows) -> [[f64; 3]; 4] {
    let (spacing, n_z) = (beside.lattice.spacing, beside.n_z);
    let covered = |k: Option<usize>| k.map_or(0.0, |k| nodes.area[k] * n_z / (spacing * spacing));
    let ([i, j], cell) = (nodes.index[k], rows.cell(nodes.index[k]));
    let lower = nodes.reference[k] - nodes.depth[k] / n_z;
    let own = covered(Some(k));
    let mut faces = [[0.0; 3]; 4];
    for (face, (di, dj)) in faces.iter_mut().zip(NEIGHBOURS) {
        let next = rows.beside(cell, [di, dj]);
        let outside = own - covered(next);
        // soil in a cell that is covered in part stands as high as it did before it was pressed
        let (bed, loose) = match next {
            Some(k) => (nodes.reference[k], None),
            None => {
                let [bed, loose] = (beside.levels)(i + di, j + dj);
                (bed, Some(loose))
            }
        };
        let above = bed - lower;
        if outside > 0.0 && above > 0.0 {
            let (width, on_bed) = (outside * spacing, beside.loose([i, j], (di, dj), above, loose));
            *face = [width, width * above, width * on_bed];
        }
    }
    faces
}

impl Remembered for Push {
    fn new(key: u64) -> Self {
        Self { key, ..Self::default() }
    }
    fn key(&self) -> u64 {
        self.key
    }
    fn energy(&self) -> f64 {
        self.energy
    }
}

terraglue_subsystem::persist!(Push { key, mobilised, energy });
