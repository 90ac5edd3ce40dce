//! The slope of the underside of every shape: which way a body presses the soil at a node.

use super::Placed;
use terraglue_subsystem::Geometry;

/// Largest slope that is reported (72°); the side of a shape is a wall and no underside.
pub const STEEPEST_SLOPE: f64 = 3.0;

/// Faces whose distance from the point differs by less than this (m) count as equally near: an edge.
pub(super) const EDGE: f64 = 1e-9;

impl Placed {
    /// ∂z/∂x and ∂z/∂y of the underside at its point `p` (world, m), at most [`STEEPEST_SLOPE`] steep. On an edge,
    /// that of the flatter face.
    pub fn underside_slope(&self, p: [f64; 3]) -> [f64; 2] {
        let centre = self.world_from_shape.position;
        if let Geometry::Sphere { .. } = &self.geometry {
            return slope_of(std::array::from_fn(|k| p[k] - centre[k]));
        }
        if let Some(tree) = &self.tree {
            let hit = tree.lowest(&self.rotation, [p[0] - centre[0], p[1] - centre[1]]);
            return hit.map_or([0.0; 2], |hit| slope_of(hit.normal));
        }
        if let Geometry::ConvexMesh { .. } = &self.geometry {
            let [a, b] = self.planes.slope(p[0] - centre[0], p[1] - centre[1]);
            return slope_of([a, b, -1.0]);
        }
        let local = self.rotation.to_shape(std::array::from_fn(|k| p[k] - centre[k]));
        let mut face = Downwards { placed: self, distance: f64::NEG_INFINITY, normal: [0.0, 0.0, -1.0] };
        match &self.geometry {
            Geometry::Sphere { .. } => {}
            Geometry::Capsule { half_length, .. } => {
                face.offer([local[0], local[1], local[2] - local[2].clamp(-half_length, *half_length)], 0.0);
            }
            Geometry::Cylinder { half_length, radius } => {
                let across = (local[0] * local[0] + local[1] * local[1]).sqrt();
                face.offer([local[0], local[1], 0.0], across - radius);
                face.offer([0.0, 0.0, 1.0], local[2] - half_length);
                face.offer([0.0, 0.0, -1.0], -local[2] - half_length);
            }
            Geometry::Box { half_extents } => {
                for k in 0..3 {
                    for sign in [1.0, -1.0] {
                        let normal = std::array::from_fn(|c| if c == k { sign } else { 0.0 });
                        face.offer(normal, sign * local[k] - half_extents[k]);
                    }
                }
            }
            Geometry::Ellipsoid { semi_axes } => {
                face.offer(std::array::from_fn(|k| local[k] / (semi_axes[k] * semi_axes[k])), 0.0);
            }
            Geometry::ConeFrustum { half_length, radius_bottom, radius_top } => {
                let across = (local[0] * local[0] + local[1] * local[1]).sqrt();
                let widening = 0.5 * (radius_top - radius_bottom) / half_length;
                let beyond = across - 0.5 * (radius_bottom + radius_top) - widening * local[2];
                let slant = (1.0 + widening * widening).sqrt();
                face.offer([local[0], local[1], -widening * across], beyond / slant);
                face.offer([0.0, 0.0, 1.0], local[2] - half_length);
                face.offer([0.0, 0.0, -1.0], -local[2] - half_length);
            }
            // a tree of triangles or planes, see above
            Geometry::Mesh { .. } | Geometry::ConvexMesh { .. } => {}
        }
        slope_of(face.normal)
    }
}

/// The nearest face that looks down.
struct Downwards<'a> {
    placed: &'a Placed,
    distance: f64,
    /// Outward, world; any length.
    normal: [f64; 3],
}

impl Downwards<'_> {
    fn offer(&mut self, normal: [f64; 3], distance: f64) {
        let normal = self.placed.rotation.to_world(normal);
        let better = distance > self.distance + EDGE
            || distance > self.distance - EDGE && steepness(normal) < steepness(self.normal);
        if normal[2] < 0.0 && better {
            (self.distance, self.normal) = (distance, normal);
        }
    }
}

/// Slope of a face with the outward normal `n` (any length), at most [`STEEPEST_SLOPE`].
fn slope_of(n: [f64; 3]) -> [f64; 2] {
    let size = (n[0] * n[0] + n[1] * n[1]).sqrt();
    let down = n[2].abs().max(size / STEEPEST_SLOPE);
    if down > 0.0 { [n[0] / down, n[1] / down] } else { [0.0; 2] }
}

/// Squared slope.
fn steepness(n: [f64; 3]) -> f64 {
    (n[0] * n[0] + n[1] * n[1]) / (n[2] * n[2])
}
