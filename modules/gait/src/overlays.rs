//! Overlays of the gait, in the frame of the body that it walks: the support polygon, the targets of the feet, and the
//! touchdowns of those in the air.

use crate::foot::Foot;
use crate::parameters::Settings;
use crate::walker::{Mode, Walker};
use terraglue_subsystem::{Figure, Overlay};

const WIDTH_M: f64 = 0.006;
const POINT_M: f64 = 0.03;

/// Figures of a committed state, behind what `out` holds.
pub(crate) fn of(walker: &Walker, settings: &Settings, out: &mut Vec<Overlay>) {
    let mut show = |layer: &str, colour: [f32; 4], figure: Figure| {
        out.push(Overlay { layer: layer.into(), frame: Overlay::MOUNT, colour, figure });
    };
    let corners = hull(walker.feet.iter().filter(|f| !f.airborne && !f.searching).map(|f| f.position));
    let edges = (0..corners.len()).map(|k| [corners[k], corners[(k + 1) % corners.len()]]);
    // the plane of the feet, tilted as the posture corrects it
    let low = |p: [f64; 2]| [p[0], p[1], walker.posture.raise(p) - settings.body_height];
    let points: Vec<[f64; 3]> = edges.flatten().map(low).collect();
    if corners.len() > 1 {
        show("support polygon", [0.1, 0.7, 0.3, 1.0], Figure::Lines { points, width: WIDTH_M });
    }
    let target = |f: &Foot| {
        let [x, y, z] = low(f.position);
        [x, y, z + f.height]
    };
    let points = walker.feet.iter().map(target).collect();
    show("foot targets", [0.2, 0.5, 0.9, 1.0], Figure::Points { points, size: POINT_M });
    let stance_s = settings.duty(walker.pattern) * settings.cycle_s(walker.pattern);
    let flying = walker.feet.iter().zip(settings.neutral).filter(|(f, _)| f.airborne);
    let landing =
        |(f, neutral): (&Foot, [f64; 2])| [target(f), low(walker.twist.pass_below(neutral, -0.5 * stance_s))];
    let points: Vec<[f64; 3]> = flying.flat_map(landing).collect();
    if walker.mode == Mode::Walking && !points.is_empty() {
        show("next footholds", [0.2, 0.5, 0.9, 0.6], Figure::Arrows { points, width: WIDTH_M });
    }
}

/// Corners of the convex hull, counter-clockwise (Andrew's monotone chain, 1979).
fn hull(points: impl Iterator<Item = [f64; 2]>) -> Vec<[f64; 2]> {
    let mut all: Vec<[f64; 2]> = points.collect();
    all.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    all.dedup();
    if all.len() < 3 {
        return all;
    }
    let turns_left = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| {
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0.0
    };
    let chain = |points: &mut dyn Iterator<Item = [f64; 2]>| {
        let mut chain: Vec<[f64; 2]> = Vec::new();
        for p in points {
            while let [.., a, b] = chain[..]
                && !turns_left(a, b, p)
            {
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
        chain
    };
    let (lower, upper) = (chain(&mut all.iter().copied()), chain(&mut all.iter().rev().copied()));
    [lower, upper].concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hull_leaves_out_what_lies_inside_or_on_an_edge() {
        let points = [[0.0, 0.0], [2.0, 0.0], [1.0, 0.0], [1.0, 0.5], [2.0, 2.0], [0.0, 2.0], [0.0, 2.0]];
        let corners = hull(points.into_iter());
        assert_eq!(corners, [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]]);
        assert_eq!(hull([[1.0, 0.0], [0.0, 0.0]].into_iter()), [[0.0, 0.0], [1.0, 0.0]]);
        assert!(hull(std::iter::empty()).is_empty());
    }
}
