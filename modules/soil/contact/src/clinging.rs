//! Nodes that cling to a foot as it is lifted: they let go one after the other.

/// A node that clings to a foot: it lets go at the shift `end` (m); up to there its normal force is `stiffness`·shift −
/// `at_zero`.
#[derive(Clone, Copy, Debug)]
pub struct Clinging {
    /// See above, m.
    pub end: f64,
    /// See above, N/m.
    pub stiffness: f64,
    /// See above, N.
    pub at_zero: f64,
}

/// The clinging nodes of one foot.
#[derive(Clone, Debug, Default)]
pub struct ClingingNodes(Vec<Clinging>);

impl ClingingNodes {
    /// Forgets all of them; keeps the room.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// Takes one in.
    pub fn push(&mut self, node: Clinging) {
        self.0.push(node);
    }

    /// Those that let go first to the front.
    pub fn sort(&mut self) {
        self.0.sort_unstable_by(|a, b| b.end.total_cmp(&a.end));
    }

    /// Largest force with which they hold the foot back, N.
    pub fn most(&self) -> f64 {
        let mut most = 0.0_f64;
        self.peel(|end, stiffness, at_zero| {
            most = most.max(at_zero - stiffness * end);
            None
        });
        most
    }

    /// Shift at which they pull with −`force` ≥ 0 N; `None` where they cannot.
    pub fn held(&self, force: f64) -> Option<f64> {
        self.peel(|end, stiffness, at_zero| {
            (stiffness * end - at_zero <= force).then(|| (force + at_zero) / stiffness)
        })
    }

    /// Walks up from letting go to letting go: `visit` gets the shift and the line on which the force falls to there.
    fn peel(&self, mut visit: impl FnMut(f64, f64, f64) -> Option<f64>) -> Option<f64> {
        let sum = |of: fn(&Clinging) -> f64| self.0.iter().map(of).sum::<f64>();
        let (mut stiffness, mut at_zero) = (sum(|c| c.stiffness), sum(|c| c.at_zero));
        for c in &self.0 {
            if let Some(found) = visit(c.end, stiffness, at_zero) {
                return Some(found);
            }
            (stiffness, at_zero) = (stiffness - c.stiffness, at_zero - c.at_zero);
        }
        None
    }
}
