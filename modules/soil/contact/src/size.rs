//! The size of a contact: b of the pressure law.

use crate::patch_nodes::PatchNodes;

/// Area of a contact and its second moments.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Size {
    /// Below the reference level, in the tangent plane, m².
    area: f64,
    /// Mean squares of the place along t1 and t2 about their mean, and their mean product, m².
    square: [f64; 3],
}

/// Width of a strip over the radius of the disc that bears the same pressure: the width term of bearing capacity counts ½ for a
/// strip and 0.3 for a disc of the same breadth (Terzaghi 1943, art. 45 and 50), and a disc of radius R is 2R broad.
const STRIP: f64 = 5.0 / 6.0;

impl Size {
    /// Of the nodes in `range`. A cell that the reference level cuts counts with its part below.
    pub fn of(nodes: &PatchNodes, range: std::ops::Range<usize>, spacing: f64) -> Self {
        let (mut area, mut mean, mut square) = (0.0, [0.0; 2], [0.0; 3]);
        for k in range {
            let weight = nodes.area[k] * below(nodes, k, spacing);
            let [_, x, y] = nodes.arm[k];
            area += weight;
            mean = [mean[0] + weight * x, mean[1] + weight * y];
            square = [square[0] + weight * x * x, square[1] + weight * y * y, square[2] + weight * x * y];
        }
        if area <= 0.0 {
            return Self::default();
        }
        let [x, y] = mean.map(|m| m / area);
        let [xx, yy, xy] = square.map(|s| s / area);
        // the areas of the cells are the contact smeared over a cell
        let cell = spacing * spacing / 12.0;
        Self { area, square: [xx - x * x - cell, yy - y * y - cell, xy - x * y] }
    }

    /// b of the pressure law, m: radius of the disc of equal area, but no more than that of the disc which bears the
    /// pressure of an endless strip of this breadth.
    pub fn b(&self, spacing: f64) -> f64 {
        let disc = (self.area / std::f64::consts::PI).sqrt();
        disc.min(STRIP * self.breadth()).max(0.5 * spacing)
    }

    /// Breadth of the rectangle of this area and of this larger principal moment, m, no longer than broad at least. The lattice
    /// knows the area exactly and the length well, but not the smaller moment: a blade as broad as a cell covers one row of
    /// nodes or two.
    pub fn breadth(&self) -> f64 {
        let [xx, yy, xy] = self.square;
        let largest = 0.5 * (xx + yy) + (0.25 * (xx - yy) * (xx - yy) + xy * xy).sqrt();
        self.area / (12.0 * largest).max(self.area).sqrt()
    }
}

/// Part of the cell of node k that lies below the reference level. Where nothing is known of how its depths spread, as the slope of the
/// underside has it: a cell must not come in all at once.
fn below(nodes: &PatchNodes, k: usize, spacing: f64) -> f64 {
    let (spread, depth) = (&nodes.spread[k], nodes.depth[k]);
    if spread.range > 0.0 {
        return spread.part_below(depth, 0.0);
    }
    let [_, a, b] = nodes.facing[k].press;
    let falls = a.hypot(b) * spacing;
    if 2.0 * depth.abs() >= falls { f64::from(u8::from(depth > 0.0)) } else { 0.5 + depth / falls }
}
