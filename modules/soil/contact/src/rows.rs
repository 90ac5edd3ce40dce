//! The rows of nodes below a contact, to find the neighbours of a node.

use crate::patch_nodes::PatchNodes;

/// Where the rows of a patch begin; the storage is reused.
#[derive(Clone, Debug, Default)]
pub struct Rows {
    /// Index along y of the first row.
    first: i32,
    /// First node of each row, and one past the last node.
    begins: Vec<usize>,
    /// Where the sides of a contact lie, world x and y from the port, m.
    pub places: Vec<[f64; 2]>,
}

impl Rows {
    /// Room for the sides of contacts with `nodes` nodes.
    pub fn reserve(&mut self, nodes: usize) {
        self.begins.reserve(nodes);
        self.places.reserve(nodes);
    }

    /// Lists the rows of the nodes in `range`, which lie row by row.
    pub fn list(&mut self, nodes: &PatchNodes, range: std::ops::Range<usize>) {
        self.begins.clear();
        self.first = nodes.index.get(range.start).map_or(0, |at| at[1]);
        for k in range.clone() {
            // a row without nodes is empty
            while self.first + self.begins.len() as i32 <= nodes.index[k][1] {
                self.begins.push(k);
            }
        }
        self.begins.push(range.end);
    }

    /// The node at an index.
    pub fn find(&self, nodes: &PatchNodes, at: [i32; 2]) -> Option<usize> {
        let row = usize::try_from(at[1] - self.first).ok()?;
        let range = *self.begins.get(row)?..*self.begins.get(row + 1)?;
        let begin = nodes.index.get(range.start)?[0];
        // mostly the nodes of a row follow one after the other
        let guess = range.start.checked_add_signed((at[0] - begin) as isize);
        match guess.filter(|g| range.contains(g) && nodes.index[*g] == at) {
            Some(guess) => Some(guess),
            None => nodes.index[range.clone()].iter().position(|index| *index == at).map(|k| range.start + k),
        }
    }
}
