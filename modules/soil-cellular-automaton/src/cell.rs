//! What the automaton knows of a node beyond its height: load and room below a foot.

/// Room of a node with open sky, units.
pub const OPEN: i32 = i32::MAX;
/// Load and room change in steps of so many units (61 µm), so that a foot at rest wakes nobody.
pub const QUANTUM: i32 = 256;

/// State of a node for the automaton. The default is open and unloaded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// What still fits below the foot's underside, units; 0: a foot stands here; [`OPEN`]: no foot above.
    pub room: i32,
    /// Force-equivalent height, units.
    pub load: i32,
    /// Number of the commit that last found a foot above.
    pub covered: u32,
}

impl Default for Cell {
    fn default() -> Self {
        Self { room: OPEN, load: 0, covered: 0 }
    }
}

impl Cell {
    /// Whether a foot stands here.
    #[inline]
    pub fn loaded(&self) -> bool {
        self.room == 0
    }

    /// Largest flux over one of up to sixteen paths into the node in one pass, units.
    #[inline]
    pub fn inlet(&self) -> i32 {
        (self.room - self.room % QUANTUM) / 16
    }
}
