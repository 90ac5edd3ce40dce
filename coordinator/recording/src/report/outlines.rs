//! Outlines from above of what stands still: edges between faces that look up and faces that do not, and open ends.

use crate::reader::Recording;
use crate::solids::Solid;
use std::collections::BTreeMap;
use terraglue_subsystem::Pose;

/// Most corners of all outlines; the shortest lines are left out first.
const MOST_POINTS: usize = 8000;
/// Faces that look less up than this (cosine of the slope) count as walls.
const WALL: f64 = 1e-6;

/// A line on the map.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Outline {
    /// `subsystem/body`.
    pub frame: String,
    /// Its corners, x and y in the world, m.
    pub points: Vec<[f64; 2]>,
}

impl Outline {
    fn length(&self) -> f64 {
        self.points.windows(2).map(|p| (p[1][0] - p[0][0]).hypot(p[1][1] - p[0][1])).sum()
    }
}

/// The outlines of all bodies that never move.
pub(crate) fn of(recording: &Recording) -> Vec<Outline> {
    let mut lines = Vec::new();
    for (frame, solids) in &recording.solids {
        let Some(pose) = still(recording, frame) else { continue };
        for solid in solids {
            let found = contours(&solid.placed(&pose));
            lines.extend(found.into_iter().map(|points| Outline { frame: frame.clone(), points }));
        }
    }
    keep_longest(lines)
}

/// The pose of a body that has the same one at all times.
fn still(recording: &Recording, frame: &str) -> Option<Pose> {
    let poses = recording.poses.get(frame)?;
    let (position, orientation) = (*poses.position.first()?, *poses.orientation.first()?);
    let same =
        poses.position.iter().all(|p| *p == position) && poses.orientation.iter().all(|q| *q == orientation);
    same.then_some(Pose { position, orientation })
}

fn keep_longest(mut lines: Vec<Outline>) -> Vec<Outline> {
    let longest_first = |a: &Outline, b: &Outline| b.length().total_cmp(&a.length());
    if lines.iter().map(|l| l.points.len()).sum::<usize>() > MOST_POINTS {
        lines.sort_by(longest_first);
        let mut left = MOST_POINTS;
        lines.retain(|l| {
            let fits = l.points.len() <= left;
            left -= if fits { l.points.len() } else { 0 };
            fits
        });
    }
    lines
}

/// The lines of one solid in the world.
fn contours(solid: &Solid) -> Vec<Vec<[f64; 2]>> {
    // Corners at the same place are one, else every edge would be open.
    let mut places: BTreeMap<[u64; 3], u32> = BTreeMap::new();
    let own: Vec<u32> = solid
        .points
        .iter()
        .enumerate()
        .map(|(k, p)| *places.entry(p.map(|x| (x + 0.0).to_bits())).or_insert(k as u32))
        .collect();
    // Faces at an edge that look up less those that do not, and how many there are.
    let mut edges: BTreeMap<[u32; 2], (u32, u32)> = BTreeMap::new();
    for t in &solid.triangles {
        let Some(corners) = corners(solid, t) else { continue };
        let up = looks_up(&corners);
        for k in 0..3 {
            let (a, b) = (own[t[k] as usize], own[t[(k + 1) % 3] as usize]);
            let edge = edges.entry([a.min(b), a.max(b)]).or_default();
            *edge = (edge.0 + u32::from(up), edge.1 + 1);
        }
    }
    let drawn = |(_, (up, all)): &(&[u32; 2], &(u32, u32))| *all == 1 || (*up > 0 && up < all);
    chains(edges.iter().filter(drawn).map(|(e, _)| *e).filter(|[a, b]| a != b))
        .into_iter()
        .map(|chain| chain.iter().map(|k| solid.points[*k as usize]).map(|[x, y, _]| [x, y]).collect())
        .collect()
}

fn corners(solid: &Solid, triangle: &[u32; 3]) -> Option<[[f64; 3]; 3]> {
    let [a, b, c] = triangle.map(|k| solid.points.get(k as usize).copied());
    Some([a?, b?, c?])
}

fn looks_up([a, b, c]: &[[f64; 3]; 3]) -> bool {
    let (u, v) = ([0, 1, 2].map(|k| b[k] - a[k]), [0, 1, 2].map(|k| c[k] - a[k]));
    let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let length = normal.iter().map(|n| n * n).sum::<f64>().sqrt();
    normal[2] > WALL * length
}

/// Edges joined end to end.
fn chains(edges: impl Iterator<Item = [u32; 2]>) -> Vec<Vec<u32>> {
    let mut at: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for [a, b] in edges {
        at.entry(a).or_default().push(b);
        at.entry(b).or_default().push(a);
    }
    // Ends first, so that open lines are not begun in their middle.
    let mut begins: Vec<u32> = at.keys().copied().collect();
    begins.sort_by_key(|k| at[k].len().is_multiple_of(2));
    let mut chains = Vec::new();
    for begin in begins {
        while let Some(mut next) = take(&mut at, begin) {
            let mut chain = vec![begin, next];
            while let Some(after) = take(&mut at, next) {
                chain.push(after);
                next = after;
            }
            chains.push(chain);
        }
    }
    chains
}

/// Takes an edge from a corner; its other end.
fn take(at: &mut BTreeMap<u32, Vec<u32>>, from: u32) -> Option<u32> {
    let to = at.get_mut(&from)?.pop()?;
    if let Some(back) = at.get_mut(&to) {
        back.iter().position(|k| *k == from).map(|k| back.swap_remove(k));
    }
    Some(to)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reader::PoseSeries;

    use crate::scene_message::{quaternion, vector};
    use crate::solids::solids;
    use foxglove::messages::{CubePrimitive, CylinderPrimitive, SceneEntity, SpherePrimitive};
    use foxglove::messages::{Point3, Pose as MessagePose, TriangleListPrimitive};

    fn place(x: f64, q: [f64; 4]) -> Option<MessagePose> {
        Some(MessagePose { position: Some(vector([x, 0.0, 0.0])), orientation: Some(quaternion(q)) })
    }

    fn cube(x: f64, q: [f64; 4], size: [f64; 3]) -> SceneEntity {
        let cube = CubePrimitive { pose: place(x, q), size: Some(vector(size)), color: None };
        SceneEntity { cubes: vec![cube], ..Default::default() }
    }

    const STRAIGHT: [f64; 4] = [1.0, 0.0, 0.0, 0.0];

    /// Enclosed area of a closed line, m².
    fn area(line: &[[f64; 2]]) -> f64 {
        assert_eq!(line.first(), line.last(), "the line is open");
        line.windows(2).map(|p| 0.5 * (p[0][0] * p[1][1] - p[1][0] * p[0][1])).sum::<f64>().abs()
    }

    fn areas(solids: &[Solid]) -> Vec<f64> {
        solids.iter().flat_map(contours).map(|l| area(&l)).collect()
    }

    #[test]
    fn every_shape_has_the_outline_of_its_shadow() {
        let size = [2.0, 3.0, 4.0];
        let (sin, cos) = (libm::sin(0.25), libm::cos(0.25));
        let block = |q| cube(1.0, q, size);
        let sphere =
            SpherePrimitive { pose: place(1.0, [cos, sin, 0.0, 0.0]), size: Some(vector(size)), color: None };
        let cylinder =
            CylinderPrimitive { pose: place(1.0, STRAIGHT), size: Some(vector(size)), ..Default::default() };
        // Turned about z a shadow keeps its area; tilted by 0.5 rad about x a box shows its side, too.
        let shadow = 2.0 * (3.0 * libm::cos(0.5) + 4.0 * libm::sin(0.5));
        let round = 48.0 / 2.0 * libm::sin(std::f64::consts::TAU / 48.0);
        let cases = [
            (block(STRAIGHT), 6.0),
            (block([cos, 0.0, 0.0, sin]), 6.0),
            (block([cos, sin, 0.0, 0.0]), shadow),
            (SceneEntity { spheres: vec![sphere], ..Default::default() }, round),
            (SceneEntity { cylinders: vec![cylinder], ..Default::default() }, 1.5 * round),
        ];
        for (entity, expected) in cases {
            let found = areas(&solids(&entity));
            assert!(
                found.len() == 1 && (found[0] - expected).abs() < 1e-9,
                "{entity:?}: {found:?} {expected}"
            );
        }
    }

    /// A gable roof without thickness.
    #[test]
    fn an_open_mesh_shows_its_ends_and_a_ridge_of_two_slopes_does_not_show() {
        let points = [[0, 0, 0], [1, 0, 1], [2, 0, 0], [0, 3, 0], [1, 3, 1], [2, 3, 0]];
        let points = points.map(|[x, y, z]: [i32; 3]| Point3 { x: x.into(), y: y.into(), z: z.into() });
        let roof = TriangleListPrimitive {
            pose: place(5.0, STRAIGHT),
            points: points.into(),
            indices: vec![0, 1, 4, 0, 4, 3, 1, 2, 5, 1, 5, 4],
            ..Default::default()
        };
        let entity = SceneEntity { triangles: vec![roof], ..Default::default() };
        let lines: Vec<_> = solids(&entity).iter().flat_map(contours).collect();
        assert_eq!((lines.len(), area(&lines[0])), (1, 6.0));
        assert!(lines[0].iter().all(|p| (5.0..=7.0).contains(&p[0])));
    }

    #[test]
    fn only_what_never_moves_is_drawn_and_of_too_much_the_longest() {
        let size = |x: f64| solids(&cube(0.0, STRAIGHT, [x, 1.0, 1.0]));
        let poses = |last: f64| PoseSeries {
            t_s: vec![0.0, 1.0],
            position: vec![[10.0, 0.0, 0.0], [last, 0.0, 0.0]],
            orientation: vec![STRAIGHT; 2],
        };
        let mut recording = Recording::default();
        for (frame, last) in [("a/world", 10.0), ("a/robot", 10.1)] {
            recording.solids.insert(frame.into(), size(2.0));
            recording.poses.insert(frame.into(), poses(last));
        }
        let outlines = of(&recording);
        assert_eq!(outlines.iter().map(|o| o.frame.as_str()).collect::<Vec<_>>(), ["a/world"]);
        assert!(outlines[0].points.iter().all(|p| (p[0] - 10.0).abs() == 1.0));
        // Without ground there is a map all the same, as wide as lines and path.
        let map = super::super::ground_map::data(&recording, &[]).expect("a map").expect("a map");
        assert!(map["image"].is_null() && map["outlines"][0]["name"] == "a.world", "{map}");
        assert!(map["x"][0] == 8.8 && map["x"][1] == 11.2, "{}", map["x"]);
        let many = (0..2000).flat_map(|k| size(1.0 + f64::from(k))).collect();
        recording.solids.insert("a/world".into(), many);
        let outlines = of(&recording);
        assert_eq!(outlines.iter().map(|o| o.points.len()).sum::<usize>(), MOST_POINTS);
        let shortest = outlines.iter().map(Outline::length).reduce(f64::min).expect("some");
        assert!((shortest - 2.0 * (1.0 + 401.0)).abs() < 1e-9, "{shortest}");
    }
}
