//! Of the many points of a large contact those that carry it: the deepest one and the outermost in eight directions.
//!
//! A foot on a mesh of centimetres touches hundreds of triangles; a rigid body needs three points of one plane.

use crate::math::{V3, frame_of_normal};

/// Points of one plane that are kept at most.
const MOST: usize = 9;
/// Normals closer than this belong to one plane (cosine of 2.5°).
const SAME_PLANE: f64 = 0.999;
/// Points of one plane nearer than this are one point, m.
const SAME_POINT: f64 = 1e-5;
/// Height by which an outermost point may lie above the deepest one, per metre that it is further out. Round bodies
/// touch near their deepest point and not at their rim.
const SLOPE: f64 = 0.02;
/// Half of the square root of 2.
const DIAGONAL: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// A point between ground and a shape, world.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Found {
    pub on_ground: V3,
    pub on_shape: V3,
    /// Out of the ground.
    pub normal: V3,
    /// Negative where they overlap, m.
    pub gap: f64,
}

/// Keeps the points that carry, plane by plane in the order in which planes were found.
pub(crate) fn reduce(found: &mut Vec<Found>) {
    let (mut read, mut kept) = (0, 0);
    while read < found.len() {
        let end = gather(found, read);
        let count = thin(&mut found[read..end]);
        found.copy_within(read..read + count, kept);
        (read, kept) = (end, kept + count);
    }
    found.truncate(kept);
}

/// Moves all points of the plane of `found[start]` next to it; gives their end.
fn gather(found: &mut [Found], start: usize) -> usize {
    let normal = found[start].normal;
    let mut end = start + 1;
    for k in start + 1..found.len() {
        if found[k].normal.dot(&normal) > SAME_PLANE {
            found.swap(end, k);
            end += 1;
        }
    }
    end
}

/// Moves the points that are kept to the front; gives their number.
fn thin(plane: &mut [Found]) -> usize {
    let count = distinct(plane);
    if count <= MOST {
        return count;
    }
    let [normal, t1, t2] = frame_of_normal(plane[0].normal);
    let middle = plane[..count].iter().map(|f| f.on_ground).sum::<V3>() / count as f64;
    let (a, b) = (DIAGONAL * (t1 + t2), DIAGONAL * (t1 - t2));
    let directions = [V3::zeros(), t1, -t1, t2, -t2, a, -a, b, -b];
    let mut kept = 0;
    for d in directions {
        let worth = |f: &Found| SLOPE * d.dot(&(f.on_ground - middle)) - f.gap * normal.dot(&f.normal);
        let best = (0..count).max_by(|i, k| worth(&plane[*i]).total_cmp(&worth(&plane[*k])).then(k.cmp(i)));
        if let Some(best) = best.filter(|best| *best >= kept) {
            plane.swap(best, kept);
            kept += 1;
        }
    }
    kept
}

/// Moves points at different places to the front, of those at one place the deepest; gives their number.
fn distinct(plane: &mut [Found]) -> usize {
    let mut count = 0;
    for k in 0..plane.len() {
        let f = plane[k];
        let near = |o: &&mut Found| (o.on_ground - f.on_ground).norm_squared() < SAME_POINT * SAME_POINT;
        match plane[..count].iter_mut().find(near) {
            Some(other) if f.gap < other.gap => *other = f,
            Some(_) => {}
            None => {
                plane[count] = f;
                count += 1;
            }
        }
    }
    count
}

#[cfg(test)]
#[path = "../../tests/unit/reduce.rs"]
mod tests;
