//! Displacement: soil pressed out of a node is compacted in part; the rest flows to the ring around the foot, to where the
//! pressure falls and where the underside drags it (the flow zones below a rim, Wong 1967), trench and rims by conservation.

use crate::active::Marks;
use crate::compaction::Compaction;
use crate::feet::Feet;
use terraglue_soil_contact::{Ground, squares_grown};

/// The eight directions with the squared distance of one step.
const DIRECTIONS: [([i32; 2], i32); 8] = [
    ([1, 0], 1),
    ([1, 1], 2),
    ([0, 1], 1),
    ([-1, 1], 2),
    ([-1, 0], 1),
    ([-1, -1], 2),
    ([0, -1], 1),
    ([1, -1], 2),
];

/// A node by its tile and its number in it.
type Node = (usize, usize);

/// A node without a foot, and its weight among the eight.
type Place = (Node, f64);

/// Data that displacement changes.
pub struct Site<'a> {
    /// Ground.
    pub ground: &'a mut Ground,
    /// Nodes below feet: none of them takes material.
    pub feet: &'a Feet,
    /// Material that became denser.
    pub compaction: &'a mut Compaction,
    /// Nodes that have changed.
    pub changed: &'a mut Marks,
    /// Nodes whose loose soil moves.
    pub moving: &'a mut Marks,
    /// By how much the sum of the squares of the heights may grow.
    pub most: f64,
    /// By how much it has grown.
    pub lifted: i64,
}

impl Site<'_> {
    /// Takes `excess` units out of the loaded node (i, j): its compacted part, and the rest to the nearest nodes without
    /// a foot in eight directions d, weighted with (1 + flow·d)₊/distance². Returns how many units were moved; those without a
    /// place, and those whose lifting is not paid for yet, stay and are tried again at the next commit. `turn` rotates the direction that gets the remainder.
    pub fn displace(&mut self, [i, j]: [i32; 2], excess: i32, flow: [f64; 2], turn: u32) -> i32 {
        let mut places = [None; 8];
        let mut sum = 0.0;
        for (place, (direction, squared)) in places.iter_mut().zip(DIRECTIONS) {
            *place = self.nearest_free([i, j], direction).map(|(at, steps)| {
                let along = flow[0] * f64::from(direction[0]) + flow[1] * f64::from(direction[1]);
                let towards = (1.0 + along / f64::from(squared).sqrt()).max(0.0);
                let weight = towards / (f64::from(squared) * f64::from(steps) * f64::from(steps));
                sum += weight;
                (at, weight)
            });
        }
        let excess = excess.min(self.liftable([i, j], &places, sum));
        if excess <= 0 {
            return 0;
        }
        let dense = self.compaction.take([i, j], excess);
        let loose = excess - dense;
        let mut left = loose;
        if sum == 0.0 {
            let any = places.iter().flatten().map(|(at, _)| *at).next();
            if let Some(at) = any.or_else(|| self.nearest_anywhere([i, j])) {
                left -= self.give(at, left);
            }
        } else {
            for (at, weight) in places.iter().flatten() {
                let share = (f64::from(loose) * weight / sum) as i32;
                left -= self.give(*at, share.min(left));
            }
            let last =
                (0..8).find_map(|k| places[(turn as usize + k) % 8].filter(|(_, weight)| *weight > 0.0));
            left -= last.map_or(0, |(at, _)| self.give(at, left));
        }
        let gone = excess - left;
        if gone > 0 {
            self.ground.heights.add_units(i, j, -gone);
            self.changed.mark([i, j]);
            // compacted material stays at its height
            let all = squares_grown(self.ground.heights.units(i, j), -gone);
            self.lifted += all - all / i64::from(gone) * i64::from(dense);
        }
        loose - left
    }

    /// Number of units that can go from a node to its places until the sum of the squares of the heights has grown by
    /// the most.
    fn liftable(&self, [i, j]: [i32; 2], places: &[Option<Place>; 8], sum: f64) -> i32 {
        let heights = &self.ground.heights;
        let (own, mut higher, mut spread) = (heights.units(i, j), 0.0, 1.0);
        for ((tile, k), weight) in places.iter().flatten().filter(|_| sum > 0.0) {
            let share = weight / sum;
            higher += share * f64::from(heights.units_at(*tile, *k) - own);
            spread += share * share;
        }
        // compacted material is not lifted: spread·n² + 2·higher·n = most of the rest
        let most = self.most.max(0.0) / (1.0 - self.compaction.fraction()).max(f64::MIN_POSITIVE);
        (((higher * higher + spread * most).sqrt() - higher) / spread) as i32
    }

    /// A node of the lattice, if no foot covers it.
    fn free(&self, [i, j]: [i32; 2]) -> Option<Node> {
        let (tile, k) = self.ground.heights.lattice().locate(i as u32, j as u32);
        (!self.feet.above_at(tile, k)).then_some((tile, k))
    }

    /// The first node along a direction that no foot covers, and its distance in steps.
    fn nearest_free(&self, from: [i32; 2], direction: [i32; 2]) -> Option<(Node, i32)> {
        let lattice = self.ground.heights.lattice();
        for steps in 1.. {
            let at = [from[0] + steps * direction[0], from[1] + steps * direction[1]];
            if !lattice.has(at[0], at[1]) {
                return None;
            }
            if let Some(node) = self.free(at) {
                return Some((node, steps));
            }
        }
        None
    }

    /// A nearest free node by rings of growing size: for a foot in a corner that no direction leads out of.
    fn nearest_anywhere(&self, [i, j]: [i32; 2]) -> Option<Node> {
        let lattice = self.ground.heights.lattice();
        let farthest = lattice.size[0].max(lattice.size[1]) as i32;
        for r in 1..=farthest {
            for d in -r..=r {
                let ring = [[i + d, j - r], [i + d, j + r], [i - r, j + d], [i + r, j + d]];
                let mut inside = ring.into_iter().filter(|at| lattice.has(at[0], at[1]));
                if let Some(node) = inside.find_map(|at| self.free(at)) {
                    return Some(node);
                }
            }
        }
        None
    }

    fn give(&mut self, (tile, k): Node, units: i32) -> i32 {
        if units > 0 {
            let height = self.ground.add_material_at(tile, k, units);
            self.lifted += squares_grown(height, units);
            self.changed.mark_at(tile, k);
            self.moving.mark_at(tile, k);
        }
        units.max(0)
    }
}
