//! A hash over numbers and names that does not change with the compiler: FNV-1a of 64 bits.

use terraglue::diagnostics::fingerprint;

/// A hash in the making: the bytes to be hashed.
pub struct Digest(Vec<u8>);

impl Digest {
    /// Nothing hashed yet.
    pub fn new() -> Self {
        Self(Vec::new())
    }

    /// Adds bytes.
    pub fn bytes(&mut self, bytes: &[u8]) {
        self.0.extend_from_slice(bytes);
    }

    /// Adds a name, with an end that no name contains.
    pub fn name(&mut self, name: &str) {
        self.bytes(name.as_bytes());
        self.bytes(&[0]);
    }

    /// Adds numbers by their bits.
    pub fn numbers<'a>(&mut self, numbers: impl IntoIterator<Item = &'a f64>) {
        numbers.into_iter().for_each(|x| self.bytes(&x.to_bits().to_le_bytes()));
    }

    /// The hash in hexadecimal digits.
    pub fn text(&self) -> String {
        format!("{:016x}", fingerprint(&self.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_bit_counts() {
        let hash = |x: f64| {
            let mut digest = Digest::new();
            digest.numbers(&[1.0, x]);
            digest.text()
        };
        assert_eq!(hash(2.0), hash(2.0));
        assert_ne!(hash(2.0), hash(2.0_f64.next_up()));
        assert_ne!(hash(0.0), hash(-0.0));
    }

    #[test]
    fn it_is_the_published_function() {
        let mut digest = Digest::new();
        digest.bytes(b"foobar");
        assert_eq!(digest.text(), "85944171f73967e8");
    }
}
