//! Hits of a ray, by looking at every shape.

use crate::draw::Piece;
use terraglue_numerics::rotation::{Vector, conjugate, cross, dot, length, minus, plus, turned};
use terraglue_subsystem::{GROUND, Geometry, Pose, Ray, RayHit, SceneShape, ShapeRef};

/// A ray that gets no deeper into a shape than this, or passes it no farther away, m, grazes it: hit or miss is undecided.
const GRAZING: f64 = 1e-8;

/// Heights on a lattice, x fastest; the cells between four of them are two triangles that share the diagonal from (i + 1, j) to (i, j + 1).
#[derive(Clone, Debug)]
pub struct Heights {
    /// World x, y of node (0, 0), m.
    pub origin: [f64; 2],
    /// Distance of neighbouring nodes, m.
    pub spacing: f64,
    /// Number of nodes along x and y.
    pub size: [u32; 2],
    /// m; not a number: no ground.
    pub values: Vec<f64>,
}

impl Heights {
    /// Height of node (i, j), m.
    pub fn at(&self, i: u32, j: u32) -> f64 {
        self.values[(j * self.size[0] + i) as usize]
    }

    /// A node in the world, m.
    pub fn point(&self, i: u32, j: u32) -> Vector {
        let place = |k: usize, n: u32| self.origin[k] + f64::from(n) * self.spacing;
        [place(0, i), place(1, j), self.at(i, j)]
    }

    /// All triangles of the surface.
    pub fn triangles(&self) -> impl Iterator<Item = [Vector; 3]> + '_ {
        let cells = (0..self.size[1] - 1).flat_map(|j| (0..self.size[0] - 1).map(move |i| (i, j)));
        cells.flat_map(|(i, j)| {
            let [a, b, c, d] =
                [(i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1)].map(|(i, j)| self.point(i, j));
            let whole = [a, b, c, d].iter().all(|p| p[2].is_finite());
            whole.then_some([[a, b, c], [b, d, c]]).into_iter().flatten()
        })
    }
}

/// Something that a ray meets.
#[derive(Clone, Copy, Debug)]
pub struct Candidate {
    /// What.
    pub shape: ShapeRef,
    /// How far away, m; ∞: it is missed.
    pub distance: f64,
    /// How deep the ray gets into it, or how far it passes by, m: below some 1e-8 it is undecided which.
    pub depth: f64,
}

/// Everything that a ray meets or nearly meets, with the grounds of the subsystems that are named by number.
pub fn naive(pieces: &[Piece], grounds: &[(u32, &Heights)], ray: &Ray) -> Vec<Candidate> {
    let mut found = Vec::new();
    let share = (ray.time - crate::STEP[0]) / (crate::STEP[1] - crate::STEP[0]);
    for (subsystem, piece) in (0..).zip(pieces) {
        for shape in &piece.scene.shapes {
            let body = shape.body as usize;
            let at = between(&piece.before[body].world_from_body, &piece.after[body].world_from_body, share);
            let of = ShapeRef { subsystem, body: shape.body, shape: shape.id };
            let (distance, depth) = meet(shape, &at, ray);
            found.push(Candidate { shape: of, distance, depth });
        }
    }
    for (subsystem, heights) in grounds {
        let distance = heights
            .triangles()
            .map(|t| triangle(&t, ray.origin, ray.direction))
            .fold(f64::INFINITY, f64::min);
        let shape = ShapeRef { subsystem: *subsystem, body: GROUND, shape: GROUND };
        found.push(Candidate { shape, distance, depth: f64::INFINITY });
    }
    found.iter_mut().filter(|c| c.distance > ray.range).for_each(|c| c.distance = f64::INFINITY);
    found.retain(|c| c.distance < f64::INFINITY || c.depth < GRAZING);
    found
}

/// Whether an answer is right: the nearest distance to 1e-5 or 10 µm, and something that is there. None: undecided, the ray grazes
/// something.
pub fn is_right(hit: &RayHit, candidates: &[Candidate]) -> Option<bool> {
    let nearest = candidates.iter().map(|c| c.distance).fold(f64::INFINITY, f64::min);
    let close = |a: f64, b: f64| a == b || (a - b).abs() <= tolerance(b);
    let of = ShapeRef { subsystem: hit.subsystem, body: hit.body, shape: hit.shape };
    let there = |c: &Candidate| c.shape == of && close(c.distance, nearest);
    let right = close(hit.distance, nearest) && (!hit.is_hit() || candidates.iter().any(there));
    (right || !candidates.iter().any(|c| c.depth < GRAZING)).then_some(right)
}

/// How far a distance may be off, m.
pub fn tolerance(distance: f64) -> f64 {
    1e-5_f64.max(1e-5 * distance)
}

/// On a straight line, along the shorter great circle of the quaternions: K. Shoemake, "Animating Rotation with Quaternion
/// Curves" (1985).
fn between(a: &Pose, b: &Pose, share: f64) -> Pose {
    let position = std::array::from_fn(|k| (1.0 - share) * a.position[k] + share * b.position[k]);
    let (p, q) = (a.orientation, b.orientation);
    let cosine: f64 = (0..4).map(|k| p[k] * q[k]).sum();
    let (cosine, sign) = (cosine.abs().min(1.0), if cosine < 0.0 { -1.0 } else { 1.0 });
    let angle = libm::acos(cosine);
    let orientation = if angle < 1e-9 {
        p
    } else {
        let [u, v] = [(1.0 - share) * angle, share * angle].map(|x| libm::sin(x) / libm::sin(angle));
        std::array::from_fn(|k| u * p[k] + sign * v * q[k])
    };
    Pose { position, orientation }
}

/// A point of the outer frame in that of a pose.
fn inward(pose: &Pose, p: Vector) -> Vector {
    turned(conjugate(pose.orientation), minus(p, pose.position))
}

fn meet(shape: &SceneShape, world_from_body: &Pose, ray: &Ray) -> (f64, f64) {
    let origin = inward(&shape.body_from_shape, inward(world_from_body, ray.origin));
    let back = |pose: &Pose, v| turned(conjugate(pose.orientation), v);
    let direction = back(&shape.body_from_shape, back(world_from_body, ray.direction));
    match &shape.geometry {
        Geometry::Mesh { points, triangles } | Geometry::ConvexMesh { points, triangles } => {
            let corners = triangles.iter().map(|t| t.map(|k| points[k as usize]));
            (corners.map(|t| triangle(&t, origin, direction)).fold(f64::INFINITY, f64::min), f64::INFINITY)
        }
        convex => search(convex, origin, direction),
    }
}

/// How far a point is outside, in no particular measure: negative inside, convex, 0 on the surface.
fn outside(geometry: &Geometry, p: Vector) -> f64 {
    let across = (p[0] * p[0] + p[1] * p[1]).sqrt();
    match geometry {
        Geometry::Sphere { radius } => length(p) - radius,
        Geometry::Box { half_extents: h } => (0..3).map(|k| p[k].abs() - h[k]).fold(f64::MIN, f64::max),
        Geometry::Capsule { half_length, radius } => {
            let along = (p[2].abs() - half_length).max(0.0);
            (across * across + along * along).sqrt() - radius
        }
        Geometry::Cylinder { half_length, radius } => (across - radius).max(p[2].abs() - half_length),
        Geometry::ConeFrustum { half_length, radius_bottom, radius_top } => {
            let up = 0.5 + 0.5 * p[2] / half_length;
            let radius = radius_bottom * (1.0 - up) + radius_top * up;
            (across - radius).max(p[2].abs() - half_length)
        }
        Geometry::Ellipsoid { semi_axes: a } => {
            let smallest = a.iter().fold(f64::MAX, |m, x| m.min(*x));
            smallest * (length(std::array::from_fn(|k| p[k] / a[k])) - 1.0)
        }
        Geometry::Mesh { .. } | Geometry::ConvexMesh { .. } => f64::NAN,
    }
}

/// Distance along a line to a convex shape around the origin, and how deep the line gets into it or how far it passes by.
fn search(geometry: &Geometry, origin: Vector, direction: Vector) -> (f64, f64) {
    let reach = 4.0;
    // from the point nearest to the middle: the shape lies within the reach of it
    let shift = -dot(origin, direction);
    let near = plus(origin, direction.map(|x| shift * x));
    let start = (-shift).max(-reach);
    if length(near) > reach || start > reach {
        return (f64::INFINITY, f64::INFINITY);
    }
    let at = |s: f64| outside(geometry, plus(near, direction.map(|x| s * x)));
    let deepest = lowest(start, reach, &at);
    let depth = at(deepest).abs().min(at(start).abs());
    let crossing = match (at(start) <= 0.0, at(deepest) <= 0.0) {
        (true, _) => Some(bisect([start, reach], &|s| -at(s))),
        (false, true) => Some(bisect([start, deepest], &at)),
        (false, false) => None,
    };
    (crossing.map_or(f64::INFINITY, |s| s + shift), depth)
}

/// Where a convex function is lowest, by thirds.
fn lowest(mut low: f64, mut high: f64, f: &dyn Fn(f64) -> f64) -> f64 {
    for _ in 0..100 {
        let third = (high - low) / 3.0;
        let (a, b) = (low + third, high - third);
        if f(a) <= 0.0 {
            return a;
        }
        if f(a) < f(b) { high = b } else { low = a }
    }
    0.5 * (low + high)
}

/// Where a function that is positive at the first end falls to 0.
fn bisect([mut above, mut below]: [f64; 2], f: &dyn Fn(f64) -> f64) -> f64 {
    for _ in 0..80 {
        let middle = 0.5 * (above + below);
        if f(middle) > 0.0 { above = middle } else { below = middle }
    }
    0.5 * (above + below)
}

/// Distance along a line to a triangle, from both sides, by Cramer's rule for a + u·(b − a) + v·(c − a) = o + t·d.
fn triangle([a, b, c]: &[Vector; 3], o: Vector, d: Vector) -> f64 {
    let (e, f, g) = (minus(*b, *a), minus(*c, *a), minus(o, *a));
    let p = cross(d, f);
    let whole = dot(e, p);
    let q = cross(g, e);
    let (u, v, t) = (dot(g, p) / whole, dot(d, q) / whole, dot(f, q) / whole);
    if u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= 0.0 { t } else { f64::INFINITY }
}
