//! Files with points: LAS and LAZ, and text.

use std::path::Path;
use terraglue_diagnostics::{Error, Result};
use terraglue_scenario::InputError;
use terraglue_tree_localisation::{Point, Scan};

/// Points that are read at once.
const AT_ONCE: u64 = 100_000;
/// Points that are read from a file at most.
const MOST_POINTS: u64 = 200_000_000;

/// The points of a file that a scanner at a place saw; where no place is given, at the origin if points lie around it, else
/// at unknown places.
pub fn read(path: &Path, eye: Option<[f64; 3]>) -> Result<Scan> {
    let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
    let points = match ending.as_deref() {
        Some("las" | "laz") => las(path)?,
        _ => text(path)?,
    };
    let eye = eye.or_else(|| has_around(&points).then_some([0.0; 3]));
    Ok(Scan { points, eye })
}

/// Whether the origin lies within the bounds of points.
fn has_around(points: &[Point]) -> bool {
    (0..3).all(|k| {
        let on = |side: f64| points.iter().any(|p| side * p.position[k] > 0.0);
        on(1.0) && on(-1.0)
    })
}

fn wrong(path: &Path, why: impl std::fmt::Display) -> Error {
    let help =
        "LAS or LAZ, or text with x y z in each line; a file that was cut off is written anew".to_owned();
    InputError::plain(format!("{}: {why}", path.display()), Some(help)).into()
}

fn las(path: &Path) -> Result<Vec<Point>> {
    let failed = |source| Error::File { path: path.display().to_string(), source };
    let file = terraglue_subsystem::files::open(path).map_err(failed)?;
    let mut reader = las::Reader::new(std::io::BufReader::new(file)).map_err(|e| wrong(path, e))?;
    let promised = reader.header().number_of_points();
    if promised > MOST_POINTS {
        return Err(wrong(path, format!("{promised} points are more than {MOST_POINTS}")));
    }
    let mut points = Vec::new();
    loop {
        let after = |e: las::Error| wrong(path, format!("after {} of {promised} points: {e}", points.len()));
        let part = reader.read_points(AT_ONCE).map_err(after)?;
        if part.is_empty() {
            break;
        }
        let places = part.x().zip(part.y()).zip(part.z());
        points.extend(places.map(|((x, y), z)| Point::at([x, y, z])));
    }
    if (points.len() as u64) < promised {
        return Err(wrong(path, format!("it ends after {} of {promised} points", points.len())));
    }
    Ok(points)
}

fn text(path: &Path) -> Result<Vec<Point>> {
    let failed = |source| Error::File { path: path.display().to_string(), source };
    let text = terraglue_subsystem::files::read_text(path).map_err(failed)?;
    let mut points = Vec::new();
    for (line, number) in text.lines().zip(1..) {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let fields = line.split([',', ';', ' ', '\t']).filter(|f| !f.is_empty());
        let values: Vec<Option<f64>> = fields.take(3).map(|f| f.parse().ok()).collect();
        match values[..] {
            [Some(x), Some(y), Some(z)] => points.push(Point::at([x, y, z])),
            // the head
            _ if points.is_empty() && number == 1 => {}
            _ => {
                return Err(wrong(
                    path,
                    format!("line {number}: `{line}` does not begin with three numbers"),
                ));
            }
        }
    }
    Ok(points)
}
