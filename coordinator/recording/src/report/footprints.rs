//! Prints of every body that carried a normal force, and their shape from above.

use crate::prints::{Print, Touch, press};
use crate::reader::{GroundRecord, Recording};
use crate::solids::Solid;
use std::f64::consts::TAU;
use terraglue_subsystem::Pose;

/// Least depth at which the underside of a shape is cut, m: a foot that hardly sinks in still has a shape.
const LEAST_CUT_M: f64 = 1e-3;
/// Corners of a round footprint.
const ROUND: u32 = 24;
/// Prints in a row that make a track.
const TRACK: usize = 3;

/// A body that stood on the ground at some time.
#[derive(Clone, Debug, PartialEq)]
pub struct Leg {
    /// Name of its subsystem.
    pub subsystem: String,
    /// Name of the body.
    pub body: String,
    /// Sum of the normal forces of its ports at every time of `/gluing`, N.
    pub normal_n: Vec<f64>,
    /// Prints of each of its shapes.
    shapes: Vec<(u32, Vec<Print>)>,
}

/// All bodies that carried load, in order of their names.
pub fn legs(recording: &Recording) -> Vec<Leg> {
    let mut legs: Vec<Leg> = Vec::new();
    for (row, record) in recording.gluing.iter().enumerate() {
        for port in &record.ports {
            let normal_n = port.wrench.first().copied().unwrap_or(0.0);
            let same = |l: &Leg| l.body == port.body && l.subsystem == port.subsystem;
            let k = legs.iter().position(same).unwrap_or_else(|| {
                let (subsystem, body) = (port.subsystem.clone(), port.body.clone());
                let normal_n = vec![0.0; recording.gluing.len()];
                legs.push(Leg { subsystem, body, normal_n, shapes: Vec::new() });
                legs.len() - 1
            });
            legs[k].normal_n[row] += normal_n;
            if normal_n > 0.0 {
                let at = [port.origin.x, port.origin.y];
                // the lower, the deeper: the ground below is known at the end of the recording only
                let touch = Touch { at, t_s: record.t, normal_n, depth_m: -port.origin.z };
                press(legs[k].prints_of(port.shape), &touch);
            }
        }
    }
    legs.retain(|l| !l.shapes.is_empty());
    legs.sort_by(|a, b| (&a.subsystem, &a.body).cmp(&(&b.subsystem, &b.body)));
    legs
}

impl Leg {
    fn prints_of(&mut self, shape: u32) -> &mut Vec<Print> {
        let k = self.shapes.iter().position(|s| s.0 == shape).unwrap_or_else(|| {
            self.shapes.push((shape, Vec::new()));
            self.shapes.len() - 1
        });
        &mut self.shapes[k].1
    }

    /// Prints that a foot left one by one: each alone, or the few that it slid through.
    pub(crate) fn single(&self) -> impl Iterator<Item = &Print> {
        self.runs().filter(|run| run.len() < TRACK).flatten()
    }

    /// Prints of a wheel that rolled on, or of a foot that slid far, in a row.
    pub(crate) fn tracks(&self) -> impl Iterator<Item = &[Print]> {
        self.runs().filter(|run| run.len() >= TRACK)
    }

    fn runs(&self) -> impl Iterator<Item = &[Print]> {
        self.shapes.iter().flat_map(|(_, prints)| prints.chunk_by(|_, next| next.joined))
    }

    /// Outline from above of what was below the ground when a print was deepest, m: corners of a convex line, not closed.
    pub(crate) fn footprint(&self, recording: &Recording, print: &Print) -> Vec<[f64; 2]> {
        let frame = format!("{}/{}", self.subsystem, self.body);
        let pose = recording.poses.get(&frame).and_then(|poses| {
            let k = poses
                .t_s
                .partition_point(|t| *t < print.deepest_s - 1e-9)
                .min(poses.t_s.len().checked_sub(1)?);
            Some(Pose { position: poses.position[k], orientation: poses.orientation[k] })
        });
        let level_m = recording.initial_ground.as_ref().and_then(|g| g.undisturbed_near(print.at));
        let solids = recording.solids.get(&frame).into_iter().flatten();
        let outlines = pose.into_iter().flat_map(|pose| {
            let outline = move |solid: &Solid| below(&solid.placed(&pose), level_m);
            solids.clone().map(outline).filter(|o| !o.is_empty())
        });
        let off = |outline: &Vec<[f64; 2]>| {
            let n = outline.len() as f64;
            let [x, y] = [0, 1].map(|k| outline.iter().map(|p| p[k]).sum::<f64>() / n - print.at[k]);
            x.hypot(y)
        };
        let mut outlines: Vec<_> = outlines.collect();
        outlines.sort_by(|a, b| off(a).total_cmp(&off(b)));
        // of merged links several shapes may lie in the print: the largest around its place made it
        let around = outlines.iter().filter(|o| contains(o, print.at));
        let largest = around.max_by(|a, b| area(a).total_cmp(&area(b)));
        largest.or(outlines.first()).cloned().unwrap_or_else(|| circle(print.at, 0.01))
    }
}

impl GroundRecord {
    /// Number of the node next to a place; none outside.
    pub(crate) fn node_near(&self, at: [f64; 2]) -> Option<usize> {
        let [i, j] = [0, 1].map(|k| ((at[k] - self.origin[k]) / self.spacing).round());
        let inside = i >= 0.0 && j >= 0.0 && i < self.size[0] as f64 && j < self.size[1] as f64;
        inside.then(|| j as usize * self.size[0] + i as usize)
    }

    /// Height of the undisturbed surface next to a place, m: a ground that was recorded at the start may have prints, of the
    /// time to settle.
    fn undisturbed_near(&self, at: [f64; 2]) -> Option<f64> {
        let node = self.node_near(at)?;
        Some(f64::from(*self.height.get(node)?) + f64::from(*self.sinkage.get(node)?))
    }
}

/// Outline of the part of a solid below a level, at least of its lowest millimetre; empty where all of it is above.
fn below(solid: &Solid, level_m: Option<f64>) -> Vec<[f64; 2]> {
    if let (Some(radius), Some(centre)) = (solid.round, solid.points.first()) {
        let lowest = centre[2] - radius;
        let Some(cut) = cut(lowest, level_m) else { return Vec::new() };
        let depth = (cut - lowest).min(radius);
        return circle([centre[0], centre[1]], (depth * (2.0 * radius - depth)).sqrt());
    }
    let lowest = solid.points.iter().map(|p| p[2]).fold(f64::INFINITY, f64::min);
    let Some(cut) = cut(lowest, level_m).filter(|c| c.is_finite()) else { return Vec::new() };
    let inside = solid.points.iter().filter(|p| p[2] <= cut).map(|p| [p[0], p[1]]);
    let edges = solid.triangles.iter().flat_map(|t| (0..3).map(|k| [t[k], t[(k + 1) % 3]]));
    let crossings = edges.filter_map(|edge| {
        let [a, b] = edge.map(|k| solid.points.get(k as usize));
        let (a, b) = (a?, b?);
        let share = (cut - a[2]) / (b[2] - a[2]);
        (a[2] < cut && b[2] > cut).then(|| [0, 1].map(|k| a[k] + share * (b[k] - a[k])))
    });
    hull(inside.chain(crossings).collect())
}

/// The height at which a solid is cut; none where it floats well above the level.
fn cut(lowest: f64, level_m: Option<f64>) -> Option<f64> {
    let level = level_m.unwrap_or(lowest);
    (lowest <= level + APART_ABOVE_M).then(|| level.max(lowest + LEAST_CUT_M))
}

/// A shape whose lowest point is higher above the initial ground than this did not make the print, m; soil heaps up.
const APART_ABOVE_M: f64 = 0.05;

/// Whether a place lies within a convex outline that runs counter-clockwise.
fn contains(outline: &[[f64; 2]], at: [f64; 2]) -> bool {
    let next = outline.iter().cycle().skip(1);
    let left = |(p, q): (&[f64; 2], &[f64; 2])| {
        (q[0] - p[0]) * (at[1] - p[1]) - (q[1] - p[1]) * (at[0] - p[0]) >= 0.0
    };
    outline.len() > 2 && outline.iter().zip(next).all(left)
}

/// Area of an outline that runs counter-clockwise, m².
fn area(outline: &[[f64; 2]]) -> f64 {
    let next = outline.iter().cycle().skip(1);
    0.5 * outline.iter().zip(next).map(|(p, q)| p[0] * q[1] - q[0] * p[1]).sum::<f64>()
}

fn circle(centre: [f64; 2], radius: f64) -> Vec<[f64; 2]> {
    let corner = |k: u32| {
        let angle = TAU * f64::from(k) / f64::from(ROUND);
        [centre[0] + radius * libm::cos(angle), centre[1] + radius * libm::sin(angle)]
    };
    (0..ROUND).map(corner).collect()
}

/// Convex hull counter-clockwise (Andrew's monotone chain, 1979).
fn hull(mut points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let left = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| {
        (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0.0
    };
    let chain = |points: &mut dyn Iterator<Item = [f64; 2]>| {
        let mut chain: Vec<[f64; 2]> = Vec::new();
        for p in points {
            while chain.len() >= 2 && !left(chain[chain.len() - 2], chain[chain.len() - 1], p) {
                chain.pop();
            }
            chain.push(p);
        }
        chain.pop();
        chain
    };
    let mut all = chain(&mut points.iter().copied());
    all.extend(chain(&mut points.iter().rev().copied()));
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::{GluingRecord, Point, PortRecord};
    use crate::reader::PoseSeries;
    use crate::scene_message::{quaternion, vector};
    use crate::solids::solids;
    use foxglove::messages::{CubePrimitive, CylinderPrimitive, Pose as MessagePose};
    use foxglove::messages::{SceneEntity, SpherePrimitive};
    use std::f64::consts::PI;

    /// A ball, a box turned by 0.5 rad, a wheel whose axle lies along y, each 4 mm in the ground; all move with `speed`.
    fn recorded(speed: f64) -> Recording {
        let pose =
            |q| Some(MessagePose { position: Some(vector([0.0; 3])), orientation: Some(quaternion(q)) });
        let straight = [1.0, 0.0, 0.0, 0.0];
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let ball = SpherePrimitive { pose: pose(straight), size: Some(vector([0.06; 3])), color: None };
        let size = Some(vector([0.2, 0.1, 0.06]));
        let cube =
            CubePrimitive { pose: pose([libm::cos(0.25), 0.0, 0.0, libm::sin(0.25)]), size, color: None };
        let wheel = CylinderPrimitive {
            pose: pose([half, half, 0.0, 0.0]),
            size: Some(vector([0.3, 0.3, 0.08])),
            ..Default::default()
        };
        let parts = [
            ("ball", SceneEntity { spheres: vec![ball], ..Default::default() }, 0.026),
            ("cube", SceneEntity { cubes: vec![cube], ..Default::default() }, 0.026),
            ("wheel", SceneEntity { cylinders: vec![wheel], ..Default::default() }, 0.146),
        ];
        let mut recording = Recording::default();
        let times: Vec<f64> = (0..200).map(|k| 0.005 * f64::from(k)).collect();
        for (name, entity, z) in &parts {
            let frame = format!("fixture/{name}");
            recording.solids.insert(frame.clone(), solids(entity));
            let series = PoseSeries {
                t_s: times.clone(),
                position: times.iter().map(|t| [speed * t, 0.0, *z]).collect(),
                orientation: vec![straight; times.len()],
            };
            recording.poses.insert(frame, series);
        }
        let port = |name: &str, t: f64| PortRecord {
            subsystem: "fixture".into(),
            body: name.into(),
            origin: Point { x: speed * t, y: 0.0, z: -0.004 },
            wrench: vec![10.0],
            ..Default::default()
        };
        let ports = |t: f64| parts.iter().map(|(name, ..)| port(name, t)).collect();
        recording.gluing =
            times.iter().map(|t| GluingRecord { t: *t, ports: ports(*t), ..Default::default() }).collect();
        let flat = GroundRecord { spacing: 1.0, size: [3, 3], origin: [-1.0; 2], ..Default::default() };
        recording.initial_ground =
            Some(GroundRecord { height: vec![-0.004; 9], sinkage: vec![0.004; 9], ..flat });
        recording
    }

    #[test]
    fn a_print_has_the_shape_of_what_was_in_the_ground() {
        let recording = recorded(0.0);
        let legs = legs(&recording);
        let outline = |k: usize| {
            let prints: Vec<_> = legs[k].single().collect();
            assert!(prints.len() == 1 && legs[k].tracks().count() == 0, "{}", legs[k].body);
            legs[k].footprint(&recording, prints[0])
        };
        assert_eq!(legs.iter().map(|l| l.body.as_str()).collect::<Vec<_>>(), ["ball", "cube", "wheel"]);
        let radius = f64::sqrt(0.004 * (0.06 - 0.004));
        assert!(outline(0).iter().all(|p| (p[0].hypot(p[1]) - radius).abs() < 1e-12));
        let cube = outline(1);
        assert!((area(&cube) - 0.02).abs() < 1e-12, "{cube:?}");
        let farthest = cube.iter().map(|p| p[0]).fold(0.0, f64::max);
        assert!((farthest - (0.1 * libm::cos(0.5) + 0.05 * libm::sin(0.5))).abs() < 1e-12, "{cube:?}");
        // as long as the chord of the wheel at the ground, up to the corners of the drawn circle
        let chord = 2.0 * f64::sqrt(0.004 * (0.3 - 0.004));
        assert!((area(&outline(2)) / (0.08 * chord) - 1.0).abs() < 0.05, "{}", area(&outline(2)));
    }

    #[test]
    fn of_shapes_in_one_print_the_largest_around_its_place_made_it() {
        let pose = |place| {
            Some(MessagePose {
                position: Some(vector(place)),
                orientation: Some(quaternion([1.0, 0.0, 0.0, 0.0])),
            })
        };
        let ball =
            SpherePrimitive { pose: pose([0.002, 0.0, 0.0]), size: Some(vector([0.06; 3])), color: None };
        let shin =
            CubePrimitive { pose: pose([0.0; 3]), size: Some(vector([0.004, 0.004, 0.059])), color: None };
        let mut recording = recorded(0.0);
        let entity = SceneEntity { spheres: vec![ball], cubes: vec![shin], ..Default::default() };
        recording.solids.insert("fixture/ball".into(), solids(&entity));
        let legs = legs(&recording);
        let print = legs[0].single().next().expect("a print");
        let radius = f64::sqrt(0.004 * (0.06 - 0.004));
        assert!((area(&legs[0].footprint(&recording, print)) / (PI * radius * radius) - 1.0).abs() < 0.05);
    }

    #[test]
    fn what_rolls_on_leaves_a_track_and_no_prints() {
        let recording = recorded(0.4);
        for leg in legs(&recording) {
            let tracks: Vec<_> = leg.tracks().collect();
            assert!(tracks.len() == 1 && leg.single().count() == 0, "{}: {tracks:?}", leg.body);
            let last = tracks[0].last().expect("prints");
            assert!((0.36..0.4).contains(&last.at[0]), "{last:?}");
        }
    }
}
