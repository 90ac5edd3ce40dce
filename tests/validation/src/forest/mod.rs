//! Figures of the forest: the errors of a laser scanner, stems from its turns, their match with a map, drives, and the cost; on
//! stands that are grown from a seed, and on the files of `TERRAGLUE_FOREST_DATA` where they are.

mod data;
mod drive;
mod matching;
mod npz;
mod scanner;
mod scenario;
mod speed;
mod stems;
mod sweep;

use super::{Context, Figure, Limit, Part};

/// The parts, in the order of the table.
pub const PARTS: [Part; 8] = [
    ("scanner", scanner::figures),
    ("stems", stems::figures),
    ("matching", matching::figures),
    ("sweep", sweep::figures),
    ("drive", drive::figures),
    ("data", data::figures),
    ("scenario", scenario::figures),
    ("speed", speed::figures),
];
