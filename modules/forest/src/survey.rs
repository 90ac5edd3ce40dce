//! Maps of a stand as a survey makes them: places with noise, trees that were missed, and trees that are not there.

use crate::stand::Stand;
use terraglue_numerics::random::Random;

/// Errors of a map.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Survey {
    /// Deviation of a place along x and along y, m.
    pub noise_m: f64,
    /// Share of the trees that are not on the map.
    pub missing: f64,
    /// Trees on the map that are not there, as a share of those that are.
    pub extra: f64,
}

/// A tree of a map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surveyed {
    /// Place, world, m.
    pub place: [f64; 2],
    /// Number of the tree in the stand; none: it is not there.
    pub tree: Option<usize>,
}

impl Survey {
    /// The map that this survey makes of a stand: extra trees lie anywhere within the bounds of the trees.
    pub fn of(&self, stand: &Stand, seed: u64) -> Vec<Surveyed> {
        let mut random = Random::new(seed);
        let mut map = Vec::new();
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for (number, tree) in stand.trees.iter().enumerate() {
            let place = tree.place();
            for k in 0..2 {
                low[k] = low[k].min(place[k]);
                high[k] = high[k].max(place[k]);
            }
            let is_missed = random.uniform() < self.missing;
            let place = place.map(|x| x + self.noise_m * random.normal());
            if !is_missed {
                map.push(Surveyed { place, tree: Some(number) });
            }
        }
        let extra = (self.extra * stand.trees.len() as f64).round().clamp(0.0, 1e6) as usize;
        map.extend(
            (0..extra)
                .map(|_| Surveyed { place: [0, 1].map(|k| random.between(low[k], high[k])), tree: None }),
        );
        map
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Growth;

    #[test]
    fn a_survey_misses_and_invents_its_shares() {
        let stand = Stand::grow(&Growth { half_m: 80.0, ..Growth::default() }, 2);
        let n = stand.trees.len() as f64;
        let map = Survey { noise_m: 0.5, missing: 0.3, extra: 0.1 }.of(&stand, 1);
        let seen: Vec<_> = map.iter().filter_map(|m| Some((m.place, stand.trees[m.tree?].place()))).collect();
        // four standard errors of a share of 0.7
        assert!((seen.len() as f64 / n - 0.7).abs() < 4.0 * (0.21 / n).sqrt());
        assert_eq!(map.len() - seen.len(), (0.1 * n).round() as usize);
        let square = seen.iter().map(|(a, b)| (a[0] - b[0]) * (a[0] - b[0])).sum::<f64>() / seen.len() as f64;
        assert!((square.sqrt() - 0.5).abs() < 0.05, "{square}");
    }
}
