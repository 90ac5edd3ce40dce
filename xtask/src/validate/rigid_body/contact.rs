//! Contact figures of the rigid bodies.

mod gait;
mod problems;
mod walking;

use crate::process::Outcome;
use crate::validate::{Context, Figure};

/// All contact figures.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    let mut all = walking::figures(context)?;
    all.extend(problems::figures(context)?);
    Ok(all)
}
