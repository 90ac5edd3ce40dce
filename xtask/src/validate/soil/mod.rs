//! Area `soil`: what both soils promise, part by part.

mod automaton;
mod fit;
mod panel;
mod plates;
mod real_wheel;
#[path = "../../../../interfaces/soil-contact/tests/support/mod.rs"]
mod rig;
mod rig_scenario;
mod rows;
mod stick;
mod wheel_picture;
mod wheel_rig;
mod wheels;
mod wong_reece;

pub use automaton::print_hash;

use super::Part;
use crate::process::Outcome;
use plates::{Maker, level};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use terraglue_soil_bekker::SoilBekker;
use terraglue_soil_cellular_automaton::SoilCellularAutomaton;

/// The parts, in the order of the table.
pub const PARTS: [Part; 8] = [
    ("automaton", automaton::figures),
    ("cost", automaton::cost),
    ("plates", plates::figures),
    ("fit", fit::figures),
    ("wheels", wheels::figures),
    ("rig-scenario", rig_scenario::figures),
    ("stick", stick::figures),
    ("wong-reece", wong_reece::figures),
];

/// Draws the pictures of docs/images.
pub fn write_pictures() -> Outcome {
    automaton::write_picture().and_then(|()| wheel_picture::write_picture())
}

/// Both soils: name in the figures and how an instance is made.
const MODULES: [(&str, Maker); 2] =
    [("automaton", level::<SoilCellularAutomaton>), ("bekker", level::<SoilBekker>)];

/// Keys of the automaton for material that stays where it is pressed, as integrals of stresses assume: all becomes denser in
/// place, and walls stand.
const STILL: &str = r#""compacted_fraction":1.0,"angle_of_repose_rad":1.4"#;

/// `job` on every item, on as many threads as there are processors; answers in the order of the items.
fn in_parallel<T: Sync, R: Send>(items: &[T], job: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let (next, done) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    let work = || {
        while let Some((k, item)) =
            Some(next.fetch_add(1, Ordering::Relaxed)).and_then(|k| Some((k, items.get(k)?)))
        {
            let answer = job(item);
            done.lock().unwrap_or_else(PoisonError::into_inner).push((k, answer));
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(work);
        }
    });
    let mut answers = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    answers.sort_by_key(|(k, _)| *k);
    answers.into_iter().map(|(_, answer)| answer).collect()
}
