//! Points as the library of the localisation takes them, and its stems against the trees that stand there.

use crate::{Forest, Seen};
use terraglue_tree_localisation::{Point, Stem};

/// Number of the bodies of the machine among those of plants.
pub const OWN: u32 = 1_000_000;

/// Points of a scan as the library takes them; those of the machine lie on the body [`OWN`].
pub fn points(seen: &[Seen]) -> Vec<Point> {
    seen.iter()
        .map(|s| Point { position: s.position, ring: s.ring, body: if s.is_own { OWN } else { s.plant } })
        .collect()
}

/// How many stems are right.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Score {
    /// Stems that stand where a tree does.
    pub right: usize,
    /// Stems that do not.
    pub wrong: usize,
    /// Trees that are seen well enough.
    pub visible: usize,
    /// Those of them that have a stem.
    pub recalled: usize,
    /// Sum of squared distances of stems from trees, m².
    square: f64,
    /// Stems whose diameter is known to 10 cm, and the sum of their excess over the trees, m.
    known: usize,
    thicker: f64,
}

impl Score {
    /// Adds the counts of another scan.
    pub fn add(&mut self, other: &Self) {
        self.right += other.right;
        self.wrong += other.wrong;
        self.visible += other.visible;
        self.recalled += other.recalled;
        self.square += other.square;
        self.known += other.known;
        self.thicker += other.thicker;
    }

    /// Share of the stems that are trees.
    pub fn precision(&self) -> f64 {
        self.right as f64 / (self.right + self.wrong) as f64
    }

    /// Share of the trees seen well enough that have a stem.
    pub fn recall(&self) -> f64 {
        self.recalled as f64 / self.visible as f64
    }

    /// Root of the mean squared distance of right stems from their trees, m.
    pub fn rms(&self) -> f64 {
        (self.square / self.right as f64).sqrt()
    }

    /// Mean of the diameters less the true ones, of stems of which both sides are seen, m.
    pub fn bias(&self) -> f64 {
        self.thicker / self.known as f64
    }
}

/// Stems within a distance of the first scanner, in its frame, against trees of whose stems it sees ten points or more; a stem is right
/// within 0.5 m of a tree.
pub fn score(forest: &Forest, scans: &[(&[Seen], [f64; 2], f64)], stems: &[Stem], within: f64) -> Score {
    let (first, at, yaw) = scans[0];
    let visible = forest.visible(first, at, yaw, within, 10);
    let all = forest.visible(first, at, yaw, within + 5.0, 0);
    let mut score = Score { visible: visible.len(), ..Score::default() };
    let gap = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
    for stem in stems.iter().filter(|s| gap(s.place, [0.0; 2]) <= within) {
        let near = all.iter().min_by(|a, b| gap(a.1, stem.place).total_cmp(&gap(b.1, stem.place)));
        match near.filter(|(_, p)| gap(*p, stem.place) < 0.5) {
            Some((tree, place)) => {
                score.right += 1;
                score.square += gap(*place, stem.place).powi(2);
                if stem.diameter_deviation < 0.1 {
                    score.known += 1;
                    score.thicker += stem.diameter - forest.stand.trees[*tree].diameter;
                }
            }
            None => score.wrong += 1,
        }
    }
    score.recalled = visible.iter().filter(|(_, p)| stems.iter().any(|s| gap(s.place, *p) < 0.5)).count();
    score
}
