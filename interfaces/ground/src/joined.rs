//! The nodes below several shapes that are one piece, and below meshes that are not convex.

use crate::Surface;
use crate::outline::{Cell, Outline, SAMPLES, closer, reaches_beside};
use crate::shape::{Aabb, Placed};
use terraglue_subsystem::Node;

/// A shape of a piece.
#[derive(Clone, Copy, Debug)]
pub struct Part<'a> {
    /// The shape.
    pub placed: &'a Placed,
    /// Its [`Placed::aabb`].
    pub bounds: &'a Aabb,
}

/// Smallest box around all parts; none of no part.
pub fn bounds_of<'a>(parts: impl Iterator<Item = Part<'a>>) -> Option<Aabb> {
    parts.map(|p| *p.bounds).reduce(|a, b| Aabb {
        min: std::array::from_fn(|k| a.min[k].min(b.min[k])),
        max: std::array::from_fn(|k| a.max[k].max(b.max[k])),
    })
}

/// [`crate::nodes_below`] of shapes that are parts of one piece: each node appears once.
///
/// `lower` is that of the part that lies lowest above the node, `slope` its slope there. A cell that no more than one
/// convex part can cover counts as below that part alone. Of any other cell the part counts above which something lies
/// lower than the surface + `margin`: all of it where that is so above its corners and its node, from 8 × 8 points
/// otherwise; where it is not so above the node, the underside is that of the nearest such point.
///
/// `found` is given each node with the number of the part whose underside it is.
pub fn nodes_below_parts<'a, S: Surface + ?Sized>(
    parts: impl Iterator<Item = Part<'a>> + Clone,
    surface: &S,
    margin: f64,
    mut found: impl FnMut(usize, Node),
) {
    let Some(bounds) = bounds_of(parts.clone()) else { return };
    let lattice = surface.lattice();
    let (i0, i1) = lattice.cell_range(0, bounds.min[0], bounds.max[0]);
    let (j0, j1) = lattice.cell_range(1, bounds.min[1], bounds.max[1]);
    // neighbours mostly lie below the same part
    let mut last = None;
    for j in j0..=j1 {
        for i in i0..=i1 {
            let cell = Cell { at: lattice.position(i, j), half: 0.5 * lattice.spacing };
            let reach = surface.height(i, j) + margin;
            let near =
                parts.clone().enumerate().filter(|(_, p)| p.bounds.min[2] < reach && cell.meets(p.bounds));
            let mut few = near.clone();
            let Some(first) = few.next() else { continue };
            let below = if few.next().is_none() && first.1.placed.is_convex() {
                alone(first, &mut last, &cell, reach, |point| {
                    reaches_beside(first.1.placed, surface, margin, [i, j], point)
                })
            } else {
                below_any(near, &cell, reach)
            };
            if let Some(Below { area, point, part: (number, part) }) = below {
                let slope = part.placed.underside_slope(point);
                found(number, Node { i, j, area, lower: point[2], slope });
            }
        }
    }
}

/// Lower boundary of a cell.
struct Below<'a> {
    /// Covered, m².
    area: f64,
    /// Of the underside.
    point: [f64; 3],
    part: (usize, Part<'a>),
}

/// Below one convex part; `last` keeps the outline of the last part, and its number.
fn alone<'a>(
    part: (usize, Part<'a>),
    last: &mut Option<(usize, Outline)>,
    cell: &Cell,
    reach: f64,
    beside: impl FnOnce([f64; 3]) -> bool,
) -> Option<Below<'a>> {
    let shape = part.1.placed;
    last.take_if(|(number, _)| *number != part.0);
    let (_, outline) = last.get_or_insert_with(|| (part.0, Outline::of(shape)));
    let (area, point) = outline.node(shape, cell, reach, beside)?;
    Some(Below { area, point, part })
}

fn below_any<'a>(
    parts: impl Iterator<Item = (usize, Part<'a>)> + Clone,
    cell: &Cell,
    reach: f64,
) -> Option<Below<'a>> {
    let lowest = |[x, y]: [f64; 2]| {
        let hits = parts.clone().filter_map(|p| Some(([x, y, p.1.placed.lower(x, y)?], p)));
        hits.filter(|(point, _)| point[2] < reach).min_by(|a, b| a.0[2].total_cmp(&b.0[2]))
    };
    let here = lowest(cell.at);
    if let Some((point, part)) = here
        && cell.corners().into_iter().all(|c| lowest(c).is_some())
    {
        return Some(Below { area: cell.area(), point, part });
    }
    let (mut count, mut nearest, mut there) = (0, f64::INFINITY, None);
    for [dx, dy] in cell.samples() {
        let Some(hit) = lowest([cell.at[0] + dx, cell.at[1] + dy]) else { continue };
        count += 1;
        let distance = dx * dx + dy * dy;
        let best = there.map_or(f64::INFINITY, |(point, _): ([f64; 3], _)| point[2]);
        if closer([distance, hit.0[2]], [nearest, best]) {
            (nearest, there) = (distance, Some(hit));
        }
    }
    // A node on the very edge may lie below something that no sample lies below.
    let (point, part) = here.or(there).filter(|_| count > 0)?;
    Some(Below { area: f64::from(count) / f64::from(SAMPLES * SAMPLES) * cell.area(), point, part })
}
