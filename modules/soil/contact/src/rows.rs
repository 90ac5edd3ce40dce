//! The nodes below a contact on their lattice, to find the neighbours of a node.

use crate::patch_nodes::PatchNodes;

/// The lattice around a patch, with a border of one cell; the storage is reused.
#[derive(Clone, Debug, Default)]
pub struct Rows {
    /// Lattice index of the corner of the border.
    first: [i32; 2],
    /// Cells along x.
    width: usize,
    /// Node of each cell, x fastest; [`NOBODY`] where there is none.
    cells: Vec<u32>,
    /// First node of the patch.
    start: usize,
    /// Weight of the slope of each node, 0 … 1.
    pub weights: Vec<f64>,
    /// Places of the sides of a contact, world x and y from the port, m.
    pub places: Vec<[f64; 2]>,
}

/// Room for the cells of most patches: a node alone has nine.
const CELLS_PER_NODE: usize = 9;
const NOBODY: u32 = u32::MAX;

impl Rows {
    /// Room for the sides of contacts with `nodes` nodes.
    pub fn reserve(&mut self, nodes: usize) {
        self.cells.reserve(CELLS_PER_NODE * nodes);
        self.weights.reserve(nodes);
        self.places.reserve(nodes);
    }

    /// Lists the nodes in `range`.
    pub fn list(&mut self, nodes: &PatchNodes, range: std::ops::Range<usize>) {
        self.start = range.start;
        self.cells.clear();
        let Some(&one) = nodes.index.get(range.start) else { return };
        let (mut low, mut high) = (one, one);
        for at in &nodes.index[range.clone()] {
            (low, high) = ([0, 1].map(|c| low[c].min(at[c])), [0, 1].map(|c| high[c].max(at[c])));
        }
        self.first = low.map(|c| c - 1);
        let [width, height] = [0, 1].map(|c| (high[c] - low[c] + 3) as usize);
        self.width = width;
        self.cells.resize(width * height, NOBODY);
        for k in range {
            let cell = self.cell(nodes.index[k]);
            self.cells[cell] = (k - self.start) as u32;
        }
    }

    /// Weight of the slope of node k.
    #[inline]
    pub fn weight(&self, k: usize) -> f64 {
        self.weights[k - self.start]
    }

    /// The cell at an index of the lattice.
    #[inline]
    pub fn cell(&self, at: [i32; 2]) -> usize {
        let [i, j] = [0, 1].map(|c| (at[c] - self.first[c]) as usize);
        j * self.width + i
    }

    /// The node at some steps from a cell that has one.
    #[inline]
    pub fn beside(&self, cell: usize, [i, j]: [i32; 2]) -> Option<usize> {
        let at = cell as isize + j as isize * self.width as isize + i as isize;
        let found = *self.cells.get(at as usize)?;
        (found != NOBODY).then_some(self.start + found as usize)
    }
}
