//! Displacement: what a foot presses out of a node goes to the nearest free nodes.

use crate::awake::Awake;
use crate::cell::{Cell, OPEN, QUANTUM};
use crate::levels::Levels;
use terraglue_ground::TileMap;
use terraglue_soil_contact::Ground;

/// The eight directions with the squared distance of one step.
const DIRECTIONS: [([i32; 2], f64); 8] = [
    ([1, 0], 1.0),
    ([1, 1], 2.0),
    ([0, 1], 1.0),
    ([-1, 1], 2.0),
    ([-1, 0], 1.0),
    ([-1, -1], 2.0),
    ([0, -1], 1.0),
    ([1, -1], 2.0),
];
/// Nodes that are looked at along a direction.
const FARTHEST: i32 = 200;

/// What displacement changes.
pub struct Site<'a> {
    /// Ground.
    pub ground: &'a mut Ground,
    /// Cells.
    pub cells: &'a mut TileMap<Cell>,
    /// Heights with load.
    pub levels: &'a mut Levels,
    /// Awake nodes.
    pub awake: &'a mut Awake,
}

impl Site<'_> {
    /// Moves `excess` units out of the loaded node (i, j). Returns how many found a place; the others stay and are
    /// tried again at the next commit. `turn` rotates the direction that gets the units that cannot be split.
    pub fn displace(&mut self, [i, j]: [i32; 2], excess: i32, turn: u32) -> i32 {
        let mut places = [None; 8];
        let mut sum = 0.0;
        for (place, (direction, squared)) in places.iter_mut().zip(DIRECTIONS) {
            *place = self.nearest_free([i, j], direction).map(|(at, steps)| {
                let weight = 1.0 / (squared * f64::from(steps * steps));
                sum += weight;
                (at, weight)
            });
        }
        if sum == 0.0 {
            return 0;
        }
        let mut left = excess;
        for (at, weight) in places.iter().flatten() {
            let share = (f64::from(excess) * weight / sum) as i32;
            left -= self.give(*at, share.min(left));
        }
        for k in 0..8 {
            if let Some((at, _)) = places[(turn as usize + k) % 8] {
                left -= self.give(at, left);
            }
        }
        let moved = excess - left;
        if moved > 0 {
            self.ground.heights.add_units(i, j, -moved);
            self.levels.add(i, j, -moved);
            self.awake.wake(i, j);
        }
        moved
    }

    /// The first node along a direction that takes material, and its distance in steps.
    fn nearest_free(&self, from: [i32; 2], direction: [i32; 2]) -> Option<([i32; 2], i32)> {
        for steps in 1..=FARTHEST {
            let at = [from[0] + steps * direction[0], from[1] + steps * direction[1]];
            if !self.cells.lattice().has(at[0], at[1]) {
                return None;
            }
            if self.cells.get(at[0], at[1]).room >= QUANTUM {
                return Some((at, steps));
            }
        }
        None
    }

    /// Puts up to `units` onto a free node, no more than fits below a foot; returns how many.
    fn give(&mut self, [i, j]: [i32; 2], units: i32) -> i32 {
        let cell = self.cells.get(i, j);
        let units = units.min(cell.room);
        if units <= 0 {
            return 0;
        }
        if cell.room != OPEN {
            self.cells.get_mut(i, j).room -= units;
        }
        self.ground.add_material(i, j, units);
        self.levels.add(i, j, units);
        self.awake.wake(i, j);
        units
    }
}
