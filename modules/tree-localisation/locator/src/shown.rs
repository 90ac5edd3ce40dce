//! A match as people see it: overlays, and a message that a report can draw.

use nalgebra::Matrix3;
use std::fmt::Write;
use terraglue_subsystem::{Figure, Overlay, Pose, persist};
use terraglue_tree_localisation::{LocalTree, Pose2, TreeMap};

/// The local map on the global one, as it was shown last.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Shown {
    /// Time, s.
    pub time: f64,
    /// Pose that is believed, or the best that there is; none: nothing is known.
    pub pose: Option<Pose2>,
    /// Height of the overlays, m.
    pub height: f64,
    /// Trees of the local map in the frame of the machine.
    pub local: Vec<LocalTree>,
    /// Trees of the local map and of the global one that are the same.
    pub matches: Vec<(u32, u32)>,
    /// Half axes of the ellipse of one deviation, m, and the direction of the longer one, rad.
    pub ellipse: [f64; 3],
}
persist!(Shown { time, pose, height, local, matches, ellipse });

/// Trees of the map that are farther away are not shown, m.
const REACH: f64 = 60.0;
/// Deviations of the ellipse that is drawn.
const DEVIATIONS: f64 = 3.0;

/// Half axes, m, and the direction of the longer one, rad, of one deviation in the plane.
pub(crate) fn ellipse(covariance: &Matrix3<f64>) -> [f64; 3] {
    let (a, b, c) = (covariance[(0, 0)], covariance[(1, 1)], covariance[(0, 1)]);
    let (mean, half) = (0.5 * (a + b), libm::sqrt(0.25 * (a - b) * (a - b) + c * c));
    let axis = |square: f64| libm::sqrt(square.max(0.0));
    [axis(mean + half), axis(mean - half), 0.5 * libm::atan2(2.0 * c, a - b)]
}

impl Shown {
    /// Trees of the global map around.
    fn around<'a>(&self, map: &'a TreeMap) -> impl Iterator<Item = (u32, [f64; 2])> + 'a {
        let at = self.pose.map_or([0.0; 2], |p| [p.x, p.y]);
        let near = move |p: [f64; 2]| {
            (p[0] - at[0]) * (p[0] - at[0]) + (p[1] - at[1]) * (p[1] - at[1]) < REACH * REACH
        };
        map.around(at, REACH).map(|k| (k, map.trees()[k as usize].place)).filter(move |(_, p)| near(*p))
    }

    /// Places of the local trees in the frame of the map.
    fn placed(&self) -> Vec<[f64; 2]> {
        let pose = self.pose.unwrap_or_default();
        self.local.iter().map(|t| pose.place(t.place)).collect()
    }

    /// Global trees, local trees, the lines between them, and the ellipse of three deviations.
    pub fn overlays(&self, map: &TreeMap, out: &mut Vec<Overlay>) {
        if self.pose.is_none() {
            return;
        }
        let z = self.height;
        let up = |[x, y]: [f64; 2]| [x, y, z];
        let mut layer = |name: &str, colour, figure| {
            out.push(Overlay { layer: name.into(), frame: Overlay::WORLD, colour, figure });
        };
        let places = self.placed();
        let points = self.around(map).map(|(_, p)| up(p)).collect();
        layer("global trees", [0.1, 0.5, 0.2, 1.0], Figure::Points { points, size: 0.25 });
        let points = places.iter().copied().map(up).collect();
        layer("local trees", [0.9, 0.4, 0.0, 1.0], Figure::Points { points, size: 0.2 });
        let pairs = self.matches.iter().filter_map(|(local, global)| {
            Some([up(*places.get(*local as usize)?), up(map.trees().get(*global as usize)?.place)])
        });
        layer(
            "matches",
            [0.9, 0.1, 0.2, 1.0],
            Figure::Lines { points: pairs.flatten().collect(), width: 0.05 },
        );
        let (pose, [long, short, angle]) = (self.pose.unwrap_or_default(), self.ellipse);
        let (c, s) = (libm::cos(0.5 * angle), libm::sin(0.5 * angle));
        let pose = Pose { position: [pose.x, pose.y, z], orientation: [c, 0.0, 0.0, s] };
        let semi_axes = [long, short].map(|a| (DEVIATIONS * a).max(0.01));
        layer("error ellipse", [0.2, 0.2, 0.9, 1.0], Figure::Ellipse { pose, semi_axes });
    }

    /// A message for reports, in JSON; lengths in m, angles in rad.
    pub fn message(&self, map: Option<&TreeMap>, status: &str, bound: f64) -> Vec<u8> {
        let mut out = String::new();
        let list = |out: &mut String, name: &str, points: &mut dyn Iterator<Item = [f64; 2]>| {
            let _ = write!(out, ",\"{name}\":[");
            for (k, [x, y]) in points.enumerate() {
                let comma = if k > 0 { "," } else { "" };
                let _ = write!(out, "{comma}[{x:.2},{y:.2}]");
            }
            out.push(']');
        };
        let _ = write!(out, "{{\"status\":\"{status}\",\"bound\":{bound:.4}");
        if let Some(Pose2 { x, y, yaw }) = self.pose {
            let _ = write!(out, ",\"pose\":[{x:.4},{y:.4},{yaw:.5}]");
        }
        let [long, short, angle] = self.ellipse;
        let _ = write!(out, ",\"ellipse\":[{long:.4},{short:.4},{angle:.4}]");
        let places = self.placed();
        list(&mut out, "local", &mut places.iter().copied());
        if let Some(map) = map {
            list(&mut out, "global", &mut self.around(map).map(|(_, p)| p));
            let partner = |(local, global): &(u32, u32)| {
                Some([*places.get(*local as usize)?, map.trees().get(*global as usize)?.place])
            };
            let pairs: Vec<[[f64; 2]; 2]> = self.matches.iter().filter_map(partner).collect();
            list(&mut out, "match_from", &mut pairs.iter().map(|p| p[0]));
            list(&mut out, "match_to", &mut pairs.iter().map(|p| p[1]));
        }
        out.push('}');
        out.into_bytes()
    }
}
