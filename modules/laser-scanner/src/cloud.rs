//! The points of a turn, and the message `foxglove.PointCloud` that carries them, written by hand: a module needs no viewer's
//! library for nine fields (<https://docs.foxglove.dev/docs/visualization/message-schemas/point-cloud>).

use terraglue_subsystem::{Pose, persist};

/// A point that a scanner reports.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Told {
    /// Place in the frame of the scanner when the ray left, m.
    pub position: [f64; 3],
    /// When, s.
    pub time: f64,
    /// Share of the light that comes back: reflectivity times the cosine of the angle of incidence.
    pub intensity: f64,
    /// Number of the beam.
    pub ring: u32,
    /// Numbers of the subsystem, of the body and of the shape that it lies on: the truth, for tests.
    pub subsystem: u32,
    /// See there.
    pub body: u32,
    /// Id of the shape.
    pub shape: u32,
}
persist!(Told { position, time, intensity, ring, subsystem, body, shape });

/// Bytes of a point.
pub const STRIDE: usize = 32;
/// Bytes of a message without its points, at most.
pub const HEAD: usize = 600;
/// Names, places and types of the numbers of a point.
const FIELDS: [(&str, u32, u64); 9] = [
    ("x", 0, FLOAT32),
    ("y", 4, FLOAT32),
    ("z", 8, FLOAT32),
    ("intensity", 12, FLOAT32),
    ("time", 16, FLOAT32),
    ("ring", 20, UINT16),
    ("subsystem", 22, UINT16),
    ("body", 24, UINT32),
    ("shape", 28, UINT32),
];
const UINT16: u64 = 3;
const UINT32: u64 = 5;
const FLOAT32: u64 = 7;

/// A turn as a message: `time` of its end, s, `frame` the body that the scanner sits on, and its pose on it. The field `time` of a point is
/// relative to the end of the turn.
pub fn message(points: &[Told], time: f64, frame: &str, pose: &Pose) -> Vec<u8> {
    let mut out = Vec::with_capacity(HEAD + STRIDE * points.len());
    let seconds = time.max(0.0).floor();
    let mut stamp = Vec::new();
    number(&mut stamp, 1, seconds as u64);
    number(&mut stamp, 2, ((time.max(0.0) - seconds) * 1e9) as u64);
    block(&mut out, 1, &stamp);
    block(&mut out, 2, frame.as_bytes());
    block(&mut out, 3, &posed(pose));
    fixed(&mut out, 4, STRIDE as u32);
    for (name, offset, kind) in FIELDS {
        let mut field = Vec::new();
        block(&mut field, 1, name.as_bytes());
        fixed(&mut field, 2, offset);
        number(&mut field, 3, kind);
        block(&mut out, 5, &field);
    }
    let mut data = Vec::with_capacity(STRIDE * points.len());
    for p in points {
        let [x, y, z] = p.position;
        [x, y, z, p.intensity, p.time - time].iter().for_each(|v| data.extend((*v as f32).to_le_bytes()));
        [p.ring, p.subsystem].iter().for_each(|v| data.extend((*v).min(0xffff).to_le_bytes()[..2].iter()));
        [p.body, p.shape].iter().for_each(|v| data.extend(v.to_le_bytes()));
    }
    block(&mut out, 6, &data);
    out
}

/// Position and orientation, both with x, y, z first.
fn posed(pose: &Pose) -> Vec<u8> {
    let [w, i, j, k] = pose.orientation;
    let mut out = Vec::new();
    for (tag, values) in [(1, pose.position.to_vec()), (2, vec![i, j, k, w])] {
        let mut part = Vec::new();
        for (tag, value) in (1..).zip(values) {
            key(&mut part, tag, 1);
            part.extend(f64::to_le_bytes(value));
        }
        block(&mut out, tag, &part);
    }
    out
}

fn varint(out: &mut Vec<u8>, mut value: u64) {
    while value >= 128 {
        out.push((value & 127) as u8 | 128);
        value >>= 7;
    }
    out.push(value as u8);
}

fn key(out: &mut Vec<u8>, tag: u64, wire: u64) {
    varint(out, tag << 3 | wire);
}

fn number(out: &mut Vec<u8>, tag: u64, value: u64) {
    key(out, tag, 0);
    varint(out, value);
}

fn block(out: &mut Vec<u8>, tag: u64, bytes: &[u8]) {
    key(out, tag, 2);
    varint(out, bytes.len() as u64);
    out.extend_from_slice(bytes);
}

fn fixed(out: &mut Vec<u8>, tag: u64, value: u32) {
    key(out, tag, 5);
    out.extend(value.to_le_bytes());
}
