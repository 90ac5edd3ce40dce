//! Where trees stand: grown from a seed by published distributions.

use crate::tree::{Species, Tree};
use terraglue_numerics::random::Random;

/// Ground of a stand as a formula: a slope with two waves.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Terrain {
    /// Rise along x and y, m/m.
    pub slope: [f64; 2],
    /// Height of the waves, m.
    pub waves: f64,
}

impl Terrain {
    /// Height at a place, m.
    pub fn height(&self, [x, y]: [f64; 2]) -> f64 {
        let long = libm::sin(0.21 * x + 0.4) * libm::cos(0.17 * y);
        let short = libm::sin(0.9 * x - 0.6 * y);
        self.slope[0] * x + self.slope[1] * y + self.waves * (long + 0.15 * short)
    }
}

/// How a stand grows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Growth {
    /// Trees per hectare.
    pub per_hectare: f64,
    /// Half the edge of the square around the origin in which trees stand, m.
    pub half_m: f64,
    /// Least distance of two trees, m.
    pub apart_m: f64,
    /// Scale of the Weibull distribution of diameters, m.
    pub diameter_m: f64,
    /// Shape of that distribution: 1 for stands of all ages, 3 to 4 for planted ones.
    pub shape: f64,
    /// Deviation of the lean of a stem along x and along y, m/m.
    pub lean: f64,
    /// Share of spruces; the others are pines.
    pub spruces: f64,
    /// Bushes per hectare.
    pub bushes_per_hectare: f64,
    /// No plant stands within this distance of the origin, m.
    pub clearing_m: f64,
    /// The ground.
    pub terrain: Terrain,
}

impl Default for Growth {
    fn default() -> Self {
        Self {
            per_hectare: 700.0,
            half_m: 40.0,
            apart_m: 1.5,
            diameter_m: 0.3,
            shape: 3.0,
            lean: 0.02,
            spruces: 0.4,
            bushes_per_hectare: 300.0,
            clearing_m: 2.0,
            terrain: Terrain { slope: [0.05, -0.03], waves: 0.4 },
        }
    }
}

impl Growth {
    /// Plants in the square at so many per hectare.
    fn count(&self, per_hectare: f64) -> usize {
        let hectares = 4e-4 * self.half_m * self.half_m;
        (per_hectare * hectares).round().clamp(0.0, 1e6) as usize
    }

    /// A diameter, m, of the Weibull distribution, by the inverse of its distribution function.
    pub fn diameter(&self, random: &mut Random) -> f64 {
        let drawn = libm::pow(-libm::log(random.uniform()), 1.0 / self.shape);
        (self.diameter_m * drawn).max(THINNEST)
    }

    /// A species by its share.
    pub fn species(&self, random: &mut Random) -> Species {
        if random.uniform() < self.spruces { Species::Spruce } else { Species::Pine }
    }
}

/// A bush, which is no tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bush {
    /// Middle on the ground, world, m.
    pub foot: [f64; 3],
    /// Radius, m; it is 1.5 times as tall.
    pub radius: f64,
}

/// Trees and bushes.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Stand {
    /// All trees.
    pub trees: Vec<Tree>,
    /// All bushes.
    pub bushes: Vec<Bush>,
}

/// Thinnest tree, m.
const THINNEST: f64 = 0.07;
/// Places that are tried for each plant.
const TRIES: usize = 200;

impl Stand {
    /// Grows trees one after the other, each at a place drawn anew until it is far enough from the others (simple sequential
    /// inhibition: B. D. Ripley, "Modelling spatial patterns", 1977), with diameters of a Weibull distribution (R. L. Bailey and
    /// T. R. Dell, "Quantifying diameter distributions with the Weibull function", 1973). Trees that find no place are omitted.
    pub fn grow(growth: &Growth, seed: u64) -> Self {
        let mut random = Random::new(seed);
        let mut stand = Self::default();
        let mut taken: Vec<[f64; 2]> = Vec::new();
        for _ in 0..growth.count(growth.per_hectare) {
            let Some(at) = place(growth, &taken, growth.apart_m, &mut random) else { continue };
            taken.push(at);
            stand.trees.push(tree(growth, at, &mut random));
        }
        stand.grow_bushes(growth, &mut random);
        stand
    }

    /// Bushes beside trees that are there already, grown as those of [`Stand::grow`].
    pub fn grow_bushes(&mut self, growth: &Growth, random: &mut Random) {
        for _ in 0..growth.count(growth.bushes_per_hectare) {
            let Some(at) = place(growth, &[], 0.0, random) else { continue };
            let foot = [at[0], at[1], growth.terrain.height(at)];
            self.bushes.push(Bush { foot, radius: random.between(0.3, 0.9) });
        }
    }

    /// Takes away all plants within `half_m` of a road through these corners, m.
    pub fn clear_road(&mut self, road: &[[f64; 2]], half_m: f64) {
        self.trees.retain(|t| is_free(road, half_m, t.foot));
        self.clear_road_of_bushes(road, half_m);
    }

    /// The same of bushes alone.
    pub fn clear_road_of_bushes(&mut self, road: &[[f64; 2]], half_m: f64) {
        self.bushes.retain(|b| is_free(road, half_m, b.foot));
    }
}

/// Whether a plant stands beside a road.
fn is_free(road: &[[f64; 2]], half_m: f64, foot: [f64; 3]) -> bool {
    road.windows(2).all(|p| distance(p[0], p[1], [foot[0], foot[1]]) >= half_m)
}

/// Distance of a place from a segment, m.
fn distance(from: [f64; 2], to: [f64; 2], at: [f64; 2]) -> f64 {
    let [ux, uy] = [0, 1].map(|k| to[k] - from[k]);
    let [x, y] = [0, 1].map(|k| at[k] - from[k]);
    let share = ((x * ux + y * uy) / (ux * ux + uy * uy).max(1e-12)).clamp(0.0, 1.0);
    libm::hypot(x - share * ux, y - share * uy)
}

fn place(growth: &Growth, taken: &[[f64; 2]], apart: f64, random: &mut Random) -> Option<[f64; 2]> {
    let far = |a: &[f64; 2], b: [f64; 2], d: f64| {
        let (x, y) = (a[0] - b[0], a[1] - b[1]);
        x * x + y * y >= d * d
    };
    (0..TRIES).find_map(|_| {
        let at = [0; 2].map(|_| random.between(-growth.half_m, growth.half_m));
        let free = far(&[0.0; 2], at, growth.clearing_m) && taken.iter().all(|t| far(t, at, apart));
        free.then_some(at)
    })
}

fn tree(growth: &Growth, at: [f64; 2], random: &mut Random) -> Tree {
    let diameter = growth.diameter(random);
    let height = Tree::usual_height(diameter) * (1.0 + 0.07 * random.normal()).max(0.7);
    let lean = [0; 2].map(|_| growth.lean * random.normal());
    let species = growth.species(random);
    Tree { foot: [at[0], at[1], growth.terrain.height(at)], diameter, height, lean, species }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trees_keep_their_distance_and_have_the_diameters_of_the_distribution() {
        let growth = Growth { half_m: 60.0, ..Growth::default() };
        let trees = Stand::grow(&growth, 3).trees;
        assert!((900..=1008).contains(&trees.len()), "{}", trees.len());
        for (k, a) in trees.iter().enumerate() {
            let near = |b: &Tree| libm::hypot(a.foot[0] - b.foot[0], a.foot[1] - b.foot[1]) < growth.apart_m;
            assert!(!trees[..k].iter().any(near));
        }
        // mean of a Weibull distribution of shape 3: 0.893 of its scale, four standard errors of 0.324/√n
        let mean = trees.iter().map(|t| t.diameter).sum::<f64>() / trees.len() as f64;
        assert!((mean - 0.893 * growth.diameter_m).abs() < 0.013, "{mean}");
    }

    #[test]
    fn nothing_stands_on_a_road() {
        let mut stand = Stand::grow(&Growth::default(), 1);
        let all = stand.trees.len();
        let road = [[-40.0, 0.0], [0.0, 0.0], [30.0, 20.0]];
        stand.clear_road(&road, 3.0);
        assert!(stand.trees.len() < all && stand.trees.len() > all / 2);
        let near = |at: [f64; 2]| road.windows(2).any(|p| distance(p[0], p[1], at) < 3.0);
        assert!(!stand.trees.iter().any(|t| near(t.place())));
        assert!((distance([0.0, 0.0], [2.0, 0.0], [3.0, 1.0]) - 2.0_f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn no_trees_and_no_room_are_no_error() {
        assert_eq!(
            Stand::grow(&Growth { per_hectare: 0.0, bushes_per_hectare: 0.0, ..Growth::default() }, 1),
            Stand::default()
        );
        let crowded = Growth { half_m: 2.0, apart_m: 50.0, clearing_m: 0.0, ..Growth::default() };
        assert!(Stand::grow(&crowded, 1).trees.len() <= 1);
    }
}
