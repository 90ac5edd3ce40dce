//! The figures of the steps before, for a run that goes on in another process.

use super::{Deepest, GluingSums, Integral, SummaryObserver};
use crate::keep::{Keep, keep};
use terraglue_subsystem::bytes::Persist;
use terraglue_subsystem::persist;

persist!(Integral { subsystem, id, told, before, sum });
persist!(GluingSums {
    steps,
    histogram,
    soil_histogram,
    bodies,
    soil,
    soil_max,
    not_converged,
    checked,
    with_gap,
    tt_steps,
    xt_steps,
    max_gap_m,
    max_action_reaction_gap_n,
    max_estimate_gap_n,
    interface_work_error_j,
    kappa_max,
    refreshes,
    differences,
    residual,
    complementarity_n,
    rank_missing,
    condition,
    halved,
});
keep!(SummaryObserver {
    events,
    steps,
    t_s,
    body,
    speed,
    mass_error,
    motors,
    electrical_j,
    energies,
    gluing,
} parts { sinkage, prints } same {
    scenario,
    strategy,
    body_name,
    speed_name,
    gravity_m_s2,
    soil_module,
});

impl Keep for Deepest {
    fn keep(&self, out: &mut Vec<u8>) {
        match self {
            Self::Variable { largest, .. } => largest.write(out),
            Self::Ground { grid, largest } => {
                largest.write(out);
                grid.keep(out);
            }
        }
    }

    fn recall(&mut self, from: &mut &[u8]) -> terraglue_subsystem::Result {
        match self {
            Self::Variable { largest, .. } => *largest = Persist::read(from)?,
            Self::Ground { grid, largest } => {
                *largest = Persist::read(from)?;
                grid.recall(from)?;
            }
        }
        Ok(())
    }
}
