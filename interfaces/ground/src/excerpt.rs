//! The heights around a footprint, read row by row and kept: at its rim they are asked for several times.

use crate::Surface;
use crate::lattice::Lattice;

/// Nodes that are kept: those below a foot that is up to twelve cells wide, with a border.
const ROOM: usize = 256;

/// A rectangle of a surface.
pub(crate) struct Excerpt<'a, S: ?Sized> {
    surface: &'a S,
    first: [i32; 2],
    size: [i32; 2],
    heights: [f64; ROOM],
}

impl<'a, S: Surface + ?Sized> Excerpt<'a, S> {
    /// The nodes in the ranges `i` and `j`, ends included, and those beside them; `None` where there is no room.
    pub fn around(surface: &'a S, i: (i32, i32), j: (i32, i32)) -> Option<Self> {
        let last = surface.lattice().size.map(|n| n as i32 - 1);
        let first = [i.0, j.0].map(|k| (k - 1).max(0));
        let size = [(i.1 + 1).min(last[0]) - first[0] + 1, (j.1 + 1).min(last[1]) - first[1] + 1];
        let small = size.iter().all(|n| (1..=ROOM as i32).contains(n)) && size[0] * size[1] <= ROOM as i32;
        if !small || i.0 > i.1 || j.0 > j.1 {
            return None;
        }
        let mut heights = [0.0; ROOM];
        for (j, row) in (first[1]..first[1] + size[1]).zip(heights.chunks_exact_mut(size[0] as usize)) {
            surface.heights(first[0], j, row);
        }
        Some(Self { surface, first, size, heights })
    }

    /// Place of a node, if it is among those kept.
    #[inline]
    fn place(&self, i: i32, j: i32) -> Option<usize> {
        let [x, y] = [i - self.first[0], j - self.first[1]];
        let inside = x >= 0 && y >= 0 && x < self.size[0] && y < self.size[1];
        inside.then_some((y * self.size[0] + x) as usize)
    }
}

impl<S: Surface + ?Sized> Surface for Excerpt<'_, S> {
    #[inline]
    fn lattice(&self) -> &Lattice {
        self.surface.lattice()
    }

    #[inline]
    fn height(&self, i: i32, j: i32) -> f64 {
        self.place(i, j).map_or_else(|| self.surface.height(i, j), |place| self.heights[place])
    }
}
