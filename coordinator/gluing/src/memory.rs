//! Memory of a group from step to step, as plain words: a snapshot holds all that later steps depend on.

/// Writes numbers one behind the other.
pub trait Remember {
    /// One number, to the bit.
    fn put(&mut self, value: f64);
    /// A list with its length.
    fn put_all(&mut self, values: &[f64]);
    /// Wrenches by port.
    fn put_wrenches(&mut self, wrenches: &[(u64, [f64; 6])]);
    /// Bytes with their number.
    fn put_bytes(&mut self, bytes: &[u8]);
}

impl Remember for Vec<u64> {
    fn put(&mut self, value: f64) {
        self.push(value.to_bits());
    }

    fn put_all(&mut self, values: &[f64]) {
        self.push(values.len() as u64);
        self.extend(values.iter().map(|v| v.to_bits()));
    }

    fn put_wrenches(&mut self, wrenches: &[(u64, [f64; 6])]) {
        self.push(wrenches.len() as u64);
        for (key, wrench) in wrenches {
            self.push(*key);
            self.extend(wrench.iter().map(|v| v.to_bits()));
        }
    }

    fn put_bytes(&mut self, bytes: &[u8]) {
        self.push(bytes.len() as u64);
        let word = |part: &[u8]| {
            let mut whole = [0; 8];
            whole[..part.len()].copy_from_slice(part);
            u64::from_le_bytes(whole)
        };
        self.extend(bytes.chunks(8).map(word));
    }
}

/// Reads them back in the same order; past the end, zeros.
#[derive(Debug)]
pub struct Recall<'a>(pub &'a [u64]);

impl Recall<'_> {
    /// A whole number.
    pub fn word(&mut self) -> u64 {
        let Some((first, rest)) = self.0.split_first() else { return 0 };
        self.0 = rest;
        *first
    }

    /// One number.
    pub fn number(&mut self) -> f64 {
        f64::from_bits(self.word())
    }

    /// A list.
    pub fn all(&mut self, into: &mut Vec<f64>) {
        let count = (self.word() as usize).min(self.0.len());
        into.clear();
        into.extend((0..count).map(|_| self.number()));
    }

    /// Bytes.
    pub fn bytes(&mut self, into: &mut Vec<u8>) {
        let count = (self.word() as usize).min(8 * self.0.len());
        into.clear();
        into.extend((0..count.div_ceil(8)).flat_map(|_| self.word().to_le_bytes()));
        into.truncate(count);
    }

    /// Wrenches by port.
    pub fn wrenches(&mut self, into: &mut Vec<(u64, [f64; 6])>) {
        let count = (self.word() as usize).min(self.0.len() / 7);
        into.clear();
        into.extend((0..count).map(|_| (self.word(), [0; 6].map(|_: i32| self.number()))));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_put_comes_back_to_the_bit() {
        let mut kept = Vec::new();
        let wrenches = vec![(7, [1.0, -0.0, f64::MIN_POSITIVE, 4.0, 5.0, 6.0])];
        kept.put(0.1 + 0.2);
        kept.put_all(&[1.0, f64::NAN]);
        kept.put_wrenches(&wrenches);
        let mut recall = Recall(&kept);
        assert_eq!(recall.number().to_bits(), (0.1_f64 + 0.2).to_bits());
        let (mut list, mut back) = (vec![9.0], Vec::new());
        recall.all(&mut list);
        assert!(list.len() == 2 && list[1].is_nan());
        recall.wrenches(&mut back);
        assert_eq!(back, wrenches);
        assert_eq!(recall.word(), 0);
    }
}
