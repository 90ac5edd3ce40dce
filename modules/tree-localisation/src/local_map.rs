//! Stages 4 and 5: the map of the trees around, from the stems of one scanner, of several, and of several turns.

use crate::pose::Pose2;
use crate::stems::Stem;
use terraglue_subsystem::persist;

/// A tree of a local map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalTree {
    /// Place at breast height in the frame of the map, m.
    pub place: [f64; 2],
    /// Deviation of the place along each axis, m.
    pub deviation: f64,
    /// Diameter at breast height, m.
    pub diameter: f64,
    /// Deviation of the diameter, m.
    pub diameter_deviation: f64,
    /// Scans that showed it.
    pub sightings: u32,
}
persist!(LocalTree { place, deviation, diameter, diameter_deviation, sightings });

impl From<&Stem> for LocalTree {
    fn from(stem: &Stem) -> Self {
        Self {
            place: stem.place,
            deviation: stem.deviation,
            diameter: stem.diameter,
            diameter_deviation: stem.diameter_deviation,
            sightings: 1,
        }
    }
}

impl LocalTree {
    /// The same tree in the frame in which its own frame has this pose.
    pub fn moved(&self, pose: &Pose2) -> Self {
        Self { place: pose.place(self.place), ..*self }
    }

    /// One tree from two sightings, each with the weight of its deviation.
    fn with(&self, other: &Self) -> Self {
        let fused = |a: f64, da: f64, b: f64, db: f64| {
            let (wa, wb) = (1.0 / (da * da).max(1e-8), 1.0 / (db * db).max(1e-8));
            ((wa * a + wb * b) / (wa + wb), (1.0 / (wa + wb)).sqrt())
        };
        let (x, deviation) = fused(self.place[0], self.deviation, other.place[0], other.deviation);
        let (y, _) = fused(self.place[1], self.deviation, other.place[1], other.deviation);
        let (diameter, diameter_deviation) =
            fused(self.diameter, self.diameter_deviation, other.diameter, other.diameter_deviation);
        // sightings share errors of the method: lean, taper
        let deviation = deviation.max(0.5 * self.deviation.min(other.deviation)).max(0.015);
        let sightings = self.sightings + other.sightings;
        Self { place: [x, y], deviation, diameter, diameter_deviation, sightings }
    }
}

/// Trees nearer to each other than this are one, m.
pub const SAME_TREE_M: f64 = 0.3;
/// Deviations by which two sightings of one tree may differ.
const GATE: f64 = 3.0;

/// Adds sightings to a map: each joins the nearest tree that it can be, or is a new one.
pub fn add_sightings(map: &mut Vec<LocalTree>, sightings: &[LocalTree]) {
    for seen in sightings.iter().filter(|s| s.place.iter().all(|x| x.is_finite())) {
        let gap = |t: &LocalTree| distance(t.place, seen.place);
        let near = (0..map.len()).min_by(|a, b| gap(&map[*a]).total_cmp(&gap(&map[*b])));
        match near.filter(|k| is_same(&map[*k], seen)) {
            Some(k) => map[k] = map[k].with(seen),
            None => map.push(*seen),
        }
    }
    join(map);
}

/// One map from those of several scanners in the same frame: no two trees are within [`SAME_TREE_M`].
pub fn merged(maps: &[Vec<LocalTree>]) -> Vec<LocalTree> {
    let mut all = Vec::new();
    maps.iter().for_each(|map| add_sightings(&mut all, map));
    all
}

fn is_same(a: &LocalTree, b: &LocalTree) -> bool {
    let spread = libm::sqrt(a.deviation * a.deviation + b.deviation * b.deviation);
    distance(a.place, b.place) < SAME_TREE_M.max((GATE * spread).min(0.8))
}

/// Joins trees of a map until none are within [`SAME_TREE_M`].
fn join(map: &mut Vec<LocalTree>) {
    let mut k = 0;
    while k < map.len() {
        let near = |other: usize| distance(map[k].place, map[other].place) < SAME_TREE_M;
        match (k + 1..map.len()).find(|other| near(*other)) {
            Some(other) => {
                map[k] = map[k].with(&map[other]);
                map.swap_remove(other);
                // it has moved: begin again
                k = 0;
            }
            None => k += 1,
        }
    }
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    let (x, y) = (a[0] - b[0], a[1] - b[1]);
    (x * x + y * y).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tree(x: f64, y: f64) -> LocalTree {
        LocalTree { place: [x, y], deviation: 0.05, diameter: 0.3, diameter_deviation: 0.02, sightings: 1 }
    }

    #[test]
    fn scanners_that_see_the_same_tree_make_one_of_it() {
        let maps =
            [vec![tree(0.0, 0.0), tree(5.0, 0.0)], vec![tree(0.1, 0.1), tree(0.0, 5.0), tree(f64::NAN, 0.0)]];
        let map = merged(&maps);
        assert_eq!(map.len(), 3);
        assert!((map[0].place[0] - 0.05).abs() < 1e-12 && map[0].sightings == 2 && map[0].deviation < 0.05);
    }

    #[test]
    fn duplicates_are_joined_however_many() {
        let many: Vec<LocalTree> = (0..50).map(|k| tree(0.01 * f64::from(k), 0.0)).collect();
        let map = merged(&[many]);
        for (k, a) in map.iter().enumerate() {
            assert!(map[..k].iter().all(|b| distance(a.place, b.place) >= SAME_TREE_M));
        }
    }
}
