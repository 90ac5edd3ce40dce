//! Contact figures of the rigid bodies.

mod problems;

use crate::process::Outcome;
use crate::validate::{Context, Figure};

/// All contact figures.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    problems::figures(context)
}
