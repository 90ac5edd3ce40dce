//! Shapes of the links of a URDF file; convex meshes become hulls where they move, others also keep their own form.

use crate::check::isometry;
use crate::error::{Error, Source};
use crate::mesh::{Folders, Mesh, load};
use crate::model::{Shape, ShapeGeometry};
use crate::plausible;
use std::sync::Arc;
use urdf_rs::{Geometry, Link, Pose};

/// A mesh whose hull has more than this many times its own volume is called hollow.
const HOLLOW: f64 = 1.05;

/// Reads shapes and collects notices about them.
pub(crate) struct Shapes<'a> {
    pub source: &'a Source<'a>,
    pub folders: &'a Folders,
    pub warnings: Vec<String>,
    pub notices: Vec<String>,
    /// Pictures that cannot be shown, and the first reason.
    unseen: (usize, String),
    /// Shapes of sizes that no part of a robot has.
    odd: Vec<String>,
}

/// Place of a shape in the file.
#[derive(Clone, Copy)]
struct ShapePlace<'a> {
    link: &'a Link,
    name: Option<&'a str>,
    origin: &'a Pose,
    collides: bool,
    /// Whether it stands still.
    still: bool,
}

impl<'a> Shapes<'a> {
    pub fn new(source: &'a Source<'a>, folders: &'a Folders) -> Self {
        Self {
            source,
            folders,
            warnings: Vec::new(),
            notices: Vec::new(),
            unseen: (0, String::new()),
            odd: Vec::new(),
        }
    }

    /// All shapes of a link in its own frame; one both seen and hit appears once. `still`: the link is the world.
    pub fn of(&mut self, link: &Link, still: bool) -> Result<Vec<Shape>, Error> {
        let mut shapes: Vec<Shape> = Vec::new();
        for c in &link.collision {
            if self.is_nothing(link, &c.geometry) {
                continue;
            }
            let place =
                ShapePlace { link, name: c.name.as_deref(), origin: &c.origin, collides: true, still };
            shapes.push(self.shape(place, &c.geometry)?);
        }
        for v in &link.visual {
            if self.is_nothing(link, &v.geometry) {
                continue;
            }
            let place =
                ShapePlace { link, name: v.name.as_deref(), origin: &v.origin, collides: false, still };
            let seen = match self.shape(place, &v.geometry) {
                Ok(seen) => seen,
                // A picture that cannot be drawn does no harm to the simulation.
                Err(e) if matches!(v.geometry, Geometry::Mesh { .. }) => {
                    let first = std::mem::take(&mut self.unseen.1);
                    self.unseen = (self.unseen.0 + 1, if first.is_empty() { e.to_string() } else { first });
                    continue;
                }
                Err(e) => return Err(e),
            };
            if !shapes
                .iter()
                .any(|s| s.geometry == seen.geometry && s.body_from_shape == seen.body_from_shape)
            {
                shapes.push(Shape { geometry: drawn(seen.geometry), ..seen });
            }
        }
        Ok(shapes)
    }

    /// Warnings and notices, in this order.
    pub fn said(mut self) -> (Vec<String>, Vec<String>) {
        self.warnings.extend(plausible::first(std::mem::take(&mut self.odd)));
        if self.unseen.0 > 0 {
            let (count, first) = self.unseen;
            self.notices.push(format!("{count} <visual> meshes are not shown; the first: {first}"));
        }
        (self.warnings, self.notices)
    }

    /// Whether a shape has no size at all, which is reported once: files have them as placeholders.
    fn is_nothing(&mut self, link: &Link, geometry: &Geometry) -> bool {
        let nothing = match geometry {
            Geometry::Box { size } => size.0 == [0.0; 3],
            Geometry::Sphere { radius } => *radius == 0.0,
            Geometry::Cylinder { radius, length } | Geometry::Capsule { radius, length } => {
                *radius == 0.0 && *length == 0.0
            }
            Geometry::Mesh { .. } => false,
        };
        if nothing {
            let text = self.source.link(&link.name, "a shape of size 0 m is left out").to_string();
            self.warnings.push(text);
        }
        nothing
    }

    fn shape(&mut self, place: ShapePlace, geometry: &Geometry) -> Result<Shape, Error> {
        let link = place.link;
        let (geometry, sizes) = match geometry {
            Geometry::Sphere { radius } => (ShapeGeometry::Sphere { radius: *radius }, vec![*radius]),
            Geometry::Box { size } => {
                (ShapeGeometry::Box { half_extents: size.0.map(|s| s / 2.0) }, size.0.to_vec())
            }
            Geometry::Cylinder { radius, length } => (
                ShapeGeometry::Cylinder { half_length: length / 2.0, radius: *radius },
                vec![*radius, *length],
            ),
            Geometry::Capsule { radius, length } => (
                ShapeGeometry::Capsule { half_length: length / 2.0, radius: *radius },
                vec![*radius, *length],
            ),
            Geometry::Mesh { filename, scale } => {
                let scale = scale.map_or([1.0; 3], |s| s.0);
                (self.mesh(place, filename, scale)?, Vec::new())
            }
        };
        if let Some(bad) = sizes.iter().find(|s| **s <= 0.0) {
            let problem = format!("a shape has the size {bad} m; sizes are positive");
            return Err(self.source.link(&link.name, problem));
        }
        if let Some(odd) = plausible::shape(&geometry).filter(|_| place.collides && !place.still) {
            self.odd.push(self.source.link(&link.name, odd).to_string());
        }
        let name = place.name.filter(|n| !n.is_empty()).unwrap_or(&link.name).into();
        let (body_from_shape, collides) = (isometry(place.origin), place.collides);
        Ok(Shape { name, geometry, body_from_shape, collides, friction: None, group: 1, mask: 1 })
    }

    fn mesh(&mut self, place: ShapePlace, file: &str, scale: [f64; 3]) -> Result<ShapeGeometry, Error> {
        let link = place.link.name.as_str();
        let wrong = |problem: String| self.source.link(link, format!("the mesh `{file}`: {problem}"));
        if scale.contains(&0.0) {
            return Err(wrong(format!("its scale {scale:?} has a 0; it flattens the mesh")));
        }
        let path = self.folders.find(file).map_err(wrong)?;
        let loaded = load(&path).map_err(|p| wrong(format!("{}: {p}", path.display())))?;
        let mesh = loaded.mesh.scaled(scale);
        if let Some(remark) = loaded.remark.filter(|_| place.collides) {
            self.notices.push(wrong(remark).to_string());
        }
        if place.still {
            return Ok(ShapeGeometry::Triangles(Arc::new(mesh)));
        }
        let (hull, beyond) = mesh.hull().map_err(wrong)?;
        let convex = mesh.is_convex();
        if place.collides {
            let said = hull_notice(&mesh, (&hull, beyond), convex);
            let said = self.source.link(link, format!("the mesh `{file}` {}", said)).to_string();
            if hollow(&mesh, &hull) { self.warnings.push(said) } else { self.notices.push(said) }
        }
        let hull = Arc::new(hull);
        let concave = |hull| ShapeGeometry::Concave { mesh: Arc::new(mesh), hull };
        Ok(if convex { ShapeGeometry::Hull(hull) } else { concave(hull) })
    }
}

/// A picture is drawn as its hull: the triangles of a fine one would swell the recording.
pub(crate) fn drawn(geometry: ShapeGeometry) -> ShapeGeometry {
    match geometry {
        ShapeGeometry::Concave { hull, .. } => ShapeGeometry::Hull(hull),
        _ => geometry,
    }
}

/// Whether the hull fills space that the mesh leaves open.
pub(crate) fn hollow(mesh: &Mesh, hull: &Mesh) -> bool {
    mesh.is_closed() && hull.solid().volume > HOLLOW * mesh.solid().volume.abs()
}

/// The notice about the replacement of a mesh that moves.
pub(crate) fn hull_notice(mesh: &Mesh, (hull, beyond): (&Mesh, f64), convex: bool) -> String {
    let corners = hull.points.len();
    let mut text = if convex {
        format!("moves and counts as its convex hull of {corners} corners")
    } else {
        let count = mesh.triangles.len();
        format!(
            "moves and is not convex: soil meets its own {count} triangles, bodies and rigid ground meet its convex hull of \
             {corners} corners"
        )
    };
    if hollow(mesh, hull) {
        let times = hull.solid().volume / mesh.solid().volume.abs();
        text += &format!(", whose volume is {times:.2} times its own; take it apart where that matters");
    }
    if beyond > 0.0 {
        text += &format!(" (thinned: it sticks out by up to {:.2} mm)", 1e3 * beyond);
    }
    text
}
