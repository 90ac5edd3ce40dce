//! Contacts among the robot's own bodies: found with parry, kept apart by unilateral constraints on the rate.
//!
//! For each pair of shapes that can meet within the step: w = n·(v_b − v_a)⁺ + gap/h ≥ 0 ⟂ λ ≥ 0 (Stewart and
//! Trinkle 1996), without friction. Neighbours in the tree and shapes that overlap in the initial pose are left
//! alone: a leg may stand in the box that stands for the body.

use crate::dense::{cholesky, cholesky_solve};
use crate::lcp::{Lemke, Outcome};
use crate::math::V3;
use crate::model::Model;
use crate::state::Motion;
use nalgebra::{Isometry3, Translation3};
use parry3d_f64::math::Pose;
use parry3d_f64::query;
use parry3d_f64::shape::SharedShape;
use terraglue_linear_solver::Tree;
use terraglue_robot_import::{Shape, ShapeGeometry};

/// Pairs that come nearer than this within the step are watched, m.
const MARGIN: f64 = 5e-3;
/// Overlap is taken back by this share per step, so that it cannot throw bodies apart.
const RECOVERY: f64 = 0.1;

struct Collider {
    body: usize,
    /// Pose against the centre of mass, in body axes.
    local: Isometry3<f64>,
    shape: SharedShape,
    radius: f64,
}

/// A constraint n·(v_b − v_a) + gap/h ≥ 0.
struct Constraint {
    bodies: [usize; 2],
    /// Rates of a and b → rate of the gap.
    rows: [[f64; 6]; 2],
    /// Gap over h, m/s.
    offset: f64,
}

/// All watched pairs and the constraints of the step.
pub(crate) struct SelfContact {
    colliders: Vec<Collider>,
    pairs: Vec<(usize, usize)>,
    constraints: Vec<Constraint>,
    /// Per constraint: its impulse in the last solve.
    impulses: Vec<f64>,
    offsets: Vec<f64>,
    delassus: Vec<f64>,
    /// K⁻¹·Jᵀ of each constraint, one after the other.
    responses: Vec<f64>,
    lemke: Lemke,
}

/// The shape for parry.
pub(crate) fn parry_shape(shape: &Shape) -> SharedShape {
    match shape.geometry {
        ShapeGeometry::Sphere { radius } => SharedShape::ball(radius),
        ShapeGeometry::Box { half_extents: [x, y, z] } => SharedShape::cuboid(x, y, z),
        // parry's axis is y, ours is z: see `parry_local`.
        ShapeGeometry::Cylinder { half_length, radius } => SharedShape::cylinder(half_length, radius),
        ShapeGeometry::Capsule { half_length, radius } => SharedShape::capsule_y(half_length, radius),
    }
}

/// Pose of the parry shape in the body frame: cylinders and capsules turn from z to y.
pub(crate) fn parry_local(shape: &Shape) -> Isometry3<f64> {
    match shape.geometry {
        ShapeGeometry::Cylinder { .. } | ShapeGeometry::Capsule { .. } => {
            let turn = nalgebra::UnitQuaternion::from_axis_angle(&V3::x_axis(), std::f64::consts::FRAC_PI_2);
            shape.body_from_shape * turn
        }
        _ => shape.body_from_shape,
    }
}

impl SelfContact {
    /// Chooses the pairs at the initial pose.
    pub fn new(model: &Model, bodies: &[Motion]) -> Self {
        let mut colliders = Vec::new();
        for (b, body) in model.bodies.iter().enumerate() {
            for shape in body.shapes.iter().filter(|s| s.collides) {
                let local = Translation3::from(-body.com) * parry_local(shape);
                let parry = parry_shape(shape);
                let radius = parry.compute_local_bounding_sphere().radius;
                colliders.push(Collider { body: b, local, shape: parry, radius });
            }
        }
        let mut me = Self {
            colliders,
            pairs: Vec::new(),
            constraints: Vec::new(),
            impulses: Vec::new(),
            offsets: Vec::new(),
            delassus: Vec::new(),
            responses: Vec::new(),
            lemke: Lemke::default(),
        };
        for i in 0..me.colliders.len() {
            for k in i + 1..me.colliders.len() {
                if me.may_meet(model, bodies, i, k) {
                    me.pairs.push((i, k));
                }
            }
        }
        me
    }

    fn may_meet(&self, model: &Model, bodies: &[Motion], i: usize, k: usize) -> bool {
        let (a, b) = (self.colliders[i].body, self.colliders[k].body);
        let neighbours =
            |a: usize, b: usize| model.joint_above[a].is_some_and(|j| model.joints[j].parent == Some(b));
        if a == b || neighbours(a, b) || neighbours(b, a) {
            return false;
        }
        let (p, q) = (self.pose(bodies, i), self.pose(bodies, k));
        let apart = query::distance(&p, &*self.colliders[i].shape, &q, &*self.colliders[k].shape);
        apart.is_ok_and(|d| d.distance > 0.0)
    }

    fn pose(&self, bodies: &[Motion], i: usize) -> Pose {
        let collider = &self.colliders[i];
        let m = &bodies[collider.body];
        (Isometry3::from_parts(Translation3::from(m.c), m.q) * collider.local).into()
    }

    /// Finds the constraints of a step of length h from the committed motion.
    pub fn detect(&mut self, bodies: &[Motion], h: f64) {
        self.constraints.clear();
        for p in 0..self.pairs.len() {
            let (i, k) = self.pairs[p];
            if let Some(c) = self.constraint(bodies, i, k, h) {
                self.constraints.push(c);
            }
        }
        self.impulses.clear();
        self.impulses.resize(self.constraints.len(), 0.0);
    }

    fn constraint(&self, bodies: &[Motion], i: usize, k: usize, h: f64) -> Option<Constraint> {
        let (a, b) = (&self.colliders[i], &self.colliders[k]);
        let (pose_a, pose_b) = (self.pose(bodies, i), self.pose(bodies, k));
        let (ma, mb) = (&bodies[a.body], &bodies[b.body]);
        let reach = MARGIN
            + 2.0 * h * (ma.v - mb.v).norm()
            + 2.0 * h * (ma.w.norm() * a.radius + mb.w.norm() * b.radius);
        let apart = (pose_a.translation - pose_b.translation).length();
        if apart > a.radius + b.radius + reach + a.local.translation.vector.norm() {
            return None;
        }
        let contact = query::contact(&pose_a, &*a.shape, &pose_b, &*b.shape, reach).ok()??;
        let vector = |v: parry3d_f64::math::Vector| V3::new(v.x, v.y, v.z);
        let n = vector(contact.normal1);
        let row = |motion: &Motion, point: V3, sign: f64| {
            let (force, moment) = (n * sign, (point - motion.c).cross(&n) * sign);
            [force.x, force.y, force.z, moment.x, moment.y, moment.z]
        };
        let gap = contact.dist;
        Some(Constraint {
            bodies: [a.body, b.body],
            rows: [row(ma, vector(contact.point1), -1.0), row(mb, vector(contact.point2), 1.0)],
            offset: if gap > 0.0 { gap / h } else { RECOVERY * gap / h },
        })
    }

    /// Adds the impulses that keep the constraints to a solution of the system. False: no solution was found.
    pub fn resolve(&mut self, solver: &Tree, body_at: &[usize], solution: &mut [f64]) -> bool {
        self.impulses.fill(0.0);
        let (m, n) = (self.constraints.len(), solution.len());
        if m == 0 {
            return true;
        }
        self.offsets.clear();
        self.offsets.extend(self.constraints.iter().map(|c| c.rate(body_at, solution) + c.offset));
        if self.offsets.iter().all(|w| *w >= 0.0) {
            return true;
        }
        self.fill_responses(solver, body_at, n);
        self.delassus.clear();
        for k in 0..m {
            let response = &self.responses[k * n..][..n];
            self.delassus.extend(self.constraints.iter().map(|c| c.rate(body_at, response)));
        }
        if !matches!(self.lemke.solve(&self.delassus, &self.offsets, &mut self.impulses), Outcome::Solved(_))
        {
            return false;
        }
        for (k, impulse) in self.impulses.iter().enumerate().filter(|(_, i)| **i > 0.0) {
            solution.iter_mut().zip(&self.responses[k * n..]).for_each(|(s, r)| *s += impulse * r);
        }
        true
    }

    fn fill_responses(&mut self, solver: &Tree, body_at: &[usize], n: usize) {
        self.responses.clear();
        self.responses.resize(self.constraints.len() * n, 0.0);
        for (c, response) in self.constraints.iter().zip(self.responses.chunks_exact_mut(n)) {
            for (body, row) in c.bodies.iter().zip(&c.rows) {
                response[body_at[*body]..][..6].copy_from_slice(row);
            }
            solver.substitute(response);
        }
    }

    /// Whether own bodies pressed on each other in the last solve.
    pub fn pressing(&self) -> bool {
        self.impulses.iter().any(|i| *i > 0.0)
    }

    /// Takes the pressing contacts into account in a compliance matrix g = P·K⁻¹·Pᵀ (n × n): they hold within
    /// the step, so g loses g_ps·D_ss⁻¹·g_sp. `rate(p, v)` is row p of P applied to v.
    pub fn stiffen(
        &self,
        n: usize,
        g: &mut [f64],
        unknowns: usize,
        rate: &dyn Fn(usize, &[f64]) -> f64,
        scratch: &mut Vec<f64>,
    ) {
        let active = || (0..self.impulses.len()).filter(|k| self.impulses[*k] > 0.0);
        let (m, count) = (self.constraints.len(), active().count());
        // D_ss, then the columns g_sp and D_ss⁻¹·g_sp, one pair for each port component.
        scratch.clear();
        for c in active() {
            // A little compliance, as redundant contacts between two bodies would need.
            let compliance = 1e-12 * self.delassus[c * m + c];
            scratch
                .extend(active().map(|r| self.delassus[c * m + r] + if r == c { compliance } else { 0.0 }));
        }
        if !cholesky(count, scratch) {
            return;
        }
        for p in 0..n {
            for _ in 0..2 {
                scratch.extend(active().map(|s| rate(p, &self.responses[s * unknowns..][..unknowns])));
            }
            let (factor, column) = scratch.split_at_mut(count * count + (2 * p + 1) * count);
            cholesky_solve(count, &factor[..count * count], column);
        }
        let column = |k: usize| &scratch[count * count + k * count..][..count];
        for c in 0..n {
            for r in 0..n {
                let loss = column(2 * r).iter().zip(column(2 * c + 1));
                g[c * n + r] -= loss.map(|(a, b)| a * b).sum::<f64>();
            }
        }
    }
}

impl Constraint {
    fn rate(&self, body_at: &[usize], v: &[f64]) -> f64 {
        let part = |k: usize| {
            let at = body_at[self.bodies[k]];
            self.rows[k].iter().zip(&v[at..at + 6]).map(|(r, v)| r * v).sum::<f64>()
        };
        part(0) + part(1)
    }
}
