//! Geoms: shapes, their masses, planes.

use super::assets::Assets;
use super::defaults::{Defaults, Element, from_z};
use crate::error::Error;
use crate::inertia::Inertial;
use crate::mesh::Solid;
use crate::model::{Plane, Shape, ShapeGeometry};
use crate::shapes::drawn;
use crate::solid::{nothing, placed, solid};
use nalgebra::{Isometry3, Translation3, Unit, Vector3};

/// Density where a file gives neither mass nor density, kg/m³.
const DENSITY: f64 = 1000.0;

/// Kind of a geom.
pub(crate) enum Geom {
    Shape(Box<Weighed>),
    Plane(Plane),
    /// Cannot be used, and why.
    Unused(String),
}

/// A shape that weighs something.
pub(super) struct Weighed {
    pub shape: Shape,
    /// kg.
    pub mass: f64,
    pub solid: Solid,
    /// Notice of the choice that was made.
    pub notice: Option<String>,
}

/// Context in which a geom is read.
#[derive(Clone, Copy)]
pub(super) struct Around<'a> {
    pub assets: &'a Assets,
    /// Names it where it has no name.
    pub owner: &'a str,
    /// Whether it stands still in the world.
    pub still: bool,
}

/// Reads a geom.
pub(super) fn geom(d: &Defaults, e: &Element, around: Around) -> Result<Geom, Error> {
    let kind = d.text(e, "type").unwrap_or("sphere").to_owned();
    let size = d.numbers(e, "size")?.unwrap_or_default();
    let (pose, length) = match d.numbers(e, "fromto")? {
        Some(ends) => between(d, e, &ends).map(|(pose, half)| (pose, Some(half)))?,
        None => (d.pose(e)?, None),
    };
    let friction = friction(d, e)?;
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
    let bits = |name: &str| d.count(e, name, i32::MAX as u32).map(|b| b.unwrap_or(1));
    let (group, mask) = (bits("contype")?, bits("conaffinity")?);
    let collides = group != 0 || mask != 0;
    let name = e.node.attribute("name").unwrap_or(around.owner).to_owned();
    let mut notice = None;
    let geometry = match kind.as_str() {
        "mesh" => match mesh(d, e, around)? {
            Ok((geometry, said)) => {
                notice = said.filter(|_| collides);
                if collides { geometry } else { drawn(geometry) }
            }
            Err(why) if collides => return Err(d.wrong(e, why)),
            Err(why) => return Ok(Geom::Unused(format!("is only seen and is not shown: {why}"))),
        },
        "hfield" if !around.still => {
            return Ok(Geom::Unused(
                "is a height field on a body; they belong to the world, it is left out".into(),
            ));
        }
        "hfield" => heights(d, e, around)?,
        "sphere" => ShapeGeometry::Sphere { radius: at(0)? },
        "capsule" => ShapeGeometry::Capsule { radius: at(0)?, half_length: half(1)? },
        "cylinder" => ShapeGeometry::Cylinder { radius: at(0)?, half_length: half(1)? },
        "box" if length.is_none() => ShapeGeometry::Box { half_extents: [at(0)?, at(1)?, at(2)?] },
        _ => return unsupported(d, e, &kind),
    };
    let solid = match &geometry {
        ShapeGeometry::Hull(_) | ShapeGeometry::Concave { .. } | ShapeGeometry::Triangles(_) => {
            let asset = around.assets.meshes.get(d.text(e, "mesh").unwrap_or_default());
            asset.and_then(|a| a.as_ref().ok()).map_or_else(nothing, |a| a.solid)
        }
        other => solid(other),
    };
    let weighs = |name: &str| d.not_negative(e, name, "nothing weighs less than nothing");
    let density = weighs("density")?.unwrap_or(DENSITY);
    let mass = weighs("mass")?.unwrap_or(density * solid.volume);
    let shape = Shape { name, geometry, body_from_shape: pose, collides, friction, group, mask };
    Ok(Geom::Shape(Box::new(Weighed { shape, mass, solid, notice })))
}

/// Pose in the middle between the ends that `fromto` names, and half of their distance, m.
fn between(d: &Defaults, e: &Element, ends: &[f64]) -> Result<(Isometry3<f64>, f64), Error> {
    let [a, b, c, x, y, z] = *ends else {
        return Err(d.wrong(e, format!("fromto has {} numbers; six are needed", ends.len())));
    };
    let (from, to) = (Vector3::new(a, b, c), Vector3::new(x, y, z));
    let along = Unit::try_new(to - from, 1e-12)
        .ok_or_else(|| d.wrong(e, "fromto: both ends are the same point".into()))?;
    let pose = Isometry3::from_parts(Translation3::from((from + to) / 2.0), from_z(&along));
    Ok((pose, (to - from).norm() / 2.0))
}

/// Sliding friction; none where it is not given.
fn friction(d: &Defaults, e: &Element) -> Result<Option<f64>, Error> {
    let friction = match d.text(e, "condim") {
        Some("1") => Some(0.0),
        _ => d.first(e, "friction")?,
    };
    match friction.filter(|mu| *mu < 0.0) {
        Some(bad) => Err(d.wrong(e, format!("friction = {bad} is negative: it would drive what slides"))),
        None => Ok(friction),
    }
}

/// The height field that a geom names.
fn heights(d: &Defaults, e: &Element, around: Around) -> Result<ShapeGeometry, Error> {
    let wanted = d.text(e, "hfield").unwrap_or_default();
    let unknown = || d.wrong(e, format!("there is no <hfield> `{wanted}` in <asset>"));
    let field = around.assets.fields.get(wanted).ok_or_else(unknown)?;
    Ok(ShapeGeometry::Heights(field.clone().map_err(|why| d.wrong(e, format!("hfield {why}")))?))
}

/// Types of geoms that MJCF has.
const TYPES: [&str; 9] =
    ["plane", "hfield", "sphere", "capsule", "ellipsoid", "cylinder", "box", "mesh", "sdf"];

/// A type of MJCF that is not read is left out with a warning; one that MJCF does not have is a mistake.
fn unsupported(d: &Defaults, e: &Element, kind: &str) -> Result<Geom, Error> {
    match TYPES.contains(&kind) {
        true => Ok(Geom::Unused(format!("of type `{kind}` is not supported and is left out"))),
        false => {
            let types = TYPES.join(", ");
            Err(d.wrong(e, format!("type = \"{kind}\" is no type of a geom; types are {types}")))
        }
    }
}

/// A mesh by its name: triangles where it stands still, else its hull, with its own form too where it is not convex.
fn mesh(
    d: &Defaults,
    e: &Element,
    around: Around,
) -> Result<Result<(ShapeGeometry, Option<String>), String>, Error> {
    let wanted = d.text(e, "mesh").unwrap_or_default();
    let unknown = || d.wrong(e, format!("there is no <mesh> `{wanted}` in <asset>"));
    Ok(match around.assets.meshes.get(wanted).ok_or_else(unknown)? {
        Ok(asset) if around.still => Ok((ShapeGeometry::Triangles(asset.triangles.clone()), None)),
        Ok(asset) => {
            let said = format!("with the mesh `{wanted}` {}", asset.notice);
            let hull = asset.hull.clone();
            let own = if asset.convex {
                ShapeGeometry::Hull(hull)
            } else {
                ShapeGeometry::Concave { mesh: asset.triangles.clone(), hull }
            };
            Ok((own, Some(said)))
        }
        Err(why) => Err(format!("mesh {why}")),
    })
}

/// Mass, centre of mass and inertia about it of shapes in their common frame.
pub(super) fn compound(shapes: &[Box<Weighed>]) -> Option<Inertial> {
    let weighed = shapes.iter().map(|s| placed(s.mass, &s.solid, &s.shape.body_from_shape));
    weighed.reduce(|a, b| a.with(&b)).filter(|whole| whole.mass > 0.0)
}
