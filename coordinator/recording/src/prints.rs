//! Prints and tracks: where and when something pressed on the ground, for the summary of a run and for its map.

use crate::ground_grid::GroundGrid;
use crate::keep::Keep;
use crate::summary::PrintDepth;
use terraglue_diagnostics::error::Result;
use terraglue_engine::observer::View;
use terraglue_subsystem::bytes::Persist;

/// After a longer break of contact than this the next print does not belong to the same track, s.
const BREAK_S: f64 = 0.05;
/// A body that has moved further than this leaves a new print, m.
pub(crate) const APART_M: f64 = 0.03;

/// A place where a shape pressed for a while.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Print {
    /// Place of the largest force, m.
    pub at: [f64; 2],
    pub from_s: f64,
    pub to_s: f64,
    pub largest_n: f64,
    /// Largest depth below the initial surface while it pressed, m.
    pub depth_m: f64,
    /// When it was that deep, s.
    pub deepest_s: f64,
    /// Whether the contact went on from the print before: a wheel rolls, a foot slides.
    pub joined: bool,
}

/// One moment of contact.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Touch {
    pub at: [f64; 2],
    pub t_s: f64,
    pub normal_n: f64,
    pub depth_m: f64,
}

/// Takes a moment into the prints of one shape, in order of time.
pub(crate) fn press(prints: &mut Vec<Print>, touch: &Touch) {
    let Touch { at, t_s, normal_n, depth_m } = *touch;
    let mut joined = false;
    if let Some(last) = prints.last_mut() {
        joined = t_s - last.to_s <= BREAK_S;
        let moved = (at[0] - last.at[0]).hypot(at[1] - last.at[1]);
        // what bounces, or steps on the spot, presses its own print once more
        if moved <= APART_M {
            last.to_s = t_s;
            if depth_m > last.depth_m {
                (last.depth_m, last.deepest_s) = (depth_m, t_s);
            }
            if normal_n > last.largest_n {
                (last.at, last.largest_n) = (at, normal_n);
            }
            return;
        }
    }
    let (from_s, to_s, deepest_s) = (t_s, t_s, t_s);
    prints.push(Print { at, from_s, to_s, largest_n: normal_n, depth_m, deepest_s, joined });
}

/// Prints of all shapes while a run goes on, with the depth of each.
pub(crate) struct PrintTrack {
    grid: Box<GroundGrid>,
    /// Subsystem, shape, prints.
    shapes: Vec<(u32, u32, Vec<Print>)>,
    sum_m: f64,
    steps: u64,
}

impl PrintTrack {
    /// On the ground of the run; `None` where no soil shows one.
    pub fn find(view: &View) -> Result<Option<Self>> {
        let grid = GroundGrid::find(view)?;
        Ok(grid.map(|grid| Self { grid: Box::new(grid), shapes: Vec::new(), sum_m: 0.0, steps: 0 }))
    }

    /// Takes the contacts of a step.
    pub fn follow(&mut self, view: &View) -> Result {
        let soil = &view.subsystems[self.grid.subsystem];
        let (mut sum, mut loaded) = (0.0, 0u32);
        for port in view.gluing.ports.iter().filter(|p| p.wrench[0] > 0.0) {
            let at = [port.origin[0], port.origin[1]];
            let depth_m = self.grid.sinkage_at(soil, at[0], at[1], view.t_s)?;
            (sum, loaded) = (sum + depth_m, loaded + 1);
            let same = |(subsystem, shape, _): &(u32, u32, Vec<Print>)| {
                (*subsystem, *shape) == (port.subsystem, port.shape)
            };
            let k = self.shapes.iter().position(same).unwrap_or_else(|| {
                self.shapes.push((port.subsystem, port.shape, Vec::with_capacity(256)));
                self.shapes.len() - 1
            });
            let touch = Touch { at, t_s: view.t_s, normal_n: port.wrench[0], depth_m };
            press(&mut self.shapes[k].2, &touch);
        }
        if loaded > 0 {
            self.sum_m += sum / f64::from(loaded);
            self.steps += 1;
        }
        Ok(())
    }

    /// Mean over the steps of the depth under what is loaded, m.
    pub fn mean_m(&self) -> Option<f64> {
        (self.steps > 0).then(|| self.sum_m / self.steps as f64)
    }

    /// Median and spread of the depths of all prints.
    pub fn depth(&self) -> Option<PrintDepth> {
        spread(self.shapes.iter().flat_map(|(_, _, prints)| prints).map(|p| p.depth_m).collect())
    }
}

terraglue_subsystem::persist!(Print { at, from_s, to_s, largest_n, depth_m, deepest_s, joined });

impl Keep for PrintTrack {
    fn keep(&self, out: &mut Vec<u8>) {
        let Self { grid, shapes, sum_m, steps } = self;
        (*sum_m, *steps).write(out);
        shapes.write(out);
        grid.keep(out);
    }

    fn recall(&mut self, from: &mut &[u8]) -> terraglue_subsystem::Result {
        (self.sum_m, self.steps) = Persist::read(from)?;
        self.shapes = Persist::read(from)?;
        self.grid.recall(from)
    }
}

/// Median, 10th and 90th percentile, between ranks by straight lines; none of nothing.
fn spread(mut depths: Vec<f64>) -> Option<PrintDepth> {
    depths.sort_by(f64::total_cmp);
    let last = depths.len().checked_sub(1)?;
    let at = |share: f64| {
        let rank = share * last as f64;
        let below = rank.floor() as usize;
        let (low, high) = (depths[below], depths[(below + 1).min(last)]);
        low + (rank - below as f64) * (high - low)
    };
    Some(PrintDepth { count: depths.len() as u64, median_m: at(0.5), p10_m: at(0.1), p90_m: at(0.9) })
}

#[cfg(test)]
#[path = "../tests/unit/prints.rs"]
mod tests;
