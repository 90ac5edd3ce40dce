//! Points, pins and loads of planar bodies with their derivatives.

use crate::dense::Dense;
use crate::scheme::Coordinate;
use terraglue_subsystem::{Config, Error, Result};

/// A material point of a body; coordinates 3·body + (0, 1, 2) are x, y, θ.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    /// Body.
    pub body: usize,
    /// Place in the body's frame, m.
    pub local: [f64; 2],
}

impl Point {
    /// The place in the body of the point `world`.
    pub fn local(body: usize, world: [f64; 2], q: impl Fn(usize) -> f64) -> [f64; 2] {
        let (s, c) = libm::sincos(q(3 * body + 2));
        let d = [world[0] - q(3 * body), world[1] - q(3 * body + 1)];
        [c * d[0] + s * d[1], c * d[1] - s * d[0]]
    }

    /// From the centre of mass to the point, world axes.
    pub fn arm(&self, q: impl Fn(usize) -> f64) -> [f64; 2] {
        let (s, c) = libm::sincos(q(3 * self.body + 2));
        [c * self.local[0] - s * self.local[1], s * self.local[0] + c * self.local[1]]
    }

    /// World place.
    pub fn place(&self, q: impl Fn(usize) -> f64) -> [f64; 2] {
        let arm = self.arm(&q);
        [q(3 * self.body) + arm[0], q(3 * self.body + 1) + arm[1]]
    }

    /// Adds a force at the point to the right-hand side and its change with θ to the matrix (residual form:
    /// the matrix holds −d(force)/dq·q1).
    pub fn force(&self, q: impl Fn(usize) -> f64, f: [f64; 2], q1: f64, kkt: &mut Dense, right: &mut [f64]) {
        let (arm, at) = (self.arm(q), 3 * self.body);
        right[at] += f[0];
        right[at + 1] += f[1];
        right[at + 2] += f[1] * arm[0] - f[0] * arm[1];
        // d(arm)/dθ = (−arm_y, arm_x)
        kkt.add(at + 2, at + 2, q1 * (f[1] * arm[1] + f[0] * arm[0]));
    }
}

/// Two points that stay together; the second may be fixed in the world.
#[derive(Clone, Copy, Debug)]
pub struct Pin {
    a: Point,
    b: Option<Point>,
    world: [f64; 2],
}

impl Pin {
    /// a − b.
    pub fn gap(&self, q: impl Fn(usize) -> f64) -> [f64; 2] {
        let a = self.a.place(&q);
        let b = self.b.map_or(self.world, |b| b.place(&q));
        [a[0] - b[0], a[1] - b[1]]
    }

    /// Second derivative of the gap.
    pub fn acceleration(
        &self,
        q: impl Fn(usize) -> f64,
        v: impl Fn(usize) -> f64,
        x: impl Fn(usize) -> f64,
    ) -> [f64; 2] {
        let of = |p: &Point| {
            let (arm, at) = (p.arm(&q), 3 * p.body);
            let (w, alpha) = (v(at + 2), x(at + 2));
            [x(at) - alpha * arm[1] - w * w * arm[0], x(at + 1) + alpha * arm[0] - w * w * arm[1]]
        };
        let (a, b) = (of(&self.a), self.b.as_ref().map_or([0.0; 2], of));
        [a[0] - b[0], a[1] - b[1]]
    }

    /// Φ_q and its transpose, and the force of λ with its change.
    pub fn assemble(
        &self,
        q: impl Fn(usize) -> f64,
        lambda: [f64; 2],
        q1: f64,
        row: usize,
        kkt: &mut Dense,
        right: &mut [f64],
    ) {
        for (point, sign) in [(Some(self.a), 1.0), (self.b, -1.0)] {
            let Some(point) = point else { continue };
            let (arm, at) = (point.arm(&q), 3 * point.body);
            let columns = [[sign, 0.0, -sign * arm[1]], [0.0, sign, sign * arm[0]]];
            for (k, entries) in columns.iter().enumerate() {
                for (j, entry) in entries.iter().enumerate() {
                    kkt.add(row + k, at + j, *entry);
                    kkt.add(at + j, row + k, *entry);
                }
            }
            // M·q̈ + Φ_qᵀ·λ = Q: λ acts as −λ on the first point
            point.force(&q, lambda.map(|l| -sign * l), q1, kkt, right);
        }
    }
}

/// A spring from a point to a place in the world.
#[derive(Clone, Copy, Debug)]
struct Spring {
    point: Point,
    anchor: [f64; 2],
    stiffness: f64,
    rest: f64,
}

/// Constant data of the run.
#[derive(Clone, Debug)]
pub struct Mechanism {
    /// Masses, kg.
    pub mass: Vec<f64>,
    moment: Vec<f64>,
    gravity: [f64; 2],
    /// Pins.
    pub pins: Vec<Pin>,
    springs: Vec<Spring>,
    torques: Vec<(usize, f64)>,
}

impl Mechanism {
    /// Mass or moment of inertia of coordinate i.
    pub fn inertia(&self, i: usize) -> f64 {
        if i % 3 == 2 { self.moment[i / 3] } else { self.mass[i / 3] }
    }

    /// Adds gravity, torques and springs.
    pub fn loads(&self, q: impl Fn(usize) -> f64, q1: f64, kkt: &mut Dense, right: &mut [f64]) {
        for (body, mass) in self.mass.iter().enumerate() {
            right[3 * body] += mass * self.gravity[0];
            right[3 * body + 1] += mass * self.gravity[1];
        }
        for (body, torque) in &self.torques {
            right[3 * body + 2] += torque;
        }
        for s in &self.springs {
            let place = s.point.place(&q);
            let d = [s.anchor[0] - place[0], s.anchor[1] - place[1]];
            let length = (d[0] * d[0] + d[1] * d[1]).sqrt();
            let pull = s.stiffness * (1.0 - s.rest / length);
            s.point.force(&q, d.map(|d| pull * d), q1, kkt, right);
            // stiffness of the spring in the point's own motion: along e fully, across by the pull
            let (arm, at) = (s.point.arm(&q), 3 * s.point.body);
            let j = [[1.0, 0.0, -arm[1]], [0.0, 1.0, arm[0]]];
            let e = d.map(|d| d / length);
            for r in 0..3 {
                for c in 0..3 {
                    let mut sum = 0.0;
                    for a in 0..2 {
                        for b in 0..2 {
                            let along = (s.stiffness - pull) * e[a] * e[b] + if a == b { pull } else { 0.0 };
                            sum += j[a][r] * along * j[b][c];
                        }
                    }
                    kkt.add(at + r, at + c, q1 * sum);
                }
            }
        }
    }

    /// Potential energy, J.
    pub fn potential(&self, q: impl Fn(usize) -> f64) -> f64 {
        let gravity: f64 = (self.mass.iter().enumerate())
            .map(|(b, m)| -m * (self.gravity[0] * q(3 * b) + self.gravity[1] * q(3 * b + 1)))
            .sum();
        let springs: f64 = (self.springs.iter())
            .map(|s| {
                let place = s.point.place(&q);
                let d = [s.anchor[0] - place[0], s.anchor[1] - place[1]];
                let stretch = (d[0] * d[0] + d[1] * d[1]).sqrt() - s.rest;
                0.5 * s.stiffness * stretch * stretch
            })
            .sum();
        let torques: f64 = self.torques.iter().map(|(b, torque)| -torque * q(3 * b + 2)).sum();
        gravity + springs + torques
    }
}

/// The mechanism and its state at the start.
pub fn read_mechanism(config: &Config, gravity: [f64; 3]) -> Result<(Mechanism, Vec<Coordinate>)> {
    let (mass, moment) = (config.numbers("mass_kg")?, config.numbers("inertia_kg_m2")?);
    let (pose, mut rate) = (config.numbers("pose")?, config.numbers("rate")?);
    let n = mass.len();
    rate.resize(3 * n, 0.0);
    if moment.len() != n || pose.len() != 3 * n {
        return Err(Error::Refused(format!("{n} masses need {n} inertias and {} numbers in `pose`", 3 * n)));
    }
    let now: Vec<Coordinate> =
        pose.iter().zip(&rate).map(|(q, v)| Coordinate { q: *q, v: *v, ..Coordinate::default() }).collect();
    let q = |i: usize| pose[i];
    let body = |x: f64| {
        let known = x >= 0.0 && (x as usize) < n;
        if known { Ok(x as usize) } else { Err(Error::Refused(format!("there is no body {x}"))) }
    };
    let point = |x: f64, world: [f64; 2]| {
        let body = body(x)?;
        Ok::<_, Error>(Point { body, local: Point::local(body, world, q) })
    };
    let mut pins = Vec::new();
    for p in config.numbers("pins")?.chunks_exact(4) {
        let world = [p[2], p[3]];
        let b = if p[1] < 0.0 { None } else { Some(point(p[1], world)?) };
        pins.push(Pin { a: point(p[0], world)?, b, world });
    }
    let mut springs = Vec::new();
    for s in config.numbers("spring")?.chunks_exact(7) {
        let point = point(s[0], [s[1], s[2]])?;
        springs.push(Spring { point, anchor: [s[3], s[4]], stiffness: s[5], rest: s[6] });
    }
    let mut torques = Vec::new();
    for t in config.numbers("torque")?.chunks_exact(2) {
        torques.push((body(t[0])?, t[1]));
    }
    Ok((Mechanism { mass, moment, gravity: [gravity[0], gravity[1]], pins, springs, torques }, now))
}
