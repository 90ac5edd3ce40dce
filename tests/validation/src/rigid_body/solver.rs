//! Figures of the joint solver and of the integrators.

mod chains;
mod cost;
mod free;
mod gait;
mod mechanisms;
mod statics;
mod top;

use crate::process::Outcome;
use crate::{Context, Figure};

/// All of them.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    let mut all = chains::figures()?;
    all.extend(free::figures(context)?);
    all.extend(gait::figures()?);
    all.extend(mechanisms::figures(context)?);
    all.extend(top::figures(context)?);
    all.extend(statics::figures()?);
    if context.timing {
        all.push(cost::resolve()?);
    }
    Ok(all)
}
