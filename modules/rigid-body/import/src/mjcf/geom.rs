//! Geoms: shapes, what they weigh, planes.

use super::defaults::{Defaults, Element, from_z};
use crate::error::Error;
use crate::model::{Plane, Shape, ShapeGeometry};
use nalgebra::{Isometry3, Matrix3, Translation3, Unit, Vector3};
use std::f64::consts::PI;

/// Density where a file gives neither mass nor density, kg/m³.
const DENSITY: f64 = 1000.0;

/// What a geom is.
pub(crate) enum Geom {
    Shape {
        shape: Shape,
        mass: f64,
    },
    Plane(Plane),
    /// Of a kind that cannot be used.
    Unknown(String),
}

/// Reads a geom; `owner` names it where it has no name.
pub(crate) fn geom(d: &Defaults, e: &Element, owner: &str) -> Result<Geom, Error> {
    let kind = d.text(e, "type").unwrap_or("sphere").to_owned();
    let size = d.numbers(e, "size")?.unwrap_or_default();
    let mut pose = d.pose(e)?;
    let mut length = None;
    if let Some(ends) = d.numbers(e, "fromto")? {
        let [a, b, c, x, y, z] = ends[..] else {
            return Err(d.wrong(e, format!("fromto has {} numbers; six are needed", ends.len())));
        };
        let (from, to) = (Vector3::new(a, b, c), Vector3::new(x, y, z));
        let along = Unit::try_new(to - from, 1e-12)
            .ok_or_else(|| d.wrong(e, "fromto: both ends are the same point".into()))?;
        pose = Isometry3::from_parts(Translation3::from((from + to) / 2.0), from_z(&along));
        length = Some((to - from).norm() / 2.0);
    }
    let friction = match d.text(e, "condim") {
        Some("1") => Some(0.0),
        _ => d.number(e, "friction")?,
    };
    if kind == "plane" {
        let normal = pose.rotation * Vector3::z_axis();
        return Ok(Geom::Plane(Plane { normal, offset: normal.dot(&pose.translation.vector), friction }));
    }
    let at = |k: usize| -> Result<f64, Error> {
        match size.get(k) {
            Some(s) if *s > 0.0 => Ok(*s),
            _ => Err(d.wrong(e, format!("a {kind} needs a positive number {} in size", k + 1))),
        }
    };
    let half = |k: usize| length.map_or_else(|| at(k), Ok);
    let geometry = match kind.as_str() {
        "sphere" => ShapeGeometry::Sphere { radius: at(0)? },
        "capsule" => ShapeGeometry::Capsule { radius: at(0)?, half_length: half(1)? },
        "cylinder" => ShapeGeometry::Cylinder { radius: at(0)?, half_length: half(1)? },
        "box" if length.is_none() => ShapeGeometry::Box { half_extents: [at(0)?, at(1)?, at(2)?] },
        _ => return Ok(Geom::Unknown(kind)),
    };
    let bits = |name: &str| d.number(e, name).map(|b| b.unwrap_or(1.0) as u32);
    let (group, mask) = (bits("contype")?, bits("conaffinity")?);
    let density = d.number(e, "density")?.unwrap_or(DENSITY);
    let mass = d.number(e, "mass")?.unwrap_or_else(|| density * volume(&geometry));
    let name = e.node.attribute("name").unwrap_or(owner).to_owned();
    let collides = group != 0 || mask != 0;
    Ok(Geom::Shape {
        shape: Shape { name, geometry, body_from_shape: pose, collides, friction, group, mask },
        mass,
    })
}

fn volume(g: &ShapeGeometry) -> f64 {
    match *g {
        ShapeGeometry::Sphere { radius: r } => 4.0 / 3.0 * PI * r * r * r,
        ShapeGeometry::Box { half_extents: [x, y, z] } => 8.0 * x * y * z,
        ShapeGeometry::Cylinder { half_length: l, radius: r } => PI * r * r * 2.0 * l,
        ShapeGeometry::Capsule { half_length: l, radius: r } => PI * r * r * (2.0 * l + 4.0 / 3.0 * r),
    }
}

/// Inertia of a homogeneous shape about its centre in its axes, kg m².
fn inertia(g: &ShapeGeometry, mass: f64) -> Matrix3<f64> {
    let (about, along) = match *g {
        ShapeGeometry::Sphere { radius: r } => return Matrix3::from_diagonal_element(0.4 * mass * r * r),
        ShapeGeometry::Box { half_extents: [x, y, z] } => {
            let i = |a: f64, b: f64| mass * (a * a + b * b) / 3.0;
            return Matrix3::from_diagonal(&Vector3::new(i(y, z), i(x, z), i(x, y)));
        }
        ShapeGeometry::Cylinder { half_length: l, radius: r } => {
            (mass * (r * r / 4.0 + l * l / 3.0), mass * r * r / 2.0)
        }
        ShapeGeometry::Capsule { half_length: l, radius: r } => {
            // A cylinder and two half spheres whose centres lie 3/8·r beyond its ends.
            let total = volume(g);
            let (rod, ball) =
                (mass * PI * r * r * 2.0 * l / total, mass * 4.0 / 3.0 * PI * r * r * r / total);
            let about = rod * (r * r / 4.0 + l * l / 3.0) + ball * (0.4 * r * r + l * l + 0.75 * l * r);
            (about, rod * r * r / 2.0 + 0.4 * ball * r * r)
        }
    };
    Matrix3::from_diagonal(&Vector3::new(about, about, along))
}

/// Mass, centre of mass and inertia about it of shapes with their masses, in their common frame.
pub(crate) fn compound(shapes: &[(Shape, f64)]) -> Option<(f64, Vector3<f64>, Matrix3<f64>)> {
    let mass: f64 = shapes.iter().map(|(_, m)| m).sum();
    if mass <= 0.0 {
        return None;
    }
    let centre =
        shapes.iter().map(|(s, m)| *m * s.body_from_shape.translation.vector).sum::<Vector3<f64>>() / mass;
    let mut total = Matrix3::zeros();
    for (s, m) in shapes {
        let r = s.body_from_shape.rotation.to_rotation_matrix();
        let arm = s.body_from_shape.translation.vector - centre;
        let moved = Matrix3::from_diagonal_element(arm.norm_squared()) - arm * arm.transpose();
        total += r * inertia(&s.geometry, *m) * r.transpose() + *m * moved;
    }
    Some((mass, centre, total))
}
