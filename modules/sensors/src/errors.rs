//! Errors of a channel: bias, white noise, rounding; and the numbers that they are drawn from.

/// Errors of a channel.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct ErrorModel {
    /// Standard deviation of the part that stays the same over a run.
    pub bias: f64,
    /// Standard deviation of white noise, for each sample.
    pub noise: f64,
    /// Values are rounded to multiples of this; 0: not rounded.
    pub quantum: f64,
}

/// The errors of all channels of a sensor.
///
/// ```
/// use terraglue_sensors::{ErrorModel, Errors};
/// let errors = Errors::new(7, [ErrorModel { quantum: 0.5, ..ErrorModel::default() }; 2]);
/// assert_eq!(errors.shown(0, 0, 1.7), 1.5);
/// // nothing is remembered: the same sample has the same error
/// let noisy = Errors::new(7, [ErrorModel { noise: 1.0, ..ErrorModel::default() }; 2]);
/// assert_eq!(noisy.shown(0, 3, 1.0), noisy.shown(0, 3, 1.0));
/// assert_ne!(noisy.shown(0, 3, 1.0), noisy.shown(0, 4, 1.0));
/// ```
#[derive(Clone, Debug)]
pub struct Errors {
    seed: u64,
    /// Channels 0 to 2, and those from 3 on.
    models: [ErrorModel; 2],
}

/// Sample number of the bias, which no sample has.
const BIAS: u64 = u64::MAX;

impl Errors {
    /// Of an instance with this seed.
    pub fn new(seed: u64, models: [ErrorModel; 2]) -> Self {
        Self { seed, models }
    }

    /// Output of a channel for `truth` in a sample.
    pub fn shown(&self, channel: usize, sample: u64, truth: f64) -> f64 {
        let model = &self.models[usize::from(channel >= 3)];
        let mut value = truth;
        if model.bias > 0.0 {
            value += model.bias * self.normal(channel, BIAS);
        }
        if model.noise > 0.0 {
            value += model.noise * self.normal(channel, sample);
        }
        let rounded = (value / model.quantum).round() * model.quantum;
        // a quantum of 0, or one so small that its multiples are no numbers, rounds nothing
        if rounded.is_finite() { rounded } else { value }
    }

    /// A number of the normal distribution (Box and Muller, 1958) that belongs to a channel and a sample.
    fn normal(&self, channel: usize, sample: u64) -> f64 {
        let base = mixed(self.seed ^ mixed(sample.wrapping_mul(8).wrapping_add(channel as u64)));
        let [u, v] = [base, mixed(base)].map(|bits| ((bits >> 11) as f64 + 0.5) / (1_u64 << 53) as f64);
        (-2.0 * libm::log(u)).sqrt() * libm::cos(std::f64::consts::TAU * v)
    }
}

/// One step of SplitMix64 (Steele, Lea and Flood, 2014).
fn mixed(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ x >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ x >> 31
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_and_bias_have_the_spread_that_is_asked_for() {
        let model = ErrorModel { noise: 2.0, ..ErrorModel::default() };
        let errors = Errors::new(42, [model; 2]);
        let all: Vec<f64> = (0..20_000).map(|k| errors.shown(1, k, 5.0)).collect();
        let n = all.len() as f64;
        let mean = all.iter().sum::<f64>() / n;
        let spread = (all.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / n).sqrt();
        // four standard errors: 2/√n and 2/√(2n)
        assert!(
            (mean - 5.0).abs() < 4.0 * 2.0 / n.sqrt() && (spread - 2.0).abs() < 4.0 * 2.0 / (2.0 * n).sqrt()
        );
        // neighbours know nothing of each other
        let together: f64 = all.windows(2).map(|w| (w[0] - mean) * (w[1] - mean)).sum::<f64>() / n;
        assert!(together.abs() < 4.0 * 4.0 / n.sqrt(), "{together}");
        let drawn = |seed: u64| {
            let bias = ErrorModel { bias: 1.0, ..ErrorModel::default() };
            Errors::new(seed, [bias; 2]).shown(0, 9, 0.0)
        };
        let spread = (0..5000).map(|seed| drawn(seed) * drawn(seed)).sum::<f64>() / 5000.0;
        assert!((spread - 1.0).abs() < 4.0 * (2.0_f64 / 5000.0).sqrt(), "{spread}");
    }
}
