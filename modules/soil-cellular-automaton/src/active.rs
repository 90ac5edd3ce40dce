//! The list of awake nodes: nothing else is visited.
//!
//! A node's next change is a function of the heights within two nodes of it. It is therefore awake exactly as long
//! as something in that neighbourhood changed since it was visited; sweeping the list gives what sweeping the
//! whole field would give.

use crate::cell::Cell;
use terraglue_ground::TileMap;

/// Nodes that a change at (0, 0) can set in motion: the eight neighbours (faces, diagonal triples) and the far
/// ends of triples.
const REACH: [[i32; 2]; 17] = [
    [0, 0],
    [1, 0],
    [-1, 0],
    [0, 1],
    [0, -1],
    [1, 1],
    [-1, 1],
    [1, -1],
    [-1, -1],
    [2, 0],
    [-2, 0],
    [0, 2],
    [0, -2],
    [2, 2],
    [-2, 2],
    [2, -2],
    [-2, -2],
];

/// Awake nodes, each once.
#[derive(Clone, Debug, Default)]
pub struct ActiveList {
    /// The nodes.
    pub nodes: Vec<[i32; 2]>,
    /// Number of this list; cells remember the last list that noted them.
    pub number: u32,
}

impl ActiveList {
    /// Empties the list.
    pub fn restart(&mut self, number: u32) {
        self.nodes.clear();
        self.number = number;
    }

    /// Notes a node.
    #[inline]
    pub fn note(&mut self, cells: &mut TileMap<Cell>, i: i32, j: i32) {
        if !cells.lattice().has(i, j) {
            return;
        }
        let cell = cells.get_mut(i, j);
        if cell.noted != self.number {
            cell.noted = self.number;
            self.nodes.push([i, j]);
        }
    }

    /// Notes all nodes that a change at (i, j) can set in motion.
    #[inline]
    pub fn wake(&mut self, cells: &mut TileMap<Cell>, i: i32, j: i32) {
        for [a, b] in REACH {
            self.note(cells, i + a, j + b);
        }
    }
}
