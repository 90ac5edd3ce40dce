//! Figures of the joint solver and of the integrators.

mod chains;
mod free;
mod gait;
mod mechanisms;

use crate::process::Outcome;
use crate::validate::{Context, Figure};

/// All of them.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    let mut all = chains::figures()?;
    all.extend(free::figures(context)?);
    all.extend(gait::figures()?);
    all.extend(mechanisms::figures(context)?);
    Ok(all)
}
