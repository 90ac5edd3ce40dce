//! Points of a scan, in a frame whose z is up.

/// [`Point::ring`] of a point of an unknown beam.
pub const NO_RING: u16 = u16::MAX;
/// [`Point::body`] of a point on an unknown body.
pub const NO_BODY: u32 = u32::MAX;

/// A point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Place, m; z is up.
    pub position: [f64; 3],
    /// Number of the beam; [`NO_RING`]: unknown.
    pub ring: u16,
    /// Number of the body that it lies on; [`NO_BODY`]: unknown.
    pub body: u32,
}

impl Point {
    /// A point of which only its place is known.
    pub fn at(position: [f64; 3]) -> Self {
        Self { position, ring: NO_RING, body: NO_BODY }
    }

    /// Whether all its numbers are some.
    pub fn is_finite(&self) -> bool {
        self.position.iter().all(|x| x.is_finite())
    }
}

/// Points that a scanner saw from one place, or that come from several.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Scan {
    /// The points.
    pub points: Vec<Point>,
    /// Where the scanner stood, m; none: points of several places, or of an unknown one.
    pub eye: Option<[f64; 3]>,
}

impl Scan {
    /// Points of a scanner at the origin of their frame.
    pub fn from_origin(points: Vec<Point>) -> Self {
        Self { points, eye: Some([0.0; 3]) }
    }
}
