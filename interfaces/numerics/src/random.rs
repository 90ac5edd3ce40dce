//! Numbers drawn from a seed by their place in a sequence: nothing is remembered, so the numbers do not depend on order or threads.

/// One step of SplitMix64 (Steele, Lea and Flood, 2014): 64 bits that know nothing of those of neighbouring numbers.
#[inline]
pub fn mixed(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ x >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ x >> 31
}

/// Number `place` of the sequence of a seed, evenly distributed in 0 … 1 with neither end.
///
/// ```
/// use terraglue_numerics::random::uniform;
/// assert_eq!(uniform(7, 3), uniform(7, 3));
/// assert!(uniform(7, 3) != uniform(7, 4) && uniform(7, 3) != uniform(8, 3));
/// ```
#[inline]
pub fn uniform(seed: u64, place: u64) -> f64 {
    unit(mixed(seed ^ mixed(place)))
}

/// Number `place` of the sequence of a seed, normally distributed with mean 0 and deviation 1 (Box and Muller, 1958).
#[inline]
pub fn normal(seed: u64, place: u64) -> f64 {
    let base = mixed(seed ^ mixed(place));
    let [u, v] = [base, mixed(base)].map(unit);
    (-2.0 * libm::log(u)).sqrt() * libm::cos(std::f64::consts::TAU * v)
}

#[inline]
fn unit(bits: u64) -> f64 {
    ((bits >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
}

/// Draws one number after the other from a seed.
///
/// ```
/// use terraglue_numerics::random::Random;
/// let mut random = Random::new(1);
/// assert!(random.between(2.0, 3.0) >= 2.0);
/// assert!(random.uniform() != random.uniform());
/// ```
#[derive(Clone, Debug)]
pub struct Random {
    seed: u64,
    place: u64,
}

impl Random {
    /// The sequence of a seed.
    pub fn new(seed: u64) -> Self {
        Self { seed: mixed(seed), place: 0 }
    }

    fn next(&mut self) -> u64 {
        self.place += 1;
        self.place
    }

    /// Evenly in 0 … 1.
    pub fn uniform(&mut self) -> f64 {
        uniform(self.seed, self.next())
    }

    /// Evenly in `low` … `high`.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }

    /// Normally, mean 0 and deviation 1.
    pub fn normal(&mut self) -> f64 {
        normal(self.seed, self.next())
    }

    /// Evenly among 0 … n − 1; 0 where n is 0.
    pub fn below(&mut self, n: usize) -> usize {
        ((self.uniform() * n as f64) as usize).min(n.saturating_sub(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_are_those_of_the_distributions() {
        let n = 100_000;
        let of = |f: &dyn Fn(u64) -> f64| {
            let all: Vec<f64> = (0..n).map(f).collect();
            let mean = all.iter().sum::<f64>() / n as f64;
            (mean, all.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / n as f64)
        };
        let (mean, square) = of(&|k| normal(3, k));
        // four standard errors
        assert!(mean.abs() < 4.0 / (n as f64).sqrt() && (square - 1.0).abs() < 4.0 * (2.0 / n as f64).sqrt());
        let (mean, square) = of(&|k| uniform(3, k));
        assert!((mean - 0.5).abs() < 4.0 * (1.0 / 12.0 / n as f64).sqrt());
        assert!((square - 1.0 / 12.0).abs() < 1e-3);
    }
}
