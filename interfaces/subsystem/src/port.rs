//! A port: the place where two subsystems are glued. Plain data that crosses the C ABI unchanged.

/// Place where two subsystems are glued.
///
/// For a contact patch the origin is the body's lowest point along −n at t, `n` points from the soil into the
/// body, and X1 is the motion of the body within the step, measured from the origin.
///
/// ```
/// use terraglue_subsystem::{Law, Port, PortKind, component};
///
/// let port = Port {
///     key: 1,
///     kind: PortKind::Contact as u32,
///     side: 1,
///     mask: component::N | component::T1,
///     first: 2,
///     body: 0,
///     shape: 0,
///     first_node: 0,
///     node_count: 0,
///     origin: [0.0; 3],
///     frame: [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0],
///     extent: [0.0; 2],
///     law: Law::UNILATERAL,
/// };
/// // the normal force is component 2 of the packed vector, the force along x component 3
/// assert_eq!(port.range(), 2..4);
/// let (force, moment) = port.wrench_in_world(&[0.0, 0.0, 20.0, 5.0]);
/// assert_eq!((force, moment), ([5.0, 0.0, 20.0], [0.0; 3]));
/// ```
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Port {
    /// Stable over the run; ports come in ascending order of key.
    pub key: u64,
    /// One of [`PortKind`], as a number because foreign code writes it too.
    pub kind: u32,
    /// +1: T acts on this subsystem; −1: −T does.
    pub side: i32,
    /// Bit c: component c of (n, t1, t2, mn, mt1, mt2) is carried.
    pub mask: u32,
    /// First component of this port in packed vectors.
    pub first: u32,
    /// Body of this subsystem at the port: index into its scene's bodies, or a cell, or a terminal.
    pub body: u32,
    /// Id of the scene shape on the side of the body; `u32::MAX`: none.
    pub shape: u32,
    /// First of the ground nodes below the shape: `Step::nodes[first_node..][..node_count]`.
    pub first_node: u32,
    /// Number of ground nodes below the shape.
    pub node_count: u32,
    /// Reference point, world, m; fixed during the step.
    pub origin: [f64; 3],
    /// n, t1, t2 in the world, one after the other; fixed during the step.
    pub frame: [f64; 9],
    /// Half lengths of the contact along t1 and t2, m: bound the centre of pressure. Zero for a sphere.
    pub extent: [f64; 2],
    /// Bounds of the wrench and compliance of the glue.
    pub law: Law,
}

/// Kinds of ports.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PortKind {
    /// One body shape on one ground; unilateral.
    Contact = 0,
    /// A cut joint; bilateral.
    Joint = 1,
    /// Declared by name in a scenario.
    Named = 2,
}

/// t_min ≤ T_n ≤ t_max, |T_t| ≤ mu·T_n, residual x1 − x2 + compliance·T.
///
/// Bilateral −∞, ∞; unilateral 0, ∞; yielding 0, cap.
///
/// ```
/// use terraglue_subsystem::Law;
///
/// // ground that pushes with 50 N at most and has a friction coefficient of 0.6
/// let soft = Law { t_max: 50.0, mu: 0.6, ..Law::UNILATERAL };
/// assert_eq!((soft.t_min, soft.compliance), (0.0, 0.0));
/// ```
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Law {
    /// Smallest normal force, N.
    pub t_min: f64,
    /// Largest normal force, N.
    pub t_max: f64,
    /// Coulomb coefficient that bounds the tangential force, dimensionless.
    pub mu: f64,
    /// Compliance of the glue itself, m/N.
    pub compliance: f64,
}

impl Law {
    /// A contact without a cap; friction is narrowed by the ground.
    pub const UNILATERAL: Self =
        Self { t_min: 0.0, t_max: f64::INFINITY, mu: f64::INFINITY, compliance: 0.0 };
    /// A joint.
    pub const BILATERAL: Self =
        Self { t_min: f64::NEG_INFINITY, t_max: f64::INFINITY, mu: f64::INFINITY, compliance: 0.0 };
}

/// Bits of [`Port::mask`].
pub mod component {
    /// Force along the normal.
    pub const N: u32 = 1;
    /// Force along the first tangent.
    pub const T1: u32 = 2;
    /// Force along the second tangent.
    pub const T2: u32 = 4;
    /// Moment about the normal.
    pub const MN: u32 = 8;
    /// Moment about the first tangent.
    pub const MT1: u32 = 16;
    /// Moment about the second tangent.
    pub const MT2: u32 = 32;
    /// A point contact: three forces.
    pub const FORCE: u32 = N | T1 | T2;
    /// A patch that can carry moments.
    pub const WRENCH: u32 = FORCE | MN | MT1 | MT2;
}

impl Port {
    /// Number of carried components.
    pub fn len(&self) -> usize {
        self.mask.count_ones() as usize
    }

    /// Whether nothing is carried.
    pub fn is_empty(&self) -> bool {
        self.mask == 0
    }

    /// Range of this port in packed vectors.
    pub fn range(&self) -> std::ops::Range<usize> {
        self.first as usize..self.first as usize + self.len()
    }

    /// World direction of component c (0 … 5): n, t1, t2 for forces and again for moments.
    pub fn direction(&self, c: usize) -> [f64; 3] {
        let k = 3 * (c % 3);
        [self.frame[k], self.frame[k + 1], self.frame[k + 2]]
    }

    /// The carried components in packed order: (position in the packed vector, component 0 … 5).
    pub fn components(&self) -> impl Iterator<Item = (usize, usize)> + use<> {
        let (mask, first) = (self.mask, self.first as usize);
        (0..6).filter(move |c| mask & (1 << c) != 0).enumerate().map(move |(i, c)| (first + i, c))
    }

    /// Packed wrench of this port as force and moment about the origin in the world, N and N m.
    pub fn wrench_in_world(&self, t: &[f64]) -> ([f64; 3], [f64; 3]) {
        let mut out = [[0.0; 3]; 2];
        for (i, c) in self.components() {
            let d = self.direction(c);
            for k in 0..3 {
                out[c / 3][k] += d[k] * t[i];
            }
        }
        (out[0], out[1])
    }

    /// The nodes below this port's shape.
    pub fn nodes<'a>(&self, nodes: &'a [Node]) -> &'a [Node] {
        &nodes[self.first_node as usize..][..self.node_count as usize]
    }
}

/// A lattice node below a contact shape at t.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// Index along x; the node lies at `origin + i·spacing` of the ground.
    pub i: i32,
    /// Index along y.
    pub j: i32,
    /// Horizontal area of the cell covered by the shape, m²; at most spacing².
    pub area: f64,
    /// World height of the shape's underside at the node at t, m.
    pub lower: f64,
    /// ∂lower/∂x and ∂lower/∂y of the underside there (world): the body's inward normal is (−slope, 1).
    pub slope: [f64; 2],
}
