//! States as bytes: compact, little-endian, with a version, with the mark of their owner, and with a hash, so that
//! bytes that were cut, changed or made by something else are refused before anything is taken over.
//!
//! Integers are variable-length (LEB128, signed ones folded by zigzag: 0, −1, 1, …), so that the many zeros of a ground
//! cost a byte each; numbers are the 8 bytes of an f64. A frame is `TGS1`, version, mark, content, FNV-1a of all before
//! (Fowler, Noll and Vo, 64 bits).
//!
//! ```
//! use terraglue_subsystem::{bytes, persist};
//! #[derive(Debug, PartialEq)]
//! struct Foot { key: u64, depth: f64, slipped: bool }
//! persist!(Foot { key, depth, slipped });
//! let foot = Foot { key: 7, depth: 0.02, slipped: false };
//! let state = bytes::seal(1, 42, &foot);
//! assert_eq!(bytes::open::<Foot>(1, 42, &state), Ok(foot));
//! assert!(bytes::open::<Foot>(2, 42, &state).is_err());
//! assert!(bytes::open::<Foot>(1, 42, &state[1..]).is_err());
//! ```

use crate::error::{Error, Result};

const MAGIC: &[u8; 4] = b"TGS1";
const HASH_BYTES: usize = 8;

/// A value that can be written and read back exactly. [`crate::persist!`] makes it for structures and enumerations.
pub trait Persist: Sized {
    /// Appends it.
    fn write(&self, out: &mut Vec<u8>);
    /// Takes it from the front.
    ///
    /// # Errors
    /// `Refused`: the bytes end too early, or encode no value of the type.
    fn read(from: &mut &[u8]) -> Result<Self>;
}

/// Makes [`bytes::Persist`](Persist) for a structure, all fields in this order, or for an enumeration without data, by
/// the names of its values. A field that is left out does not compile.
#[macro_export]
macro_rules! persist {
    (enum $name:ty { $($variant:ident),* $(,)? }) => {
        impl $crate::bytes::Persist for $name {
            fn write(&self, out: &mut Vec<u8>) {
                let name = match self { $(Self::$variant => stringify!($variant)),* };
                $crate::bytes::Persist::write(&name.to_owned(), out);
            }
            fn read(from: &mut &[u8]) -> $crate::Result<Self> {
                let name: String = $crate::bytes::Persist::read(from)?;
                match name.as_str() {
                    $(stringify!($variant) => Ok(Self::$variant),)*
                    other => Err($crate::bytes::wrong(&format!("`{other}` is none of its values"))),
                }
            }
        }
    };
    ($name:ty { $($field:ident),* $(,)? }) => {
        impl $crate::bytes::Persist for $name {
            fn write(&self, out: &mut Vec<u8>) {
                let Self { $($field),* } = self;
                $($crate::bytes::Persist::write($field, out);)*
            }
            fn read(from: &mut &[u8]) -> $crate::Result<Self> {
                Ok(Self { $($field: $crate::bytes::Persist::read(from)?),* })
            }
        }
    };
}

/// The refusal of a state, with the reason.
pub fn wrong(reason: &str) -> Error {
    Error::Refused(format!("these bytes are no state of this instance: {reason}"))
}

/// FNV-1a of 64 bits (Fowler, Noll and Vo 1991): distinguishes states, builds and inputs; no protection against intent.
pub fn hash(bytes: &[u8]) -> u64 {
    hash_from(0xcbf2_9ce4_8422_2325, bytes)
}

/// The same continued: the hash of what gave `start`, followed by these bytes.
pub fn hash_from(start: u64, bytes: &[u8]) -> u64 {
    bytes.iter().fold(start, |h, b| (h ^ u64::from(*b)).wrapping_mul(0x0100_0000_01b3))
}

/// Bytes of a state. `version` is that of its form, `mark` identifies its owner: the same model, the same ground.
pub fn seal(version: u32, mark: u64, state: &impl Persist) -> Vec<u8> {
    let mut out = MAGIC.to_vec();
    version.write(&mut out);
    out.extend(mark.to_le_bytes());
    state.write(&mut out);
    let sum = hash(&out);
    out.extend(sum.to_le_bytes());
    out
}

/// The state in bytes that [`seal`] made.
///
/// # Errors
/// `Refused`: cut, changed, of another version, or of something else.
pub fn open<T: Persist>(version: u32, mark: u64, bytes: &[u8]) -> Result<T> {
    let Some((content, sum)) = bytes.split_last_chunk::<HASH_BYTES>() else {
        return Err(wrong(&format!("{} bytes are too few", bytes.len())));
    };
    if !content.starts_with(MAGIC) {
        return Err(wrong("they begin with something else"));
    }
    if hash(content) != u64::from_le_bytes(*sum) {
        return Err(wrong("they were cut or changed"));
    }
    let mut rest = &content[MAGIC.len()..];
    let found = u32::read(&mut rest)?;
    if found != version {
        return Err(wrong(&format!("they are of version {found}, version {version} is read here")));
    }
    if u64::from_le_bytes(take(&mut rest)?) != mark {
        return Err(wrong("they belong to another model or another ground"));
    }
    let state = T::read(&mut rest)?;
    if rest.is_empty() { Ok(state) } else { Err(wrong(&format!("{} bytes are left over", rest.len()))) }
}

fn take<const N: usize>(from: &mut &[u8]) -> Result<[u8; N]> {
    let (first, rest) = from.split_first_chunk::<N>().ok_or_else(|| wrong("they end too early"))?;
    *from = rest;
    Ok(*first)
}

impl Persist for u64 {
    fn write(&self, out: &mut Vec<u8>) {
        let mut left = *self;
        while left >= 0x80 {
            out.push(left as u8 | 0x80);
            left >>= 7;
        }
        out.push(left as u8);
    }
    fn read(from: &mut &[u8]) -> Result<Self> {
        let mut value = 0;
        for k in 0..10 {
            let [byte] = take(from)?;
            let part = u64::from(byte & 0x7f);
            if k == 9 && part > 1 {
                break;
            }
            value |= part << (7 * k);
            if byte & 0x80 == 0 {
                return Ok(value);
            }
        }
        Err(wrong("a whole number is too long"))
    }
}

impl Persist for i64 {
    fn write(&self, out: &mut Vec<u8>) {
        (((self << 1) ^ (self >> 63)) as u64).write(out);
    }
    fn read(from: &mut &[u8]) -> Result<Self> {
        let folded = u64::read(from)?;
        Ok((folded >> 1) as i64 ^ -((folded & 1) as i64))
    }
}

macro_rules! narrow {
    ($($t:ty as $wide:ty),*) => {$(
        impl Persist for $t {
            fn write(&self, out: &mut Vec<u8>) {
                (*self as $wide).write(out);
            }
            fn read(from: &mut &[u8]) -> Result<Self> {
                <$wide>::read(from)?.try_into().map_err(|_| wrong("a whole number is too large"))
            }
        }
    )*};
}
narrow!(u8 as u64, u16 as u64, u32 as u64, usize as u64, i32 as i64);

impl Persist for bool {
    fn write(&self, out: &mut Vec<u8>) {
        out.push(u8::from(*self));
    }
    fn read(from: &mut &[u8]) -> Result<Self> {
        match take(from)? {
            [0] => Ok(false),
            [1] => Ok(true),
            [other] => Err(wrong(&format!("{other} is no truth value"))),
        }
    }
}

impl Persist for f64 {
    fn write(&self, out: &mut Vec<u8>) {
        out.extend(self.to_le_bytes());
    }
    fn read(from: &mut &[u8]) -> Result<Self> {
        take(from).map(Self::from_le_bytes)
    }
}

impl Persist for f32 {
    fn write(&self, out: &mut Vec<u8>) {
        out.extend(self.to_le_bytes());
    }
    fn read(from: &mut &[u8]) -> Result<Self> {
        take(from).map(Self::from_le_bytes)
    }
}

/// Bytes that take a byte each; as numbers every second of them would take two.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Block(pub Vec<u8>);

impl Persist for Block {
    fn write(&self, out: &mut Vec<u8>) {
        self.0.len().write(out);
        out.extend(&self.0);
    }
    fn read(from: &mut &[u8]) -> Result<Self> {
        let length = usize::read(from)?;
        let (block, rest) = from.split_at_checked(length).ok_or_else(|| wrong("they end too early"))?;
        *from = rest;
        Ok(Self(block.to_vec()))
    }
}

impl Persist for String {
    fn write(&self, out: &mut Vec<u8>) {
        self.len().write(out);
        out.extend(self.as_bytes());
    }
    fn read(from: &mut &[u8]) -> Result<Self> {
        Self::from_utf8(Block::read(from)?.0).map_err(|_| wrong("a name is no text"))
    }
}

impl Persist for () {
    fn write(&self, _: &mut Vec<u8>) {}
    fn read(_: &mut &[u8]) -> Result<Self> {
        Ok(())
    }
}

impl<T: Persist> Persist for Option<T> {
    fn write(&self, out: &mut Vec<u8>) {
        self.is_some().write(out);
        if let Some(value) = self {
            value.write(out);
        }
    }
    fn read(from: &mut &[u8]) -> Result<Self> {
        bool::read(from)?.then(|| T::read(from)).transpose()
    }
}

impl<T: Persist> Persist for Vec<T> {
    fn write(&self, out: &mut Vec<u8>) {
        self.len().write(out);
        self.iter().for_each(|value| value.write(out));
    }
    fn read(from: &mut &[u8]) -> Result<Self> {
        let length = usize::read(from)?;
        // every value takes a byte at least, so a length that lies takes no memory
        let mut all = Self::with_capacity(length.min(from.len() / size_of::<T>().max(1)));
        for _ in 0..length {
            if from.is_empty() {
                return Err(wrong("they end too early"));
            }
            all.push(T::read(from)?);
        }
        Ok(all)
    }
}

impl<T: Persist, const N: usize> Persist for [T; N] {
    fn write(&self, out: &mut Vec<u8>) {
        self.iter().for_each(|value| value.write(out));
    }
    fn read(from: &mut &[u8]) -> Result<Self> {
        let all = (0..N).map(|_| T::read(from)).collect::<Result<Vec<T>>>()?;
        all.try_into().map_err(|_| wrong("they end too early"))
    }
}

impl<A: Persist, B: Persist> Persist for (A, B) {
    fn write(&self, out: &mut Vec<u8>) {
        self.0.write(out);
        self.1.write(out);
    }
    fn read(from: &mut &[u8]) -> Result<Self> {
        Ok((A::read(from)?, B::read(from)?))
    }
}

impl<A: Persist, B: Persist, C: Persist> Persist for (A, B, C) {
    fn write(&self, out: &mut Vec<u8>) {
        self.0.write(out);
        self.1.write(out);
        self.2.write(out);
    }
    fn read(from: &mut &[u8]) -> Result<Self> {
        Ok((A::read(from)?, B::read(from)?, C::read(from)?))
    }
}

persist!(crate::Energy { kinetic, potential, dissipated, port_work, actuator_work, electrical });

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, PartialEq, Clone)]
    enum Gear {
        Off,
        On,
    }
    persist!(
        enum Gear {
            Off,
            On,
        }
    );

    #[derive(Debug, PartialEq, Clone)]
    struct State {
        counts: Vec<i32>,
        largest: (u64, i64),
        gear: [Gear; 2],
        held: Option<f64>,
        name: String,
        part: (f32, bool, Block),
    }
    persist!(State { counts, largest, gear, held, name, part });

    fn state() -> State {
        State {
            counts: vec![0, -1, 63, -64, 64, i32::MIN, i32::MAX],
            largest: (u64::MAX, i64::MIN),
            gear: [Gear::On, Gear::Off],
            held: Some(-0.0),
            name: "Fuß".into(),
            part: (f32::MIN_POSITIVE, true, Block(vec![0, 255])),
        }
    }

    #[test]
    fn what_is_written_is_read_and_small_numbers_are_short() {
        let bytes = seal(3, 9, &state());
        assert_eq!(open::<State>(3, 9, &bytes), Ok(state()));
        let mut out = Vec::new();
        vec![0_i32; 1000].write(&mut out);
        assert_eq!(out.len(), 1002);
    }

    #[test]
    fn every_cut_and_every_changed_byte_is_refused() {
        let bytes = seal(3, 9, &state());
        for k in 0..bytes.len() {
            assert!(open::<State>(3, 9, &bytes[..k]).is_err(), "{k} bytes");
            let mut other = bytes.clone();
            other[k] ^= 0x10;
            assert!(open::<State>(3, 9, &other).is_err(), "byte {k}");
        }
        assert!(open::<State>(3, 8, &bytes).is_err());
        assert!(open::<State>(2, 9, &bytes).is_err());
    }

    #[test]
    fn lengths_that_lie_take_no_memory() {
        let mut long = Vec::new();
        u64::MAX.write(&mut long);
        assert!(Vec::<f64>::read(&mut long.as_slice()).is_err());
        assert!(String::read(&mut long.as_slice()).is_err());
    }
}
