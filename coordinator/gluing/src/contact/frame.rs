//! Frame, origin and extent of a contact patch.

use super::touching::Touching;
use terraglue_ground::{PlaneFit, Surface};
use terraglue_subsystem::Node;

/// Smallest upward part of a normal that is reckoned with; steeper ground is no height field any more.
const STEEPEST: f64 = 0.2;

/// Contact patch of a shape on the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch {
    /// The shape's lowest point along −n, world, m.
    pub origin: [f64; 3],
    /// Upward unit normal of the ground.
    pub normal: [f64; 3],
    /// Height of the ground's plane at the origin, m.
    pub ground: f64,
}

impl Patch {
    /// Lowest point and normal depend on each other: two rounds, from the vertical, settle both. The normal is
    /// that of the `undisturbed` ground, the height that of the present `surface`.
    pub fn find<U: Surface + ?Sized, S: Surface + ?Sized>(
        shape: &Touching,
        undisturbed: &U,
        surface: &S,
    ) -> Self {
        // Twice the half width: enough ground beyond the foot itself.
        let bounds = &shape.bounds;
        let radius = (bounds.max[0] - bounds.min[0]).min(bounds.max[1] - bounds.min[1]);
        let (mut fit, mut normal) = (PlaneFit::new(undisturbed, radius), [0.0, 0.0, 1.0]);
        for _ in 0..2 {
            let origin = shape.patch_origin(normal);
            normal = fit.at(origin[0], origin[1]).normal;
        }
        let origin = shape.patch_origin(normal);
        let [u, v] = surface.lattice().coordinates(origin[0], origin[1]).map(|c| c.round() as i32);
        Self { origin, normal, ground: surface.height(u, v) }
    }

    /// Vertical distance in which a motion of `reach` (m) along the normal shows.
    pub fn vertical(&self, reach: f64) -> f64 {
        reach / self.normal[2].max(STEEPEST)
    }

    /// n, t1, t2: t1 is world x made orthogonal to n, t2 = n × t1.
    pub fn frame(&self) -> [f64; 9] {
        let n = self.normal;
        let across = [1.0 - n[0] * n[0], -n[0] * n[1], -n[0] * n[2]];
        let length = across.iter().map(|c| c * c).sum::<f64>().sqrt();
        let t1 = if length > 1e-6 { across.map(|c| c / length) } else { [0.0, 1.0, 0.0] };
        let t2 = [n[1] * t1[2] - n[2] * t1[1], n[2] * t1[0] - n[0] * t1[2], n[0] * t1[1] - n[1] * t1[0]];
        [n[0], n[1], n[2], t1[0], t1[1], t1[2], t2[0], t2[1], t2[2]]
    }
}

/// Half lengths of the patch along t1 and t2: how far those of its nodes reach from the origin whose surface lies less than
/// `margin` (m) below the underside, at most half the shape's width, at least half a cell.
pub fn extent<S: Surface + ?Sized>(
    shape: &Touching,
    surface: &S,
    margin: f64,
    patch: &Patch,
    frame: &[f64; 9],
    nodes: &[Node],
) -> [f64; 2] {
    let lattice = surface.lattice();
    let half = 0.5 * lattice.spacing;
    [3, 6].map(|k| {
        let t = [frame[k], frame[k + 1], frame[k + 2]];
        let along = |n: &Node| {
            let p = lattice.position(n.i, n.j);
            let d = [p[0] - patch.origin[0], p[1] - patch.origin[1], n.lower - patch.origin[2]];
            (d[0] * t[0] + d[1] * t[1] + d[2] * t[2]).abs()
        };
        let near = |n: &&Node| n.lower < surface.height(n.i, n.j) + margin;
        let reach = nodes.iter().filter(near).map(along).fold(0.0, f64::max) + half;
        reach.min(shape.half_width(t)).max(half.min(shape.half_width(t)))
    })
}
