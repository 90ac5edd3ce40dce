//! Triangles from a file or from the text: the solid that they enclose, and their convex hull.

mod collada;
mod find;
mod read;

pub(crate) use find::Folders;
pub(crate) use read::{corners_of, load};

use nalgebra::{Matrix3, Vector3};
use parry3d_f64::math::Vector;
use parry3d_f64::transformation::try_convex_hull;
use std::collections::BTreeSet;
use std::f64::consts::PI;

/// A hull with more corners than this is replaced by that of its farthest corners along as many directions.
const MOST_CORNERS: usize = 200;

/// A closed mesh is convex where its hull's volume differs from its own by no more than this part: the effect of single
/// precision on the corners of a convex one.
const SAME_VOLUME: f64 = 1e-5;

/// An open mesh is convex where its triangles lie on its hull, to this part of its size.
const ON_HULL: f64 = 1e-6;

/// Corners and triangles, m.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Mesh {
    /// Corners, no two at the same place.
    pub points: Vec<[f64; 3]>,
    /// Three corners each, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// Mass properties of a solid of density 1: volume (m³), centre (m), inertia about it over its mass (m²).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Solid {
    pub volume: f64,
    pub centre: Vector3<f64>,
    pub inertia: Matrix3<f64>,
}

impl Mesh {
    /// Whether every edge has a triangle on either side that turns the same way.
    pub fn is_closed(&self) -> bool {
        let edges: Vec<[u32; 2]> =
            self.triangles.iter().flat_map(|[a, b, c]| [[*a, *b], [*b, *c], [*c, *a]]).collect();
        let known: BTreeSet<[u32; 2]> = edges.iter().copied().collect();
        known.len() == edges.len() && edges.iter().all(|[a, b]| known.contains(&[*b, *a]))
    }

    /// Each corner times a factor per axis; a mirrored mesh keeps its outside.
    pub(crate) fn scaled(mut self, scale: [f64; 3]) -> Self {
        self.points.iter_mut().for_each(|p| (0..3).for_each(|k| p[k] *= scale[k]));
        if scale.iter().product::<f64>() < 0.0 {
            self.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        }
        self
    }

    /// The convex hull and how far the mesh sticks out of it (m), which is 0 unless it has very many corners.
    pub(crate) fn hull(&self) -> Result<(Self, f64), String> {
        let points: Vec<Vector> = self.points.iter().map(|p| Vector::new(p[0], p[1], p[2])).collect();
        let whole = hull_of(&points)?;
        if whole.points.len() <= MOST_CORNERS {
            return Ok((whole, 0.0));
        }
        let few = hull_of(&farthest(&points, MOST_CORNERS))?;
        let beyond = whole.points.iter().fold(0.0_f64, |most, p| most.max(few.beyond(p)));
        Ok((few, beyond))
    }

    /// Whether it fills its convex hull; where it is open, whether all of it lies on the hull. Corners without triangles
    /// stand for their hull.
    pub(crate) fn is_convex(&self) -> bool {
        let points: Vec<Vector> = self.points.iter().map(|p| Vector::new(p[0], p[1], p[2])).collect();
        let Ok(hull) = hull_of(&points) else { return true };
        if self.is_closed() {
            let whole = hull.solid().volume;
            return (whole - self.solid().volume.abs()).abs() <= SAME_VOLUME * whole;
        }
        let size = self.points.iter().flatten().fold(0.0_f64, |m, c| m.max(c.abs()));
        self.triangles.iter().all(|t| {
            let corners = t.map(|k| self.points[k as usize]);
            let middle = std::array::from_fn(|k| corners.iter().map(|c| c[k]).sum::<f64>() / 3.0);
            hull.beyond(&middle) > -ON_HULL * size
        })
    }

    /// Distance of a point outside a convex mesh along the normals of its faces, m; negative inside.
    fn beyond(&self, p: &[f64; 3]) -> f64 {
        let corner = |k: u32| Vector3::from(self.points[k as usize]);
        let of = |t: &[u32; 3]| {
            let [a, b, c] = t.map(corner);
            (b - a).cross(&(c - a)).normalize().dot(&(Vector3::from(*p) - a))
        };
        self.triangles.iter().map(of).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Volume, centre and inertia of the solid that the triangles enclose: the sum over the tetrahedra between them and
    /// the origin (Tonon, J. Math. Stat. 1, 2005).
    pub(crate) fn solid(&self) -> Solid {
        let (mut volume, mut first, mut second) = (0.0, Vector3::zeros(), Matrix3::zeros());
        for t in &self.triangles {
            let [a, b, c] = t.map(|k| Vector3::from(self.points[k as usize]));
            let v = a.dot(&b.cross(&c)) / 6.0;
            let sum = a + b + c;
            volume += v;
            first += v / 4.0 * sum;
            second += v / 20.0
                * (a * a.transpose() + b * b.transpose() + c * c.transpose() + sum * sum.transpose());
        }
        let centre = first / volume;
        let about = second / volume - centre * centre.transpose();
        Solid { volume, centre, inertia: Matrix3::from_diagonal_element(about.trace()) - about }
    }
}

fn hull_of(points: &[Vector]) -> Result<Mesh, String> {
    let flat = "its corners lie in a plane: a hull needs a volume";
    let (corners, triangles) = try_convex_hull(points).map_err(|_| flat.to_owned())?;
    let mesh = Mesh { points: corners.iter().map(|p| [p.x, p.y, p.z]).collect(), triangles };
    let size = corners.iter().map(|p| (*p - corners[0]).length()).fold(0.0, f64::max);
    let solid = mesh.is_closed() && mesh.solid().volume > 1e-9 * size * size * size;
    if solid { Ok(mesh) } else { Err(flat.into()) }
}

/// The farthest points along directions spread evenly over the sphere (a spiral by the golden angle).
fn farthest(points: &[Vector], directions: usize) -> Vec<Vector> {
    let golden = PI * (3.0 - 5.0_f64.sqrt());
    let of = |k: usize| {
        let z = 1.0 - (2 * k + 1) as f64 / directions as f64;
        let (across, angle) = ((1.0 - z * z).sqrt(), golden * k as f64);
        let d = Vector::new(across * libm::cos(angle), across * libm::sin(angle), z);
        let far = |a: &usize, b: &usize| points[*a].dot(d).total_cmp(&points[*b].dot(d));
        (0..points.len()).max_by(far).unwrap_or(0)
    };
    let chosen: BTreeSet<usize> = (0..directions).map(of).collect();
    chosen.into_iter().map(|k| points[k]).collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    fn brick(inner: bool) -> Mesh {
        let mut points: Vec<[f64; 3]> = (0..8)
            .map(|k| [0, 1, 2].map(|c| if k >> c & 1 == 1 { 1.0 + f64::from(c) } else { 0.0 }))
            .collect();
        if inner {
            points.extend([[0.5, 1.0, 1.5], [0.2, 0.0, 1.0], [1.0, 2.0, 1.0]]);
        }
        Mesh { points, triangles: Vec::new() }
    }

    #[test]
    fn the_hull_of_a_box_is_the_box() {
        let (hull, beyond) = brick(true).hull().unwrap();
        assert_eq!((hull.points.len(), hull.triangles.len(), beyond), (8, 12, 0.0));
        assert!(hull.is_closed());
        let solid = hull.solid();
        assert!((solid.volume - 6.0).abs() < 1e-12);
        assert!((solid.centre - Vector3::new(0.5, 1.0, 1.5)).norm() < 1e-12);
        let moment = |a: f64, b: f64| (a * a + b * b) / 12.0;
        let exact =
            Matrix3::from_diagonal(&Vector3::new(moment(2.0, 3.0), moment(1.0, 3.0), moment(1.0, 2.0)));
        assert!((solid.inertia - exact).norm() < 1e-12);
        let mirrored = hull.scaled([-1.0, 1.0, 1.0]).solid();
        assert!((mirrored.volume - 6.0).abs() < 1e-12 && (mirrored.centre.x + 0.5).abs() < 1e-12);
    }

    #[test]
    fn a_hull_of_many_corners_is_thinned_and_says_by_how_much() {
        let grid = (0..60).flat_map(|i| (0..60).map(move |k| (f64::from(i) * 0.052, f64::from(k) * 0.105)));
        let ball = Mesh {
            points: grid.map(|(a, b)| [a.sin() * b.cos(), a.sin() * b.sin(), a.cos()]).collect(),
            ..Mesh::default()
        };
        let (hull, beyond) = ball.hull().unwrap();
        assert!(hull.points.len() <= MOST_CORNERS && beyond > 1e-3 && beyond < 0.05, "{beyond}");
    }

    #[test]
    fn a_mesh_is_convex_where_it_fills_its_hull_or_lies_on_it() {
        let (whole, _) = brick(false).hull().unwrap();
        assert!(whole.is_convex());
        let open = Mesh { triangles: whole.triangles[1..].to_vec(), ..whole.clone() };
        assert!(open.is_convex());
        // A corner pushed in.
        let mut dent = whole.clone();
        dent.points.push([0.5, 1.0, 2.0]);
        let [a, b, c] = dent.triangles[0];
        dent.triangles.splice(0..1, [[a, b, 8], [b, c, 8], [c, a, 8]]);
        assert!(dent.is_closed() && !dent.is_convex());
        dent.triangles.pop();
        assert!(!dent.is_convex());
    }

    #[test]
    fn what_is_flat_has_no_hull() {
        let mut flat = brick(false);
        flat.points.iter_mut().for_each(|p| p[2] = 0.0);
        assert!(flat.hull().is_err());
    }
}
