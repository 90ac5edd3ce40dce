//! Reads the point clouds of scanners: messages `foxglove.PointCloud` in Protocol Buffers, of which x, y and z are needed, and time,
//! ring, subsystem and body are read where they are.

use std::fmt;
use terraglue_subsystem::Pose;

/// A point cloud.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Cloud {
    /// Frame in which the pose lies.
    pub frame: String,
    /// Pose of the scanner in that frame: position, m, and quaternion w, x, y, z.
    pub pose: Option<Pose>,
    /// Its points.
    pub points: Vec<CloudPoint>,
}

/// A point in the frame of the scanner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CloudPoint {
    /// Place, m.
    pub position: [f64; 3],
    /// Time before the end of the turn, s, not positive.
    pub time: f64,
    /// Number of the beam; none: unknown.
    pub ring: Option<u16>,
    /// Subsystem and body that it lies on; none: unknown.
    pub on: Option<(u32, u32)>,
}

/// Why bytes are no point cloud.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CloudError {
    /// They end too early.
    Cut,
    /// They are no message of Protocol Buffers.
    NoMessage,
    /// Points have no numbers x, y and z.
    NoPlaces,
}

impl fmt::Display for CloudError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Cut => "the message ends too early",
            Self::NoMessage => "this is no message foxglove.PointCloud",
            Self::NoPlaces => "the points have no numbers x, y and z",
        })
    }
}

impl std::error::Error for CloudError {}

type Result<T> = std::result::Result<T, CloudError>;

/// A field of a message.
enum Value<'a> {
    Number(u64),
    Fixed(u64),
    Block(&'a [u8]),
}

/// Takes the next field.
fn field<'a>(from: &mut &'a [u8]) -> Result<(u64, Value<'a>)> {
    let key = varint(from)?;
    let value = match key & 7 {
        0 => Value::Number(varint(from)?),
        1 => Value::Fixed(u64::from_le_bytes(take(from)?)),
        2 => {
            let length = usize::try_from(varint(from)?).map_err(|_| CloudError::NoMessage)?;
            let (block, rest) = from.split_at_checked(length).ok_or(CloudError::Cut)?;
            *from = rest;
            Value::Block(block)
        }
        5 => Value::Number(u64::from(u32::from_le_bytes(take(from)?))),
        _ => return Err(CloudError::NoMessage),
    };
    Ok((key >> 3, value))
}

fn take<const N: usize>(from: &mut &[u8]) -> Result<[u8; N]> {
    let (first, rest) = from.split_first_chunk::<N>().ok_or(CloudError::Cut)?;
    *from = rest;
    Ok(*first)
}

fn varint(from: &mut &[u8]) -> Result<u64> {
    let mut value = 0;
    for k in 0..10 {
        let [byte] = take(from)?;
        value |= u64::from(byte & 127) << (7 * k);
        if byte < 128 {
            return Ok(value);
        }
    }
    Err(CloudError::NoMessage)
}

/// Place of a number in a point, and its type in the numbering of foxglove.
#[derive(Clone, Copy)]
struct Part {
    offset: usize,
    kind: u64,
}

/// The parts that are read.
#[derive(Default)]
struct Parts([Option<Part>; 7]);

const NAMES: [&str; 7] = ["x", "y", "z", "time", "ring", "subsystem", "body"];

impl Parts {
    fn add(&mut self, mut block: &[u8]) -> Result<()> {
        let (mut name, mut part) = (&[][..], Part { offset: 0, kind: 0 });
        while !block.is_empty() {
            match field(&mut block)? {
                (1, Value::Block(text)) => name = text,
                (2, Value::Number(offset)) => part.offset = offset.min(1 << 16) as usize,
                (3, Value::Number(kind)) => part.kind = kind,
                _ => {}
            }
        }
        if let Some(k) = NAMES.iter().position(|n| n.as_bytes() == name) {
            self.0[k] = Some(part);
        }
        Ok(())
    }

    fn number(&self, k: usize, point: &[u8]) -> Option<f64> {
        let Part { offset, kind } = self.0[k]?;
        let bytes = point.get(offset..)?;
        match kind {
            1 => bytes.first().map(|v| f64::from(*v)),
            3 => bytes.first_chunk().map(|b| f64::from(u16::from_le_bytes(*b))),
            5 => bytes.first_chunk().map(|b| f64::from(u32::from_le_bytes(*b))),
            7 => bytes.first_chunk().map(|b| f64::from(f32::from_le_bytes(*b))),
            8 => bytes.first_chunk().map(|b| f64::from_le_bytes(*b)),
            _ => None,
        }
    }

    fn point(&self, bytes: &[u8]) -> Option<CloudPoint> {
        let position = [self.number(0, bytes)?, self.number(1, bytes)?, self.number(2, bytes)?];
        let on = self.number(5, bytes).zip(self.number(6, bytes)).map(|(s, b)| (s as u32, b as u32));
        let time = self.number(3, bytes).filter(|t| t.is_finite()).unwrap_or(0.0);
        Some(CloudPoint { position, time, ring: self.number(4, bytes).map(|r| r as u16), on })
    }
}

impl Cloud {
    /// The cloud of a message.
    ///
    /// # Errors
    /// Bytes that are cut off, or something else.
    pub fn read(mut bytes: &[u8]) -> Result<Self> {
        let (mut cloud, mut stride, mut parts, mut data) = (Self::default(), 0, Parts::default(), &[][..]);
        while !bytes.is_empty() {
            match field(&mut bytes)? {
                (2, Value::Block(text)) => cloud.frame = String::from_utf8_lossy(text).into_owned(),
                (3, Value::Block(block)) => cloud.pose = Some(posed(block)?),
                (4, Value::Number(bytes)) => stride = bytes as usize,
                (5, Value::Block(block)) => parts.add(block)?,
                (6, Value::Block(block)) => data = block,
                _ => {}
            }
        }
        if stride == 0 || parts.0[..3].iter().any(Option::is_none) {
            return Err(CloudError::NoPlaces);
        }
        let points: Option<Vec<CloudPoint>> = data.chunks_exact(stride).map(|p| parts.point(p)).collect();
        cloud.points = points.ok_or(CloudError::NoPlaces)?;
        Ok(cloud)
    }
}

/// A pose: position, and quaternion with x first.
fn posed(mut block: &[u8]) -> Result<Pose> {
    let mut pose = Pose::IDENTITY;
    while !block.is_empty() {
        match field(&mut block)? {
            (1, Value::Block(part)) => numbers(part, &mut pose.position)?,
            (2, Value::Block(part)) => {
                let mut q = [0.0; 4];
                numbers(part, &mut q)?;
                pose.orientation = [q[3], q[0], q[1], q[2]];
            }
            _ => {}
        }
    }
    Ok(pose)
}

fn numbers(mut block: &[u8], out: &mut [f64]) -> Result<()> {
    while !block.is_empty() {
        if let (tag @ 1.., Value::Fixed(bits)) = field(&mut block)?
            && let Some(out) = out.get_mut(tag as usize - 1)
        {
            *out = f64::from_bits(bits);
        }
    }
    Ok(())
}
