//! Walls that stand by cohesion in a window: the beds below what lies loose, and which of its slopes stand.

use super::{LEFT, Limits, Window};
use crate::standing::Field;
use terraglue_soil_contact::Ground;

impl Window {
    /// Prepares the filled window for slopes that stand by cohesion; `range`: lowest and highest level of all that may slide,
    /// units. Where it lies within the critical height every slope stands.
    pub fn look_for_standing(&mut self, ground: &Ground, limits: &Limits, [low, high]: [i32; 2]) {
        if limits.critical <= 0 {
            return;
        }
        let any_loose = self.copy_beds(ground);
        self.all_stands = !any_loose && high.saturating_sub(low) <= limits.critical;
        if !self.all_stands {
            let bounds = [self.width, self.height];
            self.standing.look_beyond(ground, self.origin, bounds, limits.repose as i32);
        }
    }

    /// The levels of the beds; where the lattice ends nothing lies loose. Returns whether anything does.
    fn copy_beds(&mut self, ground: &Ground) -> bool {
        self.beds.clear();
        self.beds.extend_from_slice(&self.levels[..self.stride * self.height]);
        let mut any_loose = false;
        let (Some(columns), Some(rows)) = (self.columns, self.rows) else { return false };
        for y in rows.lo..rows.hi {
            for x in columns.lo..columns.hi {
                let [i, j] = [self.origin[0] + (x - LEFT) as i32, self.origin[1] + y as i32];
                let loose = ground.loose_units(i, j);
                self.beds[y * self.stride + x] -= loose;
                any_loose |= loose > 0;
            }
        }
        any_loose
    }

    /// What lies loose at a place, units.
    #[inline(always)]
    pub(super) fn loose(&self, at: usize) -> i32 {
        (self.levels[at] - self.beds[at]).max(0)
    }

    /// Finds the faces whose slope stands by cohesion.
    pub(super) fn find_standing(&mut self, limits: &Limits) {
        let (Some(x), Some(y)) = (self.columns, self.rows) else { return };
        let thr = |at: usize| self.repose_of.get(at).copied().unwrap_or(limits.repose);
        let (levels, beds, stride) = (&self.levels, &self.beds, self.stride);
        let inlets = if self.limited.contains(&true) { &self.inlets[..] } else { &[] };
        let field = Field {
            levels,
            beds,
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
