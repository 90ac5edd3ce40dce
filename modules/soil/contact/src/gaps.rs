//! The gaps between grousers: the underside of the soil that turns with a wheel, see [`crate::grousers`].

use crate::grousers::{Section, is_across};
use crate::patch_nodes::{Facing, PatchNodes};
use crate::wheel::Wheel;
use terraglue_ground::STEEPEST_SLOPE;
use terraglue_subsystem::Port;

/// Distances of the underside below which it is left where it is, m.
const NOTHING: f64 = 1e-9;

impl Wheel {
    /// Lowers the underside of the nodes in `range` below `port` to that of the soil which turns with the wheel.
    pub fn fill_gaps(&self, nodes: &mut PatchNodes, port: &Port, range: std::ops::Range<usize>) {
        let Some(rim) = self.rim.filter(|rim| self.memory.grousers.are_close(rim)) else { return };
        let section = Section::new(self.heading, self.lean);
        let vertical = section.of([0, 1, 2].map(|c| port.direction(c)[2]));
        for k in range {
            let point = (section.of(nodes.arm[k]), section.of(nodes.facing[k].inward()));
            if !is_across(&point) {
                continue;
            }
            let (p, _) = point;
            let from = [p[0] - rim.axle[0], p[1] - rim.axle[1]];
            let Some(falls) = below(from, vertical, self.radius) else { continue };
            if falls > NOTHING {
                let inward = [0, 1].map(|c| falls * vertical[c] - from[c]);
                lower(nodes, port, k, falls, section.vector(inward));
            }
        }
    }
}

/// How far below a point, as seen from the axle, a circle lies, m; `vertical`: upwards in the section.
fn below(from: [f64; 2], vertical: [f64; 2], radius: f64) -> Option<f64> {
    let of = |a: [f64; 2], b: [f64; 2]| a[0] * b[0] + a[1] * b[1];
    let (a, b) = (of(vertical, vertical), of(from, vertical));
    let root = b * b - a * (of(from, from) - radius * radius);
    (root > 0.0 && a > 0.0).then(|| (b + root.sqrt()) / a)
}

/// Puts the underside at node k lower by `falls` (m), with an inward normal along n, t1, t2.
fn lower(nodes: &mut PatchNodes, port: &Port, k: usize, falls: f64, inward: [f64; 3]) {
    let world: [f64; 3] =
        std::array::from_fn(|axis| (0..3).map(|c| inward[c] * port.direction(c)[axis]).sum());
    let flat = (world[0] * world[0] + world[1] * world[1]).sqrt();
    let up = world[2].max(flat / STEEPEST_SLOPE);
    if up <= 0.0 {
        return;
    }
    let slope = [-world[0] / up, -world[1] / up];
    nodes.plane[k].height -= falls;
    nodes.plane[k].slope = slope;
    nodes.depth[k] += falls * port.frame[2];
    for c in 0..3 {
        nodes.arm[k][c] -= falls * port.direction(c)[2];
    }
    nodes.facing[k] = Facing::new(port, slope);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_circle_lies_below_by_its_closed_form() {
        let falls = below([-0.092, 0.03], [1.0, 0.0], 0.097).expect("below");
        assert!((falls - ((0.097f64 * 0.097 - 0.03 * 0.03).sqrt() - 0.092)).abs() < 1e-15);
        assert_eq!(below([-0.01, 0.1], [1.0, 0.0], 0.097), None);
    }
}
