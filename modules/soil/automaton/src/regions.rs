//! Which active nodes are swept together: rectangles that do not come near each other within a round.

use crate::active::Marks;
use crate::window::Rectangle;
use terraglue_ground::{Lattice, TILE_EDGE};

/// Rectangles around the nodes of `sets`, farther than `gap` nodes apart.
pub fn rectangles(lattice: &Lattice, sets: [&Marks; 2], gap: i32, out: &mut Vec<Rectangle>) {
    out.clear();
    for set in sets {
        for tile in &set.tiles {
            add(around_tile(lattice, set, *tile), gap, out);
        }
    }
}

fn around_tile(lattice: &Lattice, set: &Marks, tile: u32) -> Rectangle {
    let nx = lattice.tiles()[0];
    let corner = [(tile % nx * TILE_EDGE) as i32, (tile / nx * TILE_EDGE) as i32];
    let bits = set.tile(tile);
    let columns = bits.rows.iter().fold(0, |all, row| all | row);
    let first = [columns.trailing_zeros(), bits.any.trailing_zeros()];
    let last = [31 - columns.leading_zeros(), 31 - bits.any.leading_zeros()];
    let at = |part: [u32; 2]| [corner[0] + part[0] as i32, corner[1] + part[1] as i32];
    Rectangle { first: at(first), last: at(last) }
}

/// Adds a rectangle, swallowing those that come too near.
fn add(mut new: Rectangle, gap: i32, out: &mut Vec<Rectangle>) {
    while let Some(k) = out.iter().position(|other| near(&new, other, gap)) {
        new = new.hull(&out.swap_remove(k));
    }
    out.push(new);
}

fn near(a: &Rectangle, b: &Rectangle, gap: i32) -> bool {
    (0..2).all(|c| a.first[c] - b.last[c] <= gap && b.first[c] - a.last[c] <= gap)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn rectangles_hold_all_nodes_and_keep_apart(
            nodes in prop::collection::vec((0..200i32, 0..150i32), 1..60), gap in 1..30i32,
        ) {
            let lattice = Lattice { origin: [0.0; 2], spacing: 1.0, size: [200, 150] };
            let (mut set, empty, mut out) = (Marks::new(lattice), Marks::new(lattice), Vec::new());
            nodes.iter().for_each(|(i, j)| set.mark([*i, *j]));
            rectangles(&lattice, [&set, &empty], gap, &mut out);
            for (i, j) in &nodes {
                let inside = |r: &Rectangle| {
                    (r.first[0]..=r.last[0]).contains(i) && (r.first[1]..=r.last[1]).contains(j)
                };
                prop_assert_eq!(out.iter().filter(|r| inside(r)).count(), 1);
            }
            for (k, a) in out.iter().enumerate() {
                prop_assert!(out[..k].iter().all(|b| !near(a, b, gap)));
            }
        }
    }
}
