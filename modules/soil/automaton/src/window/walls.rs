//! Walls that stand by cohesion in a window: the beds below loose soil, and which of its slopes stand.

use super::{LEFT, Limits, Window};
use crate::active::Marks;
use crate::standing::Face;
use crate::standing::Field;
use terraglue_soil_contact::Ground;

impl Window {
    /// Prepares the filled window for slopes that stand by cohesion; `moving`: nodes whose loose soil is not at rest; `range`:
    /// lowest and highest level of all that may slide, units. Where it lies within the critical height every slope stands.
    pub fn look_for_standing(
        &mut self,
        ground: &Ground,
        limits: &Limits,
        moving: &Marks,
        [low, high]: [i32; 2],
    ) {
        if limits.critical[0] <= 0 {
            return;
        }
        let any = self.copy_beds(ground, moving);
        let within = |critical: i32| high.saturating_sub(low) <= critical;
        let [firm, loose] = limits.critical.map(within);
        self.all_stands = firm && !any[0] || loose && !any[1];
        if !self.all_stands {
            let bounds = [self.width, self.height];
            self.standing.look_beyond(ground, self.origin, bounds, limits.repose as i32);
        }
    }

    /// The levels of the beds and of the soil at rest; where the lattice ends nothing lies loose. Returns whether anything
    /// lies loose, and whether anything of it moves.
    fn copy_beds(&mut self, ground: &Ground, moving: &Marks) -> [bool; 2] {
        let Self { beds, resting, levels, .. } = self;
        for copy in [beds, resting] {
            copy.clear();
            copy.extend_from_slice(&levels[..self.stride * self.height]);
        }
        let mut any = [false; 2];
        let (Some(columns), Some(rows)) = (self.columns, self.rows) else { return any };
        for y in rows.lo..rows.hi {
            for x in columns.lo..columns.hi {
                let [i, j] = [self.origin[0] + (x - LEFT) as i32, self.origin[1] + y as i32];
                let loose = ground.loose_units(i, j);
                if loose <= 0 {
                    continue;
                }
                self.beds[y * self.stride + x] -= loose;
                any[0] = true;
                if moving.has([i, j]) {
                    self.resting[y * self.stride + x] -= loose;
                    any[1] = true;
                }
            }
        }
        any
    }

    /// Units at a place that cohesion does not hold over such a face. Units that arrive in a round move to its end.
    #[inline(always)]
    pub(super) fn free(&self, at: usize, face: Face) -> i32 {
        let held = if face == Face::Sheds { &self.beds } else { &self.resting };
        (self.levels[at] - held[at]).max(0)
    }

    /// Finds the faces whose slope stands by cohesion.
    pub(super) fn find_standing(&mut self, limits: &Limits) {
        let (Some(x), Some(y)) = (self.columns, self.rows) else { return };
        let thr = |at: usize| self.repose_of.get(at).copied().unwrap_or(limits.repose);
        let (levels, beds, resting, stride) = (&self.levels, &self.beds, &self.resting, self.stride);
        let inlets = if self.limited.contains(&true) { &self.inlets[..] } else { &[] };
        let field = Field {
            levels,
            beds,
            resting,
            stride,
            columns: x,
            rows: y,
            left: LEFT,
            least: limits.least_repose,
            inlets,
        };
        self.standing.find(&field, &self.repose, thr, limits.critical);
    }
}
