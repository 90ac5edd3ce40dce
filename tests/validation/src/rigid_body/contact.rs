//! Contact figures of the rigid bodies.

mod analytic;
mod gait;
mod problems;
mod scenes;
mod shapes;
mod small;
mod walking;

use crate::process::Outcome;
use crate::{Context, Figure};

/// All contact figures.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    let mut all = walking::figures(context)?;
    all.extend(small::figures(context)?);
    all.extend(shapes::figures(context)?);
    all.extend(analytic::figures(context)?);
    all.extend(problems::figures(context)?);
    Ok(all)
}
