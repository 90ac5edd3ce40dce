//! Area `rigid-body`, part by part.

mod contact;
mod peers;
mod rig;
mod solver;

pub use peers::comparison;

use super::{Context, Figure};
use crate::process::Outcome;

/// All figures of the area.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    let mut all = contact::figures(context)?;
    all.extend(solver::figures(context)?);
    all.extend(peers::figures(context));
    Ok(all)
}
