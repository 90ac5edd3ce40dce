//! The list of awake nodes: nothing else is visited.
//!
//! A node's next change is a function of the heights within two nodes of it. It is therefore awake exactly as long
//! as something in that neighbourhood changed since it was visited; sweeping the list gives what sweeping the
//! whole field would give.

use terraglue_ground::{TILE_EDGE, TileMap};

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

    /// Notes a node. `noted` holds for each node the number of the list that noted it last.
    #[inline]
    pub fn note(&mut self, noted: &mut TileMap<u32>, i: i32, j: i32) {
        if !noted.lattice().has(i, j) {
            return;
        }
        let number = noted.get_mut(i, j);
        if *number != self.number {
            *number = self.number;
            self.nodes.push([i, j]);
        }
    }

    /// Notes all nodes that a change at (i, j) can set in motion.
    #[inline]
    pub fn wake(&mut self, noted: &mut TileMap<u32>, i: i32, j: i32) {
        let edge = TILE_EDGE as i32;
        let (x, y) = (i % edge, j % edge);
        let lattice = noted.lattice();
        let inner = x >= 2 && y >= 2 && x < edge - 2 && y < edge - 2 && lattice.has(i + 2, j + 2);
        if !inner {
            REACH.iter().for_each(|[a, b]| self.note(noted, i + a, j + b));
            return;
        }
        let (tile, k) = lattice.locate(i as u32, j as u32);
        let numbers = noted.tile_mut(tile);
        for [a, b] in REACH {
            let number = &mut numbers[(k as i32 + b * edge + a) as usize];
            if *number != self.number {
                *number = self.number;
                self.nodes.push([i + a, j + b]);
            }
        }
    }
}
