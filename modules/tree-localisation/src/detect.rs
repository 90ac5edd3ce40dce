//! Stages 1 to 3 in one go: from scans to the stems around the machine, with a reason where there are none.

use crate::arcs::{Arc, arcs};
use crate::filter::{Dropped, Filter};
use crate::ground::Ground;
use crate::rings::Rings;
use crate::scan::{Point, Scan};
use crate::slices;
use crate::stems::{Revolution, Stem, StemRules, stems};

/// Settings of the search for stems.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Detector {
    /// Points that are left out.
    pub filter: Filter,
    /// Criteria of a stem.
    pub rules: StemRules,
}

/// Points that a turn of a scanner has at most; a larger cloud holds many turns.
const MOST_OF_A_TURN: usize = 2_000_000;

/// Where a scanner stood when it made a turn, in the frame of the local map.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Station {
    /// Place of the origin of the points, m.
    pub position: [f64; 3],
    /// Turn of their frame about the vertical, rad.
    pub yaw: f64,
}

/// Why a scan shows no trees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Nothing {
    /// The scan has no points.
    NoPoints,
    /// No point is left after the filter.
    AllFiltered,
    /// Points do not show where the ground is.
    NoGround,
    /// Nothing stands on the ground.
    NothingStands,
    /// The objects there are not round, not upright, or rays go through.
    NoStems,
}

impl std::fmt::Display for Nothing {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::NoPoints => "there are no points",
            Self::AllFiltered => "no point is left after the filter",
            Self::NoGround => "too few points to tell where the ground is",
            Self::NothingStands => "nothing stands on the ground between the heights that are looked at",
            Self::NoStems => "what stands on the ground is not round and upright, or rays go through it",
        })
    }
}

/// Stems that scans show.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Detection {
    /// The stems.
    pub stems: Vec<Stem>,
    /// Points that were left out.
    pub dropped: Dropped,
    /// Pieces of beams that were looked at.
    pub arcs: usize,
    /// Why there are none.
    pub nothing: Option<Nothing>,
}

impl Detector {
    /// Stems of one turn, in the frame of its points.
    pub fn detect(&self, scan: &Scan) -> Detection {
        self.detect_all(&[(scan, Station::default())])
    }

    /// Stems of several turns that were made from different stations.
    pub fn detect_all(&self, scans: &[(&Scan, Station)]) -> Detection {
        let mut seen = TurnCounts::default();
        for (scan, station) in scans {
            self.add(scan, station, &mut seen);
        }
        let mut detection =
            Detection { dropped: seen.dropped, arcs: seen.arcs.len(), ..Detection::default() };
        if !seen.arcs.is_empty() {
            detection.stems = stems(&seen.arcs, &seen.turns, &self.rules);
        }
        if detection.stems.is_empty() {
            let [low, high] = self.rules.heights_m;
            let stands = seen.arcs.iter().any(|a| (low..high).contains(&a.height));
            let late = if stands { Nothing::NoStems } else { Nothing::NothingStands };
            detection.nothing = Some(seen.nothing.filter(|_| seen.arcs.is_empty()).unwrap_or(late));
        }
        detection
    }

    /// Arcs of one turn, brought into the frame of the map.
    fn add(&self, scan: &Scan, station: &Station, seen: &mut TurnCounts) {
        if scan.points.is_empty() {
            seen.nothing = Some(Nothing::NoPoints);
            return;
        }
        let (points, dropped) = self.filter.apply(scan);
        seen.add_dropped(&dropped);
        if points.is_empty() {
            seen.nothing = Some(Nothing::AllFiltered);
            return;
        }
        let Some(ground) = Ground::below(&points) else {
            seen.nothing = Some(Nothing::NoGround);
            return;
        };
        let rings = scan
            .eye
            .filter(|_| points.len() <= MOST_OF_A_TURN)
            .and_then(|eye| Some((eye, Rings::of(&points, eye)?)));
        let Some((eye, rings)) = rings else {
            let found = slices::arcs(&points, &ground, self.rules.heights_m);
            seen.arcs.extend(found.into_iter().map(|arc| Arc { centre: station.place(arc.centre), ..arc }));
            return;
        };
        let number = seen.turns.len() as u32;
        for mut arc in arcs(&rings, number) {
            let local = [0, 1, 2].map(|k| arc.centre[k] + eye[k]);
            arc.height = local[2] - ground.height([local[0], local[1]]);
            seen.arcs.push(Arc { centre: station.place(local), ..arc });
        }
        seen.turns.push(Revolution { rings, eye: station.place(eye), yaw: station.yaw });
    }
}

impl Station {
    /// A point of the frame of the scan in that of the map.
    pub fn place(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let (s, c) = (libm::sin(self.yaw), libm::cos(self.yaw));
        let [a, b, h] = self.position;
        [a + c * x - s * y, b + s * x + c * y, h + z]
    }
}

/// Collected over turns.
#[derive(Default)]
struct TurnCounts {
    arcs: Vec<Arc>,
    turns: Vec<Revolution>,
    dropped: Dropped,
    nothing: Option<Nothing>,
}

impl TurnCounts {
    fn add_dropped(&mut self, more: &Dropped) {
        self.dropped.not_finite += more.not_finite;
        self.dropped.out_of_range += more.out_of_range;
        self.dropped.own += more.own;
        self.dropped.sparse += more.sparse;
    }
}

/// Points of a list of places, seen from the origin.
impl From<&[[f64; 3]]> for Scan {
    fn from(places: &[[f64; 3]]) -> Self {
        Self::from_origin(places.iter().map(|p| Point::at(*p)).collect())
    }
}
