//! Half-open ranges of columns, one per row of a window: where a rule has something to do.

use crate::lanes::LANES;

/// Columns lo … hi − 1; empty when lo ≥ hi.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Span {
    /// First column.
    pub lo: usize,
    /// One past the last.
    pub hi: usize,
}

impl Span {
    /// No column.
    pub const NONE: Self = Self { lo: usize::MAX, hi: 0 };

    /// Whether there is no column.
    #[inline]
    pub fn is_empty(self) -> bool {
        self.lo >= self.hi
    }

    /// Number of columns.
    #[inline]
    pub fn len(self) -> usize {
        self.hi.saturating_sub(self.lo)
    }

    /// The groups of [`LANES`] columns that hold it. They begin at multiples of [`LANES`], so that a group loads whole
    /// what another has stored.
    #[inline]
    pub fn whole_groups(self) -> Self {
        Self { lo: self.lo - self.lo % LANES, hi: self.hi.next_multiple_of(LANES) }
    }

    /// Smallest span around both.
    #[inline]
    pub fn hull(self, other: Self) -> Self {
        Self { lo: self.lo.min(other.lo), hi: self.hi.max(other.hi) }
    }

    /// `by` columns more on either side, within `bounds`; an empty span stays empty.
    #[inline]
    pub fn grown(self, by: usize, bounds: Self) -> Self {
        if self.is_empty() {
            return Self::NONE;
        }
        Self { lo: self.lo.saturating_sub(by).max(bounds.lo), hi: (self.hi + by).min(bounds.hi) }
    }
}
