//! JSON text written into a buffer that is reused from message to message, without an intermediate tree.
//!
//! A recording writes thousands of numbers a step; building `serde_json::Value`s for them would cost more than
//! the physics. Numbers are written in their shortest form that reads back to the same bits.

use std::io::Write;

/// A JSON text under construction. Commas are placed by [`JsonBuffer::key`] and [`JsonBuffer::element`].
#[derive(Default)]
pub(crate) struct JsonBuffer {
    bytes: Vec<u8>,
    refused: Option<String>,
}

impl JsonBuffer {
    /// Empties the text, keeps the memory.
    pub fn clear(&mut self) -> &mut Self {
        self.bytes.clear();
        self.refused = None;
        self
    }

    /// The text so far.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Key of the first number since `clear` that was NaN.
    pub fn refused(&self) -> Option<&str> {
        self.refused.as_deref()
    }

    /// Text that is JSON already.
    pub fn raw(&mut self, text: impl AsRef<[u8]>) -> &mut Self {
        self.bytes.extend_from_slice(text.as_ref());
        self
    }

    /// A comma where one is needed before another element of an array or object.
    pub fn element(&mut self) -> &mut Self {
        if !matches!(self.bytes.last(), None | Some(b'{' | b'[' | b':' | b'\n')) {
            self.bytes.push(b',');
        }
        self
    }

    /// A key that needs no escape, and its colon.
    pub fn key(&mut self, key: &str) -> &mut Self {
        self.element();
        self.bytes.push(b'"');
        self.bytes.extend_from_slice(key.as_bytes());
        self.bytes.extend_from_slice(b"\":");
        self
    }

    /// A number. NaN is refused and remembered under the key `name`; an infinite one becomes `null`: no bound.
    pub fn number(&mut self, name: &str, value: f64) -> &mut Self {
        if value.is_nan() && self.refused.is_none() {
            self.refused = Some(name.to_owned());
        }
        // Writing to a vector cannot fail; serde_json writes infinities as null.
        let _ = serde_json::to_writer(&mut self.bytes, &value);
        self
    }

    /// `"key":number`, or `null` where it is unknown or does not apply (NaN).
    pub fn known(&mut self, key: &str, value: f64) -> &mut Self {
        if value.is_nan() { self.key(key).raw("null") } else { self.field(key, value) }
    }

    /// A whole number.
    pub fn integer(&mut self, value: impl std::fmt::Display) -> &mut Self {
        let _ = write!(self.bytes, "{value}");
        self
    }

    /// `true` or `false`.
    pub fn boolean(&mut self, value: bool) -> &mut Self {
        self.raw(if value { "true" } else { "false" })
    }

    /// A text with escapes.
    pub fn text(&mut self, value: &str) -> &mut Self {
        let _ = serde_json::to_writer(&mut self.bytes, value);
        self
    }

    /// `"key":number`.
    pub fn field(&mut self, key: &str, value: f64) -> &mut Self {
        self.key(key).number(key, value)
    }

    /// `"key":[a,b,…]`.
    pub fn numbers(&mut self, key: &str, values: &[f64]) -> &mut Self {
        self.key(key).raw("[");
        for value in values {
            self.element().number(key, *value);
        }
        self.raw("]")
    }

    /// `"key":{"x":…,"y":…,"z":…}`, as viewers want points and vectors.
    pub fn vector(&mut self, key: &str, v: &[f64; 3]) -> &mut Self {
        self.key(key).raw("{").field("x", v[0]).field("y", v[1]).field("z", v[2]).raw("}")
    }

    /// A unit quaternion given as w, x, y, z.
    pub fn quaternion(&mut self, key: &str, q: &[f64; 4]) -> &mut Self {
        self.key(key).raw("{").field("x", q[1]).field("y", q[2]).field("z", q[3]).field("w", q[0]).raw("}")
    }

    /// `"timestamp":{"sec":…,"nsec":…}`.
    pub fn timestamp(&mut self, nanoseconds: u64) -> &mut Self {
        self.key("timestamp").raw("{").key("sec").integer(nanoseconds / 1_000_000_000);
        self.key("nsec").integer(nanoseconds % 1_000_000_000).raw("}")
    }
}
