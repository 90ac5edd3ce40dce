//! The outline of a shape seen from above, and the part of a lattice cell that it covers.

use crate::Surface;
use crate::coverage::{MOST_CORNERS, disc_in_rectangle, polygon_in_rectangle};
use crate::math::point;
use crate::shape::{Aabb, Placed};
use terraglue_subsystem::Geometry;

/// Sub-samples along each side of a cell at the edge of an outline without closed form.
pub(crate) const SAMPLES: i32 = 8;

/// Outline of a shape seen from above.
pub(crate) enum Outline {
    /// Centre and radius.
    Disc([f64; 2], f64),
    /// Corners, counter-clockwise.
    Polygon(Polygon),
    /// By asking the shape point by point.
    Sampled,
}

/// Slopes below are level: which way rounding inclines them must not be seen.
const LEVEL: f64 = 1e-9;

/// Whether the underside, which is at `point` above node (i, j), comes nearer to the surface than `margin` above one of the next nodes
/// on its way down.
pub(crate) fn reaches_beside<S: Surface + ?Sized>(
    shape: &Placed,
    surface: &S,
    margin: f64,
    [i, j]: [i32; 2],
    point: [f64; 3],
) -> bool {
    let lattice = surface.lattice();
    let slope = shape.underside_slope(point);
    let [a, b] = slope.map(|s| if s > LEVEL { -1 } else { i32::from(s < -LEVEL) });
    [[a, 0], [0, b], [a, b]].iter().any(|[di, dj]| {
        if (*di, *dj) == (0, 0) || !lattice.has(i + di, j + dj) {
            return false;
        }
        let [x, y] = lattice.position(i + di, j + dj);
        let reach = surface.height(i + di, j + dj) + margin;
        // a convex body lies above its tangent plane
        let tangent = point[2] + slope[0] * (x - point[0]) + slope[1] * (y - point[1]);
        tangent < reach && shape.lower(x, y).is_some_and(|lower| lower < reach)
    })
}

/// A square of side 2·half around a node.
pub(crate) struct Cell {
    pub at: [f64; 2],
    pub half: f64,
}

impl Cell {
    fn low(&self) -> [f64; 2] {
        self.at.map(|c| c - self.half)
    }

    fn high(&self) -> [f64; 2] {
        self.at.map(|c| c + self.half)
    }

    pub fn area(&self) -> f64 {
        4.0 * self.half * self.half
    }

    /// Its four corners.
    pub fn corners(&self) -> [[f64; 2]; 4] {
        let (low, high) = (self.low(), self.high());
        [[low[0], low[1]], [high[0], low[1]], [low[0], high[1]], [high[0], high[1]]]
    }

    /// Whether a box lies above or below some of it.
    pub fn meets(&self, bounds: &Aabb) -> bool {
        (0..2).all(|k| bounds.min[k] <= self.at[k] + self.half && bounds.max[k] >= self.at[k] - self.half)
    }

    /// Places of the sample points from the node, row by row.
    pub fn samples(&self) -> impl Iterator<Item = [f64; 2]> {
        let (step, half) = (2.0 * self.half / f64::from(SAMPLES), self.half);
        let offset = move |k: i32| (f64::from(k) + 0.5) * step - half;
        (0..SAMPLES * SAMPLES).map(move |k| [offset(k % SAMPLES), offset(k / SAMPLES)])
    }

    /// Whether the shape covers all corners and so, being convex, the whole cell.
    fn inside(&self, shape: &Placed) -> bool {
        self.corners().iter().all(|c| shape.lower(c[0], c[1]).is_some())
    }

    /// Distance of the corner farthest from a point, m.
    fn farthest(&self, p: [f64; 2]) -> f64 {
        let [x, y] = [0, 1].map(|k| (self.at[k] - p[k]).abs() + self.half);
        (x * x + y * y).sqrt()
    }

    /// Covered part by sample points, and the point of the underside at the covered one nearest to the node.
    fn sample(&self, shape: &Placed) -> (f64, [f64; 3]) {
        let (mut count, mut nearest, mut point) = (0, f64::INFINITY, [self.at[0], self.at[1], f64::INFINITY]);
        for [dx, dy] in self.samples() {
            let (x, y) = (self.at[0] + dx, self.at[1] + dy);
            if let Some(z) = shape.lower(x, y) {
                count += 1;
                let distance = dx * dx + dy * dy;
                if closer([distance, z], [nearest, point[2]]) {
                    (nearest, point) = (distance, [x, y, z]);
                }
            }
        }
        (f64::from(count) / f64::from(SAMPLES * SAMPLES), point)
    }
}

/// Whether a sample point, by its squared distance from the node and its height, stands for the cell before another: of four that
/// are equally near, that which lies lowest, whichever of them comes first.
pub(crate) fn closer([distance, z]: [f64; 2], [nearest, lowest]: [f64; 2]) -> bool {
    let tie = 1e-9 * distance;
    distance < nearest - tie || distance < nearest + tie && z < lowest
}

impl Outline {
    pub fn of(shape: &Placed) -> Self {
        let centre = [shape.pose().position[0], shape.pose().position[1]];
        let upright = shape.rotation().0[2][2].abs() > 1.0 - 1e-14;
        match shape.geometry() {
            Geometry::Sphere { radius } => Self::Disc(centre, *radius),
            Geometry::Cylinder { radius, .. } | Geometry::Capsule { radius, .. } if upright => {
                Self::Disc(centre, *radius)
            }
            Geometry::Cylinder { half_length, radius } => rounded_outline(shape, *half_length, *radius, true),
            Geometry::Capsule { half_length, radius } => rounded_outline(shape, *half_length, *radius, false),
            Geometry::Box { half_extents } => box_outline(shape, *half_extents),
            Geometry::ConvexMesh { points, .. } if shape.is_convex() => mesh_outline(shape, points),
            _ => Self::Sampled,
        }
    }

    /// Covered area and point of the lower surface of a node that is covered, and lower than `reach` or `beside` one that is.
    /// The area, which costs most, is computed last.
    pub fn node(
        &self,
        shape: &Placed,
        cell: &Cell,
        reach: f64,
        beside: impl FnOnce([f64; 3]) -> bool,
    ) -> Option<(f64, [f64; 3])> {
        let hit = shape.lower(cell.at[0], cell.at[1]);
        let (point, sampled) = match (hit, self) {
            (_, Self::Disc(centre, radius)) if at_rim(shape, cell, *centre, *radius) => {
                (below_rim(shape, cell, *centre, *radius), None)
            }
            (Some(lower), _) => ([cell.at[0], cell.at[1], lower], None),
            // A node on the edge itself, by rounding.
            (None, Self::Disc(centre, radius)) => (below_rim(shape, cell, *centre, *radius), None),
            (None, Self::Polygon(polygon)) => {
                let [x, y] = polygon.nearest(cell.at);
                ([x, y, shape.lower(x, y)?], None)
            }
            (None, Self::Sampled) => {
                let (share, nearest) = cell.sample(shape);
                (nearest, Some(share))
            }
        };
        if point[2] >= reach && !beside(point) {
            return None;
        }
        let share = match sampled {
            Some(share) => share,
            None => self.share(shape, cell),
        };
        // Slivers of rounding are no contact.
        (share > 1e-12).then(|| (share * cell.area(), point))
    }

    /// Covered part of a cell, 0 … 1.
    fn share(&self, shape: &Placed, cell: &Cell) -> f64 {
        match self {
            Self::Disc(centre, radius) if cell.farthest(*centre) <= *radius => 1.0,
            Self::Disc(centre, radius) => {
                disc_in_rectangle(*centre, *radius, cell.low(), cell.high()) / cell.area()
            }
            _ if cell.inside(shape) => 1.0,
            Self::Polygon(polygon) => {
                polygon_in_rectangle(polygon.corners(), cell.low(), cell.high()) / cell.area()
            }
            Self::Sampled => cell.sample(shape).0,
        }
    }
}

/// Part of the radius that a round underside's rim is drawn in: closer to its widest circle the underside is a wall, and
/// its height at a node says nothing about the soil there. It bounds the effect of a rounding error of the position on a
/// stiff soil (the slope at this rim is 32).
const RIM: f64 = 5e-4;

/// Underside at the rim of a disc on the ray to a node, as far below the shape's origin at every node.
fn below_rim(shape: &Placed, cell: &Cell, centre: [f64; 2], radius: f64) -> [f64; 3] {
    let (dx, dy) = (cell.at[0] - centre[0], cell.at[1] - centre[1]);
    let round = radius * (RIM * (2.0 - RIM)).sqrt();
    let (inwards, below) = match shape.geometry() {
        Geometry::Cylinder { half_length, .. } => (1.0, *half_length),
        Geometry::Capsule { half_length, .. } => (1.0 - RIM, half_length + round),
        _ => (1.0 - RIM, round),
    };
    let s = inwards * radius / (dx * dx + dy * dy).sqrt();
    [centre[0] + s * dx, centre[1] + s * dy, shape.pose().position[2] - below]
}

/// Whether a node lies so near the widest circle of a round underside, or outside it, that the rim stands for it.
fn at_rim(shape: &Placed, cell: &Cell, centre: [f64; 2], radius: f64) -> bool {
    let (dx, dy) = (cell.at[0] - centre[0], cell.at[1] - centre[1]);
    let flat = matches!(shape.geometry(), Geometry::Cylinder { .. });
    let rim = if flat { radius } else { (1.0 - RIM) * radius };
    dx * dx + dy * dy > rim * rim
}

/// Corners of an outline, counter-clockwise.
pub(crate) struct Polygon {
    points: [[f64; 2]; MOST_CORNERS],
    count: usize,
    /// Share of the way to the middle by which points of the edge are drawn inwards to lie below the shape.
    inwards: f64,
}

/// Points of half an ellipse, both ends counted.
const HALF: usize = MOST_CORNERS / 2;

impl Polygon {
    fn corners(&self) -> &[[f64; 2]] {
        &self.points[..self.count]
    }

    /// The point of the edge nearest to p, drawn a little towards the middle.
    fn nearest(&self, p: [f64; 2]) -> [f64; 2] {
        let (mut best, mut distance, mut middle) = (p, f64::INFINITY, [0.0; 2]);
        let corners = self.corners();
        for (k, a) in corners.iter().enumerate() {
            let b = corners[(k + 1) % corners.len()];
            let (ex, ey) = (b[0] - a[0], b[1] - a[1]);
            let length2 = ex * ex + ey * ey;
            let along = (p[0] - a[0]) * ex + (p[1] - a[1]) * ey;
            let s = if length2 > 0.0 { (along / length2).clamp(0.0, 1.0) } else { 0.0 };
            let q = [a[0] + s * ex, a[1] + s * ey];
            let d2 = (q[0] - p[0]) * (q[0] - p[0]) + (q[1] - p[1]) * (q[1] - p[1]);
            if d2 < distance {
                (best, distance) = (q, d2);
            }
            middle = [middle[0] + a[0], middle[1] + a[1]];
        }
        let n = corners.len().max(1) as f64;
        std::array::from_fn(|k| best[k] + self.inwards * (middle[k] / n - best[k]))
    }
}

/// Outline of a cylinder or capsule that does not stand: two ellipses, the discs at its ends seen from above, and the area
/// between them. The polygon has their area.
fn rounded_outline(shape: &Placed, half_length: f64, radius: f64, flat: bool) -> Outline {
    let (centre, axis) = (shape.pose().position, shape.rotation().0[2]);
    let level = libm::hypot(axis[0], axis[1]);
    let e = [axis[0] / level, axis[1] / level];
    // semi-axes of the ends along the axis and across it
    let along = if flat { radius * axis[2].abs() } else { radius };
    let mut polygon = Polygon { points: [[0.0; 2]; MOST_CORNERS], count: 0, inwards: RIM };
    let mut add = |a: f64, c: f64| {
        polygon.points[polygon.count] = [centre[0] + a * e[0] - c * e[1], centre[1] + a * e[1] + c * e[0]];
        polygon.count += 1;
    };
    let end = half_length * level;
    if along < LEAST * radius {
        for (a, c) in [(1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0)] {
            add(a * end, c * radius);
        }
        return Outline::Polygon(polygon);
    }
    let step = std::f64::consts::PI / (HALF - 1) as f64;
    let wider = (step / libm::sin(step)).sqrt();
    for side in [1.0, -1.0] {
        for k in 0..HALF {
            let (s, c) = libm::sincos(step * k as f64);
            add(side * (end + wider * along * s), -side * wider * radius * c);
        }
    }
    // its corners lie outside of the shape by so much
    polygon.inwards = 1.2 * (wider - 1.0);
    Outline::Polygon(polygon)
}

/// Directions in which the corners of a mesh are searched.
const DIRECTIONS: usize = 32;

/// Hull of the corners of a convex mesh that lie farthest in each of 32 horizontal directions: all its corners seen from above but
/// those at which the outline turns by less than 11°, where it lies inside by at most 0.5 % of its width.
fn mesh_outline(shape: &Placed, corners: &[[f64; 3]]) -> Outline {
    let directions: [[f64; 2]; DIRECTIONS] = std::array::from_fn(|k| {
        let (s, c) = libm::sincos(std::f64::consts::TAU * k as f64 / DIRECTIONS as f64);
        [c, s]
    });
    let mut farthest = [([0.0; 2], f64::NEG_INFINITY); DIRECTIONS];
    for corner in corners {
        let turned = shape.rotation().to_world(*corner);
        for ([c, s], (place, reach)) in directions.iter().zip(&mut farthest) {
            let here = turned[0] * c + turned[1] * s;
            if here > *reach {
                (*place, *reach) = ([turned[0], turned[1]], here);
            }
        }
    }
    let centre = shape.pose().position;
    let mut polygon = Polygon { points: [[0.0; 2]; MOST_CORNERS], count: 0, inwards: 1e-9 };
    let mut before = farthest[DIRECTIONS - 1].0;
    for (place, _) in farthest {
        if place != before {
            polygon.points[polygon.count] = [centre[0] + place[0], centre[1] + place[1]];
            polygon.count += 1;
        }
        before = place;
    }
    Outline::Polygon(polygon)
}

/// Smaller ends of a lying cylinder, in radii, are straight.
const LEAST: f64 = 1e-9;

/// Hull of the eight corners seen from above (Andrew's monotone chain, 1979), in place.
fn box_outline(shape: &Placed, half: [f64; 3]) -> Outline {
    let mut corners: [[f64; 2]; 8] = std::array::from_fn(|k| {
        let sign = |bit: usize| if k >> bit & 1 == 1 { 1.0 } else { -1.0 };
        let p = point(shape.pose(), shape.rotation(), [0, 1, 2].map(|c| sign(c) * half[c]));
        [p[0], p[1]]
    });
    corners.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let mut hull = [[0.0; 2]; 18];
    let mut count = 0;
    let turn =
        |a: [f64; 2], b: [f64; 2], c: [f64; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    for pass in 0..2 {
        let start = count;
        for k in 0..8 {
            let p = if pass == 0 { corners[k] } else { corners[7 - k] };
            while count >= start + 2 && turn(hull[count - 2], hull[count - 1], p) <= 0.0 {
                count -= 1;
            }
            hull[count] = p;
            count += 1;
        }
        // The last corner of each half is the first of the other.
        count -= 1;
    }
    let count = count.min(8);
    let mut points = [[0.0; 2]; MOST_CORNERS];
    points[..count].copy_from_slice(&hull[..count]);
    Outline::Polygon(Polygon { points, count, inwards: 1e-9 })
}
