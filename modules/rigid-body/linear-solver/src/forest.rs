//! Factor and solution of [[M, Jᵀ], [J, −C]]·(v, μ) = (f, b) for trees of bodies.
//!
//! Each body and the joint above it are eliminated together, leaf to root. With A the inertia of the body and all
//! that hangs below, S the motions that the joint's rows allow and K = 1/C along them, the parent feels
//! Xᵀ(A − A·S·(SᵀAS + K)⁻¹·SᵀA)X: the Schur complement of body and rows in the whole matrix, which for K = 0 is the
//! articulated-body inertia of Featherstone (1983); that it is block elimination of the system with multipliers
//! is due to Baraff (1996). The directions are taken out one at a time, so each pivot SᵀAS + K is a positive
//! number, and no block is ever inverted.

use crate::rows::Rows;
use crate::spatial::{
    Inertia, Wrench, add, add_shifted, at, deflate, dot, of_body, rates_further, times, wrench_back,
};
use nalgebra::{Matrix3, Vector3};

/// Errors of the factorisation.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A parent does not come before its child.
    #[error("body {body} comes before its parent")]
    Order {
        /// The child.
        body: usize,
    },
    /// A pivot is not positive: a body without inertia, or masses too far apart for the number format.
    #[error("the pivot of body {body} is {pivot}; its inertia is not positive, or masses lie too far apart")]
    Pivot {
        /// Index of the body.
        body: usize,
        /// The pivot that should have been positive.
        pivot: f64,
    },
    /// The system of the rows that close loops cannot be factored.
    #[error("the rows that close loops are not finite or have negative compliance")]
    Loops,
    /// The right-hand side is not finite.
    #[error("the right-hand side or the solution is not finite")]
    NotFinite,
}

/// Connection of a body to its tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Link {
    /// The body above; none: the world, or nothing.
    pub parent: Option<usize>,
    /// The joint above; none: the body is free.
    pub joint: Option<usize>,
}

/// A direction in which a body can move against its parent.
#[derive(Clone, Copy, Debug, Default)]
struct Freedom {
    /// Row of the joint.
    row: usize,
    /// Rates of the body for a unit rate along the row.
    motion: Wrench,
    /// A·motion, with the freedoms before it taken out.
    response: Wrench,
    /// motionᵀ·response.
    own: f64,
    /// 1/(own + K).
    inverse: f64,
    /// Its root.
    root: f64,
    /// K: 1/compliance of the row; 0: free.
    stiffness: f64,
}

/// Numbers of one body and the joint above it.
#[derive(Clone, Copy, Debug, Default)]
struct Node {
    parent: Option<usize>,
    joint: Option<usize>,
    /// Whether the joint holds at all; without, the body is a root.
    hangs: bool,
    inertia: Inertia,
    /// Its own mass and mean moment of inertia, without its descendants.
    own: (f64, f64),
    /// From the parent's centre of mass to its own.
    shift: Vector3<f64>,
    rows: Rows,
    rigid: [bool; 6],
    /// Rows that hold at all: rigid and compliant ones.
    exists: [bool; 6],
    freedoms: [Freedom; 6],
    count: usize,
    /// Freedoms of this body and all above it.
    path_len: usize,
}

/// Trees of bodies, without rows that close loops.
#[derive(Clone, Debug)]
pub(crate) struct Forest {
    nodes: Vec<Node>,
    joints: usize,
}

impl Forest {
    /// From the links of all bodies, parents first, and the number of joints.
    pub fn new(links: &[Link], joints: usize) -> Result<Self, Error> {
        let late = links.iter().enumerate().find(|(b, l)| l.parent.is_some_and(|p| p >= *b));
        if let Some((body, _)) = late {
            return Err(Error::Order { body });
        }
        let node = |l: &Link| Node { parent: l.parent, joint: l.joint, ..Node::default() };
        Ok(Self { nodes: links.iter().map(node).collect(), joints })
    }

    /// Number of bodies.
    pub fn bodies(&self) -> usize {
        self.nodes.len()
    }

    /// Number of unknowns.
    pub fn len(&self) -> usize {
        6 * (self.nodes.len() + self.joints)
    }

    /// Factorises. Per body its mass (kg) and inertia about the centre of mass (kg m², world axes); per joint its
    /// rows and their compliance: `Some(0)` rigid, `Some(c)` compliant, `None` no row at all.
    pub fn factor(
        &mut self,
        masses: &[f64],
        inertia: &[Matrix3<f64>],
        rows: &[Rows],
        compliance: &[[Option<f64>; 6]],
    ) -> Result<(), Error> {
        for (b, node) in self.nodes.iter_mut().enumerate() {
            node.inertia = of_body(masses[b], &inertia[b]);
            node.own = (masses[b], inertia[b].trace() / 3.0);
            node.set_rows(rows, compliance);
        }
        for b in (0..self.nodes.len()).rev() {
            let mut left = self.nodes[b].inertia;
            self.nodes[b].eliminate(&mut left).map_err(|pivot| Error::Pivot { body: b, pivot })?;
            let Node { parent, hangs, shift, .. } = self.nodes[b];
            if let Some(p) = parent.filter(|_| hangs) {
                add_shifted(&mut self.nodes[p].inertia, &left, &shift);
            }
        }
        for b in 0..self.nodes.len() {
            self.nodes[b].path_len =
                self.above(b).map_or(0, |p| self.nodes[p].path_len) + self.nodes[b].count;
        }
        Ok(())
    }

    /// The body that b hangs on at present.
    pub fn above(&self, b: usize) -> Option<usize> {
        self.nodes[b].parent.filter(|_| self.nodes[b].hangs)
    }

    /// Mass and mean moment of inertia of a body alone.
    pub fn own_inertia(&self, b: usize) -> (f64, f64) {
        self.nodes[b].own
    }

    pub fn path_len(&self, b: usize) -> usize {
        self.nodes[b].path_len
    }

    /// Takes the freedoms of body b out of a wrench on it and hands the rest to the body above. `each` receives
    /// every freedom's share, divided by the root of its pivot, last freedom of the row order last.
    fn pass_up(&self, b: usize, p: &mut Wrench, mut each: impl FnMut(f64)) -> Option<usize> {
        let node = &self.nodes[b];
        for f in &node.freedoms[..node.count] {
            let share = dot(&f.motion, p) * f.inverse;
            each(share / f.root);
            add(p, -share, &f.response);
        }
        *p = wrench_back(p, &node.shift);
        self.above(b)
    }

    /// Answers of the path of a body to a wrench on it, from the root on, without loops.
    pub fn climb(&self, body: usize, wrench: &Wrench, y: &mut [f64]) {
        let mut end = self.path_len(body);
        let mut p = *wrench;
        let mut next = Some(body);
        while let Some(b) = next {
            let first = self.above(b).map_or(0, |above| self.path_len(above));
            let mut k = first;
            next = self.pass_up(b, &mut p, |share| {
                y[k] = share;
                k += 1;
            });
            debug_assert_eq!(k, end);
            end = first;
        }
    }

    /// Freedoms that the paths of two bodies have in common.
    pub fn shared(&self, mut a: usize, mut b: usize) -> usize {
        // Parents come first, so the later body is never the ancestor.
        while a != b {
            let later = if a > b { &mut a } else { &mut b };
            match self.above(*later) {
                Some(above) => *later = above,
                None => return 0,
            }
        }
        self.path_len(a)
    }

    /// Overwrites the right-hand side (f, b) by the solution (v, μ). Rows that do not exist get μ = 0; the
    /// right-hand side there is of no effect.
    pub fn substitute(&self, x: &mut [f64]) {
        self.sweep(x, Node::forward, Node::backward);
    }

    /// The same without the impulses of rigid rows, which become 0; [`Forest::impulses`] computes them.
    pub fn substitute_rates(&self, x: &mut [f64]) {
        self.sweep(x, Node::forward_rates, Node::backward_rates);
    }

    /// From the leaves to the roots, each body handing the remainder to its parent, and back.
    #[inline]
    fn sweep(
        &self,
        x: &mut [f64],
        forward: impl Fn(&Node, usize, &mut [f64], usize) -> Wrench,
        backward: impl Fn(&Node, usize, &mut [f64], usize),
    ) {
        let joints_at = 6 * self.nodes.len();
        for (b, node) in self.nodes.iter().enumerate().rev() {
            let rest = forward(node, b, x, joints_at);
            if let Some(p) = node.parent.filter(|_| node.hangs) {
                x[6 * p..6 * p + 6].iter_mut().zip(rest).for_each(|(x, r)| *x += r);
            }
        }
        for (b, node) in self.nodes.iter().enumerate() {
            backward(node, b, x, joints_at);
        }
    }

    /// Writes the impulses of rigid rows into a solution whose rates are known: the joint carries the part of the
    /// right-hand side of a body and all below it that their rates do not need. `masses`, `inertia`: as factored;
    /// `below`: a buffer.
    pub fn impulses(
        &self,
        masses: &[f64],
        inertia: &[Matrix3<f64>],
        rhs: &[f64],
        x: &mut [f64],
        below: &mut Vec<Wrench>,
    ) {
        below.clear();
        below.resize(self.nodes.len(), [0.0; 6]);
        for (b, node) in self.nodes.iter().enumerate().rev() {
            let Some(joint) = node.joint.filter(|_| node.hangs) else { continue };
            let (v, f) = (at(x, 6 * b), at(rhs, 6 * b));
            let turn = inertia[b] * Vector3::new(v[3], v[4], v[5]);
            let mut carried = below[b];
            for k in 0..3 {
                carried[k] += f[k] - masses[b] * v[k];
                carried[3 + k] += f[3 + k] - turn[k];
            }
            let row_at = 6 * (self.nodes.len() + joint);
            let along = node.rows.along(&carried);
            (0..6).filter(|r| node.rigid[*r]).for_each(|r| x[row_at + r] = along[r]);
            if let Some(p) = node.parent {
                add(&mut below[p], 1.0, &wrench_back(&carried, &node.shift));
            }
        }
    }
}

impl Node {
    fn set_rows(&mut self, rows: &[Rows], compliance: &[[Option<f64>; 6]]) {
        let given = self.joint.map(|j| (&rows[j], &compliance[j]));
        self.count = 0;
        (self.rigid, self.exists) = ([false; 6], [false; 6]);
        let Some((rows, compliance)) = given.filter(|(_, c)| c.iter().any(Option::is_some)) else {
            self.hangs = false;
            for k in 0..6 {
                self.freedoms[k] = Freedom { row: k, ..Freedom::default() };
                self.freedoms[k].motion[k] = 1.0;
            }
            (self.count, self.shift) = (6, Vector3::zeros());
            return;
        };
        self.hangs = true;
        self.rows = *rows;
        self.shift = rows.lever - rows.anchor;
        for (r, c) in compliance.iter().enumerate() {
            self.exists[r] = c.is_some_and(|c| c <= 0.0 || 1.0 / c > 0.0);
            match c {
                Some(c) if *c <= 0.0 => self.rigid[r] = true,
                _ => {
                    let stiffness = c.map_or(0.0, |c| 1.0 / c);
                    self.freedoms[self.count] =
                        Freedom { row: r, motion: rows.motion(r), stiffness, ..Freedom::default() };
                    self.count += 1;
                }
            }
        }
    }

    /// Takes the freedoms out of `a`; the pivot that was not positive, if any.
    fn eliminate(&mut self, a: &mut Inertia) -> Result<(), f64> {
        for f in &mut self.freedoms[..self.count] {
            f.response = times(a, &f.motion);
            f.own = dot(&f.motion, &f.response);
            let pivot = f.own + f.stiffness;
            if !(pivot > 0.0 && pivot.is_finite()) {
                return Err(pivot);
            }
            f.inverse = 1.0 / pivot;
            f.root = f.inverse.sqrt();
            deflate(a, f.inverse, &f.response);
        }
        Ok(())
    }

    /// Rates of the body that the rigid rows ask for against a parent at rest.
    #[inline]
    fn asked(&self, b: &Wrench) -> Option<Wrench> {
        let rigid: Wrench = std::array::from_fn(|r| if self.rigid[r] { b[r] } else { 0.0 });
        rigid.iter().any(|b| *b != 0.0).then(|| self.rows.motion_of(&rigid))
    }

    /// Eliminates the body from the right-hand side; returns the remainder for the parent. Leaves each freedom's own
    /// share in its row, or for a root in its rates.
    #[inline]
    fn forward(&self, b: usize, x: &mut [f64], joints_at: usize) -> Wrench {
        let mut p = at(x, 6 * b);
        let Some(joint) = self.joint.filter(|_| self.hangs) else {
            for f in &self.freedoms[..self.count] {
                let share = p[f.row] * f.inverse;
                add(&mut p, -share, &f.response);
                x[6 * b + f.row] = share;
            }
            return p;
        };
        let row_at = joints_at + 6 * joint;
        let rhs = at(x, row_at);
        if let Some(asked) = self.asked(&rhs) {
            add(&mut p, -1.0, &times(&self.inertia, &asked));
        }
        for f in &self.freedoms[..self.count] {
            let share = (dot(&f.motion, &p) + f.stiffness * rhs[f.row]) * f.inverse;
            add(&mut p, -share, &f.response);
            x[row_at + f.row] = share;
        }
        wrench_back(&p, &self.shift)
    }

    /// The same, but leaves the load on each freedom in the rates of the body.
    #[inline]
    fn forward_rates(&self, b: usize, x: &mut [f64], joints_at: usize) -> Wrench {
        let Some(joint) = self.joint.filter(|_| self.hangs) else { return self.forward(b, x, joints_at) };
        let mut p = at(x, 6 * b);
        let rhs = at(x, joints_at + 6 * joint);
        if let Some(asked) = self.asked(&rhs) {
            add(&mut p, -1.0, &times(&self.inertia, &asked));
        }
        for (k, f) in self.freedoms[..self.count].iter().enumerate() {
            let felt = dot(&f.motion, &p);
            add(&mut p, -(felt + f.stiffness * rhs[f.row]) * f.inverse, &f.response);
            x[6 * b + k] = felt;
        }
        wrench_back(&p, &self.shift)
    }

    /// Rates of the body from those of its parent, and the impulses of compliant rows of its joint.
    #[inline]
    fn backward_rates(&self, b: usize, x: &mut [f64], joints_at: usize) {
        let Some(joint) = self.joint.filter(|_| self.hangs) else { return self.backward(b, x, joints_at) };
        let row_at = joints_at + 6 * joint;
        let (felt, rhs) = (at(x, 6 * b), at(x, row_at));
        let mut v = match self.parent {
            Some(parent) => rates_further(&at(x, 6 * parent), &self.shift),
            None => [0.0; 6],
        };
        let mut impulses = [0.0; 6];
        for (f, felt) in self.freedoms[..self.count].iter().zip(felt).rev() {
            let (left, asked) = (felt - dot(&f.response, &v), rhs[f.row]);
            // μ = K·(rate − b), without the difference of nearly equal numbers
            impulses[f.row] = f.stiffness * f.inverse * (left - f.own * asked);
            add(&mut v, (left + f.stiffness * asked) * f.inverse, &f.motion);
        }
        if let Some(asked) = self.asked(&rhs) {
            add(&mut v, 1.0, &asked);
        }
        x[row_at..row_at + 6].copy_from_slice(&impulses);
        x[6 * b..6 * b + 6].copy_from_slice(&v);
    }

    /// Rates of the body from those of its parent, and the impulses of its joint.
    #[inline]
    fn backward(&self, b: usize, x: &mut [f64], joints_at: usize) {
        let Some(joint) = self.joint.filter(|_| self.hangs) else {
            for k in (0..6).rev() {
                let f = &self.freedoms[k];
                let later: f64 = (k + 1..6).map(|i| f.response[i] * x[6 * b + i]).sum();
                x[6 * b + k] -= f.inverse * later;
            }
            if let Some(joint) = self.joint {
                x[joints_at + 6 * joint..joints_at + 6 * joint + 6].fill(0.0);
            }
            return;
        };
        let row_at = joints_at + 6 * joint;
        let p = at(x, 6 * b);
        let carried = match self.parent {
            Some(parent) => rates_further(&at(x, 6 * parent), &self.shift),
            None => [0.0; 6],
        };
        let mut v = carried;
        for f in self.freedoms[..self.count].iter().rev() {
            let rate = x[row_at + f.row] - f.inverse * dot(&f.response, &v);
            add(&mut v, rate, &f.motion);
        }
        if let Some(asked) = self.asked(&at(x, row_at)) {
            add(&mut v, 1.0, &asked);
        }
        // Impulse of the joint: Jᵀμ = p − A·v.
        let mut carried = p;
        add(&mut carried, -1.0, &times(&self.inertia, &v));
        let along = self.rows.along(&carried);
        for (x, (along, exists)) in x[row_at..row_at + 6].iter_mut().zip(along.iter().zip(self.exists)) {
            *x = if exists { *along } else { 0.0 };
        }
        x[6 * b..6 * b + 6].copy_from_slice(&v);
    }
}
