//! Area `rigid-body`, part by part.

mod contact;

use super::{Context, Figure};
use crate::process::Outcome;

/// All figures of the area.
pub fn figures(context: &Context) -> Outcome<Vec<Figure>> {
    contact::figures(context)
}
